// SPDX-License-Identifier: Apache-2.0
// Files of received or captured frames: the numbers in a chosen format, and a preview beside them.
#pragma once

#include "images/writers/frame_writer.hpp"
#include "tools/pictures/preview.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::tools {

/// Saves numbered frames in a folder as the options --format, --no-preview, --stretch, --gamma and --msb
/// state.
class FrameFiles {
public:
    /// Declares the options; `context`: beginning of their help, such as "With --output: ".
    void declare(host::CommandLine& line, const std::string& context);
    /// Checks the options. Throws UsageError.
    void prepare(std::string_view verb);
    /// Name of the file of frame `number`.
    [[nodiscard]] std::string name(std::uint64_t number) const;
    /// Writes frame_NNNNNN and, if wanted, preview_NNNNNN.png. `windows`: of the frame, in its pixels; empty:
    /// not known. Throws OutputError.
    void save(const std::filesystem::path& folder, std::uint64_t number, const images::Picture& picture,
              images::Cards cards, const std::vector<Region>& windows) const;

private:
    std::string format_ = "png";
    StretchOptions stretch_options_;
    host::Stretch stretch_;
    bool preview_ = false, no_preview_ = false, msb_ = false;
};

} // namespace obscura::tools
