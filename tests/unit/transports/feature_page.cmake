# SPDX-License-Identifier: Apache-2.0
# cmake -DGENERATOR=obscura_describe_features -DPAGE=features.md -DOUT=... -P feature_page.cmake: the committed page of
# GenICam features is the one that the feature table gives.
execute_process(COMMAND "${GENERATOR}" page "${OUT}" COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${CMAKE_COMMAND}" -E compare_files "${OUT}" "${PAGE}" RESULT_VARIABLE different)
if(different)
    message(FATAL_ERROR "${PAGE} is out of date: cp ${OUT} ${PAGE}")
endif()
