// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "images/image.hpp"
#include "images/readers/tiff_tags.hpp"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>

namespace obscura::images {
namespace {

/// Supported layout: one plane of grey or chunky RGB, integers of 8, 16 and 32 bits and reals of 32 and 64.
struct TiffLayout {
    std::uint32_t width = 0, height = 0;
    std::uint16_t bits = 0, samples = 1, format = SAMPLEFORMAT_UINT;
};

class TiffReader {
public:
    explicit TiffReader(const std::filesystem::path& file) : file_(file) {
        // Suppress libtiff's own messages on standard error.
        TIFFSetErrorHandler(nullptr);
        TIFFSetWarningHandler(nullptr);
        // No memory mapping: a file that shrinks meanwhile must not raise SIGBUS.
        tiff_.reset(TIFFOpen(file.c_str(), "rm"));
        if (!tiff_) refuse("its directory is damaged");
        std::uint16_t planar = PLANARCONFIG_CONTIG;
        std::uint16_t photometric = PHOTOMETRIC_MINISBLACK;
        TIFFGetField(tiff_.get(), TIFFTAG_IMAGEWIDTH, &layout_.width);
        TIFFGetField(tiff_.get(), TIFFTAG_IMAGELENGTH, &layout_.height);
        TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_BITSPERSAMPLE, &layout_.bits);
        TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_SAMPLESPERPIXEL, &layout_.samples);
        TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_SAMPLEFORMAT, &layout_.format);
        TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_PLANARCONFIG, &planar);
        TIFFGetField(tiff_.get(), TIFFTAG_PHOTOMETRIC, &photometric);
        check_image_size(file, layout_.width, layout_.height);
        const std::uint16_t bits = layout_.bits;
        const bool real = layout_.format == SAMPLEFORMAT_IEEEFP && (bits == 32 || bits == 64);
        const bool whole = (layout_.format == SAMPLEFORMAT_UINT || layout_.format == SAMPLEFORMAT_INT) &&
                           (bits == 8 || bits == 16 || bits == 32);
        const bool grey = photometric == PHOTOMETRIC_MINISBLACK;
        const bool colours = photometric == PHOTOMETRIC_RGB && layout_.samples >= 3;
        if (!(real || whole) || !(grey || colours) || layout_.samples < 1 || layout_.samples > 8 ||
            (planar != PLANARCONFIG_CONTIG && layout_.samples > 1))
            refuse(fmt::format(
                "{} samples of {} bits, photometry {}: allowed are grey and RGB of 8, 16 or 32 bits or reals of 32 or 64 bits, samples together",
                layout_.samples, layout_.bits, photometric));
        const std::string_view missing = tag_text(tiff_.get(), tag_gdal_nodata);
        double value = 0;
        const char* const end = missing.data() + missing.size();
        if (!missing.empty() && std::from_chars(missing.data(), end, value).ec == std::errc{})
            missing_ = value;
    }

    [[nodiscard]] bool has_colours() const { return layout_.samples >= 3; }

    Image read(const ColourChoice& choice) {
        Image image{
            static_cast<std::int32_t>(layout_.width), static_cast<std::int32_t>(layout_.height), {}, 1};
        if (layout_.format == SAMPLEFORMAT_UINT) image.full_scale = std::ldexp(1.0, layout_.bits) - 1;
        if (layout_.format == SAMPLEFORMAT_INT) image.full_scale = std::ldexp(1.0, layout_.bits - 1) - 1;
        TIFF* tiff = tiff_.get();
        const bool tiled = TIFFIsTiled(tiff) != 0;
        std::uint32_t block_width = layout_.width;
        std::uint32_t block_height = 1;
        if (tiled) {
            TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &block_width);
            TIFFGetField(tiff, TIFFTAG_TILELENGTH, &block_height);
        }
        const tmsize_t bytes = tiled ? TIFFTileSize(tiff) : TIFFScanlineSize(tiff);
        const std::size_t pixel = std::size_t{layout_.samples} * layout_.bits / 8;
        const std::size_t wanted = std::size_t{block_width} * block_height * pixel;
        // A tile may be larger than the image, but a valid file has no tiles above 1 GiB.
        if (bytes <= 0 || static_cast<std::size_t>(bytes) < wanted || bytes > tmsize_t{1} << 30)
            refuse("invalid tile or strip size");
        std::vector<std::uint8_t> block(static_cast<std::size_t>(bytes));
        std::vector<double> values(std::size_t{layout_.width} * layout_.height);
        for (std::uint32_t y = 0; y < layout_.height; y += block_height)
            for (std::uint32_t x = 0; x < layout_.width; x += block_width) {
                if (tiled ? TIFFReadTile(tiff, block.data(), x, y, 0, 0) < 0
                          : TIFFReadScanline(tiff, block.data(), y, 0) < 0)
                    refuse(fmt::format("damaged at line {}", y + 1));
                const std::uint32_t columns = std::min(block_width, layout_.width - x);
                const std::uint32_t rows = std::min(block_height, layout_.height - y);
                for (std::uint32_t r = 0; r < rows; ++r)
                    for (std::uint32_t c = 0; c < columns; ++c)
                        values[std::size_t{y + r} * layout_.width + x + c] =
                            value(block.data() + (std::size_t{r} * block_width + c) * pixel, choice);
            }
        image.values = std::move(values);
        return image;
    }

private:
    struct Close {
        void operator()(TIFF* t) const { TIFFClose(t); }
    };

    [[noreturn]] void refuse(const std::string& why) const {
        throw InputError(fmt::format("{}: not readable as TIFF: {}", file_.string(), why));
    }

    template<typename Number>
    [[nodiscard]] static double as(const std::uint8_t* at) {
        Number v = 0;
        std::memcpy(&v, at, sizeof v);
        return static_cast<double>(v);
    }
    [[nodiscard]] double number(const std::uint8_t* at) const {
        const bool sign = layout_.format == SAMPLEFORMAT_INT;
        if (layout_.format == SAMPLEFORMAT_IEEEFP) return layout_.bits == 32 ? as<float>(at) : as<double>(at);
        if (layout_.bits == 8) return sign ? as<std::int8_t>(at) : *at;
        if (layout_.bits == 16) return sign ? as<std::int16_t>(at) : as<std::uint16_t>(at);
        return sign ? as<std::int32_t>(at) : as<std::uint32_t>(at);
    }
    [[nodiscard]] double sample(const std::uint8_t* at) const {
        const double v = number(at);
        // GDAL writes the number that marks missing samples as a decimal, of reals a rounded one.
        const double same = layout_.bits == 32 && layout_.format == SAMPLEFORMAT_IEEEFP ? 1e-6 : 0;
        if (missing_ && std::abs(v - *missing_) <= same * std::abs(*missing_))
            return std::numeric_limits<double>::quiet_NaN();
        return v;
    }
    [[nodiscard]] double value(const std::uint8_t* pixel, const ColourChoice& choice) const {
        if (!has_colours()) return sample(pixel);
        const std::size_t step = layout_.bits / 8;
        return choice.weight[0] * sample(pixel) + choice.weight[1] * sample(pixel + step) +
               choice.weight[2] * sample(pixel + 2 * step);
    }

    const std::filesystem::path& file_;
    std::unique_ptr<TIFF, Close> tiff_;
    TiffLayout layout_;
    std::optional<double> missing_; ///< number of samples without data (GDAL_NODATA)
};

} // namespace

bool tiff_has_colours(const std::filesystem::path& file) {
    return TiffReader(file).has_colours();
}

Image read_tiff_image(const std::filesystem::path& file, const std::string& plane) {
    return TiffReader(file).read(colour_choice(file, plane));
}

} // namespace obscura::images
