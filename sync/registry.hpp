// Makes a trigger source from its settings.
#pragma once

#include "sync/sync.hpp"

#include <cstdint>
#include <memory>
#include <string>

namespace obscura::sync {

/// What the [trigger] section of a configuration comes down to.
struct SourceSettings {
    std::string kind = "timer"; ///< one of source_kinds()
    double rate_hz = 10;
    std::int64_t phase_ns = 0;
    int priority = 0; ///< SCHED_FIFO priority; 0: ordinary scheduling
};

/// Null for the kind "none". Throws ConfigError for a kind that does not exist or a rate out of range.
[[nodiscard]] std::unique_ptr<TriggerSource> make_source(const SourceSettings& settings);

/// Comma-separated, for messages.
[[nodiscard]] std::string source_kinds();

} // namespace obscura::sync
