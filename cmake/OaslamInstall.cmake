# `find_package(oaslam)` then `target_link_libraries(app oaslam::oaslam)`, or `pkg-config oaslam`: the public headers and the library
# behind them. A component is a package (docs/packages.md).
include(CMakePackageConfigHelpers)

set(libraries oaslam)
if(NOT BUILD_SHARED_LIBS)
  get_property(room_targets GLOBAL PROPERTY OASLAM_ROOM_TARGETS)
  list(APPEND libraries ${room_targets})
endif()
install(TARGETS ${libraries} EXPORT oaslam
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development FILES_MATCHING PATTERN "*.h")

set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/oaslam)
install(EXPORT oaslam NAMESPACE oaslam:: FILE oaslamTargets.cmake DESTINATION ${config_dir} COMPONENT development)
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
endif()
