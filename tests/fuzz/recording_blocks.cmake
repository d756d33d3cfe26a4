torsio_fuzzer(recording_blocks torsio::data)
