# SPDX-License-Identifier: Apache-2.0
# The packages of the preset web: of the machine's libraries only those that are all headers. They
# are linked into a folder of their own, because beside them in /usr/include lie the headers of the
# machine's C library, which are none of WebAssembly's.
set(ORGANBAKE_THREADS OFF)
set(headers ${CMAKE_BINARY_DIR}/headers)
file(MAKE_DIRECTORY ${headers})
foreach(package eigen3/Eigen nlohmann)
  get_filename_component(name ${package} NAME)
  if(NOT EXISTS /usr/include/${package})
    message(FATAL_ERROR "/usr/include/${package} is missing; scripts/setup --web installs it")
  endif()
  file(CREATE_LINK /usr/include/${package} ${headers}/${name} SYMBOLIC)
endforeach()
foreach(target Eigen3::Eigen nlohmann_json::nlohmann_json)
  add_library(${target} INTERFACE IMPORTED)
  target_include_directories(${target} SYSTEM INTERFACE ${headers})
endforeach()
