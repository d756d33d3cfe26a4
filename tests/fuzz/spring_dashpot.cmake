torsio_fuzzer(spring_dashpot torsio::runtime)
