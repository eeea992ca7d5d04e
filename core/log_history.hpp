// SPDX-License-Identifier: Apache-2.0
// History of the log: the latest lines that this process has written, numbered.
#pragma once

#include "core/log.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace obscura {

/// One line of the log.
struct LoggedLine {
    std::uint64_t id = 0;    ///< counts from 1 in this process
    std::int64_t utc_ns = 0; ///< when it was written, CLOCK_REALTIME
    LogLevel level = LogLevel::info;
    std::string text; ///< at most log_history_text bytes of it
};

/// Lines that are kept, and bytes of each.
constexpr std::size_t log_history_lines = 1024, log_history_text = 1024;

/// The oldest lines kept with an id above `after`, at most `most` of them. Thread-safe, not real-time safe.
[[nodiscard]] std::vector<LoggedLine> logged_lines(std::uint64_t after, std::size_t most);

} // namespace obscura
