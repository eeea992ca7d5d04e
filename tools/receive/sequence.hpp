// SPDX-License-Identifier: Apache-2.0
// Frame numbers, scene times and file names of a rendered sequence.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::tools {

struct SequenceFrame {
    std::uint64_t number = 1; ///< from 1
    double time_s = 0;        ///< scene time
    std::filesystem::path file;
};

/// `pattern` with its single "%d" or "%04d" replaced by `number`. Throws UsageError if there is none, or any
/// other "%".
[[nodiscard]] std::string numbered(const std::string& pattern, std::uint64_t number);

/// One frame per time. A single frame uses `pattern` as the file name without replacement. Throws UsageError.
[[nodiscard]] std::vector<SequenceFrame> sequence(const std::string& pattern,
                                                  const std::vector<double>& times_s);

} // namespace obscura::tools
