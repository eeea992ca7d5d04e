# SPDX-License-Identifier: Apache-2.0
# Target `doxygen`: reference pages of the public headers in build/.../doxygen/html. The test of that name makes them too.
find_program(OBSCURA_DOXYGEN doxygen)
set(OBSCURA_DOXYGEN_DIR "${PROJECT_BINARY_DIR}/doxygen")
get_property(headers GLOBAL PROPERTY OBSCURA_PUBLIC_HEADERS)
set(OBSCURA_DOXYGEN_INPUT "\"${PROJECT_SOURCE_DIR}/docs/api.md\"")
foreach(header IN LISTS headers)
    string(APPEND OBSCURA_DOXYGEN_INPUT " \\\n                         \"${header}\"")
endforeach()
configure_file("${PROJECT_SOURCE_DIR}/docs/Doxyfile.in" "${OBSCURA_DOXYGEN_DIR}/Doxyfile" @ONLY)
set(run_doxygen "${CMAKE_COMMAND}" "-DDOXYGEN=$<$<BOOL:${OBSCURA_DOXYGEN}>:${OBSCURA_DOXYGEN}>" "-DDIR=${OBSCURA_DOXYGEN_DIR}"
    -P "${CMAKE_CURRENT_LIST_DIR}/RunDoxygen.cmake")
add_custom_target(doxygen COMMAND ${run_doxygen} VERBATIM)
if(OBSCURA_BUILD_TESTS)
    add_test(NAME doxygen COMMAND ${run_doxygen})
    set_tests_properties(doxygen PROPERTIES SKIP_REGULAR_EXPRESSION "skipped: " TIMEOUT 120)
endif()
