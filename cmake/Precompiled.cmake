# SPDX-License-Identifier: Apache-2.0
# Code that runs at start, for a person or once a request: compiled with -O1 and with precompiled headers. Not the libraries
# for rendering and real time, whose machine code shall depend on nothing but their own flags.
#
# A source file still includes what it uses: the presets debug and tidy and the Debian packages compile without precompiled
# headers. With GCC alone: clang's tools cannot read its files.
if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU" OR OBSCURA_SANITIZE)
    set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)
endif()

# With -O1 GCC compiles in three quarters of the time. It guesses more about bounds and initial values then, wrongly.
set(OBSCURA_COLD_FLAGS "")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_BUILD_TYPE STREQUAL "RelWithDebInfo" AND NOT OBSCURA_SANITIZE)
    set(OBSCURA_COLD_FLAGS -O1 -Wno-array-bounds -Wno-maybe-uninitialized -Wno-stringop-overflow)
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
    target_compile_options(${target} PRIVATE -pthread ${OBSCURA_COLD_FLAGS} ${ARG_FLAGS})
    target_precompile_headers(${target} PRIVATE ${OBSCURA_PRECOMPILED_HEADERS} ${ARG_HEADERS})
endfunction()

obscura_precompiled(library)
obscura_precompiled(program FLAGS -fPIE)

# obscura_cold(TARGET [NAME]): its flags, with the headers of obscura_precompiled_NAME, else those of its kind.
function(obscura_cold target)
    get_target_property(type ${target} TYPE)
    if(ARGC GREATER 1)
        set(name ${ARGV1})
    elseif(type STREQUAL EXECUTABLE)
        set(name program)
    else()
        set(name library)
    endif()
    # Some targets have -pthread from GLib.
    target_compile_options(${target} PRIVATE -pthread ${OBSCURA_COLD_FLAGS})
    target_precompile_headers(${target} REUSE_FROM obscura_precompiled_${name})
endfunction()
