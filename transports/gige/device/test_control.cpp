// SPDX-License-Identifier: Apache-2.0
// TestControl: PENDING_ACK, test event, and faults, which take effect at the next AcquisitionStart.
#include "transports/gige/device/test_control.hpp"

#include "transports/gige/device/accessors.hpp"

#include <array>
#include <utility>
#include <vector>

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

constexpr std::array features{
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
            .written = [](DeviceContext& d, std::uint32_t) { publish_faults(d); }},
    Feature{.name = "FaultAmount",
            .custom = true,
            .visibility = Visibility::guru,
            .tooltip = "Delay, WrongTimestamp: us; WrongBlockID: how far off",
            .address = 0xA540,
            .selectors = {"FaultSelector"},
            .stride = 4,
            .minimum = fixed(0),
            .maximum = fixed(1000000),
            .written = [](DeviceContext& d, std::uint32_t) { publish_faults(d); },
            .reset = [](const DeviceContext&) { return std::uint32_t{1}; }},
};

} // namespace

FeatureCategory test_control() {
    return {.name = "TestControl", .features = features};
}

std::size_t drop_percent_counter(const GigeSettings& settings) noexcept {
    return settings.faults.size();
}

std::size_t live_counter(const GigeSettings& settings, Fault fault) noexcept {
    return settings.faults.size() + 1 + value(fault);
}

std::size_t fault_counter_count(const GigeSettings& settings) noexcept {
    return settings.faults.size() + 1 + fault_count;
}

void publish_faults(DeviceContext& d) {
    std::vector<FaultRule> rules = d.settings.faults;
    for (std::size_t i = 0; i < rules.size(); ++i) {
        rules[i].counter = static_cast<std::uint32_t>(i);
        if (rules[i].seed == 0) rules[i].seed = d.seed;
    }
    if (d.settings.drop_percent > 0) {
        FaultRule lose;
        lose.percent = d.settings.drop_percent;
        lose.counter = static_cast<std::uint32_t>(drop_percent_counter(d.settings));
        lose.seed = d.seed;
        rules.push_back(lose);
    }
    const Feature& percent = feature("FaultPercent");
    for (std::uint32_t i = 0; i < fault_count; ++i) {
        const std::uint32_t word = stored(d, "FaultPercent", i);
        if (word == 0) continue;
        FaultRule live;
        live.fault = static_cast<Fault>(i);
        live.percent = from_word(percent, word);
        live.amount = stored(d, "FaultAmount", i);
        live.seed = d.seed;
        live.counter = static_cast<std::uint32_t>(live_counter(d.settings, live.fault));
        rules.push_back(live);
    }
    d.faults.set_rules(std::move(rules));
}

void clear_control_faults(DeviceContext& d) {
    for (const Fault fault : {Fault::mute_control, Fault::heartbeat_loss})
        store(d, "FaultPercent", value(fault), 0);
    publish_faults(d);
}

} // namespace obscura::transports::gige
