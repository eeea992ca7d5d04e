# SPDX-License-Identifier: Apache-2.0
# cmake -DXML=camera.xml -DZIP=camera.zip -DOUT=camera_xml.cpp -P embed_xml.cmake
# Zips the XML with a fixed time stamp (same source, same bytes) and writes it as a C++ array.
get_filename_component(folder "${XML}" DIRECTORY)
get_filename_component(file "${XML}" NAME)
execute_process(COMMAND "${CMAKE_COMMAND}" -E tar cf "${ZIP}" --format=zip --mtime=2000-01-01 "${file}"
                WORKING_DIRECTORY "${folder}" RESULT_VARIABLE failed)
if(failed)
    message(FATAL_ERROR "cannot zip ${XML}")
endif()
file(READ "${ZIP}" bytes HEX)
# The archive also records access and change times and the owner of the file: replace them by constants, so that
# builds are reproducible.
string(REGEX REPLACE "55540d0007(........)................" "55540d0007\\1\\1\\1" bytes "${bytes}")
string(REGEX REPLACE "75780b000104........04........" "75780b000104000000000400000000" bytes "${bytes}")
string(REGEX REPLACE "(................................)" "\\1\n" bytes "${bytes}")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
file(WRITE "${OUT}" "#include \"transports/gige/genicam/camera_xml.hpp\"

namespace obscura::transports::gige {
namespace {
constexpr std::uint8_t bytes[] = {
${bytes}};
} // namespace

std::span<const std::uint8_t> zipped_camera_xml() noexcept { return bytes; }

} // namespace obscura::transports::gige
")
