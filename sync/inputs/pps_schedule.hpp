// SPDX-License-Identifier: Apache-2.0
// Schedule at PPS + k/rate + phase, with holdover through missing pulses.
#pragma once

#include "core/clock_state.hpp"
#include "core/time.hpp"
#include "sync/schedule.hpp"

#include <cstdint>
#include <optional>

namespace obscura::sync {

struct PpsSettings {
    RationalRate rate{10, 1};
    std::int64_t phase_ns = 0;
    std::int64_t glitch_ns = 500 * ns_per_ms; ///< a pulse earlier than this after another is a glitch
    /// A locked pulse deviates by at most this from the expected instant.
    std::int64_t tolerance_ns = ns_per_ms;
    std::int64_t holdover_ns = 60 * ns_per_s; ///< longest time without pulses in holdover, then free
};

/// Slot m lies m/rate after the first pulse, measured from the pulse of its own second: the pulse's time
/// stamp plus the fraction of the second, plus the phase. While the pulse of a second is missing, the latest
/// pulse is extrapolated by seconds of the scheduling clock. Not thread-safe.
class PpsSchedule {
public:
    explicit PpsSchedule(const PpsSettings& settings);

    /// Adds a pulse. Returns false for a glitch.
    bool pulse(Time edge) noexcept;
    [[nodiscard]] bool started() const noexcept { return second_.has_value(); }

    /// Instant of slot m by the pulses so far. Requires started().
    [[nodiscard]] Time slot(std::uint64_t m) const noexcept;
    /// Number of the first slot at or after `t`.
    [[nodiscard]] std::uint64_t first_slot_from(Time t) const noexcept;
    /// Whether slot m coincides with a pulse that has not come yet.
    [[nodiscard]] bool awaits_pulse(std::uint64_t m) const noexcept;
    [[nodiscard]] ClockState state(Time now) const noexcept;
    /// Offset of the last pulse from the instant predicted by the pulse before.
    [[nodiscard]] std::int64_t last_offset_ns() const noexcept { return last_offset_ns_; }

private:
    const PpsSettings settings_;
    const Schedule nominal_; ///< slot m after 0
    /// Number of the last pulse's second; the first pulse is second 0.
    std::optional<std::int64_t> second_;
    Time last_pulse_;
    std::int64_t last_offset_ns_ = 0;
    bool consistent_ = false; ///< the last pulse came within the tolerance
};

} // namespace obscura::sync
