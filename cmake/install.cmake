include(CMakePackageConfigHelpers)

set(torsio_installed_targets torsio_runtime torsio_files)
if(TORSIO_BUILD_LAB)
  list(APPEND torsio_installed_targets torsio_lab)
  install(TARGETS torsio_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(TARGETS ${torsio_installed_targets} EXPORT torsioTargets FILE_SET HEADERS
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT torsioTargets NAMESPACE torsio:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/torsio)
configure_package_config_file(cmake/torsioConfig.cmake.in ${PROJECT_BINARY_DIR}/torsioConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/torsio)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/torsioConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/torsioConfig.cmake ${PROJECT_BINARY_DIR}/torsioConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/torsio)
