// SPDX-License-Identifier: Apache-2.0
// Image reader for textures and measured images: FITS, PNG, TIFF, JPEG, OpenEXR, PDS3. Read this header
// first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::images {

/// One plane of numbers, row-major, first row of the file first. NaN for pixels that the file marks as
/// missing.
struct Image {
    std::int32_t width = 0, height = 0;
    std::vector<double> values;
    /// The largest value that the file's integers can hold; 1 in files of reals.
    double full_scale = 1;

    [[nodiscard]] double at(std::int32_t x, std::int32_t y) const {
        return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(x)];
    }
};

/// Largest image that is read, in pixels: bounds the memory that a hostile header can request.
constexpr std::int64_t max_image_pixels = std::int64_t{1} << 28;

/// Reads one plane of `file`; the format is detected from its first bytes. `plane` selects the plane: a
/// number from 0 in FITS and PDS3 files, a channel name in OpenEXR files, "red", "green" or "blue" in colour
/// images (PNG, TIFF, JPEG). Empty: the first plane (OpenEXR: the first channel in alphabetical order; colour
/// images: the luminance). Throws InputError with one line.
[[nodiscard]] Image read_image(const std::filesystem::path& file, const std::string& plane = {});

/// Names of the planes that hold the file's colours, for read_image(): one empty name for a grey image;
/// "red", "green" and "blue" for a colour image, or "R", "G" and "B" for an OpenEXR file; "0", "1", ... for a
/// FITS cube or a PDS3 image. Throws InputError.
[[nodiscard]] std::vector<std::string> colour_planes(const std::filesystem::path& file);

/// Whether `file` is an OpenEXR file with a channel of that name. Throws InputError.
[[nodiscard]] bool has_plane(const std::filesystem::path& file, const std::string& channel);

// Readers of one format each; `plane` as for read_image().
[[nodiscard]] Image read_fits_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_png_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_tiff_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_jpeg_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_exr_image(const std::filesystem::path& file, const std::string& plane);
[[nodiscard]] Image read_pds3_image(const std::filesystem::path& label, const std::string& plane);
// Queries of one format each, for colour_planes() and has_plane().
[[nodiscard]] std::int64_t fits_planes(const std::filesystem::path& file);
[[nodiscard]] bool png_has_colours(const std::filesystem::path& file);
[[nodiscard]] bool tiff_has_colours(const std::filesystem::path& file);
[[nodiscard]] bool jpeg_has_colours(const std::filesystem::path& file);
[[nodiscard]] bool exr_has_colours(const std::filesystem::path& file);
[[nodiscard]] bool exr_has_channel(const std::filesystem::path& file, const std::string& channel);
[[nodiscard]] std::int64_t pds3_planes(const std::filesystem::path& label);

/// Weights of red, green and blue for a requested plane of a colour image.
struct ColourChoice {
    double weight[3];
};
/// Weights of "red", "green", "blue" or, for the empty name, luminance (Rec. ITU-R BT.709). Throws InputError
/// for any other name.
[[nodiscard]] ColourChoice colour_choice(const std::filesystem::path& file, const std::string& plane);

/// Parses `plane` as a number below `planes`; 0 when empty. Throws InputError.
[[nodiscard]] std::int32_t plane_number(const std::filesystem::path& file, const std::string& plane,
                                        std::int64_t planes);
/// Throws InputError unless both are positive, the product is not above max_image_pixels and there is memory
/// to read such an image.
void check_image_size(const std::filesystem::path& file, std::int64_t width, std::int64_t height);

} // namespace obscura::images
