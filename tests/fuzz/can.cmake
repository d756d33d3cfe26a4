torsio_fuzzer(can torsio::link)
