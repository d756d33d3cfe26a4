torsio_fuzzer(mapping torsio::data)
