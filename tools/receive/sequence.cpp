// SPDX-License-Identifier: Apache-2.0
#include "tools/receive/sequence.hpp"

#include "host/command_line.hpp"

#include <fmt/format.h>

#include <charconv>

namespace obscura::tools {

std::string numbered(const std::string& pattern, std::uint64_t number) {
    const std::size_t percent = pattern.find('%');
    const std::size_t end =
        percent == std::string::npos ? percent : pattern.find_first_not_of("0123456789", percent + 1);
    if (end == std::string::npos || pattern[end] != 'd' || pattern.find('%', end) != std::string::npos)
        throw host::UsageError(
            fmt::format("--output {}: the name of a sequence must hold one number like %04d", pattern));
    int width = 0;
    std::from_chars(pattern.data() + percent + 1, pattern.data() + end, width);
    if (width > 20) throw host::UsageError(fmt::format("--output {}: at most 20 digits", pattern));
    return fmt::format("{}{:0{}}{}", pattern.substr(0, percent), number, width, pattern.substr(end + 1));
}

std::vector<SequenceFrame> sequence(const std::string& pattern, const std::vector<double>& times_s) {
    if (times_s.size() == 1) return {{1, times_s.front(), pattern}};
    std::vector<SequenceFrame> frames;
    for (const double time_s : times_s) {
        const std::uint64_t number = frames.size() + 1;
        frames.push_back({number, time_s, numbered(pattern, number)});
    }
    return frames;
}

} // namespace obscura::tools
