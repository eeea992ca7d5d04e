// SPDX-License-Identifier: Apache-2.0
// Line loop of a rolling shutter: a cycle of row slots that repeats without end in both directions.
#pragma once

#include "core/camera/frame.hpp"
#include "sensors/description.hpp"

#include <array>
#include <cstdint>

namespace obscura::sensors {

/// Length of a row slot that reads `width` pixels. The sum of the pixel periods is rounded once per row.
[[nodiscard]] std::int64_t row_slot_ns(const ReadoutSettings& settings, std::int32_t width) noexcept;

/// n / d rounded towards minus infinity; d > 0.
constexpr std::int64_t floor_div(std::int64_t n, std::int64_t d) noexcept {
    return n / d - (n % d < 0 ? 1 : 0);
}
/// n / d rounded towards plus infinity; d > 0.
constexpr std::int64_t ceil_div(std::int64_t n, std::int64_t d) noexcept {
    return -floor_div(-n, d);
}

/// Cycle of row slots: runs of equal slots, one run per window and one for the blanking; times are ns from
/// the cycle's start.
class RowSlots {
public:
    /// Appends `count` slots of `row_ns` and then `gap_ns` without slots.
    void append(std::int64_t count, std::int64_t row_ns, std::int64_t gap_ns) noexcept;

    [[nodiscard]] std::int64_t cycle_ns() const noexcept { return cycle_ns_; }
    /// Start of slot `row` of run `run`.
    [[nodiscard]] std::int64_t start(std::size_t run, std::int64_t row) const noexcept {
        return runs_[run].start_ns + row * runs_[run].row_ns;
    }
    [[nodiscard]] std::int64_t row_ns(std::size_t run) const noexcept { return runs_[run].row_ns; }
    /// Start of the latest slot, of any cycle, that starts at or before `t_ns`.
    [[nodiscard]] std::int64_t latest_at_or_before(std::int64_t t_ns) const noexcept;

private:
    struct Run {
        std::int64_t start_ns, count, row_ns;
    };
    std::array<Run, max_windows + 1> runs_{};
    std::size_t run_count_ = 0;
    std::int64_t cycle_ns_ = 0;
};

} // namespace obscura::sensors
