// SPDX-License-Identifier: Apache-2.0
// The sequencer as the camera is to run it.
#pragma once

#include "transports/gige/device/device_context.hpp"

namespace obscura::transports::gige {

/// Hands `wanted` to the camera; nothing changes on refusal.
Status publish_sequence(DeviceContext& d, const Sequence& wanted);

} // namespace obscura::transports::gige
