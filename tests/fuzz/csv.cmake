torsio_fuzzer(csv torsio::data)
