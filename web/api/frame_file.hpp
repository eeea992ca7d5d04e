// SPDX-License-Identifier: Apache-2.0
// Frames of a daemon as files: PNG, FITS, JPEG, numbers, and what is known of them as JSON.
#pragma once

#include "web/live/kept_frames.hpp"
#include "web/live/view.hpp"
#include "web/server/message.hpp"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <string_view>

namespace obscura::web {

/// Makes files in a folder of its own, which ends with it. Thread-safe.
class FrameFiles {
public:
    FrameFiles() = default;
    ~FrameFiles();
    FrameFiles(const FrameFiles&) = delete;
    FrameFiles& operator=(const FrameFiles&) = delete;

    /// A frame as "png", "fits", "raw", "jpg" or "json", or what a view shows of it; the contrast of a JPEG
    /// is that of the whole frame. Throws Error where the folder cannot be written, Refusal (422) for what is
    /// too large for a JPEG.
    [[nodiscard]] Response response(std::string_view format, const KeptFrame& frame, const View& view = {});

    /// Irradiance of a frame as OpenEXR: the answer to the call `irradiance`, planes of `height` x `width`.
    /// Throws as response(), and exceptions of JSON.
    [[nodiscard]] Response irradiance(const CameraId& camera, const nlohmann::ordered_json& head,
                                      std::span<const float> values, std::size_t height, std::size_t width);

private:
    [[nodiscard]] std::string file(std::string_view format, const KeptFrame& frame);
    /// The bytes of a file of that name in the folder, which `write` makes.
    [[nodiscard]] std::string made(const std::string& name,
                                   const std::function<void(const std::filesystem::path&)>& write);

    std::mutex mutex_;             ///< held while a file is made
    std::filesystem::path folder_; ///< made for the first file
};

} // namespace obscura::web
