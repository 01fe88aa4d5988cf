# SPDX-License-Identifier: Apache-2.0
# Debian packages, one for each component of `cmake --install`: scripts/package builds them.
if(ORGANBAKE_PLAYER_ONLY OR NOT ORGANBAKE_MANUAL)
  return()
endif()

set(packages organbake organplay organplay-window organbench liborganplay-dev)
set(maintainer "organbake maintainers <maintainers@organbake.example>")
set(debian_revision 1)

# What Debian's policy asks for in every package. Its own changelog has an entry for each release.
set(folder ${PROJECT_BINARY_DIR}/debian)
set(entries "")
file(STRINGS ${PROJECT_SOURCE_DIR}/CHANGELOG.md releases REGEX "^## [0-9]" ENCODING UTF-8)
set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS CHANGELOG.md)
foreach(release ${releases})
  string(REGEX MATCH "[0-9]+[.][0-9]+[.][0-9]+" version ${release})
  string(REGEX MATCH "[0-9]+-[0-9]+-[0-9]+$" date ${release})
  if(NOT entries AND NOT "${version} ${date}" STREQUAL "${PROJECT_VERSION} ${ORGANBAKE_RELEASE_DATE}")
    message(FATAL_ERROR "CHANGELOG.md's last release is ${version} of ${date}, "
                        "CMakeLists.txt's ${PROJECT_VERSION} of ${ORGANBAKE_RELEASE_DATE}")
  endif()
  execute_process(COMMAND date -R -u -d "${date}" OUTPUT_VARIABLE time OUTPUT_STRIP_TRAILING_WHITESPACE)
  string(APPEND entries "organbake (${version}-${debian_revision}) bookworm; urgency=medium\n\n"
                        "  * Release ${version}; changelog.gz tells what changed.\n\n"
                        " -- ${maintainer}  ${time}\n\n")
endforeach()
file(WRITE ${folder}/changelog "${entries}")
add_custom_command(OUTPUT ${folder}/changelog.gz ${folder}/changelog.Debian.gz
  COMMAND gzip -9nc ${PROJECT_SOURCE_DIR}/CHANGELOG.md > ${folder}/changelog.gz
  COMMAND gzip -9nc ${folder}/changelog > ${folder}/changelog.Debian.gz
  DEPENDS ${PROJECT_SOURCE_DIR}/CHANGELOG.md ${folder}/changelog VERBATIM)
add_custom_target(debian_changelogs ALL DEPENDS ${folder}/changelog.gz ${folder}/changelog.Debian.gz)
foreach(package ${packages})
  install(FILES ${folder}/changelog.gz ${folder}/changelog.Debian.gz
                ${CMAKE_CURRENT_LIST_DIR}/debian/copyright
          DESTINATION share/doc/${package} COMPONENT ${package})
  if(EXISTS ${CMAKE_CURRENT_LIST_DIR}/debian/${package}.lintian-overrides)
    install(FILES ${CMAKE_CURRENT_LIST_DIR}/debian/${package}.lintian-overrides RENAME ${package}
            DESTINATION share/lintian/overrides COMPONENT ${package})
  endif()
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_SOURCE_DIR}/build/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL ${packages})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_DEBIAN_PACKAGE_RELEASE ${debian_revision})
set(CPACK_DEBIAN_PACKAGE_MAINTAINER ${maintainer})
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

function(organbake_package name section summary text)
  string(TOUPPER ${name} NAME)
  set(CPACK_DEBIAN_${NAME}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${NAME}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_DEBIAN_${NAME}_DESCRIPTION "${summary}\n${text}" PARENT_SCOPE)
endfunction()

# Lines below 80 columns, as Debian has them.
organbake_package(organbake science "bake CT scans and laparoscopy into deformable organs"
  "organbake reduces an organ's surface to a coarse mesh that deforms, and bakes
images of depth, colour and microstructure of it for several virtual cameras.
The result is a bundle that organplay draws and pokes on an ordinary processor.
It reads DICOM, NIfTI and other scans with their masks, and laparoscopy videos.")
organbake_package(organplay science "poke baked organs and draw them without a GPU"
  "organplay plays bundles that organbake made: tissue yields to instruments, and
pictures are warped from the baked ones on the processor. It writes
frames, videos and reports; its window is in the package organplay-window.")
organbake_package(organplay-window science "window of organplay"
  "The interactive window of organplay: an organ to turn, poke and grab with the
mouse, with readings of forces and times; and what draws with graphics
hardware.")
organbake_package(organbench science "measure organbake and organplay"
  "organbench measures how much error organbake and organplay leave in how much
time, beside other programs on the same input, and compares two such runs.")
organbake_package(liborganplay-dev libdevel "embed the player of baked organs in a program"
  "Static libraries and headers of organplay's runtime, and a CMake package for
find_package(organplay): load a bundle, step its tissue under instruments, draw
it into memory of your own.")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # else it stands before each of them

# What is only started, or read by CMake, no linker tells. The suffix is where CPack looks.
set(CPACK_DEBIAN_ORGANBAKE_PACKAGE_RECOMMENDS "organplay")
set(CPACK_DEBIAN_ORGANBENCH_PACKAGE_DEPENDS "organbake (= ${PROJECT_VERSION}-${debian_revision})")
set(CPACK_DEBIAN_ORGANPLAY_PACKAGE_SUGGESTS "organplay-window, organbake, ffmpeg")
set(CPACK_DEBIAN_ORGANPLAY-WINDOW_PACKAGE_DEPENDS "organplay (= ${PROJECT_VERSION}-${debian_revision})")
set(CPACK_DEBIAN_ORGANPLAY-WINDOW_PACKAGE_RECOMMENDS "fonts-dejavu-core")
set(CPACK_DEBIAN_LIBORGANPLAY-DEV_PACKAGE_DEPENDS
    "libeigen3-dev, libtbb-dev, libssl-dev, libopenexr-dev, libpng-dev, libdeflate-dev, nlohmann-json3-dev, pkg-config")
set(CPACK_DEBIAN_LIBORGANPLAY-DEV_PACKAGE_SHLIBDEPS OFF)
include(CPack)
