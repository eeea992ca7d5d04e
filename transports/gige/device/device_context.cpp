// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/device_context.hpp"

#include "transports/gige/device/stream_channel.hpp"

#include <algorithm>

namespace obscura::transports::gige {

DeviceContext::DeviceContext(const GigeSettings& settings_, const NetworkInterface& network_,
                             CameraControl& control_, StreamPort& stream_, MessageChannel& messages_,
                             const Clock& clock_, std::uint64_t seed_)
    : settings(settings_),
      seed(seed_),
      network(network_),
      control(control_),
      stream(stream_),
      messages(messages_),
      clock(clock_),
      limits(control_.limits()),
      packet_size_max(std::max(packet_size_min, std::min(network_.mtu, packet_size_limit) / 4 * 4)),
      armed_faults(settings, seed) {}

std::uint64_t device_time(const DeviceContext& d, Time t) noexcept {
    return static_cast<std::uint64_t>(t.ns + d.clock.tai_offset_ns() - d.timestamp_origin_ns);
}

void post(DeviceContext& d, Event e, Time t) {
    d.messages.post({e, 0, device_time(d, t)});
}

Status apply_settings(DeviceContext& d, const CameraSettings& wanted) {
    if (!d.control.explain(wanted).empty()) return Status::invalid_parameter;
    return d.control.apply(wanted) ? Status::success : Status::invalid_parameter;
}

const ReadoutAnswer& readout_answer(DeviceContext& d) {
    const CameraSettings s = d.control.settings();
    if (!d.answered || s != d.answered_settings) {
        d.answer = d.control.readout(s);
        d.answered_settings = s;
        d.answered = true;
    }
    return d.answer;
}

} // namespace obscura::transports::gige
