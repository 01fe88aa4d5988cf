# SPDX-License-Identifier: Apache-2.0
# How every target of the project is built, and organbake_module(): one folder under lib/ = one target.
include(GNUInstallDirs)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
if(NOT ORGANBAKE_WEB)
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
  set(CMAKE_CXX_COMPILE_OPTIONS_PIE -fPIC)  # programs as libraries are: one precompiled header for both
endif()
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib/organbake)

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # The sloppiness is what ccache asks for with precompiled headers; nothing here uses __TIME__. Clones
  # in other folders share what is compiled: paths below the clone are relative to it.
  set(CMAKE_C_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros
      CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE_PROGRAM})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_C_COMPILER_LAUNCHER})
endif()

# Every target and every consumer shares these: Eigen's alignment depends on the instruction set,
# so code that passes its types across libraries must agree on it. AVX2 is the documented floor.
add_library(organbake_build_flags INTERFACE)
if(ORGANBAKE_WEB)
  # Whatever has vectors of 128 bits copies whole blocks of memory by one instruction, too.
  target_compile_options(organbake_build_flags INTERFACE -msimd128 -mbulk-memory -fwasm-exceptions)
  target_link_options(organbake_build_flags INTERFACE -fwasm-exceptions)
elseif(ORGANBAKE_ARCHITECTURE)
  target_compile_options(organbake_build_flags INTERFACE -march=${ORGANBAKE_ARCHITECTURE})
endif()
add_library(organbake_warnings INTERFACE)
# g++ 12 warns of overlaps inside its own std::string (GCC bug 105651) and, at -O3, of Eigen vectors
# in brace-initialised structs whose every member is set; from precompiled headers it also warns of
# what it passes over in plain ones. Sanitizers and clang-tidy watch instead. Where several files are
# compiled as one, g++ takes a private class for one that a header shares (subobject-linkage).
target_compile_options(organbake_warnings INTERFACE -Wall -Wextra -Wno-psabi
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict;-Wno-maybe-uninitialized>
  $<$<CXX_COMPILER_ID:Clang>:-Wno-bitwise-instead-of-logical>
  $<$<BOOL:${ORGANBAKE_PRECOMPILE}>:-Wno-array-bounds;-Wno-stringop-overflow;-Wno-stringop-overread;-Wno-subobject-linkage>
  $<$<BOOL:${ORGANBAKE_WERROR}>:-Werror>)
if(ORGANBAKE_SANITIZE STREQUAL "thread")
  target_compile_options(organbake_build_flags INTERFACE -fsanitize=thread -fno-omit-frame-pointer)
  target_link_options(organbake_build_flags INTERFACE -fsanitize=thread)
elseif(ORGANBAKE_SANITIZE)
  # Tests of pointers make Eigen's small functions too large to be inlined: without them the same
  # cases take half the time.
  target_compile_options(organbake_build_flags INTERFACE
    -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
    $<$<STREQUAL:${ORGANBAKE_SANITIZE},stress>:-fno-sanitize=null,alignment,pointer-overflow>)
  target_link_options(organbake_build_flags INTERFACE -fsanitize=address,undefined)
endif()
if(ORGANBAKE_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL Clang)
    message(FATAL_ERROR "ORGANBAKE_FUZZ needs clang's libFuzzer: cmake --preset fuzz")
  endif()
  # The readers tell libFuzzer which branches an input took.
  target_compile_options(organbake_build_flags INTERFACE -fsanitize=fuzzer-no-link)
endif()
# g++ collects its garbage less often: up to a tenth of its time, for some hundred megabytes. What
# macros say of a file's place is the same in any clone.
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  string(APPEND CMAKE_CXX_FLAGS " --param ggc-min-expand=300 --param ggc-min-heapsize=1000000"
         " -fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=")
endif()
install(TARGETS organbake_build_flags EXPORT organplay COMPONENT liborganplay-dev)

# Eigen and the standard headers are parsed once, not by every file: that halves a full build. Each
# file still names all that it uses: the presets dev and player build without.
# GCC restores the flags that a precompiled header was made with where that header holds
# `#pragma GCC push_options`, as Eigen's does: -frounding-math, -ffp-contract or -O1 of its users would
# be lost without a word. So a header serves targets of its own flags alone, and each other set of
# flags gets one of its own (the test build.flags_in_force holds it over all that is compiled).
set(ORGANBAKE_UNFUSED -ffp-contract=off)
set(ORGANBAKE_FUSED -ffp-contract=fast)
if(ORGANBAKE_PRECOMPILE)
  add_library(organbake_precompiled STATIC ${CMAKE_CURRENT_LIST_DIR}/precompiled.cpp)
  target_link_libraries(organbake_precompiled PRIVATE
    organbake_build_flags $<BUILD_INTERFACE:organbake_warnings> Eigen3::Eigen nlohmann_json::nlohmann_json)
  target_precompile_headers(organbake_precompiled PRIVATE ${CMAKE_CURRENT_LIST_DIR}/precompiled.h)
endif()

# What of a target's options makes other code, those too that it inherits from the targets which it
# links: CGAL's, for one, brings -frounding-math.
function(organbake_code_flags out target property)
  get_target_property(options ${target} ${property}COMPILE_OPTIONS)
  get_target_property(libraries ${target} ${property}LINK_LIBRARIES)
  set(flags "")
  foreach(option IN LISTS options)
    if(option MATCHES "^(\\$<.*[,:])?-[Ofm]" AND NOT option STREQUAL -fpch-preprocess)
      list(APPEND flags ${option})
    endif()
  endforeach()
  foreach(library IN LISTS libraries)
    string(REGEX REPLACE "^\\$<BUILD_INTERFACE:(.*)>$" "\\1" library "${library}")
    if(TARGET "${library}")
      organbake_code_flags(inherited ${library} INTERFACE_)
      list(APPEND flags ${inherited})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES flags)
  list(SORT flags)
  set(${out} ${flags} PARENT_SCOPE)
endfunction()

# A target's header: that of FROM, or one like it for the target's own flags. Which these are is known
# where its folder's file ends.
function(organbake_precompile target from)
  if(ORGANBAKE_PRECOMPILE)
    target_compile_options(${target} PRIVATE -fpch-preprocess -Winvalid-pch)
    cmake_language(EVAL CODE "cmake_language(DEFER CALL organbake_reuse_header ${target} ${from})")
  endif()
endfunction()
function(organbake_reuse_header target from)
  organbake_code_flags(flags ${target} "")
  organbake_code_flags(made_with ${from} "")
  if(NOT flags STREQUAL made_with)
    string(MD5 name "${flags}")
    string(SUBSTRING ${name} 0 6 name)
    set(own ${from}_${name})
    if(NOT TARGET ${own})
      get_target_property(sources ${from} SOURCES)
      get_target_property(folder ${from} SOURCE_DIR)
      get_target_property(libraries ${from} LINK_LIBRARIES)
      get_target_property(header ${from} PRECOMPILE_HEADERS)
      list(TRANSFORM sources PREPEND ${folder}/ REGEX "^[^/]")
      list(TRANSFORM header PREPEND ${folder}/ REGEX "^[^/<\"$]")
      add_library(${own} STATIC ${sources})
      target_link_libraries(${own} PRIVATE ${libraries})
      target_compile_options(${own} PRIVATE ${flags})
      target_precompile_headers(${own} PRIVATE ${header})
    endif()
    set(from ${own})
  endif()
  target_precompile_headers(${target} REUSE_FROM ${from})
endfunction()

# For code that parses far more than it says: several files are compiled as one. Names in unnamed
# namespaces must then differ between the files of a target; the presets dev and player, which
# compile each file alone, see to it that each still includes what it uses.
function(organbake_unity_build target)
  if(ORGANBAKE_PRECOMPILE OR ORGANBAKE_FUZZ)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 16)
  endif()
endfunction()

# For code that only calls other code: compiled for a quick build, not for a quick run.
# A linker keeps the first of equal template functions: where -O0 is among them, all code would run
# by its Eigen, which fuzzing has no time for.
# g++ fuses nothing at -O1, whether it may or not: said here, such code of the runtime and of all else shares
# one precompiled header. At -O1 g++ 12 takes a std::vector's memory for an object that was not allocated.
set(ORGANBAKE_BUILD_TIME_FLAGS
  $<IF:$<AND:$<CONFIG:Debug>,$<NOT:$<BOOL:${ORGANBAKE_FUZZ}>>>,-O0,-O1> ${ORGANBAKE_UNFUSED}
  $<$<CXX_COMPILER_ID:GNU>:-Wno-free-nonheap-object>)
function(organbake_optimize_for_build_time target)
  target_compile_options(${target} PRIVATE ${ORGANBAKE_BUILD_TIME_FLAGS})
endfunction()

# The same for single files of a target that is otherwise built to run fast.
function(organbake_optimize_files_for_build_time)
  set_source_files_properties(${ARGN} PROPERTIES
    COMPILE_OPTIONS "${ORGANBAKE_BUILD_TIME_FLAGS}" SKIP_PRECOMPILE_HEADERS ON
    SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# organbake_own_flags(<module> <name> <flags> FILES...): files of a module that have flags of their own,
# in a target of their own, four compiled as one. No two files of different flags ever are.
function(organbake_own_flags module name flags)
  set(target organbake_${module}_${name})
  set(files ${ARGN})
  list(TRANSFORM files PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  get_target_property(sources organbake_${module} SOURCES)
  list(REMOVE_ITEM sources ${files})
  set_target_properties(organbake_${module} PROPERTIES SOURCES "${sources}")
  get_target_property(libraries organbake_${module} LINK_LIBRARIES)
  get_target_property(options organbake_${module} COMPILE_OPTIONS)
  list(FILTER options EXCLUDE REGEX pch)
  add_library(${target} OBJECT ${files})
  target_include_directories(${target} PRIVATE
    ${CMAKE_CURRENT_SOURCE_DIR}/include ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(${target} PRIVATE ${libraries})
  target_compile_options(${target} PRIVATE ${options} ${flags})
  organbake_unity_build(${target})
  set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE 4)
  target_sources(organbake_${module} PRIVATE $<TARGET_OBJECTS:${target}>)
endfunction()

# organbake_cold_files(<module> FILES...): files of a module that is otherwise built to run fast.
function(organbake_cold_files module)
  if(ORGANBAKE_PRECOMPILE AND NOT ORGANBAKE_WEB)
    organbake_own_flags(${module} cold "${ORGANBAKE_BUILD_TIME_FLAGS}" ${ARGN})
    set_target_properties(organbake_${module}_cold PROPERTIES UNITY_BUILD_BATCH_SIZE 16)
    organbake_precompile(organbake_${module}_cold organbake_precompiled)
  endif()
endfunction()

# organbake_part(<name> <module> <folder> LINK ...): a part of a module that not all who use it need: organbake::<name>,
# of what lies in a folder beside its src.
function(organbake_part name module folder)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${folder}/*.cpp)
  list(FILTER sources EXCLUDE REGEX _module.cpp$)
  add_library(organbake_${name} STATIC ${sources})
  add_library(organbake::${name} ALIAS organbake_${name})
  target_include_directories(organbake_${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} src)
  target_link_libraries(organbake_${name} PUBLIC organbake::${module} PRIVATE organbake_warnings ${arg_LINK})
  organbake_unity_build(organbake_${name})
  organbake_precompile(organbake_${name} organbake_precompiled)
endfunction()

# organbake_loaded_module(<name> <component> FILES... LINK...): what most runs have no use for, loaded when it
# is asked for: <name>.so in lib/organbake, which module_door() finds. Its door alone is exported: fewer symbols
# to bind, and none for other modules. No target waits for it.
function(organbake_loaded_module name component)
  cmake_parse_arguments(arg "" "" "FILES;LINK" ${ARGN})
  add_library(${name} MODULE ${arg_FILES})
  set_target_properties(${name} PROPERTIES PREFIX "" CXX_VISIBILITY_PRESET hidden)
  target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(${name} PRIVATE organbake_warnings ${arg_LINK})
  organbake_unity_build(${name})
  organbake_precompile(${name} organbake_precompiled)
  target_link_options(${name} PRIVATE -Wl,--exclude-libs,ALL -Wl,--as-needed)
  install(TARGETS ${name} LIBRARY DESTINATION lib/organbake COMPONENT ${component})
endfunction()

# organbake_module(<name> [RUNTIME [NOT_INSTALLED]] [ROOMS ...] [INSTALL ...] [PUBLIC ...] [PRIVATE ...])
# Declares organbake::<name>, the folder that calls it:
#   include/organbake/<name>/*.h  what others may include, as "organbake/<name>/...";
#   src/**                        the rest, which no other target sees. Of src/native, which opens
#                                 files and the like, pages have nothing; of src/web, they alone.
# RUNTIME modules are what organplay needs: they are exported, unless they are NOT_INSTALLED, and the
# headers that INSTALL names are installed. ROOMS are folders of src in the order in which they use each other, which
# scripts/check_layers holds.
function(organbake_module name)
  cmake_parse_arguments(arg "RUNTIME;NOT_INSTALLED" "" "ROOMS;INSTALL;PUBLIC;PRIVATE" ${ARGN})
  set(target organbake_${name})
  set(include ${CMAKE_CURRENT_SOURCE_DIR}/include)
  file(GLOB headers CONFIGURE_DEPENDS ${include}/organbake/${name}/*.h)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/*.cpp
       ${CMAKE_CURRENT_SOURCE_DIR}/src/*.h)
  if(ORGANBAKE_WEB)
    list(FILTER sources EXCLUDE REGEX /src/native/)
  else()
    list(FILTER sources EXCLUDE REGEX /src/web/)
  endif()
  add_library(${target} STATIC ${sources} ${headers})
  add_library(organbake::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${include}>
    PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_link_libraries(${target}
    PUBLIC organbake_build_flags ${arg_PUBLIC}
    PRIVATE $<BUILD_INTERFACE:organbake_warnings> ${arg_PRIVATE})
  organbake_unity_build(${target})
  organbake_precompile(${target} organbake_precompiled)
  if(NOT arg_RUNTIME)
    return()
  endif()
  # Which of several products an addition is fused with is the compiler's choice, another one on
  # another processor: pictures would differ by a level here and there. Files of plain loops over
  # numbers, where the choice is the same, turn it on again (ORGANBAKE_FUSED).
  target_compile_options(${target} PRIVATE ${ORGANBAKE_UNFUSED})
  if(arg_NOT_INSTALLED)
    return()
  endif()
  if(arg_INSTALL)
    list(TRANSFORM arg_INSTALL PREPEND ${include}/organbake/${name}/)
    target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS ${include} FILES ${arg_INSTALL})
  endif()
  set(header_set)
  if(arg_INSTALL)
    set(header_set FILE_SET HEADERS DESTINATION include COMPONENT liborganplay-dev)
  endif()
  install(TARGETS ${target} EXPORT organplay
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/organbake COMPONENT liborganplay-dev
          ${header_set})
endfunction()
