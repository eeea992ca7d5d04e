# SPDX-License-Identifier: Apache-2.0
# Writes OUTPUT, a C++ file with the content of each of FILES, paths below FOLDER. The page is that of index.html.
set(type_html "text/html; charset=utf-8")
set(type_js "text/javascript; charset=utf-8")
set(type_css "text/css; charset=utf-8")
set(type_svg "image/svg+xml")
set(rows "")
foreach(file IN LISTS FILES)
    file(READ "${FOLDER}/${file}" bytes HEX)
    string(LENGTH "${bytes}" size)
    math(EXPR size "${size} / 2")
    string(REGEX REPLACE "(..)" "\\\\x\\1" bytes "${bytes}")
    string(REGEX MATCH "[a-z]+$" ending "${file}")
    string(REPLACE "index.html" "" path "${file}")
    string(APPEND rows "    {\"/${path}\", \"${type_${ending}}\", std::string_view(\"${bytes}\", ${size})},\n")
endforeach()
file(WRITE "${OUTPUT}" "// Made by page_bytes.cmake.
#include \"web/page_files.hpp\"

namespace obscura::web {
namespace {
constexpr PageFile files[] = {
${rows}};
} // namespace

std::span<const PageFile> page_files() noexcept {
    return files;
}

} // namespace obscura::web
")
