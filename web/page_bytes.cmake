# SPDX-License-Identifier: Apache-2.0
# Writes OUTPUT, a C++ file with the content of each of FILES, plain and by GZIP, the program: paths below FOLDER, or NAME|FILE for a
# file of elsewhere.
# The page is that of index.html; it names the others below a folder that is a hash of all of them.
cmake_minimum_required(VERSION 3.25)
set(type_html "text/html; charset=utf-8")
set(type_js "text/javascript; charset=utf-8")
set(type_css "text/css; charset=utf-8")
set(type_svg "image/svg+xml")
set(type_txt "text/plain; charset=utf-8")

# Sets `file` to the name of one of FILES, and `path` to where it is.
macro(find_source entry)
    string(REPLACE "|" ";" path "${entry}")
    list(GET path 0 file)
    list(APPEND path "${FOLDER}/${file}")
    list(GET path 1 path)
endmacro()

# Own scripts and styles go without comments at line starts and without indentation, by which the page is an eighth lighter; the first
# line, with the licence, stays.
function(read_lighter path result)
    file(READ "${path}" text)
    string(REGEX REPLACE "\n[ \t]+" "\n" text "${text}")
    string(REGEX REPLACE "\n/\\*[^*]*(\\*+[^*/][^*]*)*\\*+/" "" text "${text}")
    string(REGEX REPLACE "\n//[^\n]*" "" text "${text}")
    string(REGEX REPLACE "\n\n+" "\n" text "${text}")
    set(${result} "${text}" PARENT_SCOPE)
endfunction()

set(hashes "")
foreach(entry IN LISTS FILES)
    find_source("${entry}")
    file(SHA256 "${path}" hash)
    string(APPEND hashes "${file} ${hash}\n")
endforeach()
string(SHA256 version "${hashes}")
string(SUBSTRING "${version}" 0 16 version)

set(rows "")
foreach(entry IN LISTS FILES)
    find_source("${entry}")
    if(file STREQUAL "index.html")
        file(READ "${path}" text)
        string(REGEX REPLACE "(href|src)=\"" "\\1=\"${version}/" text "${text}")
        set(path "${OUTPUT}.index.html")
        file(WRITE "${path}" "${text}")
    elseif(file MATCHES "^[a-z_]+\\.(js|css)$")
        read_lighter("${path}" text)
        set(path "${OUTPUT}.lighter")
        file(WRITE "${path}" "${text}")
    endif()
    # Without name and time, so that the same files make the same program.
    execute_process(COMMAND "${GZIP}" -9nc "${path}" OUTPUT_FILE "${OUTPUT}.gz" COMMAND_ERROR_IS_FATAL ANY)
    foreach(form bytes zipped)
        if(form STREQUAL "bytes")
            file(READ "${path}" ${form} HEX)
        else()
            file(READ "${OUTPUT}.gz" ${form} HEX)
        endif()
        string(LENGTH "${${form}}" ${form}_size)
        math(EXPR ${form}_size "${${form}_size} / 2")
        string(REGEX REPLACE "(..)" "\\\\x\\1" ${form} "${${form}}")
    endforeach()
    file(SHA256 "${path}" hash)
    string(SUBSTRING "${hash}" 0 16 hash)
    string(REGEX MATCH "[a-z]+$" ending "${file}")
    string(REPLACE "index.html" "" name "${file}")
    string(APPEND rows "    {\"/${name}\", \"${type_${ending}}\", std::string_view(\"${bytes}\", ${bytes_size}),\n"
        "     std::string_view(\"${zipped}\", ${zipped_size}), \"${hash}\"},\n")
endforeach()
file(REMOVE "${OUTPUT}.gz" "${OUTPUT}.index.html" "${OUTPUT}.lighter")
file(WRITE "${OUTPUT}" "// Made by page_bytes.cmake.
#include \"web/page/page_files.hpp\"

namespace obscura::web {
namespace {
constexpr PageFile files[] = {
${rows}};
} // namespace

std::span<const PageFile> page_files() noexcept {
    return files;
}

std::string_view page_version() noexcept {
    return \"${version}\";
}

} // namespace obscura::web
")
