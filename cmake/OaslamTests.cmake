# Labels of ctest. Each test has its tier, which says who runs it: `quick` (./test, ./test --ci and --all), `page` and `foreign`
# (--ci and --all) or `full` (--all). Programs of unit tests have `unit` besides; ./test --all runs them under the sanitizers.
# `foreign` are those of rooms that read foreign bytes or manage memory themselves, with these rooms under two sanitizers.
find_package(GTest REQUIRED)

add_custom_target(unit_tests)
add_custom_target(quick_tests DEPENDS unit_tests)
add_custom_target(foreign_tests)

# oaslam_test_program(NAME SOURCES file... LINK target...): the files are compiled as one, so that the templates they share
# are instantiated once.
set(test_headers ${oaslam_common_headers} <gmock/gmock.h> <gtest/gtest.h>)
function(oaslam_test_program name)
  cmake_parse_arguments(TEST "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${TEST_SOURCES})
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${OASLAM_UNITY} UNITY_BUILD_BATCH_SIZE 8)
  get_property(include_dirs GLOBAL PROPERTY OASLAM_TEST_INCLUDE_DIRS)
  target_include_directories(${name} PRIVATE ${include_dirs})
  target_compile_definitions(${name} PRIVATE OASLAM_SOURCE_DIR="${OASLAM_ROOT}")
  # What takes time to run is in the rooms.
  target_compile_options(${name} PRIVATE -O1)
  target_link_libraries(${name} PRIVATE ${TEST_LINK} oaslam_options GTest::gtest_main GTest::gmock)
  oaslam_precompile(${name} test ${test_headers})
endfunction()

# oaslam_unit_test(NAME [label...]): the program NAME_test is one test of ctest. It prints what fails and what is skipped.
function(oaslam_unit_test name)
  add_test(NAME unit.${name} COMMAND ${name}_test --gtest_brief=1)
  set(labels unit quick ${ARGN})
  set_tests_properties(unit.${name} PROPERTIES LABELS "${labels}")
  add_dependencies(unit_tests ${name}_test)
endfunction()

# The unit tests of a room once more, where it and those below it that read foreign bytes are sanitized. These come first and
# whole, so that nothing of them is taken from the rooms as they are.
function(oaslam_sanitized_test room)
  oaslam_sanitized_below(${room} below)
  set(name ${room}_sanitized_test)
  list(TRANSFORM below REPLACE "(.+)" "$<LINK_LIBRARY:WHOLE_ARCHIVE,\\1>")
  oaslam_test_program(${name} SOURCES ${sources_${room}} LINK ${below} oaslam_${room})
  set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON DISABLE_PRECOMPILE_HEADERS ON)
  target_compile_definitions(${name} PRIVATE ${oaslam_sanitizer_definitions})
  target_compile_options(${name} PRIVATE -g1 ${oaslam_sanitizers} $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  # An object of a room as it is may be linked for a template that the sanitized one has inlined: what comes first counts.
  target_link_options(${name} PRIVATE ${oaslam_sanitizers} -Wl,--allow-multiple-definition)
  add_test(NAME sanitized.${room} COMMAND ${name} --gtest_brief=1)
  set_tests_properties(sanitized.${room} PROPERTIES LABELS foreign COST 100
    ENVIRONMENT "ASAN_OPTIONS=detect_leaks=1;LSAN_OPTIONS=suppressions=${OASLAM_ROOT}/tests/lsan.supp")
  add_dependencies(foreign_tests ${name})
endfunction()

# The unit tests of this part's rooms, which stand beside the code: a room's tests make one program. What several of them need is in
# the folder tests of the part, or of those below it.
function(oaslam_part_tests)
  if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/tests)
    set_property(GLOBAL APPEND PROPERTY OASLAM_TEST_INCLUDE_DIRS ${CMAKE_CURRENT_SOURCE_DIR}/tests)
  endif()
  get_property(unit_tests GLOBAL PROPERTY OASLAM_UNIT_TESTS)
  set_property(GLOBAL PROPERTY OASLAM_UNIT_TESTS "")
  set(rooms "")
  foreach(entry ${unit_tests})
    string(REGEX MATCH "^([^:]*):(.*)$" _ ${entry})
    list(APPEND rooms ${CMAKE_MATCH_1})
    list(APPEND sources_${CMAKE_MATCH_1} ${CMAKE_MATCH_2})
  endforeach()
  list(REMOVE_DUPLICATES rooms)
  foreach(room ${rooms})
    oaslam_test_program(${room}_test SOURCES ${sources_${room}} LINK oaslam_${room})
    oaslam_unit_test(${room})
    if(TARGET oaslam_${room}_sanitized)
      oaslam_sanitized_test(${room})
    endif()
  endforeach()
endfunction()
