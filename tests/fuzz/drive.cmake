torsio_fuzzer(drive torsio_readers)
