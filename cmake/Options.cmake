# SPDX-License-Identifier: Apache-2.0
# Compiler settings shared by every target, and the helper that makes one of the project's libraries.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
    set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)
endif()

find_program(OBSCURA_CCACHE ccache)
if(OBSCURA_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
    # Without these, ccache keeps nothing of what uses precompiled headers.
    set(CMAKE_CXX_COMPILER_LAUNCHER env CCACHE_SLOPPINESS=pch_defines,time_macros "${OBSCURA_CCACHE}")
endif()

add_library(obscura_options INTERFACE)
target_include_directories(obscura_options INTERFACE
    "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>" "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/obscura>")
target_compile_features(obscura_options INTERFACE cxx_std_20)
target_compile_options(obscura_options INTERFACE
    "$<BUILD_INTERFACE:-Wall;-Wextra;-Wpedantic;-Wshadow;-Wnon-virtual-dtor;-Woverloaded-virtual>"
    # Same input, same bytes on every machine: the compiler may not fuse or reorder floating point on its own.
    -ffp-contract=off)
# GCC 13 takes any function that is given a reference and returns one for a source of dangling references.
include(CheckCXXCompilerFlag)
check_cxx_compiler_flag(-Wdangling-reference OBSCURA_HAS_DANGLING_REFERENCE)
if(OBSCURA_HAS_DANGLING_REFERENCE)
    target_compile_options(obscura_options INTERFACE $<BUILD_INTERFACE:-Wno-dangling-reference>)
endif()
# Several source files are one unit then: a name of one shadows none of another, and GCC takes types of anonymous namespaces
# for those of a header. The presets debug and tidy compile each file alone, with both warnings.
if(CMAKE_UNITY_BUILD)
    target_compile_options(obscura_options INTERFACE
        $<BUILD_INTERFACE:-Wno-shadow;$<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>>)
endif()
if(OBSCURA_WERROR)
    target_compile_options(obscura_options INTERFACE "$<BUILD_INTERFACE:-Werror>")
endif()
if(OBSCURA_SANITIZE)
    target_compile_options(obscura_options INTERFACE -fsanitize=${OBSCURA_SANITIZE} -fno-omit-frame-pointer
                           -fno-sanitize-recover=all
                           # GCC 12 takes Catch2's <regex> for uninitialised and a fill of fmt for too long once they
                           # are instrumented.
                           $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
                           $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>
                           # ThreadSanitizer knows no fences; what ours order is atomic all the same.
                           $<$<CXX_COMPILER_ID:GNU>:-Wno-tsan>)
    target_link_options(obscura_options INTERFACE -fsanitize=${OBSCURA_SANITIZE})
    target_compile_definitions(obscura_options INTERFACE OBSCURA_SANITIZED=1)
endif()

# obscura_library(NAME SOURCES...): static library obscura_NAME with the project's options.
function(obscura_library name)
    add_library(obscura_${name} STATIC ${ARGN})
    target_link_libraries(obscura_${name} PUBLIC obscura_options)
endfunction()

# obscura_public_headers(TARGET HEADERS...): the headers that programs outside this tree may include. They are installed
# with the library and documented by Doxygen; they include nothing but public headers (ctest installed_libraries).
function(obscura_public_headers target)
    get_target_property(type ${target} TYPE)
    set(scope PUBLIC)
    if(type STREQUAL INTERFACE_LIBRARY)
        set(scope INTERFACE)
    endif()
    target_sources(${target} ${scope} FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}" FILES ${ARGN})
    list(TRANSFORM ARGN PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
    set_property(GLOBAL APPEND PROPERTY OBSCURA_PUBLIC_HEADERS ${ARGN})
endfunction()

# obscura_late_library(NAME SOURCE PACKAGE FILE): objects obscura_late_NAME with the functions of the shared library FILE that
# load it when they are called; linked before anything that needs PACKAGE. OBSCURA_NAME is its SONAME.
function(obscura_late_library name source package file)
    execute_process(COMMAND "${CMAKE_OBJDUMP}" -p "${file}" OUTPUT_VARIABLE headers COMMAND_ERROR_IS_FATAL ANY)
    if(NOT headers MATCHES "SONAME +([^ \n]+)")
        message(FATAL_ERROR "${file} has no SONAME; a shared library is needed")
    endif()
    set(soname "${CMAKE_MATCH_1}")
    string(TOUPPER "${name}" upper)
    add_library(obscura_late_${name} OBJECT EXCLUDE_FROM_ALL "${source}")
    target_link_libraries(obscura_late_${name} PRIVATE obscura_options obscura_core ${package})
    target_compile_definitions(obscura_late_${name} PRIVATE "OBSCURA_${upper}=\"${soname}\"")
    # What hands on to the library is not for the library itself to find.
    target_compile_options(obscura_late_${name} PRIVATE -fvisibility=hidden)
endfunction()
