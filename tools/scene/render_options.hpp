// SPDX-License-Identifier: Apache-2.0
// Command-line options of verbs that render frames of a scene without a detector.
#pragma once

#include "core/camera/region.hpp"
#include "core/time.hpp"
#include "host/command_line.hpp"
#include "renderer/renderer.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// Everything but the scene that the bytes of a frame depend on, its time, and RenderSettings::threads, on
/// which they do not depend.
struct RenderOptions {
    std::string size{};   ///< "WxH"; empty: the scene's
    std::string window{}; ///< "X,Y,WxH"; empty: the whole sensor
    renderer::RenderSettings settings{};
    double exposure_s = 0;
    double time_s = 0, step_s = 1; ///< scene time of the first frame, and between frames
    bool trajectory = false;       ///< one frame at each sample of the camera's trajectory instead
    bool layers = false;           ///< also AOVs, samples and variance

    /// Declares the options. The help of --trajectory ends with `trajectory_help`.
    void declare(host::CommandLine& line, const std::string& trajectory_help);
    /// What can be checked without a scene. Throws UsageError.
    void check() const;
    /// Gives `scene` the pixels of --size. Throws UsageError.
    void resize(scene::Scene& scene) const;
    /// Part of the sensor that is rendered. Throws UsageError, which begins with `program`.
    [[nodiscard]] Region region(const scene::Camera& camera, std::string_view program) const;
    /// Scene time of frame `number`, from 1; with --trajectory at most the number of its samples.
    [[nodiscard]] double time_of(const scene::Camera& camera, std::uint64_t number) const;
    /// Scene times of `count` frames, or of all samples of the trajectory.
    [[nodiscard]] std::vector<double> times_s(const scene::Camera& camera, std::uint64_t count) const;
    /// Exposure of all rows of a frame.
    [[nodiscard]] RowTime exposure_of(double at_s) const;
};

} // namespace obscura::tools
