#pragma once

/// Call first. OpenBLAS, which Ceres may bring along, starts a thread per core while the program is
/// loaded. Where the address space is limited (`ulimit -v`), these wait for memory for ever, and the
/// program would wait for them at its end. The program is therefore executed once again with
/// OPENBLAS_NUM_THREADS=1, unless the variable is set or the address space has no limit.
void limit_blas_threads(char** argv);
