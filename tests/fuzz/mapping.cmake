torsio_fuzzer(mapping torsio_readers)
torsio_fuzzer(mcap torsio_readers)
