# SPDX-License-Identifier: Apache-2.0
# Precompiled headers of tests, tools and web server: the standard library and fmt, which nearly every source file includes,
# are read once for many targets. Not of the libraries for rendering and real time: GCC inlines some functions otherwise
# when their headers were precompiled, and the machine code of those libraries shall not depend on how they are built.
#
# Nor of the program obscura: GCC 12 warns of bounds in std::string, wrongly, where that was precompiled.
#
# A source file still includes what it uses: the presets debug and tidy, the test `tidy` and the Debian packages compile
# without. With GCC alone: clang's tools cannot read its files.
if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU" OR OBSCURA_SANITIZE)
    set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)
endif()

set(OBSCURA_PRECOMPILED_HEADERS
    <algorithm> <array> <atomic> <chrono> <cmath> <condition_variable> <cstdint> <cstring> <filesystem> <fstream>
    <functional> <map> <memory> <mutex> <optional> <span> <stdexcept> <string> <string_view> <thread> <utility>
    <variant> <vector> <fmt/format.h> <nlohmann/json.hpp>)

# obscura_precompiled(NAME [FLAGS flag...] [HEADERS header...]): target obscura_precompiled_NAME, which holds the headers
# for others. GCC takes them only where -O, -f and -pthread are the same, and says so if not (-Winvalid-pch).
function(obscura_precompiled name)
    cmake_parse_arguments(ARG "" "" "FLAGS;HEADERS" ${ARGN})
    set(target obscura_precompiled_${name})
    add_library(${target} OBJECT EXCLUDE_FROM_ALL "${PROJECT_SOURCE_DIR}/cmake/precompiled.cpp")
    target_link_libraries(${target} PRIVATE obscura_options fmt::fmt nlohmann_json::nlohmann_json)
    target_compile_options(${target} PRIVATE -pthread ${ARG_FLAGS})
    target_precompile_headers(${target} PRIVATE ${OBSCURA_PRECOMPILED_HEADERS} ${ARG_HEADERS})
endfunction()

obscura_precompiled(library)
obscura_precompiled(program FLAGS -fPIE)

# obscura_reuse_precompiled(TARGET [NAME]): those of obscura_precompiled_NAME, else those of its kind, library or program.
function(obscura_reuse_precompiled target)
    get_target_property(type ${target} TYPE)
    if(ARGC GREATER 1)
        set(name ${ARGV1})
    elseif(type STREQUAL EXECUTABLE)
        set(name program)
    else()
        set(name library)
    endif()
    # Some targets have it from GLib.
    target_compile_options(${target} PRIVATE -pthread)
    target_precompile_headers(${target} REUSE_FROM obscura_precompiled_${name})
endfunction()
