torsio_fuzzer(mapping torsio::lab)
