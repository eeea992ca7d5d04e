// SPDX-License-Identifier: Apache-2.0
// Recursive-descent parser of SuMoL, with limited depth.
#pragma once

#include "models/language/findings.hpp"
#include "models/language/syntax.hpp"

#include <cstddef>
#include <string_view>

namespace obscura::models {

/// Limits of a text; more is an error at the place.
inline constexpr std::size_t max_source_bytes = 65'536;
inline constexpr int max_nesting = 64;            ///< brackets, signs, conditions and blocks in each other
inline constexpr int max_expression_depth = 1000; ///< operators of one chain
inline constexpr std::size_t max_declared = 64;   ///< parameters, globals or functions

/// Syntax tree of `source`, which must outlive it. Reads on behind an error, from the next statement or
/// declaration. The tree is whole only if `findings` has no errors.
[[nodiscard]] SyntaxTree parse(std::string_view source, Findings& findings);

} // namespace obscura::models
