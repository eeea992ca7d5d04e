// SPDX-License-Identifier: Apache-2.0
// Trajectories and joint tables: poses or joint values over time, from CSV files.
#pragma once

#include "renderer/scene/scene.hpp"
#include "renderer/scene/surface_place.hpp"

#include <filesystem>
#include <string_view>
#include <vector>

namespace obscura::scene {

/// Columns of a trajectory file. Position in metres in the scene's inertial frame (or the parent's); (qw, qx,
/// qy, qz) is the scalar-first unit quaternion that turns vectors of the moving frame into that frame. A file
/// may lack the four columns of the quaternion: positions only.
inline constexpr const char* trajectory_columns = "time_s,x_m,y_m,z_m,qw,qx,qy,qz";

/// Columns of an attitude table: as in a trajectory, without positions.
inline constexpr const char* attitude_columns = "time_s,qw,qx,qy,qz";

/// The columns of a trajectory over a body, see SurfacePlace; degrees, metres, and the attitude as above.
inline constexpr const char* surface_trajectory_columns =
    "time_s,longitude_deg,latitude_deg,altitude_m,qw,qx,qy,qz";

/// Contents of a trajectory file.
struct Trajectory {
    std::vector<TimedPose> samples;
    bool has_attitude = true; ///< false: positions only, the orientations are 1, 0, 0, 0
    /// Places of a trajectory over a body, instead of the positions of the samples, which are 0; else empty.
    std::vector<SurfacePlace> places{};
};

/// Whether the file has a header with places on a body; false also where it cannot be read.
[[nodiscard]] bool is_surface_trajectory(const std::filesystem::path& file);

/// Reads a trajectory, by its header one of positions or of places on a body: at least one row, strictly
/// increasing times, |q| = 1 within 1e-3 (then normalised). Throws ConfigError `file:line:column: column:
/// what`.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& file);

/// Reads an attitude table, under the same rules; the positions are 0.
[[nodiscard]] std::vector<TimedPose> read_attitudes(const std::filesystem::path& file);

/// Reads the table of a joint: time_s and the column `value`, whose entries are multiplied by `unit` (SI).
/// Throws ConfigError.
[[nodiscard]] std::vector<scene::Joint::Sample> read_joint_table(const std::filesystem::path& file,
                                                                 std::string_view value, double unit);

} // namespace obscura::scene
