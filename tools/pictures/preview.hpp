// SPDX-License-Identifier: Apache-2.0
// 8-bit previews with stretched contrast and marked windows, for viewing only.
#pragma once

#include "core/camera/region.hpp"
#include "host/command_line.hpp"
#include "host/tone_curve.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// Writes stretched(image) as an 8-bit PNG. Throws OutputError.
void write_preview(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                   const std::vector<float>& image, const host::Stretch& stretch);

/// Digital numbers of a frame and its windows, in pixels of the frame; no windows: the whole frame is one.
struct FramePreview {
    std::int32_t width = 0, height = 0;
    int bits = 16;
    std::span<const std::uint16_t> pixels; ///< row-major
    std::vector<Region> windows;
};

/// Writes a preview of a frame: grey, or in colour with marked windows (orange outlines) and padding (blue
/// stripes) where the windows do not fill the frame or are several. Padding does not count for the contrast.
/// Throws OutputError.
void write_preview(const std::filesystem::path& file, const FramePreview& frame,
                   const host::Stretch& stretch);

/// Options --stretch and --gamma.
struct StretchOptions {
    std::string text = "auto";
    double gamma = 1;

    /// `of`: beginning of the help text, such as "Contrast of the previews".
    void declare(host::CommandLine& line, const std::string& of);
    /// Throws UsageError.
    [[nodiscard]] host::Stretch parsed(std::string_view verb) const {
        return host::Stretch::parse(verb, text, gamma);
    }
};

} // namespace obscura::tools
