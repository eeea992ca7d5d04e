// SPDX-License-Identifier: Apache-2.0
// JSON schemas (draft 2020-12) of the web server's answers.
#pragma once

#include <string_view>

namespace obscura::web {

/// An object of schemas by the names that Route::schema has.
extern const std::string_view openapi_schemas;

} // namespace obscura::web
