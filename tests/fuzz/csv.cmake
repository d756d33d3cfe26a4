torsio_fuzzer(csv torsio_readers)
