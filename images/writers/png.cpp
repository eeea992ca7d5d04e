// SPDX-License-Identifier: Apache-2.0
#include "images/writers/png.hpp"

#include "images/writers/pending_file.hpp"

#include <png.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace obscura::images {
namespace {

static_assert(std::endian::native == std::endian::little, "png_set_swap turns little into big endian");

[[noreturn]] void on_write_error(png_structp, png_const_charp message) {
    // libpng requires that the error handler does not return; its C frames hold nothing to unwind.
    throw std::runtime_error(message);
}
void on_write_warning(png_structp, png_const_charp) {}

struct Writer {
    png_structp png =
        png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, on_write_error, on_write_warning);
    png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);

    Writer() {
        if (info == nullptr) {
            png_destroy_write_struct(&png, nullptr);
            throw std::bad_alloc();
        }
    }
    ~Writer() { png_destroy_write_struct(&png, &info); }
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;
};

/// Number of samples of a pixel, their bits, and how many of these are significant.
struct Layout {
    int samples, depth, significant;
};

void write_png(const std::filesystem::path& file, std::int32_t width, std::int32_t height, Layout layout,
               const std::uint8_t* pixels, const Cards& cards) {
    PendingFile pending(file);
    const auto close = [](std::FILE* f) { std::fclose(f); };
    std::unique_ptr<std::FILE, decltype(close)> out(std::fopen(pending.path().c_str(), "wbe"), close);
    if (!out) pending.fail(std::strerror(errno));
    try {
        Writer w;
        png_init_io(w.png, out.get());
        // Noise does not compress: level 1 takes a fraction of the time of level 6 for a few per cent more
        // size.
        png_set_compression_level(w.png, 1);
        png_set_filter(w.png, 0, PNG_FILTER_SUB);
        png_set_IHDR(w.png, w.info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height),
                     layout.depth, layout.samples == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY,
                     PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
        png_color_8 significant{};
        significant.gray = static_cast<png_byte>(layout.significant);
        if (layout.significant < layout.depth) png_set_sBIT(w.png, w.info, &significant);
        std::vector<std::string> texts;
        texts.reserve(cards.size());
        std::vector<png_text> chunks;
        for (const Card& card : cards) {
            texts.push_back(card_text(card));
            png_text chunk{};
            chunk.compression = PNG_TEXT_COMPRESSION_NONE;
            chunk.key = const_cast<char*>(card.key.c_str()); // libpng only reads it
            chunk.text = texts.back().data();
            chunk.text_length = texts.back().size();
            chunks.push_back(chunk);
        }
        png_set_text(w.png, w.info, chunks.data(), static_cast<int>(chunks.size()));
        png_write_info(w.png, w.info);
        if (layout.depth == 16) png_set_swap(w.png);
        const std::size_t stride =
            static_cast<std::size_t>(width) * static_cast<std::size_t>(layout.samples * layout.depth / 8);
        for (std::int32_t y = 0; y < height; ++y)
            png_write_row(w.png, pixels + static_cast<std::size_t>(y) * stride);
        png_write_end(w.png, w.info);
    } catch (const std::runtime_error& error) {
        pending.fail(error.what());
    }
    if (std::fclose(out.release()) != 0) pending.fail(std::strerror(errno));
    pending.commit();
}

} // namespace

void write_png16(const std::filesystem::path& file, std::int32_t width, std::int32_t height, int bits,
                 std::span<const std::uint16_t> pixels, const Cards& cards) {
    write_png(file, width, height, {1, 16, bits}, reinterpret_cast<const std::uint8_t*>(pixels.data()),
              cards);
}

void write_png8(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                std::span<const std::uint8_t> pixels, const Cards& cards) {
    write_png(file, width, height, {1, 8, 8}, pixels.data(), cards);
}

void write_png_rgb(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                   std::span<const std::uint8_t> bytes, const Cards& cards) {
    write_png(file, width, height, {3, 8, 8}, bytes.data(), cards);
}

} // namespace obscura::images
