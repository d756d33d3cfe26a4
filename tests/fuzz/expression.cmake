torsio_fuzzer(expression torsio::runtime)
