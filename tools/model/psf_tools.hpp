// SPDX-License-Identifier: Apache-2.0
// What the verbs `obscura model` say of a point spread function.
#pragma once

#include "tools/model/kind_tools.hpp"

namespace obscura::tools {

[[nodiscard]] const KindTools& psf_tools();

} // namespace obscura::tools
