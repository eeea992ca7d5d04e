// SPDX-License-Identifier: Apache-2.0
// TestControl: PENDING_ACK, test event, and faults, which take effect from the next frame on.
#include "transports/gige/device/test_control.hpp"

#include "transports/gige/device/accessors.hpp"

#include <array>

namespace obscura::transports::gige {
namespace {

constexpr std::array fault_selector_entries{
    entry("Lose", Fault::lose),
    entry("LoseForGood", Fault::lose_for_good),
    entry("Duplicate", Fault::duplicate),
    entry("Reorder", Fault::reorder),
    entry("Delay", Fault::delay),
    entry("Corrupt", Fault::corrupt),
    entry("DropLeader", Fault::drop_leader),
    entry("DropTrailer", Fault::drop_trailer),
    entry("SkipFrame", Fault::skip_frame),
    entry("WrongBlockID", Fault::wrong_block_id),
    entry("WrongTimestamp", Fault::wrong_timestamp),
    entry("MuteControl", Fault::mute_control),
    entry("FreezeFrame", Fault::freeze_frame),
    entry("RepeatFrame", Fault::repeat_frame),
    entry("HeartbeatLoss", Fault::heartbeat_loss),
};

std::uint64_t get_percent(const Feature& f, DeviceContext& d, std::uint32_t i) {
    const auto plain = d.armed_faults.plain(static_cast<Fault>(i));
    return plain ? to_word(f, plain->percent) : 0;
}

Status set_percent(const Feature& f, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    d.armed_faults.set_percent(static_cast<Fault>(i), from_word(f, word), stored(d, "FaultAmount", i));
    publish_faults(d);
    return Status::success;
}

std::uint64_t get_amount(const Feature& /*f*/, DeviceContext& d, std::uint32_t i) {
    const auto plain = d.armed_faults.plain(static_cast<Fault>(i));
    return plain ? static_cast<std::uint32_t>(plain->amount) : stored(d, "FaultAmount", i);
}

Status set_amount(const Feature& /*f*/, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    store(d, "FaultAmount", i, word);
    d.armed_faults.set_amount(static_cast<Fault>(i), word);
    publish_faults(d);
    return Status::success;
}

constexpr std::array test_features{
    Feature{
        .name = "TestPendingAck",
        .visibility = Visibility::guru,
        .address = 0xA444,
        .unit = "ms",
        .minimum = fixed(0),
        .maximum = fixed(5000),
        .in_user_set = false,
        .written = [](DeviceContext& d, std::uint32_t) { d.pending_ack_ms = stored(d, "TestPendingAck"); }},
    Feature{.name = "TestEventGenerate",
            .type = FeatureType::command,
            .visibility = Visibility::guru,
            .address = 0xA440,
            .run =
                [](DeviceContext& d, std::uint32_t) {
                    post(d, Event::test, d.clock.now());
                    return Status::success;
                }},
    Feature{.name = "FaultSelector",
            .type = FeatureType::enumeration,
            .custom = true,
            .visibility = Visibility::guru,
            .entries = fault_selector_entries},
    Feature{.name = "FaultPercent",
            .type = FeatureType::floating,
            .custom = true,
            .visibility = Visibility::guru,
            .tooltip = "Share of packets (frames, commands) that the fault strikes",
            .address = 0xA500,
            .selectors = {"FaultSelector"},
            .stride = 4,
            .scale = 1000,
            .minimum = fixed(0),
            .maximum = fixed(100),
            .in_user_set = false,
            .get = get_percent,
            .set = set_percent},
    Feature{.name = "FaultAmount",
            .custom = true,
            .visibility = Visibility::guru,
            .tooltip = "Delay, WrongTimestamp: us; WrongBlockID: how far off",
            .address = 0xA540,
            .selectors = {"FaultSelector"},
            .stride = 4,
            .minimum = fixed(0),
            .maximum = fixed(1000000),
            .in_user_set = false,
            .get = get_amount,
            .set = set_amount,
            .reset = [](const DeviceContext&) { return std::uint32_t{1}; }},
    Feature{.name = "FaultStruck",
            .custom = true,
            .visibility = Visibility::guru,
            .tooltip = "Packets (frames, commands) that all rules of this fault have struck",
            .access = Access::read_only,
            .address = 0xA580,
            .selectors = {"FaultSelector"},
            .stride = 4,
            .get = [](const Feature&, DeviceContext& d,
                      std::uint32_t i) { return d.armed_faults.struck(static_cast<Fault>(i)); }},
};

} // namespace

FeatureCategory test_control() {
    return {.name = "TestControl", .features = test_features};
}

void publish_faults(DeviceContext& d) {
    d.faults.set_rules(d.armed_faults.rules());
    d.stream.set_faults(d.faults);
}

void clear_control_faults(DeviceContext& d) {
    for (const Fault fault : {Fault::mute_control, Fault::heartbeat_loss})
        while (d.armed_faults.plain(fault))
            d.armed_faults.set_percent(fault, 0, 0);
    publish_faults(d);
}

} // namespace obscura::transports::gige
