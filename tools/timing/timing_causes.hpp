// SPDX-License-Identifier: Apache-2.0
// Why frames of a run were late, and what would help: parts of their time, causes and cures with figures.
#pragma once

#include "tools/timing/timing_file.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace obscura::tools {

/// Lateness of the last row of a frame in ns; 0 if it was in time.
[[nodiscard]] std::int64_t lateness(const TimingRow& row) noexcept;
/// Stage that took the longest in a late frame, with its duration and, where known, what in it took the time
/// and what would help; "in time" for other frames.
[[nodiscard]] std::string reason(const TimingRow& row);

/// One part of the time from a frame's edge to its last row: they add up to it, but for rows that wait for
/// their time.
struct TimePart {
    std::string name;
    std::string setting; ///< what decides it
    double ms = 0;
};
/// Means over `frames`, without those that were given up. Rendering is divided by the time of the render
/// threads; its last part is the time that they lost to other programs.
[[nodiscard]] std::vector<TimePart> time_parts(std::span<const TimingRow> frames);

/// A cause of lateness (or of a lower frame rate) with its cure. `of_ms` is what the stage takes now,
/// `with_ms` what it would take with the cure.
struct Cure {
    std::string cause;
    double ms = 0, of_ms = 0, with_ms = 0;
    std::string advice; ///< a setting with its value, or what to do
    [[nodiscard]] std::string text() const;
};
/// Causes in the mean of `frames` of one acquisition, the one that costs most first.
[[nodiscard]] std::vector<Cure> cures(std::span<const TimingRow> frames);

/// Statements about the whole acquisition, a line each: load by other programs, triggers faster than the
/// chip, sending that ends after the rows.
[[nodiscard]] std::vector<std::string> remarks(const TimingFile& acquisition);

} // namespace obscura::tools
