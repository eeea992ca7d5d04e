# SPDX-License-Identifier: Apache-2.0
# cmake -DDOXYGEN=PROGRAM -DDIR=FOLDER -P RunDoxygen.cmake: makes the reference pages by FOLDER/Doxyfile. Fails for
# every complaint but one: members (of a class, of a namespace) may go without a comment where name and type say all.
# Types may not.
if(NOT DOXYGEN)
    message("skipped: doxygen is not installed")
    return()
endif()
file(REMOVE_RECURSE "${DIR}/html")
execute_process(COMMAND "${DOXYGEN}" "${DIR}/Doxyfile" COMMAND_ERROR_IS_FATAL ANY)
file(STRINGS "${DIR}/warnings.txt" warnings)
set(failed FALSE)
foreach(warning IN LISTS warnings)
    if(NOT warning MATCHES "warning: Member .* is not documented\\.")
        message("${warning}")
        set(failed TRUE)
    endif()
endforeach()
if(failed)
    message(FATAL_ERROR "the comments of public headers need the above put right")
endif()
message("${DIR}/html/index.html")
