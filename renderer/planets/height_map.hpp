// SPDX-License-Identifier: Apache-2.0
// Global height map in simple cylindrical projection, interpolated with continuous slopes.
#pragma once

#include "core/geometry.hpp"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace obscura::renderer {

/// Raster of a whole body, metres; pixels are areas of equal steps of longitude, growing eastwards, and of
/// planetocentric latitude, from +90 degrees in the first row to -90 in the last. Immutable; thread-safe.
class HeightMap {
public:
    /// What the numbers of a raster are.
    enum class Values : std::uint8_t {
        height, ///< above the ellipsoid, along the direction from the centre
        radius, ///< distance from the centre
    };

    /// `samples`: width * height, row-major, all finite, m. `width` must be even, both at least 2.
    /// `left_longitude_rad`: of the left edge of the first column.
    HeightMap(std::int32_t width, std::int32_t height, std::vector<float> samples, double left_longitude_rad);

    /// The sample at the direction of `p` (body frame, any length): Catmull-Rom cubics in longitude and
    /// latitude (Keys, Cubic convolution interpolation, IEEE ASSP 29, 1981), across the raster's left and
    /// right edge and over the poles, where a row goes on in the opposite half of the same row.
    [[nodiscard]] double at(Vec3 p) const;

    [[nodiscard]] std::int32_t width() const { return width_; }
    [[nodiscard]] std::int32_t height() const { return height_; }
    /// Smallest and largest sample.
    [[nodiscard]] float least() const { return least_; }
    [[nodiscard]] float largest() const { return largest_; }

private:
    std::int32_t width_, height_;
    double left_longitude_rad_;
    float least_ = 0, largest_ = 0;
    std::vector<float> samples_;
};

/// Largest raster that is read whole, in pixels.
constexpr std::int64_t max_height_map_pixels = std::int64_t{1} << 26;

/// Reads the first plane of an image (images/image.hpp) and multiplies its numbers by `metres_per_unit`. The
/// scaling factor and offset of a PDS3 label have been applied to them. Throws InputError, also if a sample
/// is missing or the raster is not twice as wide as high.
[[nodiscard]] HeightMap read_height_map(const std::filesystem::path& file, double metres_per_unit,
                                        double left_longitude_rad);

} // namespace obscura::renderer
