// SPDX-License-Identifier: Apache-2.0
// Files of the operator's page, as bytes in the program.
#pragma once

#include <span>
#include <string_view>

namespace obscura::web {

/// One of the files of web/page. `path`: of the request, "/" for the page itself; `type`: MIME type;
/// `zipped`: the same bytes by gzip; `hash`: hexadecimal digits that change with the bytes.
struct PageFile {
    std::string_view path, type, bytes, zipped, hash;
};

/// All of them. Thread-safe.
[[nodiscard]] std::span<const PageFile> page_files() noexcept;

/// Hexadecimal digits that change with any of the files. The page names its files below this folder,
/// "/HASH/page.js", where they never change.
[[nodiscard]] std::string_view page_version() noexcept;

} // namespace obscura::web
