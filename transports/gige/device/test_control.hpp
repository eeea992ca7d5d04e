// SPDX-License-Identifier: Apache-2.0
// Injected faults: rules of the configuration and those set live in TestControl.
#pragma once

#include "transports/gige/device/device_context.hpp"

namespace obscura::transports::gige {

/// Passes all rules to the fault injector; the stream applies them from the next AcquisitionStart on.
void publish_faults(DeviceContext& d);
/// Disables those faults set in TestControl that leave commands unanswered or let the heartbeat time out.
void clear_control_faults(DeviceContext& d);

} // namespace obscura::transports::gige
