// SPDX-License-Identifier: Apache-2.0
// Intrinsics, distortion and poses of a sequence as a JSON file that OpenCV's FileStorage reads.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/scene/scene.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {

/// One picture of the sequence, or one instant without a picture.
struct CameraFileFrame {
    std::string file{}; ///< name of the picture; empty: none
    std::uint64_t number = 1;
    double time_s = 0; ///< of the poses, mid-exposure: scene time, or time by the clock of a real camera
    double exposure_s = 0;
    GroundTruth truth{};
};

/// Camera of the pictures of a sequence, which all show the same part of the sensor.
struct PictureCamera {
    Intrinsics intrinsics{};
    std::int32_t sensor_width = 0, sensor_height = 0;
    /// Part of the sensor that the pictures show, from whose first pixel the principal point counts.
    Region window{};
    /// Sensor pixels that make one of the picture's: right, down.
    std::array<std::int32_t, 2> binning{1, 1};
    /// Projection, distortion and rotation of the sensor; not known of a camera that does not state them.
    std::optional<scene::Camera> lens{};

    /// The camera of a scene, of which the pictures show `window`.
    [[nodiscard]] static PictureCamera of_scene(const scene::Camera& camera, Region window);
};

/// The camera as JSON: camera_matrix and distortion_coefficients as OpenCV defines them, the scene's own
/// model of projection and distortion, and the poses of each frame. Without a lens it has the matrix and the
/// poses only.
[[nodiscard]] std::string camera_file_text(const PictureCamera& camera,
                                           const std::vector<CameraFileFrame>& frames);

/// Writes camera_file_text() to `file`. Throws OutputError.
void write_camera_file(const std::filesystem::path& file, const PictureCamera& camera,
                       const std::vector<CameraFileFrame>& frames);

} // namespace obscura::tools
