# `find_package(oaslam)` then `target_link_libraries(app oaslam::oaslam)`: the public headers and the static rooms behind them.
include(CMakePackageConfigHelpers)

get_property(room_targets GLOBAL PROPERTY OASLAM_ROOM_TARGETS)
install(TARGETS oaslam ${room_targets} EXPORT oaslam ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")

install(DIRECTORY ${PROJECT_SOURCE_DIR}/data/models DESTINATION ${CMAKE_INSTALL_DATADIR}/oaslam)

set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/oaslam)
install(EXPORT oaslam NAMESPACE oaslam:: FILE oaslamTargets.cmake DESTINATION ${config_dir})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/oaslamConfig.cmake.in ${PROJECT_BINARY_DIR}/oaslamConfig.cmake
  INSTALL_DESTINATION ${config_dir})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/oaslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/oaslamConfig.cmake ${PROJECT_BINARY_DIR}/oaslamConfigVersion.cmake DESTINATION ${config_dir})
