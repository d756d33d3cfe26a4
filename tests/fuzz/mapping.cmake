torsio_fuzzer(mapping torsio_readers)
