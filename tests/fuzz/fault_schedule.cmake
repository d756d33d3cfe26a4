torsio_fuzzer(fault_schedule torsio::lab)
