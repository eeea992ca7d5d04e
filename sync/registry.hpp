// Makes a trigger source from its settings.
#pragma once

#include "core/clock.hpp"
#include "core/realtime.hpp"
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
    std::string line, edge = "rising"; ///< gpio
    std::int64_t debounce_ns = 0;      ///< gpio: what the kernel may do itself
    std::string device;                ///< pps, ptp; empty: the first
    unsigned channel = 0;              ///< ptp
    std::string listen;                ///< udp
    std::string start;                 ///< ptp_timer
    ThreadSettings thread{};
};

/// Null for the kind "none". `clock` must outlive the source. Throws ConfigError for a kind that does not
/// exist or a rate out of range.
[[nodiscard]] std::unique_ptr<TriggerSource> make_source(const SourceSettings& settings, const Clock& clock);

/// Comma-separated, for messages.
[[nodiscard]] std::string source_kinds();

} // namespace obscura::sync
