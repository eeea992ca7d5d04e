// SPDX-License-Identifier: Apache-2.0
// Paths of motions from files: trajectories and attitude profiles as CSV tables or CCSDS messages.
#pragma once

#include "ephemeris/trajectories/sampled_path.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/scene/trajectory.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

namespace obscura::scene {

/// Form of a file of positions or attitudes, by its first line.
enum class PathFormat : std::uint8_t { csv, oem, aem };
/// Throws ConfigError if the file cannot be read.
[[nodiscard]] PathFormat path_format(const std::filesystem::path& file);

/// Samples of a table in scene time as a path whose time 0 is `ephemeris::Epoch{}`: linear and slerp. Throws
/// ConfigError `file: what` if times are less than 1 ns apart.
[[nodiscard]] ephemeris::PathFile path_of_table(const std::filesystem::path& file,
                                                const std::vector<TimedPose>& samples);

/// Positions and attitudes, each from a path or constant.
struct PathParts {
    std::optional<ephemeris::SampledPath> positions{}, attitudes{};
    Pose constant{}; ///< what the paths do not give
};
[[nodiscard]] std::shared_ptr<const PosePath> make_path(PathParts parts);

/// The poses of a trajectory, linear and slerp between them. Throws as path_of_table().
[[nodiscard]] std::shared_ptr<const PosePath> path_of_samples(const std::vector<TimedPose>& samples);

/// Poses of `path` at its times, for what lists the instants of a motion; never empty.
[[nodiscard]] std::vector<TimedPose> samples_of(const PosePath& path);

} // namespace obscura::scene
