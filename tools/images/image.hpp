// Images to measure with, read from FITS, PNG, OpenEXR and PDS3 files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::tools {

/// One plane of numbers, row-major, first row of the file first. NaN where the file says that nothing is
/// known.
struct Image {
    std::int32_t width = 0, height = 0;
    std::vector<double> values;

    [[nodiscard]] double at(std::int32_t x, std::int32_t y) const {
        return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(x)];
    }
};

/// Largest image that is read, in pixels: bounds what a hostile header can make us allocate.
constexpr std::int64_t max_image_pixels = std::int64_t{1} << 28;

/// Reads one plane of `file`; what kind of file it is says its first bytes. `plane` chooses among several: a
/// number from 0, or in OpenEXR files a channel's name; empty: the first (in OpenEXR the first in
/// alphabetical order; colour PNGs: luminance). Throws InputError with one line.
[[nodiscard]] Image read_image(const std::filesystem::path& file, const std::string& plane = {});

// One file pair of readers each; `plane` as above.
[[nodiscard]] Image read_fits_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_png_image(const std::filesystem::path& file);
[[nodiscard]] Image read_exr_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_pds3_image(const std::filesystem::path& label, const std::string& plane);

/// The number in `plane`, below `planes`; 0 when empty. Throws InputError.
[[nodiscard]] std::int32_t plane_number(const std::filesystem::path& file, const std::string& plane,
                                        std::int64_t planes);
/// Throws InputError unless both are positive and the product is not above max_image_pixels.
void check_image_size(const std::filesystem::path& file, std::int64_t width, std::int64_t height);

} // namespace obscura::tools
