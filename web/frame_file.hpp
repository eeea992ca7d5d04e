// SPDX-License-Identifier: Apache-2.0
// Frames of a daemon as files: PNG, FITS, numbers, and what is known of them as JSON.
#pragma once

#include "tools/support/call_client.hpp"
#include "web/message.hpp"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>
#include <string>
#include <string_view>

namespace obscura::web {

/// Makes files in a folder of its own, which ends with it. For one thread.
class FrameFiles {
public:
    FrameFiles() = default;
    ~FrameFiles();
    FrameFiles(const FrameFiles&) = delete;
    FrameFiles& operator=(const FrameFiles&) = delete;

    /// The answer to the call `frame` of a camera as "png", "fits", "raw" or "json". Throws Error where the
    /// folder cannot be written.
    [[nodiscard]] Response response(std::string_view format, const std::string& camera,
                                    const tools::CallClient::Answer& frame);

private:
    [[nodiscard]] std::string file(std::string_view format, const tools::CallClient::Answer& frame);

    std::filesystem::path folder_; ///< made for the first file
};

} // namespace obscura::web
