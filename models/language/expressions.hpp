// SPDX-License-Identifier: Apache-2.0
// Parser of SuMoL expressions by precedence.
#pragma once

#include "models/language/syntax.hpp"
#include "models/language/token_reader.hpp"

namespace obscura::models {

/// Reads an expression. `nesting` counts what it stands in (parser.hpp: max_nesting). Precedence as in C,
/// with
/// `|`, the dot product, between && and ==. Throws Unreadable.
[[nodiscard]] ExpressionPointer read_expression(TokenReader& reader, int& nesting);

} // namespace obscura::models
