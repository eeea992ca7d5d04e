// SPDX-License-Identifier: Apache-2.0
// Readout sequencing of successive triggers: accepted, deferred and over-triggers.
#pragma once

#include "sensors/sensor.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace obscura::sensors {

enum class TriggerVerdict : std::uint8_t {
    accepted,
    /// The chip is still busy with the previous frame: no frame, counted.
    over_trigger,
    refused, ///< the settings are invalid, see reason()
};

/// Plans successive frames of one sensor. A trigger that comes while the previous frame is still being read
/// out waits for the next instant of its row grid (one window, or global shutter) or of its cycle (several
/// interleaved windows); a trigger that comes before the chip can start again is an over-trigger. Settings
/// are shadow registers: they apply to the frame of the next trigger. If that frame's integration was started
/// by the reads of the previous frame, its rows keep the start that they got under the old settings, and the
/// windows are flagged `settings_changed`.
///
/// Thread-bound; does not allocate once `plan` and the sequencer have seen a frame of that size.
class ReadoutSequencer {
public:
    /// Reserves memory for any frame of such a sensor. Afterwards next() allocates only if `plan` lacks
    /// capacity, and for the text of reason().
    void reserve(const ReadoutSettings& settings);

    TriggerVerdict next(const ReadoutSettings& settings, std::span<const WindowRequest> windows, Time trigger,
                        ReadoutPlan& plan);

    /// Why the last call was refused.
    [[nodiscard]] const std::string& reason() const noexcept { return reason_; }
    [[nodiscard]] std::uint64_t accepted() const noexcept { return accepted_; }
    [[nodiscard]] std::uint64_t over_triggers() const noexcept { return over_triggers_; }
    /// Discards the state of earlier frames, as at an acquisition start.
    void restart() noexcept { running_ = false; }

private:
    [[nodiscard]] Time start_of(const ReadoutSettings& settings, Time trigger) const noexcept;
    void keep_old_starts(const ReadoutSettings& settings, ReadoutPlan& plan) const noexcept;

    bool running_ = false;
    Time earliest_next_; ///< earliest trigger that is not an over-trigger
    Time reading_until_; ///< end of the frame's last row slot
    /// An instant at which an exposure may start while rows are being read.
    Time grid_origin_;
    std::int64_t grid_ns_ = 1;
    std::vector<WindowRequest> windows_;
    /// Per array row: reset by the last destructive read; INT64_MIN: none.
    std::vector<Time> row_reset_;
    std::string reason_;
    std::uint64_t accepted_ = 0, over_triggers_ = 0;
};

} // namespace obscura::sensors
