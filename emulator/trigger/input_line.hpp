// SPDX-License-Identifier: Apache-2.0
// One input line: its edges, level and active-edge numbering, and the pulse whose width is being measured.
#pragma once

#include "core/camera/camera.hpp"
#include "emulator/trigger/line_forecast.hpp"
#include "sync/sync.hpp"

#include <atomic>
#include <cstdint>
#include <optional>

namespace obscura::emulator {

/// Members are called on the line's source thread where not stated otherwise; all are real-time safe.
class InputLine {
public:
    /// Count, time and level of the edges. Thread-safe.
    [[nodiscard]] LineActivity activity() const noexcept {
        return {edges_.load(std::memory_order_acquire), Time{edge_ns_.load(std::memory_order_relaxed)},
                high()};
    }
    /// Level after the last edge; low before the first. Thread-safe.
    [[nodiscard]] bool high() const noexcept { return high_.load(std::memory_order_relaxed); }

    /// Thread-safe.
    [[nodiscard]] const LineForecast& forecast() const noexcept { return forecast_; }

    /// Records an edge. Returns the number of edges lost before it.
    std::uint64_t record(const sync::Trigger& trigger) noexcept;
    /// Numbers an active edge of a dual-edge input, after `lost` edges, among the active edges.
    std::uint64_t number_active(std::uint64_t lost) noexcept;

    /// ExposureMode TriggerWidth: `trigger` begins a pulse in acquisition number `acquisition`.
    void begin_pulse(const sync::Trigger& trigger, std::uint32_t acquisition) noexcept;
    /// Ends the measurement at any further edge. Returns the pulse with its width if it began in
    /// `acquisition`.
    std::optional<sync::Trigger> end_pulse(const sync::Trigger& trigger, std::uint32_t acquisition) noexcept;

private:
    std::atomic<std::uint64_t> edges_{0};
    std::atomic<std::int64_t> edge_ns_{0};
    std::atomic<bool> high_{false};
    LineForecast forecast_;
    // Source's thread only.
    std::uint64_t last_id_ = 0, active_id_ = 0;
    sync::Trigger pulse_;                 ///< first edge of the pulse
    std::uint32_t pulse_acquisition_ = 0; ///< acquisition of the pulse; 0: no pulse is measured
};

} // namespace obscura::emulator
