// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "images/image.hpp"

#include <fmt/format.h>
#include <png.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>

namespace obscura::images {
namespace {

static_assert(std::endian::native == std::endian::little, "png_set_swap turns big into little endian");

[[noreturn]] void on_read_error(png_structp, png_const_charp message) {
    throw std::runtime_error(message);
}
void on_read_warning(png_structp, png_const_charp) {}

struct PngReader {
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, on_read_error, on_read_warning);
    png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);

    PngReader() {
        if (info == nullptr) {
            png_destroy_read_struct(&png, nullptr, nullptr);
            throw std::bad_alloc();
        }
    }
    ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
    PngReader(const PngReader&) = delete;
    PngReader& operator=(const PngReader&) = delete;
};

/// Calls `use` with a reader that has read the header and returns its result. Errors of libpng are thrown as
/// InputError.
template<typename Use>
auto with_header_read(const std::filesystem::path& file, const Use& use) {
    const auto close = [](std::FILE* f) { std::fclose(f); };
    const std::unique_ptr<std::FILE, decltype(close)> in(std::fopen(file.c_str(), "rbe"), close);
    if (!in)
        throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), std::strerror(errno)), errno);
    try {
        PngReader r;
        png_init_io(r.png, in.get());
        png_read_info(r.png, r.info);
        return use(r);
    } catch (const InputError&) {
        throw;
    } catch (const std::runtime_error& error) {
        throw InputError(fmt::format("{}: not readable as PNG: {}", file.string(), error.what()));
    }
}

} // namespace

bool png_has_colours(const std::filesystem::path& file) {
    return with_header_read(file, [](const PngReader& r) {
        return (png_get_color_type(r.png, r.info) & PNG_COLOR_MASK_COLOR) != 0;
    });
}

Image read_png_image(const std::filesystem::path& file, const std::string& plane) {
    const ColourChoice choice = colour_choice(file, plane);
    return with_header_read(file, [&](const PngReader& r) {
        const png_uint_32 width = png_get_image_width(r.png, r.info),
                          height = png_get_image_height(r.png, r.info);
        check_image_size(file, width, height);
        png_set_expand(r.png); // palettes, fewer than 8 bits
        png_set_strip_alpha(r.png);
        const int depth = png_get_bit_depth(r.png, r.info) == 16 ? 16 : 8;
        if (depth == 16) png_set_swap(r.png);
        const int passes = png_set_interlace_handling(r.png);
        png_read_update_info(r.png, r.info);
        const std::size_t channels = png_get_channels(r.png, r.info);
        const std::size_t stride = png_get_rowbytes(r.png, r.info);
        // Check the file size before allocation: deflate compresses by 1032 to 1 at most.
        if (stride * height / 1032 > file_bytes_at(file))
            throw std::runtime_error("the file ends before its image");
        std::vector<std::uint8_t> bytes(stride * height);
        for (int pass = 0; pass < passes; ++pass)
            for (png_uint_32 y = 0; y < height; ++y)
                png_read_row(r.png, bytes.data() + y * stride, nullptr);

        Image image{static_cast<std::int32_t>(width),
                    static_cast<std::int32_t>(height),
                    {},
                    depth == 16 ? 65535.0 : 255.0};
        image.values.reserve(static_cast<std::size_t>(width) * height);
        const auto sample = [&](png_uint_32 y, std::size_t index) -> double {
            const std::uint8_t* at = bytes.data() + y * stride;
            if (depth == 8) return at[index];
            std::uint16_t value = 0;
            std::memcpy(&value, at + 2 * index, sizeof value);
            return value;
        };
        for (png_uint_32 y = 0; y < height; ++y)
            for (png_uint_32 x = 0; x < width; ++x) {
                const std::size_t i = x * channels;
                image.values.push_back(channels < 3 ? sample(y, i)
                                                    : choice.weight[0] * sample(y, i) +
                                                          choice.weight[1] * sample(y, i + 1) +
                                                          choice.weight[2] * sample(y, i + 2));
            }
        return image;
    });
}

} // namespace obscura::images
