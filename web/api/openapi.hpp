// SPDX-License-Identifier: Apache-2.0
// OpenAPI 3.1 document of the web server, made of the table of routes.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string_view>

namespace obscura::web {

/// `version`: of the program.
[[nodiscard]] nlohmann::ordered_json openapi_document(std::string_view version);

} // namespace obscura::web
