// SPDX-License-Identifier: Apache-2.0
// Files of the operator's page, as bytes in the program.
#pragma once

#include <string_view>

namespace obscura::web {

/// Content of one of the files of web/page; empty: there is none of that name.
[[nodiscard]] std::string_view page_file(std::string_view name);

} // namespace obscura::web
