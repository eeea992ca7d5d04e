# SPDX-License-Identifier: Apache-2.0
# Makes the typed calls of all clients from clients/calls.json, when this is configured and when the table has changed.
if(NOT Python3_EXECUTABLE)
    find_package(Python3 REQUIRED COMPONENTS Interpreter)
endif()
file(GLOB obscura_stub_writers CONFIGURE_DEPENDS "${CMAKE_CURRENT_LIST_DIR}/*.py")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${CMAKE_CURRENT_LIST_DIR}/../calls.json" ${obscura_stub_writers})
execute_process(COMMAND "${Python3_EXECUTABLE}" -B "${CMAKE_CURRENT_LIST_DIR}/generate.py" COMMAND_ERROR_IS_FATAL ANY)
