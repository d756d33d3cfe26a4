# One export set each for runtime with files, realtime, lab and onnx, so that a robot that links runtime and files does not need the
# libraries of the lab.
include(CMakePackageConfigHelpers)
set(torsio_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/torsio)

install(TARGETS torsio_runtime torsio_files EXPORT torsioTargets FILE_SET HEADERS
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT torsioTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
install(TARGETS torsio_realtime EXPORT torsioRealtimeTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT torsioRealtimeTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
if(TORSIO_BUILD_LAB)
  install(TARGETS torsio_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(TARGETS torsio_lab EXPORT torsioLabTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT torsioLabTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
  install(FILES cmake/Findlz4.cmake DESTINATION ${torsio_package_dir})
endif()
if(TORSIO_HAS_ONNX)
  install(TARGETS torsio_onnx EXPORT torsioOnnxTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT torsioOnnxTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
endif()

if(TORSIO_BUILD_C)
  install(TARGETS torsio_c EXPORT torsioCTargets FILE_SET HEADERS LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT torsioCTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
  configure_file(c/torsio.pc.in ${PROJECT_BINARY_DIR}/torsio.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/torsio.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endif()

configure_package_config_file(cmake/torsioConfig.cmake.in ${PROJECT_BINARY_DIR}/torsioConfig.cmake
  INSTALL_DESTINATION ${torsio_package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/torsioConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/torsioConfig.cmake ${PROJECT_BINARY_DIR}/torsioConfigVersion.cmake
        DESTINATION ${torsio_package_dir})
install(FILES LICENSE README.md CHANGELOG.md CONTRIBUTING.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR})
