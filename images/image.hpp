// Read this first: images to measure with or to colour bodies with, from FITS, PNG, TIFF, JPEG, OpenEXR, PDS3
// files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::images {

/// One plane of numbers, row-major, first row of the file first. NaN where the file says that nothing is
/// known.
struct Image {
    std::int32_t width = 0, height = 0;
    std::vector<double> values;
    double full_scale = 1; ///< the largest value that the file's integers can hold; 1 in files of reals

    [[nodiscard]] double at(std::int32_t x, std::int32_t y) const {
        return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(x)];
    }
};

/// Largest image that is read, in pixels: bounds what a hostile header can make us allocate.
constexpr std::int64_t max_image_pixels = std::int64_t{1} << 28;

/// Reads one plane of `file`; what kind of file it is says its first bytes. `plane` chooses among several: a
/// number from 0, or in OpenEXR files a channel's name; "red", "green" or "blue" in colour pictures (PNG,
/// TIFF, JPEG). Empty: the first (in OpenEXR the first in alphabetical order, in colour pictures the
/// luminance). Throws InputError with one line.
[[nodiscard]] Image read_image(const std::filesystem::path& file, const std::string& plane = {});

/// The planes that hold the file's colours, to be read one by one: one empty name for a grey image; red,
/// green and blue of a colour picture, or R, G and B of an OpenEXR file; the planes "0", "1", ... of a FITS
/// cube or a PDS3 image. Throws InputError.
[[nodiscard]] std::vector<std::string> colour_planes(const std::filesystem::path& file);

/// Whether `file` is an OpenEXR file with a channel of that name. Throws InputError.
[[nodiscard]] bool has_plane(const std::filesystem::path& file, const std::string& channel);

// One file pair of readers each; `plane` as above.
[[nodiscard]] Image read_fits_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_png_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_tiff_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_jpeg_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_exr_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_pds3_image(const std::filesystem::path& label, const std::string& plane);
// What colour_planes() asks each of them.
[[nodiscard]] std::int64_t fits_planes(const std::filesystem::path& file);
[[nodiscard]] bool png_has_colours(const std::filesystem::path& file);
[[nodiscard]] bool tiff_has_colours(const std::filesystem::path& file);
[[nodiscard]] bool jpeg_has_colours(const std::filesystem::path& file);
[[nodiscard]] bool exr_has_colours(const std::filesystem::path& file);
[[nodiscard]] bool exr_has_channel(const std::filesystem::path& file, const std::string& channel);
[[nodiscard]] std::int64_t pds3_planes(const std::filesystem::path& label);

/// What a picture's pixels give for a plane that was asked for.
struct ColourChoice {
    double weight[3];
};
/// Red, green, blue or luminance (Rec. ITU-R BT.709). Throws InputError for any other word.
[[nodiscard]] ColourChoice colour_choice(const std::filesystem::path& file, const std::string& plane);

/// The number in `plane`, below `planes`; 0 when empty. Throws InputError.
[[nodiscard]] std::int32_t plane_number(const std::filesystem::path& file, const std::string& plane,
                                        std::int64_t planes);
/// Throws InputError unless both are positive and the product is not above max_image_pixels.
void check_image_size(const std::filesystem::path& file, std::int64_t width, std::int64_t height);

} // namespace obscura::images
