torsio_fuzzer(state torsio::files)
