// The part of Device that has a sequencer.
#include "transports/gige/device/device.hpp"

namespace obscura::transports::gige {
namespace {

constexpr std::uint32_t sequenced_feature_count = 5;

} // namespace

Status Device::publish_sequence(const Sequence& wanted) {
    if (!control_.set_sequence(wanted)) return Status::invalid_parameter;
    sequence_ = wanted;
    return Status::success;
}

void Device::add_sequencer() {
    // SFNC: sets are written in configuration mode only, and that excludes running.
    const auto configured = [this](std::uint32_t& word, std::uint32_t value) {
        if (!sequencer_configuring_ && value != word) return Status::write_protect;
        word = value;
        return Status::success;
    };
    bank_.add({.name = "SequencerMode",
               .address = feature::sequencer_mode,
               .access = Access::read_write,
               .locked_while_streaming = true,
               .maximum = 1,
               .read = [this] { return std::uint32_t{sequence_.enabled}; },
               .write =
                   [this](std::uint32_t value) {
                       if (value == 1 && sequencer_configuring_) return Status::write_protect;
                       Sequence wanted = sequence_;
                       wanted.enabled = value == 1;
                       return publish_sequence(wanted);
                   }});
    bank_.add({.name = "SequencerConfigurationMode",
               .address = feature::sequencer_configuration,
               .access = Access::read_write,
               .locked_while_streaming = true,
               .maximum = 1,
               .read = [this] { return std::uint32_t{sequencer_configuring_}; },
               .write =
                   [this](std::uint32_t value) {
                       if (value == 1 && sequence_.enabled) return Status::write_protect;
                       sequencer_configuring_ = value == 1;
                       return Status::success;
                   }});
    bank_.add(
        {.name = "SequencerSetStart",
         .address = feature::sequencer_set_start,
         .access = Access::read_write,
         .locked_while_streaming = true,
         .maximum = Sequence::max_steps - 1,
         .read = [this] { return sequence_.start; },
         .write = [this, configured](std::uint32_t value) { return configured(sequence_.start, value); }});
    word("SequencerSetActive", feature::sequencer_set_active, 0,
         [this] { return sequence_.enabled ? control_.activity().sequence_step : 0U; });
    bank_.add({.name = "SequencerSetSelector",
               .address = feature::sequencer_set_selector,
               .access = Access::read_write,
               .maximum = Sequence::max_steps - 1});
    command("SequencerSetSave", feature::sequencer_set_save, [this] {
        if (!sequencer_configuring_) return Status::write_protect;
        const CameraSettings s = control_.settings();
        SequenceStep& step = sequence_.steps[bank_.peek(feature::sequencer_set_selector)];
        step = {s.exposure_ns, s.gain_db, s.black_level_dn, s.region.x, s.region.y, step.next};
        return Status::success;
    });
    command("SequencerSetLoad", feature::sequencer_set_load, [this] {
        if (!sequencer_configuring_) return Status::write_protect;
        const CameraSettings wanted =
            with_step(control_.settings(), sequence_, bank_.peek(feature::sequencer_set_selector));
        return control_.apply(wanted) ? Status::success : Status::invalid_parameter;
    });
    for (std::uint32_t i = 0; i < sequenced_feature_count; ++i)
        bank_.add({.name = "SequencerFeatureEnable",
                   .address = feature::sequencer_feature_enable + 4 * i,
                   .access = Access::read_write,
                   .locked_while_streaming = true,
                   .maximum = 1,
                   .read = [this, i] { return sequence_.features >> i & 1; },
                   .write =
                       [this, configured, i](std::uint32_t value) {
                           return configured(sequence_.features,
                                             (sequence_.features & ~(1U << i)) | value << i);
                       }});
    for (std::uint32_t i = 0; i < Sequence::max_steps; ++i)
        bank_.add({.name = "SequencerSetNext",
                   .address = feature::sequencer_set_next + 4 * i,
                   .access = Access::read_write,
                   .locked_while_streaming = true,
                   .maximum = Sequence::max_steps - 1,
                   .read = [this, i] { return sequence_.steps[i].next; },
                   .write = [this, configured,
                             i](std::uint32_t value) { return configured(sequence_.steps[i].next, value); }});
}

} // namespace obscura::transports::gige
