// SPDX-License-Identifier: Apache-2.0
// SequencerControl. Sets hold the enabled features; SequencerSetSave stores their current values.
#include "transports/gige/device/sequencer_control.hpp"

#include "transports/gige/device/accessors.hpp"

#include <array>

namespace obscura::transports::gige {
namespace {

/// SFNC: sets are written in configuration mode only, which excludes SequencerMode On.
Status configure(DeviceContext& d, std::uint32_t& member, std::uint32_t word) {
    if (!d.sequencer_configuring && word != member) return Status::write_protect;
    member = word;
    return Status::success;
}

std::uint64_t get_sequencer_mode(const Feature&, DeviceContext& d, std::uint32_t) {
    return d.sequence.enabled ? 1 : 0;
}
Status set_sequencer_mode(const Feature&, DeviceContext& d, std::uint32_t, std::uint32_t word) {
    if (word == 1 && d.sequencer_configuring) return Status::write_protect;
    Sequence wanted = d.sequence;
    wanted.enabled = word == 1;
    return publish_sequence(d, wanted);
}

std::uint64_t get_configuration_mode(const Feature&, DeviceContext& d, std::uint32_t) {
    return d.sequencer_configuring ? 1 : 0;
}
Status set_configuration_mode(const Feature&, DeviceContext& d, std::uint32_t, std::uint32_t word) {
    if (word == 1 && d.sequence.enabled) return Status::write_protect;
    d.sequencer_configuring = word == 1;
    return Status::success;
}

std::uint64_t get_feature_enable(const Feature&, DeviceContext& d, std::uint32_t i) {
    return d.sequence.features >> i & 1;
}
Status set_feature_enable(const Feature&, DeviceContext& d, std::uint32_t i, std::uint32_t word) {
    return configure(d, d.sequence.features, (d.sequence.features & ~(1U << i)) | word << i);
}

Status save_set(DeviceContext& d, std::uint32_t) {
    if (!d.sequencer_configuring) return Status::write_protect;
    const CameraSettings s = d.control.settings();
    SequenceStep& step = d.sequence.steps[stored(d, "SequencerSetSelector")];
    step = {s.exposure_ns, s.gain_db, s.black_level_dn, s.region.x, s.region.y, step.next};
    return Status::success;
}
Status load_set(DeviceContext& d, std::uint32_t) {
    if (!d.sequencer_configuring) return Status::write_protect;
    const CameraSettings wanted =
        with_step(d.control.settings(), d.sequence, stored(d, "SequencerSetSelector"));
    return d.control.apply(wanted) ? Status::success : Status::invalid_parameter;
}

constexpr std::array sequencer_feature_selector_entries{
    entry(setting("ExposureTime").name, 0), entry(setting("Gain").name, 1),
    entry(setting("BlackLevel").name, 2),   entry(setting("OffsetX").name, 3),
    entry(setting("OffsetY").name, 4),
};

constexpr std::array sequencer_trigger_source_entries{
    entry("FrameStart", 0),
};

constexpr std::array sequencer_trigger_activation_entries{
    entry("RisingEdge", 0),
};

constexpr std::array sequencer_features{
    Feature{.name = "SequencerMode",
            .type = FeatureType::enumeration,
            .address = 0xA800,
            .entries = off_on,
            .lock = FeatureLock::streaming,
            .in_user_set = false,
            .get = get_sequencer_mode,
            .set = set_sequencer_mode},
    Feature{.name = "SequencerConfigurationMode",
            .type = FeatureType::enumeration,
            .address = 0xA804,
            .entries = off_on,
            .lock = FeatureLock::streaming,
            .in_user_set = false,
            .get = get_configuration_mode,
            .set = set_configuration_mode},
    Feature{.name = "SequencerFeatureSelector",
            .type = FeatureType::enumeration,
            .entries = sequencer_feature_selector_entries},
    Feature{.name = "SequencerFeatureEnable",
            .type = FeatureType::boolean,
            .address = 0xA820,
            .selectors = {"SequencerFeatureSelector"},
            .stride = 4,
            .lock = FeatureLock::streaming_unmarked,
            .in_user_set = false,
            .get = get_feature_enable,
            .set = set_feature_enable},
    Feature{.name = "SequencerSetSelector",
            .address = 0xA810,
            .minimum = fixed(0),
            .maximum = fixed(Sequence::max_steps - 1),
            .in_user_set = false},
    Feature{.name = "SequencerSetSave",
            .type = FeatureType::command,
            .address = 0xA814,
            .selectors = {"SequencerSetSelector"},
            .run = save_set},
    Feature{.name = "SequencerSetLoad",
            .type = FeatureType::command,
            .address = 0xA818,
            .selectors = {"SequencerSetSelector"},
            .run = load_set},
    Feature{.name = "SequencerSetActive",
            .tooltip = "The set of the last frame",
            .access = Access::read_only,
            .address = 0xA80C,
            .get = [](const Feature&, DeviceContext& d, std::uint32_t) -> std::uint64_t {
                return d.sequence.enabled ? d.control.activity().sequence_step : 0;
            }},
    Feature{.name = "SequencerSetStart",
            .address = 0xA808,
            .minimum = fixed(0),
            .maximum = fixed(Sequence::max_steps - 1),
            .lock = FeatureLock::streaming_unmarked,
            .in_user_set = false,
            .get = [](const Feature&, DeviceContext& d, std::uint32_t) -> std::uint64_t {
                return d.sequence.start;
            },
            .set = [](const Feature&, DeviceContext& d, std::uint32_t,
                      std::uint32_t word) { return configure(d, d.sequence.start, word); }},
    Feature{.name = "SequencerPathSelector", .minimum = fixed(0), .maximum = fixed(0)},
    Feature{.name = "SequencerSetNext",
            .address = 0xA840,
            .selectors = {"SequencerSetSelector", "SequencerPathSelector"},
            .stride = 4,
            .minimum = fixed(0),
            .maximum = fixed(Sequence::max_steps - 1),
            .lock = FeatureLock::streaming_unmarked,
            .in_user_set = false,
            .get = [](const Feature&, DeviceContext& d, std::uint32_t i) -> std::uint64_t {
                return d.sequence.steps[i].next;
            },
            .set = [](const Feature&, DeviceContext& d, std::uint32_t i,
                      std::uint32_t word) { return configure(d, d.sequence.steps[i].next, word); }},
    Feature{.name = "SequencerTriggerSource",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .selectors = {"SequencerSetSelector", "SequencerPathSelector"},
            .entries = sequencer_trigger_source_entries},
    Feature{.name = "SequencerTriggerActivation",
            .type = FeatureType::enumeration,
            .access = Access::read_only,
            .selectors = {"SequencerSetSelector", "SequencerPathSelector"},
            .entries = sequencer_trigger_activation_entries},
};

} // namespace

FeatureCategory sequencer_control() {
    return {.name = "SequencerControl", .features = sequencer_features};
}

Status publish_sequence(DeviceContext& d, const Sequence& wanted) {
    if (!d.control.set_sequence(wanted)) return Status::invalid_parameter;
    d.sequence = wanted;
    return Status::success;
}

} // namespace obscura::transports::gige
