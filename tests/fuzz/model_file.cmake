torsio_fuzzer(model_file torsio::files)
