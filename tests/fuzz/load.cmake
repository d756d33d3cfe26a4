torsio_fuzzer(load torsio::data)
