// SPDX-License-Identifier: Apache-2.0
// Intrinsics, distortion and poses of a sequence as a JSON file that OpenCV's FileStorage reads.
#pragma once

#include "core/frame.hpp"
#include "renderer/scene/scene.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::tools {

/// One picture of the sequence, or one instant without a picture.
struct CameraFileFrame {
    std::string file{}; ///< name of the picture; empty: none
    std::uint64_t number = 1;
    double time_s = 0; ///< scene time of the poses, mid-exposure
    double exposure_s = 0;
    GroundTruth truth{};
};

/// The camera as JSON: camera_matrix and distortion_coefficients as OpenCV defines them, the scene's own
/// model of projection and distortion, and the poses of each frame. `window` is the part of the sensor that
/// the pictures show, from whose first pixel the principal point counts.
[[nodiscard]] std::string camera_file_text(const scene::Camera& camera, Region window,
                                           const std::vector<CameraFileFrame>& frames);

/// Writes camera_file_text() to `file`. Throws OutputError.
void write_camera_file(const std::filesystem::path& file, const scene::Camera& camera, Region window,
                       const std::vector<CameraFileFrame>& frames);

} // namespace obscura::tools
