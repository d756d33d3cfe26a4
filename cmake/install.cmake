# One export set for the libraries that need the same ones of others: a robot that links runtime and files needs neither
# the readers of recordings nor cairo, and a program that fits models no cairo. The components are the Debian packages of
# packages.cmake.
include(CMakePackageConfigHelpers)
set(torsio_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/torsio)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)

install(TARGETS torsio_runtime torsio_files EXPORT torsioTargets FILE_SET HEADERS
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT torsioTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
install(TARGETS torsio_realtime EXPORT torsioRealtimeTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT torsioRealtimeTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
install(TARGETS torsio_arm EXPORT torsioArmTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT torsioArmTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
install(TARGETS torsio_link EXPORT torsioLinkTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT torsioLinkTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
if(TORSIO_HAS_LIVE)
  install(TARGETS torsio_live EXPORT torsioLiveTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT torsioLiveTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
endif()
if(TORSIO_HAS_MUJOCO)
  install(TARGETS torsio_mujoco EXPORT torsioMujocoTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT torsioMujocoTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
  install(FILES cmake/Findmujoco.cmake DESTINATION ${torsio_package_dir})
endif()
if(TORSIO_BUILD_LAB)
  install(TARGETS torsio_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
  if(NOT CMAKE_CROSSCOMPILING)
    install(DIRECTORY ${PROJECT_BINARY_DIR}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program
            FILES_MATCHING PATTERN "*.1")
  endif()
  install(TARGETS torsio_data torsio_learn torsio_bench torsio_trials torsio_export torsio_store torsio_search
          EXPORT torsioLearnTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT torsioLearnTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
  install(TARGETS torsio_report torsio_fleet torsio_design torsio_coupling torsio_lab
          EXPORT torsioLabTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT torsioLabTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
  install(FILES cmake/Findlz4.cmake cmake/Findcairo.cmake DESTINATION ${torsio_package_dir})
endif()
if(TORSIO_HAS_ONNX)
  install(TARGETS torsio_onnx EXPORT torsioOnnxTargets FILE_SET HEADERS ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT torsioOnnxTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
endif()

if(TORSIO_BUILD_C)
  install(TARGETS torsio_c EXPORT torsioCTargets FILE_SET HEADERS
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT development)
  install(EXPORT torsioCTargets NAMESPACE torsio:: DESTINATION ${torsio_package_dir})
  configure_file(c/torsio.pc.in ${PROJECT_BINARY_DIR}/torsio.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/torsio.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endif()

configure_package_config_file(cmake/torsioConfig.cmake.in ${PROJECT_BINARY_DIR}/torsioConfig.cmake
  INSTALL_DESTINATION ${torsio_package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/torsioConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/torsioConfig.cmake ${PROJECT_BINARY_DIR}/torsioConfigVersion.cmake
        DESTINATION ${torsio_package_dir})
install(FILES LICENSE README.md CHANGELOG.md CONTRIBUTING.md THIRD_PARTY.md DESTINATION ${CMAKE_INSTALL_DOCDIR}
        COMPONENT program)
install(DIRECTORY share/ DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT program)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
