// SPDX-License-Identifier: Apache-2.0
#include "emulator/trigger/input_line.hpp"

#include <utility>

namespace obscura::emulator {

std::uint64_t InputLine::record(const sync::Trigger& trigger) noexcept {
    edge_ns_.store(trigger.edge.ns, std::memory_order_relaxed);
    high_.store(!trigger.falling, std::memory_order_relaxed);
    forecast_.add(trigger);
    edges_.fetch_add(1, std::memory_order_release);
    const std::uint64_t last = std::exchange(last_id_, trigger.id);
    return last != 0 && trigger.id > last ? trigger.id - last - 1 : 0;
}

std::uint64_t InputLine::number_active(std::uint64_t lost) noexcept {
    // Assume half of the lost edges were active.
    return active_id_ += 1 + lost / 2;
}

void InputLine::begin_pulse(const sync::Trigger& trigger, std::uint32_t acquisition) noexcept {
    pulse_ = trigger;
    pulse_acquisition_ = acquisition;
}

std::optional<sync::Trigger> InputLine::end_pulse(const sync::Trigger& trigger,
                                                  std::uint32_t acquisition) noexcept {
    if (std::exchange(pulse_acquisition_, 0) != acquisition) return std::nullopt;
    sync::Trigger pulse = pulse_;
    pulse.seen = trigger.seen;
    pulse.width_ns = trigger.edge - pulse.edge;
    return pulse;
}

} // namespace obscura::emulator
