// SPDX-License-Identifier: Apache-2.0
// Trigger sources, activations, counters and timers of the camera by their SFNC names.
#pragma once

#include "core/text/enum_names.hpp"
#include "core/time.hpp"

#include <array>
#include <cstdint>

namespace obscura {

/// Input lines: Line0 to Line3. The output line comes after them.
constexpr std::size_t line_count = 4;
constexpr std::size_t counter_count = 2, timer_count = 2;

/// SFNC TriggerSource. `line0` is the main trigger input, driven by the source that the configuration assigns
/// to it (timer, GPIO edge, PPS, simulator); line1 to line3 are further inputs.
enum class TriggerSource : std::uint8_t {
    software,
    line0,
    action1,
    line1,
    line2,
    line3,
    counter0_end,
    counter1_end,
    timer0_end,
    timer1_end,
};
constexpr std::size_t trigger_source_count = 10;
constexpr auto enum_names(TriggerSource /*type*/) {
    return std::array{EnumName{TriggerSource::software, "Software"},
                      EnumName{TriggerSource::line0, "Line0"},
                      EnumName{TriggerSource::action1, "Action1"},
                      EnumName{TriggerSource::line1, "Line1"},
                      EnumName{TriggerSource::line2, "Line2"},
                      EnumName{TriggerSource::line3, "Line3"},
                      EnumName{TriggerSource::counter0_end, "Counter0End"},
                      EnumName{TriggerSource::counter1_end, "Counter1End"},
                      EnumName{TriggerSource::timer0_end, "Timer0End"},
                      EnumName{TriggerSource::timer1_end, "Timer1End"}};
}

/// Number of the input line `source`; line_count when it is not a line.
[[nodiscard]] constexpr std::size_t line_of(TriggerSource source) noexcept {
    if (source == TriggerSource::line0) return 0;
    const bool other = source >= TriggerSource::line1 && source <= TriggerSource::line3;
    return other ? static_cast<std::size_t>(source) - static_cast<std::size_t>(TriggerSource::line1) + 1
                 : line_count;
}
[[nodiscard]] constexpr TriggerSource source_of_line(std::size_t line) noexcept {
    return line == 0 ? TriggerSource::line0
                     : static_cast<TriggerSource>(static_cast<std::size_t>(TriggerSource::line1) + line - 1);
}

/// SFNC TriggerActivation: which edges of a line trigger, or the level during which the trigger is active.
enum class TriggerActivation : std::uint8_t { rising_edge, falling_edge, any_edge, level_high, level_low };
constexpr std::uint32_t trigger_activation_count = 5;
constexpr auto enum_names(TriggerActivation /*type*/) {
    return std::array{EnumName{TriggerActivation::rising_edge, "RisingEdge"},
                      EnumName{TriggerActivation::falling_edge, "FallingEdge"},
                      EnumName{TriggerActivation::any_edge, "AnyEdge"},
                      EnumName{TriggerActivation::level_high, "LevelHigh"},
                      EnumName{TriggerActivation::level_low, "LevelLow"}};
}

[[nodiscard]] constexpr bool is_level(TriggerActivation activation) noexcept {
    return activation == TriggerActivation::level_high || activation == TriggerActivation::level_low;
}
/// Whether an edge triggers under `activation`; for a level, whether it begins with that edge.
[[nodiscard]] constexpr bool activates(TriggerActivation activation, bool falling) noexcept {
    const bool on_falling =
        activation == TriggerActivation::falling_edge || activation == TriggerActivation::level_low;
    return activation == TriggerActivation::any_edge || on_falling == falling;
}

/// SFNC TriggerOverlap: when the next edge is accepted. `off`: after the readout of the previous frame;
/// `readout`: as soon as the chip can begin another exposure; `previous_frame`: an earlier edge is latched
/// and takes effect at that instant.
enum class TriggerOverlap : std::uint8_t { off, readout, previous_frame };

/// Settings of one trigger of TriggerSelector.
struct TriggerChoice {
    bool enabled = false;
    TriggerSource source = TriggerSource::line0;
    TriggerActivation activation = TriggerActivation::rising_edge; ///< applies to lines only
    constexpr bool operator==(const TriggerChoice&) const = default;
    /// Whether an edge of source `from` fires this trigger.
    [[nodiscard]] constexpr bool accepts(TriggerSource from, bool falling) const noexcept {
        return enabled && source == from && (line_of(from) == line_count || activates(activation, falling));
    }
};

/// Edge types that the source of a line can report. Single-edge sources report rising edges; unconnected
/// lines report none.
struct LineEdges {
    bool rising = false, falling = false;
    [[nodiscard]] constexpr bool both() const { return rising && falling; }
};

/// Events that counters count and that start timers: CounterEventSource and TimerTriggerSource.
enum class IoEvent : std::uint8_t {
    off,
    line0,                ///< an edge of that line, whether or not a trigger uses it
    frame_trigger,        ///< an edge that started a frame
    frame_trigger_missed, ///< counters only
    frame_start,
    frame_end, ///< the last row has left the chip
    exposure_start,
    exposure_end,
    acquisition_start,
    line1,
    line2,
    line3,
};
constexpr std::uint32_t io_event_count = 12;

/// SFNC CounterResetSource. With `counter_end` the counter ends every `duration` events.
enum class CounterReset : std::uint8_t { off, acquisition_start, counter_end };

/// SFNC CounterControl: counts the events since its last reset.
struct EventCounter {
    IoEvent source = IoEvent::off;
    CounterReset reset = CounterReset::off;
    std::uint32_t duration = 0; ///< events until the counter's end; 0: no end
    constexpr bool operator==(const EventCounter&) const = default;
};
/// State of a counter at its last reset.
struct CounterMark {
    std::uint64_t base = 0; ///< events before the reset
    std::uint32_t value_at_reset = 0;
};

/// SFNC TimerControl: `delay_ns` after its trigger the timer is active for `duration_ns`, then ends. Each
/// trigger restarts it.
struct PulseTimer {
    IoEvent source = IoEvent::off;
    std::int64_t delay_ns = 0, duration_ns = 0;
    constexpr bool operator==(const PulseTimer&) const = default;
};

} // namespace obscura
