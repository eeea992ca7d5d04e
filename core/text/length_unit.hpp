// SPDX-License-Identifier: Apache-2.0
// Names of units of length in labels of files.
#pragma once

#include <optional>
#include <string_view>

namespace obscura {

/// Metres of a unit by its symbol or English name, in any case: m, km, cm, mm, ft. Empty: it is none of
/// these.
[[nodiscard]] std::optional<double> metres_of_unit(std::string_view name);

} // namespace obscura
