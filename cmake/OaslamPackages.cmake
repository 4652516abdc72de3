# Debian packages by CPack, one for each install component: tools/packages builds and checks them (docs/packages.md).
set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL library development viewer viewer_development command server)
if(OASLAM_BUILD_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_NAME oaslam)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
# As for Debian's own tools.
set(maintainer $ENV{DEBFULLNAME} "OA-SLAM maintainers")
set(mail $ENV{DEBEMAIL} maintainers@oaslam.example.org)
list(GET maintainer 0 maintainer)
list(GET mail 0 mail)
set(CPACK_PACKAGE_CONTACT "${maintainer} <${mail}>")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/src)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(version ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})

# oaslam_package(COMPONENT NAME SECTION DESCRIPTION)
function(oaslam_package component name section description)
  string(TOUPPER ${component} key)
  set(CPACK_DEBIAN_${key}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_COMPONENT_${key}_DESCRIPTION "${description}" PARENT_SCOPE)
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/debian/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component} EXCLUDE_FROM_ALL)
  install(FILES ${PROJECT_BINARY_DIR}/changelog.Debian.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component} EXCLUDE_FROM_ALL)
endfunction()

set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(what "OA-SLAM makes a map of points and of everyday objects from one camera, and\nfinds the camera again in it, also from where points alone fail.\n\nThis package contains")
oaslam_package(library liboaslam0 libs "${what} the shared library.")
oaslam_package(development liboaslam-dev libdevel "${what} the headers, a CMake package and a pkg-config file.")
oaslam_package(viewer liboaslam-viewer0 libs "${what} the shared library of its viewer, a page for browsers.")
oaslam_package(viewer_development liboaslam-viewer-dev libdevel "${what} the header of its viewer, for CMake and pkg-config.")
oaslam_package(command oaslam science "${what} the command with its viewer.")
oaslam_package(server oaslam-server science "${what} the localization service, and what fetches detectors.")
oaslam_package(python python3-oaslam python "${what} the Python module.")

set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
file(WRITE ${PROJECT_BINARY_DIR}/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/triggers)
set(CPACK_DEBIAN_VIEWER_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/triggers)
# `oaslam serve` and `oaslam models` are passed on to the server.
set(CPACK_DEBIAN_COMMAND_PACKAGE_RECOMMENDS oaslam-server)
# It fetches detectors, and libcurl checks by these certificates from whom.
set(CPACK_DEBIAN_SERVER_PACKAGE_RECOMMENDS ca-certificates)
set(CPACK_DEBIAN_SERVER_PACKAGE_SUGGESTS oaslam)
# libheif's decoders of HEIC and AVIF photos are in the library itself before 1.17.
set(CPACK_DEBIAN_LIBRARY_PACKAGE_RECOMMENDS "oaslam, libheif-plugin-libde265 | libheif1 (<< 1.17), libheif-plugin-dav1d | libheif1 (<< 1.17)")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "liboaslam0 (= ${version}), libeigen3-dev, libopencv-core-dev")
# It knows how the library keeps a map, which is not its interface.
set(CPACK_DEBIAN_VIEWER_PACKAGE_DEPENDS "liboaslam0 (= ${version})")
set(CPACK_DEBIAN_VIEWER_DEVELOPMENT_PACKAGE_DEPENDS "liboaslam-viewer0 (= ${version}), liboaslam-dev (= ${version})")
if(OASLAM_BUILD_PYTHON)
  # The module is of the version that it was built for.
  get_directory_property(minor DIRECTORY ${PROJECT_SOURCE_DIR}/python DEFINITION Python_VERSION_MINOR)
  math(EXPR next_minor "${minor} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "liboaslam0 (= ${version}), liboaslam-viewer0 (= ${version}), python3 (>= 3.${minor}), python3 (<< 3.${next_minor}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS oaslam)
endif()
install(FILES ${PROJECT_SOURCE_DIR}/deploy/README.md ${PROJECT_SOURCE_DIR}/deploy/oaslam.service ${PROJECT_SOURCE_DIR}/deploy/haproxy.cfg
  DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/oaslam-server/examples COMPONENT server EXCLUDE_FROM_ALL)

string(TIMESTAMP date "%a, %d %b %Y 00:00:00 +0000" UTC)  # honours SOURCE_DATE_EPOCH
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/CHANGELOG.md)
execute_process(COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/cmake/debian/changelog.py ${PROJECT_SOURCE_DIR}/CHANGELOG.md ${PROJECT_VERSION}
  ${CPACK_DEBIAN_PACKAGE_RELEASE} ${CPACK_PACKAGE_CONTACT} ${date} OUTPUT_FILE ${PROJECT_BINARY_DIR}/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND gzip -9nf ${PROJECT_BINARY_DIR}/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)

include(CPack)
