// SPDX-License-Identifier: Apache-2.0
// Names of the files of frames that a daemon has handed out by its call `frame`.
#pragma once

#include "images/writers/frame_writer.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::tools {

/// Names of files as `obscura frame --output` gives them: a file for one frame, a folder for several.
/// Thread-bound.
class FrameNames {
public:
    /// `output`: a file whose suffix is a format, or a folder, which exists or ends with a slash. `several`:
    /// only a folder will do. Beside the formats of pictures there is "json", metadata only. Throws
    /// UsageError.
    FrameNames(std::string_view verb, const std::string& output, const std::string& format, bool several);

    /// Path of the file of the next frame. Ids that start again, because an acquisition did, get the prefix
    /// run2_, run3_, ..., as the file transport does it. Creates the folder. Throws OutputError.
    [[nodiscard]] std::filesystem::path next(std::uint64_t frame_id);
    /// None: metadata only.
    [[nodiscard]] std::optional<images::FrameFormat> format() const noexcept { return format_; }

private:
    std::filesystem::path output_;
    std::optional<images::FrameFormat> format_;
    bool is_folder_ = false;
    std::uint64_t last_id_ = 0;
    int run_ = 1;
};

} // namespace obscura::tools
