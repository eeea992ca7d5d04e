# SPDX-License-Identifier: Apache-2.0
# cmake -DGENERATOR=obscura_describe_features -DSOURCE=... -DFOLDER=... -P same_xml_bytes.cmake: camera.xml becomes the
# same bytes whenever it is made and embedded.
foreach(time first second)
    file(MAKE_DIRECTORY "${FOLDER}/${time}")
    execute_process(COMMAND "${GENERATOR}" camera "${FOLDER}/${time}/camera.xml" COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND "${CMAKE_COMMAND}" "-DXML=${FOLDER}/${time}/camera.xml" "-DZIP=${FOLDER}/${time}.zip"
                            "-DOUT=${FOLDER}/${time}.cpp" -P "${SOURCE}/transports/gige/genicam/embed_xml.cmake"
                    COMMAND_ERROR_IS_FATAL ANY)
    if(time STREQUAL first)
        execute_process(COMMAND "${CMAKE_COMMAND}" -E sleep 2) # the archive counts in seconds
    endif()
endforeach()
execute_process(COMMAND "${CMAKE_COMMAND}" -E compare_files "${FOLDER}/first.cpp" "${FOLDER}/second.cpp"
                RESULT_VARIABLE different)
if(different)
    message(FATAL_ERROR "${FOLDER}/first.cpp and second.cpp differ")
endif()
