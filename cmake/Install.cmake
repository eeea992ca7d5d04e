# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts where: the daemon, shipped scenes, and the libraries with headers and CMake package for
# programs that build on them. Units and their like are installed by systemd/.

install(TARGETS obscurad RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")

install(FILES config/demo.toml config/realtime.toml DESTINATION "${CMAKE_INSTALL_DATADIR}/obscura")
install(DIRECTORY config/models config/scenes config/sensors config/stars config/star-names config/examples config/instrument config/monitoring tools/editors DESTINATION "${CMAKE_INSTALL_DATADIR}/obscura")
# As in the source, so that their links hold.
install(FILES README.md CONTRIBUTING.md CHANGELOG.md DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY docs DESTINATION "${CMAKE_INSTALL_DOCDIR}"
        FILES_MATCHING PATTERN "*.md" PATTERN "*.png" PATTERN "*.svg")

# The libraries with their public headers, included as in the source: #include "renderer/renderer.hpp".
include(CMakePackageConfigHelpers)
set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/obscura")
function(obscura_libraries_below folder result)
    get_property(targets DIRECTORY "${folder}" PROPERTY BUILDSYSTEM_TARGETS)
    set(found)
    foreach(target IN LISTS targets)
        get_target_property(type ${target} TYPE)
        if(type MATCHES "^(STATIC|INTERFACE)_LIBRARY$")
            list(APPEND found ${target})
        endif()
    endforeach()
    get_property(folders DIRECTORY "${folder}" PROPERTY SUBDIRECTORIES)
    foreach(below IN LISTS folders)
        obscura_libraries_below("${below}" more)
        list(APPEND found ${more})
    endforeach()
    set(${result} ${found} PARENT_SCOPE)
endfunction()
set(libraries)
foreach(folder core config images models ephemeris terrain renderer sensors sync transports)
    obscura_libraries_below("${PROJECT_SOURCE_DIR}/${folder}" more)
    list(APPEND libraries ${more})
endforeach()
# Component and target `development`: what a program that builds on the libraries needs, without the programs.
add_custom_target(development DEPENDS ${libraries})
install(TARGETS obscura_options ${libraries} EXPORT obscura
        ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development
        LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development
        FILE_SET HEADERS DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/obscura" COMPONENT development)
install(EXPORT obscura NAMESPACE obscura:: FILE obscuraTargets.cmake DESTINATION "${package_dir}" COMPONENT development)
configure_package_config_file(cmake/obscuraConfig.cmake.in "${PROJECT_BINARY_DIR}/obscuraConfig.cmake"
                              INSTALL_DESTINATION "${package_dir}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/obscuraConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/obscuraConfig.cmake" "${PROJECT_BINARY_DIR}/obscuraConfigVersion.cmake"
        DESTINATION "${package_dir}" COMPONENT development)
install(FILES cmake/Dependencies.cmake DESTINATION "${package_dir}" RENAME obscuraDependencies.cmake COMPONENT development)
