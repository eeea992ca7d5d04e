// SPDX-License-Identifier: Apache-2.0
// Commented models to begin with.
#pragma once

#include <string>
#include <string_view>

namespace obscura::tools {

/// Text of a model of `kind` (models/model/entry_points.hpp) that works and says what can be changed. `name`
/// is for its first line. Throws std::out_of_range: there is no such kind.
[[nodiscard]] std::string new_model_text(std::string_view kind, std::string_view name);

} // namespace obscura::tools
