torsio_fuzzer(mcap torsio::data)
torsio_fuzzer(bag torsio::data)
torsio_fuzzer(npz torsio::data)
torsio_fuzzer(mat torsio::data)
