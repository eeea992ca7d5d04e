// SPDX-License-Identifier: Apache-2.0
// Writer of TOML: text of a tree of values, which reads back to the same tree.
#pragma once

#include "config/document.hpp"

#include <string>

namespace obscura::config {

/// Shortest text that reads back to the same double, and is never mistaken for an integer.
[[nodiscard]] std::string number_text(double value);

/// The table `root` as a TOML file: numbers to their last digit, members in their order, tables behind the
/// keys beside them. Positions are not used. Dates, which no key takes, are left out.
[[nodiscard]] std::string toml_text(const Value& root);

} // namespace obscura::config
