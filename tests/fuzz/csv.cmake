torsio_fuzzer(csv torsio::lab)
