// SPDX-License-Identifier: Apache-2.0
// Files of the operator's page, as bytes in the program.
#pragma once

#include <span>
#include <string_view>

namespace obscura::web {

/// One of the files of web/page. `path`: of the request, "/" for the page itself; `type`: MIME type.
struct PageFile {
    std::string_view path, type, bytes;
};

/// All of them. Thread-safe.
[[nodiscard]] std::span<const PageFile> page_files() noexcept;

} // namespace obscura::web
