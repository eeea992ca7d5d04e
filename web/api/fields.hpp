// SPDX-License-Identifier: Apache-2.0
// Queries and bodies of requests, read by the table of routes.
#pragma once

#include "web/api/route_table.hpp"

#include <nlohmann/json_fwd.hpp>

#include <span>
#include <string_view>

namespace obscura::web {

/// Fields of a query that are given, by their names. Throws Refusal (422) for a name or a value that the
/// table does not have.
[[nodiscard]] nlohmann::ordered_json read_query(std::string_view query, std::span<const Parameter> fields);

/// The object of a body; of Body::fields only what the table has. An empty text is an empty object. Throws
/// Refusal: 400 for what is no JSON or nested too deep, 422 for the rest.
[[nodiscard]] nlohmann::ordered_json read_body(std::string_view text, const Route& route);

} // namespace obscura::web
