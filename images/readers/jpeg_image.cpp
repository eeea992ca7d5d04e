// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "images/image.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

// jpeglib.h needs FILE to be declared; it is a C header with its own extern "C".
#include <jpeglib.h>

namespace obscura::images {
namespace {

[[noreturn]] void on_jpeg_error(j_common_ptr decoder) {
    char text[JMSG_LENGTH_MAX] = {};
    decoder->err->format_message(decoder, text);
    throw std::runtime_error(text);
}
/// Treats warnings as errors: they report damaged data, and a half grey texture is worse than none.
void on_message(j_common_ptr decoder, int level) {
    if (level < 0) on_jpeg_error(decoder);
}

struct Decoder {
    jpeg_error_mgr errors{};
    jpeg_decompress_struct jpeg{};

    explicit Decoder(std::FILE* in) {
        jpeg.err = jpeg_std_error(&errors);
        errors.error_exit = on_jpeg_error;
        errors.emit_message = on_message;
        jpeg_create_decompress(&jpeg);
        jpeg_stdio_src(&jpeg, in);
    }
    ~Decoder() { jpeg_destroy_decompress(&jpeg); }
    Decoder(const Decoder&) = delete;
    Decoder& operator=(const Decoder&) = delete;
};

template<typename Use>
auto decode(const std::filesystem::path& file, const Use& use) {
    const auto close = [](std::FILE* f) { std::fclose(f); };
    const std::unique_ptr<std::FILE, decltype(close)> in(std::fopen(file.c_str(), "rbe"), close);
    if (!in)
        throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), std::strerror(errno)), errno);
    try {
        Decoder d(in.get());
        jpeg_read_header(&d.jpeg, TRUE);
        check_image_size(file, d.jpeg.image_width, d.jpeg.image_height);
        return use(d.jpeg);
    } catch (const std::runtime_error& error) {
        throw InputError(fmt::format("{}: not readable as JPEG: {}", file.string(), error.what()));
    }
}

} // namespace

bool jpeg_has_colours(const std::filesystem::path& file) {
    return decode(file, [](const jpeg_decompress_struct& jpeg) { return jpeg.num_components > 1; });
}

Image read_jpeg_image(const std::filesystem::path& file, const std::string& plane) {
    const ColourChoice choice = colour_choice(file, plane);
    return decode(file, [&](jpeg_decompress_struct& jpeg) {
        const bool colours = jpeg.num_components > 1;
        jpeg.out_color_space = colours ? JCS_RGB : JCS_GRAYSCALE;
        jpeg_start_decompress(&jpeg);
        Image image{static_cast<std::int32_t>(jpeg.image_width),
                    static_cast<std::int32_t>(jpeg.image_height),
                    {},
                    255};
        image.values.reserve(static_cast<std::size_t>(jpeg.image_width) * jpeg.image_height);
        std::vector<JSAMPLE> line(static_cast<std::size_t>(jpeg.image_width) * (colours ? 3 : 1));
        while (jpeg.output_scanline < jpeg.output_height) {
            JSAMPROW row = line.data();
            if (jpeg_read_scanlines(&jpeg, &row, 1) != 1) throw std::runtime_error("no more lines");
            for (std::size_t x = 0; x < jpeg.image_width; ++x)
                image.values.push_back(colours ? choice.weight[0] * line[3 * x] +
                                                     choice.weight[1] * line[3 * x + 1] +
                                                     choice.weight[2] * line[3 * x + 2]
                                               : line[x]);
        }
        jpeg_finish_decompress(&jpeg);
        return image;
    });
}

} // namespace obscura::images
