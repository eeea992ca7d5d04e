# SPDX-License-Identifier: Apache-2.0
# Manual pages and bash completion, made by running the programs that were just built; so not when cross-compiling.
option(OBSCURA_BUILD_MANUAL "Make and install manual pages and bash completion" OFF)
if(NOT OBSCURA_BUILD_MANUAL)
    return()
endif()

set(maker "${PROJECT_SOURCE_DIR}/scripts/make-manual")
set(manual "${PROJECT_BINARY_DIR}/manual")
set(manual_files)
# obscura_manual_file(FILE ARGUMENTS...): one run of the maker, its output in FILE.
function(obscura_manual_file file)
    add_custom_command(OUTPUT "${manual}/${file}"
        COMMAND "${CMAKE_COMMAND}" -E make_directory "${manual}"
        COMMAND Python3::Interpreter "${maker}" ${ARGN} > "${manual}/${file}"
        DEPENDS "${maker}" obscurad obscura obscura-instrument obscura-stimulator-sim obscura-web VERBATIM)
    set(manual_files ${manual_files} "${manual}/${file}" PARENT_SCOPE)
endfunction()
obscura_manual_file(obscura.1 man "$<TARGET_FILE:obscura>" 1)
obscura_manual_file(obscura-instrument.1 man "$<TARGET_FILE:obscura-instrument>" 1)
obscura_manual_file(obscura-stimulator-sim.1 man "$<TARGET_FILE:obscura-stimulator-sim>" 1)
obscura_manual_file(obscurad.8 man "$<TARGET_FILE:obscurad>" 8)
obscura_manual_file(obscura-web.8 man "$<TARGET_FILE:obscura-web>" 8)
obscura_manual_file(obscurad.toml.5 keys "$<TARGET_FILE:obscura>")
set(completed obscura obscurad obscura-instrument obscura-stimulator-sim obscura-web)
foreach(program ${completed})
    obscura_manual_file(${program}.bash completion "$<TARGET_FILE:${program}>")
endforeach()
add_custom_target(manual ALL DEPENDS ${manual_files})

install(FILES "${manual}/obscura.1" "${manual}/obscura-instrument.1" "${manual}/obscura-stimulator-sim.1" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1")
install(FILES "${manual}/obscurad.toml.5" DESTINATION "${CMAKE_INSTALL_MANDIR}/man5")
install(FILES "${manual}/obscurad.8" "${manual}/obscura-web.8" DESTINATION "${CMAKE_INSTALL_MANDIR}/man8")
foreach(program ${completed})
    install(FILES "${manual}/${program}.bash" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions"
            RENAME ${program})
endforeach()
