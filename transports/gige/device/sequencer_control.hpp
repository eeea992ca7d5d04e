// SPDX-License-Identifier: Apache-2.0
// Sequencer: passes sequences of sets to the camera.
#pragma once

#include "transports/gige/device/device_context.hpp"

namespace obscura::transports::gige {

/// Passes `wanted` to the camera; nothing changes on refusal.
Status publish_sequence(DeviceContext& d, const Sequence& wanted);

} // namespace obscura::transports::gige
