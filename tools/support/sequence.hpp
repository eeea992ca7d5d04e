// The frames of a rendered sequence: their numbers, times and files.
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

/// `pattern` with `number` put in for its one "%d", "%04d" or the like. Throws UsageError when there is none,
/// or any other "%".
[[nodiscard]] std::string numbered(const std::string& pattern, std::uint64_t number);

/// One frame per time; a single one takes `pattern` as its file's name as it stands. Throws UsageError.
[[nodiscard]] std::vector<SequenceFrame> sequence(const std::string& pattern,
                                                  const std::vector<double>& times_s);

} // namespace obscura::tools
