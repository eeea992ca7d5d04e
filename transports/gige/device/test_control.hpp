// SPDX-License-Identifier: Apache-2.0
// Injected faults: rules of the configuration and those set live in TestControl.
#pragma once

#include "transports/gige/device/device_context.hpp"

#include <cstddef>

namespace obscura::transports::gige {

/// Numbers in FaultCounters: the rules of [[gige.faults]] in their order, then these.
[[nodiscard]] std::size_t drop_percent_counter(const GigeSettings& settings) noexcept;
[[nodiscard]] std::size_t live_counter(const GigeSettings& settings, Fault fault) noexcept;
[[nodiscard]] std::size_t fault_counter_count(const GigeSettings& settings) noexcept;
/// Passes all rules to the fault injector; the stream applies them from the next AcquisitionStart on.
void publish_faults(DeviceContext& d);
/// Disables those faults set in TestControl that leave commands unanswered or let the heartbeat time out.
void clear_control_faults(DeviceContext& d);

} // namespace obscura::transports::gige
