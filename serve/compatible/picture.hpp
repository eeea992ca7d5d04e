// SPDX-License-Identifier: Apache-2.0
// Picture of the published client and its forms on the wire: bottom row first, channels interleaved.
#pragma once

#include "core/camera/frame.hpp"
#include "core/geometry.hpp"
#include "models/kinds/projection_program.hpp"
#include "renderer/scene/scene.hpp"
#include "service/memory_account.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace obscura::serve::compatible {

/// Sensor of PictureLens::unit: as far from its centre as 3 focal lengths.
[[nodiscard]] models::SensorPlane unit_plane();

/// Where a lens shows directions. Lengths over the focal length.
struct PictureLens {
    scene::Projection projection = scene::Projection::pinhole;
    std::array<double, 5> distortion{}; ///< Brown and Conrady: k1, k2, k3, p1, p2, from real to ideal
    nlohmann::json own{};               ///< with Projection::model: the table of a scene file
    /// The model at a focal length of 1 m: image points are taken to grow with the focal length.
    std::shared_ptr<const models::ProjectionProgram> unit{};

    /// Distance from the centre of the ideal picture, of a direction at that angle to the boresight, to the
    /// right or down. NaN: the lens does not show it.
    [[nodiscard]] double radius(double angle_rad, bool down = false) const;
    /// Unit vector of a point of the real picture: x right, y down, z forward; 0: the lens shows nothing
    /// there.
    [[nodiscard]] Vec3 direction(double x, double y) const;
    /// Largest angle to the boresight, exclusive.
    [[nodiscard]] double max_angle_rad() const;

    [[nodiscard]] bool operator==(const PictureLens&) const = default;
};

/// A picture as it was rendered, first row on top, and what its maps are made of.
struct Picture {
    std::int32_t width = 0, height = 0;
    std::vector<float> values{}; ///< planes of the channels, one after the other
    double fx_px = 0, fy_px = 0; ///< focal lengths
    Pose eye;                    ///< camera frame (x right, y down, z forward) to the scene's, mid-exposure
    PictureLens lens{};
    double mid_s = 0;  ///< scene time of mid-exposure, of the row in the middle
    double line_s = 0; ///< from a row to the next
    /// Times of the pixels, of scanning devices and models of times; empty: as `mid_s` and `line_s` say.
    std::vector<RowTime> times{};
    bool scanned = false; ///< by a scanning device: all pixels look along the boresight
    bool los = false, time = false;
    // Surfaces behind the centres of the pixels, once they are asked for:
    std::vector<double> range_m{};            ///< infinite: nothing
    std::array<std::vector<float>, 3> normal; ///< scene axes, NaN: nothing
    /// Memory of the values, of those maps and of `times`.
    service::MemoryAccount::Share share{}, surfaces_share{}, times_share{};

    [[nodiscard]] std::size_t pixels() const {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    }
    /// Unit vector along the ray of a pixel's centre: x right, y down, z forward; 0: the lens shows nothing.
    [[nodiscard]] Vec3 ray(std::int32_t column, std::int32_t row) const;
};

/// All channels, float32.
[[nodiscard]] std::string as_float(const Picture& picture);
/// All channels, 0 to 1 as 0 to 255.
[[nodiscard]] std::string as_bytes(const Picture& picture);
/// Mean of the first three channels, float32.
[[nodiscard]] std::string gray_float(const Picture& picture);
[[nodiscard]] std::string gray_bytes(const Picture& picture);
/// Sum of the channels times `weights`, float32.
[[nodiscard]] std::string weighted_float(const Picture& picture, const std::array<double, 4>& weights);
[[nodiscard]] std::string depth_map(const Picture& picture);
/// Normals and lines of sight, float32 x, y, z each. `backward`: of a camera that looks along -z, y up.
[[nodiscard]] std::string normal_map(const Picture& picture, bool backward);
[[nodiscard]] std::string los_map(const Picture& picture, bool backward);
[[nodiscard]] std::string time_map(const Picture& picture);

/// First bytes of all floats, then all second ones, ...
[[nodiscard]] std::string byte_planes(const std::string& floats);

} // namespace obscura::serve::compatible
