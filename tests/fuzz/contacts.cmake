torsio_fuzzer(contacts torsio::arm)
