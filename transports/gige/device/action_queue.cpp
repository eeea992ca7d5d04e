// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/action_queue.hpp"

#include <algorithm>

namespace obscura::transports::gige {

bool take_action(DeviceContext& d, const ActionRequest& request, Time now, Status& status) {
    status = Status::success;
    if (request.device_key != d.bank.peek(reg::action_device_key)) return false;
    if (d.controller_ip == 0 &&
        (d.bank.peek(reg::gvcp_configuration) & gvcp_configuration::unconditional_action) == 0)
        return false;
    if (request.group_key != d.bank.peek(reg::action_groups) ||
        (request.group_mask & d.bank.peek(reg::action_groups + 4)) == 0)
        return false;
    if (!request.scheduled) {
        d.control.action_trigger(now);
        return true;
    }
    // From device time back to the scheduling clock. Sums with later instants could overflow.
    constexpr std::uint64_t latest_instant_ns = std::uint64_t{1} << 62; // the year 2116
    if (request.instant_ns > latest_instant_ns) {
        status = Status::invalid_parameter;
        return true;
    }
    const auto instant = static_cast<std::int64_t>(request.instant_ns);
    const Time due{instant + d.timestamp_origin_ns - d.clock.tai_offset_ns()};
    if (due <= now) {
        status = Status::action_late;
        post(d, Event::action_late, now);
        return true;
    }
    const auto free = std::find(d.actions.begin(), d.actions.end(), Time{});
    if (free == d.actions.end()) {
        status = Status::overflow;
    } else {
        *free = due;
    }
    return true;
}

Time next_action(const DeviceContext& d) noexcept {
    Time next{INT64_MAX};
    for (const Time t : d.actions)
        if (t != Time{}) next = std::min(next, t);
    return next;
}

void run_actions(DeviceContext& d, Time now) {
    for (Time next = next_action(d); next <= now; next = next_action(d)) {
        // The edge is the scheduled time, which is the same for every camera on the link.
        d.control.action_trigger(next);
        *std::find(d.actions.begin(), d.actions.end(), next) = {};
    }
}

} // namespace obscura::transports::gige
