// SPDX-License-Identifier: Apache-2.0
// What the verbs `obscura model` say of the response of a sensor's pixels.
#pragma once

#include "tools/model/kind_tools.hpp"

namespace obscura::tools {

[[nodiscard]] const KindTools& sensor_tools();

} // namespace obscura::tools
