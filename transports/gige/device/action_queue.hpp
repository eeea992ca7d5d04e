// SPDX-License-Identifier: Apache-2.0
// ACTION commands: executed at once, or queued until their scheduled time.
#pragma once

#include "transports/gige/device/device_context.hpp"
#include "transports/gige/wire/gvcp_parser.hpp"

#include <cstdint>

namespace obscura::transports::gige {

constexpr std::uint32_t action_group_count = 1;

/// See Device::action(), next_action() and run_actions().
bool take_action(DeviceContext& d, const ActionRequest& request, Time now, Status& status);
[[nodiscard]] Time next_action(const DeviceContext& d) noexcept;
void run_actions(DeviceContext& d, Time now);

} // namespace obscura::transports::gige
