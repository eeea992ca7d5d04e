// SPDX-License-Identifier: Apache-2.0
// Injected faults of the device: from the rules in force to stream and control.
#pragma once

#include "transports/gige/device/device_context.hpp"

namespace obscura::transports::gige {

/// Passes the rules in force to the fault injectors of the control side and of the stream, which applies them
/// from its next frame on.
void publish_faults(DeviceContext& d);
/// Disarms those faults of TestControl that leave commands unanswered or let the heartbeat time out.
void clear_control_faults(DeviceContext& d);

} // namespace obscura::transports::gige
