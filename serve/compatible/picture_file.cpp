// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/picture_file.hpp"

#include "images/writers/exr.hpp"
#include "images/writers/fits.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/png.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>

namespace obscura::serve::compatible {
namespace {

/// Ending in small letters.
std::string ending_of(const std::filesystem::path& file) {
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return ending;
}

bool is_tiff(const std::string& ending) {
    return ending == ".tif" || ending == ".tiff";
}

service::Failure unknown_ending(const std::filesystem::path& file, const char* allowed) {
    return service::bad_argument("filename",
                                 fmt::format("filename: \"{}\" has no ending of a format, allowed {}",
                                             file.filename().string(), allowed),
                                 allowed);
}

struct CloseTiff {
    void operator()(TIFF* tiff) const noexcept { TIFFClose(tiff); }
};

/// Values of the planes pixel by pixel.
template<typename T>
std::vector<T> interleaved(const PicturePlanes& picture, T (*convert)(float, float), float scale) {
    const std::size_t count = picture.planes.size(), pixels = picture.planes.front().size();
    std::vector<T> values(count * pixels);
    for (std::size_t k = 0; k < count; ++k)
        for (std::size_t i = 0; i < pixels; ++i)
            values[i * count + k] = convert(picture.planes[k][i], scale);
    return values;
}

float unchanged(float value, float /*scale*/) {
    return value;
}
/// NaN becomes 0.
template<typename T>
T scaled(float value, float scale) {
    return static_cast<T>(std::lround(value > 0 ? std::min(value, 1.0F) * scale : 0.0F));
}

template<typename T>
void write_tiff(const std::filesystem::path& file, const PicturePlanes& picture, std::vector<T> values,
                int format) {
    const std::size_t count = picture.planes.size();
    images::PendingFile pending(file);
    std::unique_ptr<TIFF, CloseTiff> tiff(TIFFOpen(pending.path().c_str(), "w"));
    if (!tiff) pending.fail("libtiff cannot open it");
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(picture.width));
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(picture.height));
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * sizeof(T)));
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, static_cast<int>(count));
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLEFORMAT, format);
    TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, count >= 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, 16);
    const std::uint16_t extra = EXTRASAMPLE_UNSPECIFIED;
    if (count == 4) TIFFSetField(tiff.get(), TIFFTAG_EXTRASAMPLES, 1, &extra);
    for (std::int32_t y = 0; y < picture.height; ++y)
        if (TIFFWriteScanline(tiff.get(),
                              values.data() + static_cast<std::size_t>(y) *
                                                  static_cast<std::size_t>(picture.width) * count,
                              static_cast<std::uint32_t>(y), 0) != 1)
            pending.fail("libtiff cannot write it");
    if (TIFFFlush(tiff.get()) != 1) pending.fail("libtiff cannot write it");
    tiff.reset();
    pending.commit();
}

} // namespace

void save_floats(const std::filesystem::path& file, const PicturePlanes& picture) {
    const std::string ending = ending_of(file);
    const std::size_t count = picture.planes.size();
    if (ending == ".png") return save_integers(file, picture, 8);
    if (is_tiff(ending))
        return write_tiff(file, picture, interleaved<float>(picture, unchanged, 1), SAMPLEFORMAT_IEEEFP);
    if (ending == ".exr") {
        std::vector<images::ExrChannel> channels;
        for (std::size_t k = 0; k < count; ++k)
            channels.push_back(
                {count == 1 ? "Y" : std::string(1, "RGBA"[k]), std::string(picture.unit), picture.planes[k]});
        return images::write_exr(file, picture.width, picture.height, channels, {});
    }
    if (ending != ".fits" && ending != ".fit") throw unknown_ending(file, ".tif, .exr, .fits, .png");
    std::vector<float> values;
    for (const std::vector<float>& plane : picture.planes)
        values.insert(values.end(), plane.begin(), plane.end());
    images::write_fits_float(file, picture.width, picture.height, static_cast<std::int32_t>(count), values,
                             picture.unit, {});
}

void save_integers(const std::filesystem::path& file, const PicturePlanes& picture, int bits) {
    const std::string ending = ending_of(file);
    const std::size_t count = picture.planes.size();
    const auto full = static_cast<float>((1 << bits) - 1);
    if (!is_tiff(ending) && (ending != ".png" || (bits > 8 && count > 1)))
        throw unknown_ending(file, bits > 8 && count > 1 ? ".tif" : ".png, .tif");
    if (bits > 8) {
        const auto values = interleaved<std::uint16_t>(picture, scaled<std::uint16_t>, full);
        if (is_tiff(ending)) return write_tiff(file, picture, values, SAMPLEFORMAT_UINT);
        return images::write_png16(file, picture.width, picture.height, bits, values, {});
    }
    if (is_tiff(ending))
        return write_tiff(file, picture, interleaved<std::uint8_t>(picture, scaled<std::uint8_t>, full),
                          SAMPLEFORMAT_UINT);
    if (count == 1)
        return images::write_png8(file, picture.width, picture.height,
                                  interleaved<std::uint8_t>(picture, scaled<std::uint8_t>, full), {});
    PicturePlanes colours = picture;
    colours.planes.resize(3); // PNG's fourth would be opacity
    images::write_png_rgb(file, picture.width, picture.height,
                          interleaved<std::uint8_t>(colours, scaled<std::uint8_t>, full), {});
}

} // namespace obscura::serve::compatible
