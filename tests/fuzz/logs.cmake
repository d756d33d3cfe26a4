torsio_fuzzer(mcap torsio_readers)
torsio_fuzzer(bag torsio_readers)
torsio_fuzzer(npz torsio_readers)
torsio_fuzzer(mat torsio_readers)
