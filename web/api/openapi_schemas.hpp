// SPDX-License-Identifier: Apache-2.0
// JSON schemas (draft 2020-12) of the web server's answers.
#pragma once

#include <string_view>

namespace obscura::web {

/// An object of schemas by their names, those of Route::schema or of calls. Those of calls have only what the
/// table of calls does not say; null takes a member of it away.
extern const std::string_view openapi_schemas;

} // namespace obscura::web
