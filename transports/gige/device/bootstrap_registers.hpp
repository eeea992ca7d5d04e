// SPDX-License-Identifier: Apache-2.0
// Bootstrap registers of GigE Vision: identity, network, capabilities, time stamps, stream and message
// channel.
#pragma once

#include "transports/gige/device/device_context.hpp"

namespace obscura::transports::gige {

/// Adds the registers below manufacturer_begin, except those of the control channel (control/control_port)
/// and the URLs of the description.
void add_bootstrap_registers(DeviceContext& d);

/// Configures the message channel from its registers.
void configure_messages(DeviceContext& d);

} // namespace obscura::transports::gige
