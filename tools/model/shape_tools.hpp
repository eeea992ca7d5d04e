// SPDX-License-Identifier: Apache-2.0
// What the verbs `obscura model` say of a shape.
#pragma once

#include "tools/model/kind_tools.hpp"

namespace obscura::tools {

[[nodiscard]] const KindTools& shape_tools();

} // namespace obscura::tools
