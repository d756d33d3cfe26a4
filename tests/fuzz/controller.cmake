torsio_fuzzer(controller torsio::data)
