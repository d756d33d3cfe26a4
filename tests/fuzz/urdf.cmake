torsio_fuzzer(urdf torsio::arm)
