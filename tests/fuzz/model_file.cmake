torsio_fuzzer(model_file torsio::files)
target_include_directories(fuzz_model_file PRIVATE ${PROJECT_SOURCE_DIR}/tests)
