torsio_fuzzer(weights_json torsio::lab)
