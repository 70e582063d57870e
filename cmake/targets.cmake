# Functions that make every target of the project, so that each has the same warnings and the same
# include root (the top of the tree: `#include "common/core/pose.hpp"`).

add_library(seastitch_warnings INTERFACE)
target_compile_features(seastitch_warnings INTERFACE cxx_std_20)
target_compile_options(seastitch_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
  $<$<BOOL:${SEASTITCH_WERROR}>:-Werror>
  # GCC 12 sees overlaps in std::string that are not there (its bug 105651), and, where headers are
  # precompiled or at -O1, strings run over that do not (its bug 105329).
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
  "$<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${SEASTITCH_PRECOMPILED_HEADERS}>>:-Wno-array-bounds;-Wno-stringop-overflow;-Wno-stringop-overread>"
  # The same source computes the same numbers on x86-64 and arm64: no product and sum are fused, by the compiler or by
  # Eigen. (Where libraries of Debian still differ: docs/measurements/deploy.md.)
  -ffp-contract=off $<$<STREQUAL:${CMAKE_SYSTEM_PROCESSOR},aarch64>:-U__ARM_FEATURE_FMA>)

# Most of the time of compiling one of our files goes into reading Eigen and GoogleTest. They are read
# once, for the tests and, unless SEASTITCH_PRECOMPILED_HEADERS is off, for the programs. `./run includes`
# compiles without them: there each file proves that it includes what it uses.
set(SEASTITCH_READ_ONCE
  <Eigen/Dense> <algorithm> <array> <cmath> <deque> <filesystem> <fstream> <functional> <map> <memory>
  <optional> <random> <set> <sstream> <stdexcept> <string> <variant> <vector>)

# seastitch_read_once(NAME OPTIONS... HEADERS... LINK TARGETS...): what targets of the same OPTIONS take
# as REUSE_FROM
function(seastitch_read_once name)
  cmake_parse_arguments(ARG "" "" "OPTIONS;HEADERS;LINK" ${ARGN})
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/${name}.cpp CONTENT "")
  add_library(${name} OBJECT ${CMAKE_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE ${ARG_LINK} seastitch_warnings Eigen3::Eigen)
  target_compile_options(${name} PRIVATE ${ARG_OPTIONS})
  target_precompile_headers(${name} PRIVATE ${SEASTITCH_READ_ONCE} ${ARG_HEADERS})
endfunction()

if(SEASTITCH_PRECOMPILED_HEADERS)
  seastitch_read_once(seastitch_read_once_by_libraries)
endif()
if(BUILD_TESTING)
  # What is tested is optimised and sanitised in full, but for what of its headers is compiled with the
  # tests; the tests' own sources need not be, and compile in half the time.
  set(SEASTITCH_ALL_TEST_OPTIONS $<$<CONFIG:Release>:-O1> ${SEASTITCH_TEST_OPTIONS})
  seastitch_read_once(seastitch_read_once_by_tests
    OPTIONS ${SEASTITCH_ALL_TEST_OPTIONS} HEADERS <gmock/gmock.h> <gtest/gtest.h> LINK GTest::gmock)
endif()

# seastitch_library(NAME SOURCES... [PUBLIC TARGETS...] [PRIVATE TARGETS...])
function(seastitch_library name)
  cmake_parse_arguments(ARG "" "" "PUBLIC;PRIVATE" ${ARGN})
  add_library(${name} STATIC ${ARG_UNPARSED_ARGUMENTS})
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
  target_link_libraries(${name}
    PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:seastitch_warnings>)
  target_compile_features(${name} PUBLIC cxx_std_20)
  if(SEASTITCH_PRECOMPILED_HEADERS)
    target_precompile_headers(${name} REUSE_FROM seastitch_read_once_by_libraries)
  endif()
endfunction()

# seastitch_executable(NAME SOURCES... LINK TARGETS...), into bin/; `programs` builds them all
add_custom_target(programs)
function(seastitch_executable name)
  cmake_parse_arguments(ARG "" "" "LINK" ${ARGN})
  add_executable(${name} ${ARG_UNPARSED_ARGUMENTS})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} seastitch_warnings)
  if(SEASTITCH_PRECOMPILED_HEADERS)
    target_precompile_headers(${name} REUSE_FROM seastitch_read_once_by_libraries)
  endif()
  install(TARGETS ${name} RUNTIME DESTINATION bin)
  add_dependencies(programs ${name})
endfunction()

# seastitch_test(NAME SOURCES... LINK TARGETS... [LABEL unit|process] [SUITES NAMES...]): one GoogleTest
# binary a unit, one ctest a case. A suite among SUITES is one ctest: its cases share surveys that take long
# to make. With SEASTITCH_TESTS_BY_BINARY there is one ctest a binary, without Monte Carlo and restarts at
# many moments, since a sanitizer needs a second to start a process. Unit tests (the default) need no other
# binary and run under the sanitizers; process tests start the real programs, take longest and so start first.
# With SEASTITCH_TEST_OBJECTS, the folder of another build, the tests' own objects are those of that build:
# what a sanitizer watches is compiled anew, and the tests, which take longer to compile, are not.
set(SEASTITCH_TEST_OBJECTS "" CACHE PATH "Build whose objects of tests are linked")
function(seastitch_objects_of name sources result)
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  foreach(source IN LISTS sources)
    string(REPLACE "../" "__/" object "${source}.o")
    list(APPEND objects ${SEASTITCH_TEST_OBJECTS}/${folder}/CMakeFiles/${name}.dir/${object})
  endforeach()
  set_source_files_properties(${objects} PROPERTIES EXTERNAL_OBJECT ON)
  set(${result} ${objects} PARENT_SCOPE)
endfunction()

add_custom_target(unit_tests)
function(seastitch_test name)
  cmake_parse_arguments(ARG "" "LABEL" "LINK;SUITES" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  if(SEASTITCH_TEST_OBJECTS)
    seastitch_objects_of(${name} "${ARG_UNPARSED_ARGUMENTS}" objects)
    add_executable(${name} ${objects})
    set_target_properties(${name} PROPERTIES LINKER_LANGUAGE CXX)
  else()
    add_executable(${name} ${ARG_UNPARSED_ARGUMENTS})
    target_precompile_headers(${name} REUSE_FROM seastitch_read_once_by_tests)
  endif()
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE
    ${ARG_LINK} seastitch_test_paths seastitch_warnings GTest::gmock GTest::gtest_main)
  target_compile_options(${name} PRIVATE ${SEASTITCH_ALL_TEST_OPTIONS})
  if(SEASTITCH_TESTS_BY_BINARY)
    add_test(NAME ${name} COMMAND ${name} --gtest_brief=1 --gtest_filter=-*MonteCarlo*:Moments/*:Faults/Restart.*)
    set_tests_properties(${name} PROPERTIES LABELS ${ARG_LABEL})
  else()
    set(others "")
    foreach(suite IN LISTS ARG_SUITES)
      add_test(NAME ${suite} COMMAND ${name} --gtest_brief=1 --gtest_filter=${suite}.*)
      set_tests_properties(${suite} PROPERTIES LABELS ${ARG_LABEL} COST 2000)
      string(APPEND others ":${suite}.*")
    endforeach()
    gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST TEST_FILTER "-${others}"
      PROPERTIES LABELS ${ARG_LABEL} COST $<IF:$<STREQUAL:${ARG_LABEL},process>,1000,1>)
  endif()
  if(ARG_LABEL STREQUAL unit)
    add_dependencies(unit_tests ${name})
  endif()
endfunction()

# read_page_part(FILE VARIABLE): the text of a file, and its SHA-256 in VARIABLE_SHA256.
function(read_page_part file variable)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} text)
  string(SHA256 hash "${text}")
  set(${variable} "${text}" PARENT_SCOPE)
  set(${variable}_SHA256 ${hash} PARENT_SCOPE)
endfunction()
