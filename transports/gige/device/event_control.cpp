// SPDX-License-Identifier: Apache-2.0
// EventControl: notification, and the identifiers of wire/event.hpp.
#include "transports/gige/device/accessors.hpp"

#include <array>

namespace obscura::transports::gige {
namespace {

constexpr std::array event_selector_entries{
    entry("FrameStart", Event::frame_start),
    entry("ExposureStart", Event::exposure_start),
    entry("ExposureEnd", Event::exposure_end),
    entry("FrameTriggerMissed", Event::frame_trigger_missed),
    entry("Error", Event::error),
    entry("Test", Event::test),
    entry("PrimaryApplicationSwitch", Event::application_switch),
    entry("ActionLate", Event::action_late),
    entry("FrameDegraded", Event::frame_degraded),
};

constexpr std::array event_features{
    Feature{.name = "EventSelector", .type = FeatureType::enumeration, .entries = event_selector_entries},
    Feature{.name = "EventNotification",
            .type = FeatureType::enumeration,
            .address = 0xA400,
            .selectors = {"EventSelector"},
            .stride = 4,
            .entries = off_on,
            .written =
                [](DeviceContext& d, std::uint32_t i) {
                    d.messages.enable(static_cast<Event>(i), stored(d, "EventNotification", i) != 0);
                }},
    Feature{.name = "EventFrameStart",
            .tooltip = "Identifier of the event on the message channel",
            .access = Access::read_only,
            .constant = event_id(Event::frame_start)},
    Feature{.name = "EventExposureStart",
            .tooltip = "Identifier of the event on the message channel",
            .access = Access::read_only,
            .constant = event_id(Event::exposure_start)},
    Feature{.name = "EventExposureEnd",
            .tooltip = "Identifier of the event on the message channel",
            .access = Access::read_only,
            .constant = event_id(Event::exposure_end)},
    Feature{.name = "EventFrameTriggerMissed",
            .custom = true,
            .tooltip = "Identifier of the event on the message channel",
            .access = Access::read_only,
            .constant = event_id(Event::frame_trigger_missed)},
    Feature{.name = "EventError",
            .tooltip = "Identifier of the event on the message channel",
            .access = Access::read_only,
            .constant = event_id(Event::error)},
    Feature{.name = "EventTest",
            .tooltip = "Identifier of the event on the message channel",
            .access = Access::read_only,
            .constant = event_id(Event::test)},
    Feature{.name = "EventPrimaryApplicationSwitch",
            .tooltip = "Identifier of the event on the message channel",
            .access = Access::read_only,
            .constant = event_id(Event::application_switch)},
    Feature{.name = "EventActionLate",
            .tooltip = "Identifier of the event on the message channel",
            .access = Access::read_only,
            .constant = event_id(Event::action_late)},
    Feature{.name = "EventFrameDegraded",
            .custom = true,
            .tooltip = "Identifier of the event on the message channel",
            .access = Access::read_only,
            .constant = event_id(Event::frame_degraded)},
};

} // namespace

FeatureCategory event_control() {
    return {.name = "EventControl", .features = event_features};
}

} // namespace obscura::transports::gige
