// SPDX-License-Identifier: Apache-2.0
#include "web/live/jpeg.hpp"

#include "host/tone_curve.hpp"

#include <cstdio>
#include <cstdlib>
#include <new>

// jpeglib.h needs FILE to be declared; it is a C header with its own extern "C".
#include <jpeglib.h>

namespace obscura::web {
namespace {

constexpr int quality = 85;

[[noreturn]] void on_error(j_common_ptr /*encoder*/) {
    throw std::bad_alloc(); // nothing else can go wrong with pixels in memory
}

struct Encoder {
    jpeg_error_mgr errors{};
    jpeg_compress_struct jpeg{};
    unsigned char* bytes = nullptr; ///< allocated by the library
    unsigned long size = 0;

    Encoder() {
        jpeg.err = jpeg_std_error(&errors);
        errors.error_exit = on_error;
        jpeg_create_compress(&jpeg);
        jpeg_mem_dest(&jpeg, &bytes, &size);
    }
    ~Encoder() {
        jpeg_destroy_compress(&jpeg);
        std::free(bytes);
    }
    Encoder(const Encoder&) = delete;
    Encoder& operator=(const Encoder&) = delete;
};

} // namespace

std::vector<std::uint8_t> preview_levels(std::span<const std::uint16_t> image, unsigned bits,
                                         std::vector<std::uint64_t>& counts) {
    counts.assign(65536, 0);
    for (const std::uint16_t dn : image)
        ++counts[dn];
    return host::display_levels(counts, static_cast<int>(bits), host::Stretch{});
}

std::vector<unsigned char> jpeg_of(std::span<const std::uint16_t> pixels, std::size_t rows,
                                   std::span<const std::uint8_t> levels) {
    const std::size_t columns = rows == 0 ? 0 : pixels.size() / rows;
    if (columns == 0 || columns > max_jpeg_side || rows > max_jpeg_side) return {};
    try {
        Encoder encoder;
        jpeg_compress_struct& jpeg = encoder.jpeg;
        jpeg.image_width = static_cast<JDIMENSION>(columns);
        jpeg.image_height = static_cast<JDIMENSION>(rows);
        jpeg.input_components = 1;
        jpeg.in_color_space = JCS_GRAYSCALE;
        jpeg_set_defaults(&jpeg);
        jpeg_set_quality(&jpeg, quality, TRUE);
        jpeg_start_compress(&jpeg, TRUE);
        std::vector<JSAMPLE> line(columns);
        while (jpeg.next_scanline < jpeg.image_height) {
            const auto row = pixels.subspan(jpeg.next_scanline * columns, columns);
            for (std::size_t x = 0; x < columns; ++x)
                line[x] = levels[row[x]];
            JSAMPROW samples = line.data();
            jpeg_write_scanlines(&jpeg, &samples, 1);
        }
        jpeg_finish_compress(&jpeg);
        return {encoder.bytes, encoder.bytes + encoder.size};
    } catch (const std::bad_alloc&) {
        return {};
    }
}

} // namespace obscura::web
