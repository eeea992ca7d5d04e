// SPDX-License-Identifier: Apache-2.0
// Injected faults: rules of the configuration and those set live in TestControl.
#pragma once

#include "transports/gige/device/device_context.hpp"

namespace obscura::transports::gige {

/// Hands all rules to the fault injector; the stream takes them at the next AcquisitionStart.
void publish_faults(DeviceContext& d);
/// Switches live faults off that keep commands from being answered or control alive.
void clear_control_faults(DeviceContext& d);

} // namespace obscura::transports::gige
