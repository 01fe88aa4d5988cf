# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts out beside the programs: the runtime as a CMake package, so that a
# simulator embeds the player with find_package(organplay) and organbake::player. The components
# organplay, organplay-window and liborganplay-dev are the player alone, organbake is the baker; each
# is a Debian package as well (OrganbakePackages.cmake).
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/organplay)
install(EXPORT organplay NAMESPACE organbake:: FILE organplayTargets.cmake
        DESTINATION ${package_folder} COMPONENT liborganplay-dev)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/organplayConfig.cmake.in
  ${CMAKE_BINARY_DIR}/organplayConfig.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/organplayConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/organplayConfig.cmake
              ${CMAKE_BINARY_DIR}/organplayConfigVersion.cmake
        DESTINATION ${package_folder} COMPONENT liborganplay-dev)
install(FILES LICENSES/Apache-2.0.txt LICENSES/GPL-3.0-or-later.txt
        DESTINATION ${CMAKE_INSTALL_DATADIR}/organbake/licences COMPONENT licences)

# The player for web pages, where it was built (scripts/build web).
if(NOT ORGANBAKE_PLAYER_ONLY)
  set(ORGANBAKE_WEB_PLAYER ${PROJECT_SOURCE_DIR}/build/web/share/organbake/web CACHE PATH
      "What the preset web built: organ.wasm and the page round it")
  install(DIRECTORY ${ORGANBAKE_WEB_PLAYER} DESTINATION ${CMAKE_INSTALL_DATADIR}/organbake
          COMPONENT organbake OPTIONAL)
endif()
