// SPDX-License-Identifier: Apache-2.0
// Words for the type and the range of a key, shared by its reader and its printer.
#pragma once

#include "config/keys.hpp"

#include <string>
#include <string_view>

namespace obscura::config {

/// "LEAST to LARGEST UNIT", with one limit "LEAST or more" or "at most LARGEST"; empty without limits.
std::string range_text(const Range& range, std::string_view unit);

/// With its article: "a number".
std::string type_name(const Target& target);

} // namespace obscura::config
