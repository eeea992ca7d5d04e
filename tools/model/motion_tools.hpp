// SPDX-License-Identifier: Apache-2.0
// What the verbs `obscura model` say of a camera's small motion.
#pragma once

#include "tools/model/kind_tools.hpp"

namespace obscura::tools {

[[nodiscard]] const KindTools& motion_tools();

} // namespace obscura::tools
