# A room of the architecture (docs/architecture.md) is one static library: every *.cc of its folder, every *_test.cc a test
# of its name. What it may include is what it is linked with; tests/include_graph_test.py checks that the code agrees.

add_library(oaslam_options INTERFACE)
target_compile_features(oaslam_options INTERFACE cxx_std_20)
target_compile_options(oaslam_options INTERFACE
  $<BUILD_INTERFACE:-Wall;-Wextra;-Wpedantic;-Wconversion;-Wshadow;-Wno-sign-conversion>
  # Without fused multiply-add every instruction set, that of arm64 as well, gives the same bits.
  -ffp-contract=off
  $<$<BOOL:${OASLAM_WERROR}>:-Werror>
  # GCC's garbage collector begins at 512 MB, not at 128: it walks all precompiled headers, in a tenth of the time of most files.
  $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=524288>)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # Hamming distances eight times as fast; in every x86-64 processor since 2008.
  target_compile_options(oaslam_options INTERFACE -mpopcnt)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  # The kernels keep vectors in arrays, and those of SVE have no size for the compiler.
  target_compile_definitions(oaslam_options INTERFACE "HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")
endif()
if(OASLAM_SANITIZE)
  target_compile_options(oaslam_options INTERFACE -fsanitize=${OASLAM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all
    # They take a third of the time to compile, and the address sanitizer finds most of what they would.
    -fno-sanitize=null,object-size,vptr
    # GCC 12 warns falsely inside the standard library (<regex>) in instrumented code.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  target_link_options(oaslam_options INTERFACE -fsanitize=${OASLAM_SANITIZE})
  # Under a sanitizer Eigen would change how it allocates, and could not free what Debian's Ceres has allocated.
  target_compile_definitions(oaslam_options INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
  if(OASLAM_SANITIZE MATCHES "thread")
    # The sanitizer does not know fences. Asio's order what locks order already, where one thread runs its handlers.
    target_compile_definitions(oaslam_options INTERFACE BOOST_ASIO_DISABLE_FENCED_BLOCK)
  endif()
endif()

if(OASLAM_FUZZ)
  # The macro is libFuzzer's convention: checksums are not compared, which a fuzzer would not get past.
  target_compile_options(oaslam_options INTERFACE -fsanitize=fuzzer-no-link)
  target_compile_definitions(oaslam_options INTERFACE FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION)
endif()

# oaslam_precompile(TARGET KIND header...): the first target of its kind compiles the headers once, the others share them. GCC
# optimises a file with the options (-O, -f) of the precompiled headers, whatever the file's own are: those of a kind must agree.
# Not with a compiler launcher: ccache does not cache files that use precompiled headers. The preset dev does without, too, so
# that missing includes are noticed.
function(oaslam_precompile target kind)
  get_property(owner GLOBAL PROPERTY OASLAM_PRECOMPILED_${kind})
  if(NOT OASLAM_PCH OR CMAKE_CXX_COMPILER_LAUNCHER)
    return()
  elseif(owner)
    target_precompile_headers(${target} REUSE_FROM ${owner})
  else()
    target_precompile_headers(${target} PRIVATE ${ARGN})
    set_property(GLOBAL PROPERTY OASLAM_PRECOMPILED_${kind} ${target})
  endif()
endfunction()
set(oaslam_common_headers <Eigen/Dense> <fmt/format.h> <algorithm> <array> <cmath> <filesystem> <functional>
  <map> <memory> <numbers> <optional> <ranges> <set> <span> <string> <vector>)

# oaslam_room(NAME [COLD] [FOR viewer|programs] [LINK target...] [PRIVATE_LINK target...]): of liboaslam, or else of
# liboaslam-viewer, or of the programs alone. COLD: reads and writes files or hands on values. Nothing in the room takes long to
# run, so that it is compiled with -O1, in two thirds of the time.
function(oaslam_room name)
  cmake_parse_arguments(ROOM "COLD" "FOR" "LINK;PRIVATE_LINK" ${ARGN})
  set(dir ${CMAKE_CURRENT_SOURCE_DIR}/oaslam/${name})
  if(NOT ROOM_FOR STREQUAL "programs")
    set_property(GLOBAL APPEND PROPERTY OASLAM_ROOM_TARGETS_${ROOM_FOR} oaslam_${name})
  endif()
  file(GLOB sources CONFIGURE_DEPENDS ${dir}/*.cc ${dir}/*.h)
  file(GLOB tests CONFIGURE_DEPENDS ${dir}/*_test.cc)
  list(REMOVE_ITEM sources ${tests} "")
  if(NOT sources)
    add_library(oaslam_${name} INTERFACE)
    target_link_libraries(oaslam_${name} INTERFACE ${ROOM_LINK})
    set_target_properties(oaslam_${name} PROPERTIES EXPORT_NAME room_${name})
    return()
  endif()
  add_library(oaslam_${name} STATIC ${sources})
  set_target_properties(oaslam_${name} PROPERTIES LINKER_LANGUAGE CXX EXPORT_NAME room_${name}
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_include_directories(oaslam_${name} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}> $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(oaslam_${name} PUBLIC cxx_std_20)
  if(NOT BUILD_SHARED_LIBS)
    target_compile_definitions(oaslam_${name} INTERFACE OASLAM_STATIC)
  endif()
  target_link_libraries(oaslam_${name} PUBLIC ${ROOM_LINK} PRIVATE $<BUILD_INTERFACE:oaslam_options> ${ROOM_PRIVATE_LINK})
  if(ROOM_COLD)
    target_compile_options(oaslam_${name} PRIVATE -O1)
    oaslam_precompile(oaslam_${name} cold_room ${oaslam_common_headers})
  else()
    oaslam_precompile(oaslam_${name} room ${oaslam_common_headers})
  endif()
  # Files that are compiled together instantiate their templates, most of all Eigen's, once: that takes two fifths of the time.
  # Not with a compiler launcher, whose cache would hold eight files for one. GCC warns there of each member of a class whose
  # type is in an unnamed namespace.
  set(batch 8)
  if(ROOM_COLD)
    set(batch 16)
  endif()
  if(OASLAM_UNITY AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
    set_target_properties(oaslam_${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${batch})
    target_compile_options(oaslam_${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
  if(NOT ROOM_FOR)
    set_property(GLOBAL APPEND PROPERTY OASLAM_ROOM_OBJECTS $<TARGET_OBJECTS:oaslam_${name}>)
  endif()
  if(OASLAM_BUILD_TESTS)
    foreach(test ${tests})
      set_property(GLOBAL APPEND PROPERTY OASLAM_UNIT_TESTS "${name}:${test}")
    endforeach()
  endif()
  set_property(GLOBAL PROPERTY OASLAM_ROOM_LINKS_${name} ${ROOM_LINK})
  if(OASLAM_BUILD_TESTS AND NOT OASLAM_SANITIZE AND name IN_LIST oaslam_foreign_rooms)
    oaslam_sanitized_room(${name} "${sources}" ${ROOM_PRIVATE_LINK})
  endif()
endfunction()

# The rooms that read foreign bytes or manage memory themselves.
set(oaslam_foreign_rooms detection features formats images map net recordings ros2 service storage)
set(oaslam_sanitizers -fsanitize=address,undefined -fno-sanitize-recover=all -fno-sanitize=null,object-size,vptr)
set(oaslam_sanitizer_definitions EIGEN_MALLOC_ALREADY_ALIGNED=1)  # as below OASLAM_SANITIZE above

# The target NAME_sanitized: the same files once more, under the sanitizers. A test of it takes the other rooms as they are, so
# that these are not built twice.
function(oaslam_sanitized_room name sources)
  set(target oaslam_${name}_sanitized)
  add_library(${target} STATIC EXCLUDE_FROM_ALL ${sources})
  set_target_properties(${target} PROPERTIES LINKER_LANGUAGE CXX CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
    UNITY_BUILD ${OASLAM_UNITY} UNITY_BUILD_BATCH_SIZE 8)
  target_link_libraries(${target} PRIVATE oaslam_${name} oaslam_options ${ARGN})
  target_compile_definitions(${target} PRIVATE $<TARGET_PROPERTY:oaslam_${name},COMPILE_DEFINITIONS> ${oaslam_sanitizer_definitions})
  target_compile_options(${target} PRIVATE $<TARGET_PROPERTY:oaslam_${name},COMPILE_OPTIONS> -O1 -g1 -fno-omit-frame-pointer
    ${oaslam_sanitizers} $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized;-Wno-subobject-linkage>)
endfunction()

# Sets in OUT the sanitized rooms that a room reaches, itself included.
function(oaslam_sanitized_below name out)
  set(found "")
  set(left ${name})
  set(done "")
  while(left)
    list(POP_FRONT left room)
    if(room IN_LIST done)
      continue()
    endif()
    list(APPEND done ${room})
    if(room IN_LIST oaslam_foreign_rooms)
      list(APPEND found oaslam_${room}_sanitized)
    endif()
    get_property(links GLOBAL PROPERTY OASLAM_ROOM_LINKS_${room})
    list(FILTER links INCLUDE REGEX "^oaslam_")
    list(TRANSFORM links REPLACE "^oaslam_" "")
    list(APPEND left ${links})
  endwhile()
  set(${out} ${found} PARENT_SCOPE)
endfunction()

# The libraries, each with the version script of core. The programs and the tests link the rooms themselves.
# oaslam_library(TARGET ROOMS room... [OBJECTS object...] [LINK target...])
function(oaslam_library name)
  cmake_parse_arguments(LIBRARY "" "" "ROOMS;OBJECTS;LINK" ${ARGN})
  if(NOT BUILD_SHARED_LIBS)
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE ${LIBRARY_LINK} ${LIBRARY_ROOMS})
    return()
  endif()
  add_library(${name} SHARED ${LIBRARY_OBJECTS})
  set(script ${OASLAM_ROOT}/core/liboaslam.map)
  set_target_properties(${name} PROPERTIES LINKER_LANGUAGE CXX VERSION ${OASLAM_VERSION} SOVERSION 0 LINK_DEPENDS ${script})
  target_include_directories(${name} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_link_libraries(${name} PUBLIC ${LIBRARY_LINK} PRIVATE ${LIBRARY_ROOMS})
  target_link_options(${name} PRIVATE -Wl,--version-script=${script} -Wl,--as-needed)
  if(NOT OASLAM_SANITIZE)
    target_link_options(${name} PRIVATE -Wl,--no-undefined)
  endif()
endfunction()

# oaslam_compiled_alone(ROOM/FILE...): files of this part, without their endings, that are not compiled together with others: a name
# that is theirs stands in another file of the room or in its headers, too; or they are compiled once for each instruction set; or
# a library takes them without the rest of the room, or the rest without them (e2e.symbols).
function(oaslam_compiled_alone)
  list(TRANSFORM ARGN REPLACE "(.+)" "oaslam/\\1.cc")
  set_source_files_properties(${ARGN} DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# oaslam_program_library(TARGET): how the files of a program are compiled.
function(oaslam_program_library target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 18)
  target_compile_options(${target} PRIVATE -O1)
  oaslam_precompile(${target} program ${oaslam_common_headers} <CLI/CLI.hpp> <spdlog/spdlog.h>)
endfunction()

# oaslam_program(TARGET NAME file...): the program NAME in the build folder.
function(oaslam_program target name)
  add_executable(${target} ${ARGN})
  set_target_properties(${target} PROPERTIES OUTPUT_NAME ${name} RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR})
  target_compile_options(${target} PRIVATE -O1)
endfunction()
