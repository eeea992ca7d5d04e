// SPDX-License-Identifier: Apache-2.0
// Frames of a daemon as files: PNG, FITS, JPEG, numbers, and what is known of them as JSON.
#pragma once

#include "web/kept_frames.hpp"
#include "web/message.hpp"

#include <filesystem>
#include <mutex>
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

    /// A frame as "png", "fits", "raw", "jpg" or "json". Throws Error where the folder cannot be written,
    /// Refusal (422) for a frame too large for a JPEG.
    [[nodiscard]] Response response(std::string_view format, const KeptFrame& frame);

private:
    [[nodiscard]] std::string file(std::string_view format, const KeptFrame& frame);

    std::mutex mutex_;             ///< held while a file is made
    std::filesystem::path folder_; ///< made for the first file
};

} // namespace obscura::web
