// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/pps_schedule.hpp"

#include <cstdlib>

namespace obscura::sync {

PpsSchedule::PpsSchedule(const PpsSettings& settings)
    : settings_(settings), nominal_(settings.rate, Time{}, 0) {}

bool PpsSchedule::pulse(Time edge) noexcept {
    if (!second_) {
        second_ = 0;
        last_pulse_ = edge;
        return true;
    }
    const std::int64_t since = edge - last_pulse_;
    if (since < settings_.glitch_ns) return false;
    const std::int64_t seconds = (since + ns_per_s / 2) / ns_per_s;
    last_offset_ns_ = since - seconds * ns_per_s;
    consistent_ = std::llabs(last_offset_ns_) <= settings_.tolerance_ns * seconds;
    second_ = *second_ + (seconds > 0 ? seconds : 1);
    last_pulse_ = edge;
    return true;
}

Time PpsSchedule::slot(std::uint64_t m) const noexcept {
    const std::int64_t nominal_ns = nominal_.slot(m).ns;
    return last_pulse_ + (nominal_ns - second_.value_or(0) * ns_per_s) + settings_.phase_ns;
}

std::uint64_t PpsSchedule::first_slot_from(Time t) const noexcept {
    const std::int64_t nominal_ns = t - last_pulse_ + second_.value_or(0) * ns_per_s - settings_.phase_ns;
    return nominal_.first_slot_from(Time{nominal_ns});
}

bool PpsSchedule::awaits_pulse(std::uint64_t m) const noexcept {
    const std::int64_t nominal_ns = nominal_.slot(m).ns;
    return settings_.phase_ns == 0 && nominal_ns % ns_per_s == 0 &&
           nominal_ns / ns_per_s > second_.value_or(0);
}

ClockState PpsSchedule::state(Time now) const noexcept {
    if (!second_ || now - last_pulse_ > settings_.holdover_ns) return ClockState::free;
    if (now - last_pulse_ > 3 * ns_per_s / 2) return ClockState::holdover;
    return consistent_ ? ClockState::locked : ClockState::free;
}

} // namespace obscura::sync
