// SPDX-License-Identifier: Apache-2.0
// Events of the message channel and their identifiers on the wire.
#pragma once

#include <cstddef>
#include <cstdint>

namespace obscura::transports::gige {

/// Events that can be notified, in the order of EventSelector.
enum class Event : std::uint8_t {
    frame_start,
    exposure_start,
    exposure_end,
    frame_trigger_missed,
    error,
    test,
    application_switch,
    action_late,
    frame_degraded,
};
constexpr std::size_t event_count = 9;

/// Identifier on the wire: that of the standard where it defines the event, else one of the range for
/// devices.
constexpr std::uint16_t event_id(Event e) noexcept {
    switch (e) {
    case Event::application_switch:
        return 0x0007;
    case Event::action_late:
        return 0x0009;
    default:
        return static_cast<std::uint16_t>(0x9001 + static_cast<unsigned>(e));
    }
}

} // namespace obscura::transports::gige
