# A reader and the free runs of what it reads, without the fits.
set(torsio_drive_file_sources drive_file.cpp drive_logs.cpp drive_model.cpp drive_rollout.cpp sheet_json.cpp)
list(TRANSFORM torsio_drive_file_sources PREPEND ${PROJECT_SOURCE_DIR}/src/identify/drive/)
add_library(torsio_drive_files STATIC ${torsio_drive_file_sources})
target_include_directories(torsio_drive_files PRIVATE ${PROJECT_SOURCE_DIR}/src)
target_link_libraries(torsio_drive_files PUBLIC torsio_readers
  PRIVATE torsio_build_settings fmt::fmt hwy::hwy nlohmann_json::nlohmann_json)
torsio_fuzzer(identified_drive torsio_drive_files)
