// SPDX-License-Identifier: Apache-2.0
// Camera and poses of received frames, from their chunks, for a JSON file beside them.
#pragma once

#include "renderer/scene/scene.hpp"
#include "tools/receive/frame_chunks.hpp"
#include "tools/scene/camera_file.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {

/// Collects what the chunks of frames say of the camera. Frames carry matrix and poses, not the distortion:
/// that comes from the camera of a configuration.
class ReceivedCamera {
public:
    /// `binning`: BinningHorizontal and BinningVertical of the camera.
    void set_binning(std::array<std::int32_t, 2> binning) { binning_ = binning; }

    /// `file`: name of the picture; empty: it is not saved.
    void add(const FrameChunks& chunks, const std::string& file);

    /// Camera of the frames, with the lens of the first of `lenses` that has their focal length and principal
    /// point. The part of the sensor is that of the frames if they have one window, the same in all, else the
    /// whole sensor of `sensor_width` x `sensor_height` pixels. Throws InputError if no lens fits.
    [[nodiscard]] PictureCamera camera(const std::vector<scene::Camera>& lenses, std::int32_t sensor_width,
                                       std::int32_t sensor_height) const;

    [[nodiscard]] const std::vector<CameraFileFrame>& frames() const { return frames_; }

private:
    std::array<std::int32_t, 2> binning_{1, 1};
    std::vector<CameraFileFrame> frames_;
    std::optional<Region> window_; ///< of the first frame; none if it has several
    bool same_window_ = true;
};

} // namespace obscura::tools
