# `find_package(oaslam)` then `target_link_libraries(app oaslam::oaslam)`, or `pkg-config oaslam`: the public headers and the library
# behind them. The viewer is the component `viewer` with the target oaslam::viewer, and `pkg-config oaslam-viewer`. A component is a package (docs/packages.md).
include(CMakePackageConfigHelpers)
# What core has found, and the files below tell.
foreach(variable OpenCV_INCLUDE_DIRS onnxruntime_FOUND onnxruntime_VERSION onnxruntime_VERSION_MAJOR onnxruntime_VERSION_MINOR)
  get_directory_property(${variable} DIRECTORY ${PROJECT_SOURCE_DIR}/core DEFINITION ${variable})
endforeach()

# oaslam_install_library(TARGET EXPORT LIBRARY_COMPONENT DEVELOPMENT_COMPONENT ROOM_TARGETS_OF): with its targets for CMake.
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/oaslam)
function(oaslam_install_library target export library development rooms_of)
  set(targets ${target})
  if(NOT BUILD_SHARED_LIBS)
    get_property(rooms GLOBAL PROPERTY OASLAM_ROOM_TARGETS_${rooms_of})
    list(APPEND targets ${rooms})
  endif()
  install(TARGETS ${targets} EXPORT ${export}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${library} NAMELINK_COMPONENT ${development}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${development})
  install(EXPORT ${export} NAMESPACE oaslam:: FILE ${export}Targets.cmake DESTINATION ${config_dir} COMPONENT ${development})
endfunction()
oaslam_install_library(oaslam oaslam library development "")
oaslam_install_library(oaslam_viewer_library oaslamViewer viewer viewer_development viewer)
set(viewer_header ${PROJECT_SOURCE_DIR}/viewer/include/oaslam/map_viewer.h)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/core/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
  FILES_MATCHING PATTERN "*.h")
install(FILES ${viewer_header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/oaslam COMPONENT viewer_development)

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/oaslamConfig.cmake.in ${PROJECT_BINARY_DIR}/oaslamConfig.cmake
  INSTALL_DESTINATION ${config_dir})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/oaslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/oaslamConfig.cmake ${PROJECT_BINARY_DIR}/oaslamConfigVersion.cmake ${CMAKE_CURRENT_LIST_DIR}/FindOpenCV.cmake
  DESTINATION ${config_dir} COMPONENT development)

# The static rooms need more than a pkg-config file should list by hand: CMake's package knows it.
if(BUILD_SHARED_LIBS)
  file(RELATIVE_PATH OASLAM_PC_TO_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
  set(system "${CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES}")
  set(OASLAM_PC_OPENCV_DIR "$<$<NOT:$<IN_LIST:$<TARGET_FILE_DIR:opencv_core>,${system}>>:-L$<TARGET_FILE_DIR:opencv_core> >")
  configure_file(${CMAKE_CURRENT_LIST_DIR}/oaslam.pc.in ${PROJECT_BINARY_DIR}/oaslam.pc.in @ONLY)
  file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/oaslam.pc INPUT ${PROJECT_BINARY_DIR}/oaslam.pc.in)
  install(FILES ${PROJECT_BINARY_DIR}/oaslam.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/oaslam-viewer.pc.in ${PROJECT_BINARY_DIR}/oaslam-viewer.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/oaslam-viewer.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT viewer_development)
endif()
