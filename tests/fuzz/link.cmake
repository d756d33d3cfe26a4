torsio_fuzzer(link torsio::link)
