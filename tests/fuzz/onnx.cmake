if(TORSIO_HAS_ONNX)
  torsio_fuzzer(onnx torsio_readers onnx_proto)
  target_compile_definitions(fuzz_onnx PRIVATE TORSIO_GOLDEN_IMPORT="${PROJECT_SOURCE_DIR}/tests/golden/import")
endif()
