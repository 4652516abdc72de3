# What each part (core, command, viewer, server) includes first: options, and how rooms, programs and tests are built. A part is
# built with those below it, alone (cmake -S core -B build/core) or from the root of the repository.
include_guard(GLOBAL)

option(BUILD_SHARED_LIBS "Build the library as a shared one; OFF: as static ones, which an application links with all they need" ON)
option(OASLAM_BUILD_APPS "Build the programs oaslam, oaslam-viewer and oaslam-server; from the root OFF leaves out the part server" ON)
option(OASLAM_BUILD_TESTS "Build the tests (tools/setup.sh --tests installs what they need)" OFF)
option(OASLAM_WERROR "Treat warnings as errors" OFF)
option(OASLAM_PCH "Precompile the headers that most files include; not with a compiler launcher such as ccache" ON)
option(OASLAM_UNITY "Compile the files of a target together where their names allow it" ON)
option(OASLAM_FUZZ "Build the fuzz targets (tools/fuzz), by clang with OASLAM_SANITIZE" OFF)
set(OASLAM_SANITIZE "" CACHE STRING "Sanitizers to build with, e.g. address,undefined")

get_filename_component(OASLAM_ROOT ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)
file(STRINGS ${OASLAM_ROOT}/CMakeLists.txt OASLAM_VERSION REGEX "^project\\(oaslam VERSION ")
string(REGEX REPLACE "^project\\(oaslam VERSION ([0-9.]+).*" "\\1" OASLAM_VERSION "${OASLAM_VERSION}")

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
# A part links libraries that a part below it has found.
set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL ON)
include(GNUInstallDirs)
list(PREPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR})
include(CTest)
find_package(PkgConfig REQUIRED)

include(OaslamRooms)
include(OaslamEmbed)
if(OASLAM_BUILD_TESTS)
  include(OaslamTests)
else()
  function(oaslam_part_tests)
  endfunction()
endif()

# oaslam_part(NAME): the folder NAME of the repository, unless it is a part of this build already.
function(oaslam_part name)
  get_property(parts GLOBAL PROPERTY OASLAM_PARTS)
  if(NOT name IN_LIST parts)
    add_subdirectory(${OASLAM_ROOT}/${name} ${CMAKE_BINARY_DIR}/${name})
    set_property(GLOBAL APPEND PROPERTY OASLAM_PARTS ${name})
  endif()
endfunction()
