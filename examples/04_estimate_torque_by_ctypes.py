"""libtorsio.so from Python by ctypes, without any package; the module `torsio` (docs/use/python.md) does more.

    python3 04_estimate_torque_by_ctypes.py LIBTORSIO MODEL < rows

Each row of standard input has the channels of the model in their order, separated by blanks; `nan` is one that was not
measured. Printed are value, standard deviation and fault.
"""

import ctypes
import sys


class Estimate(ctypes.Structure):
    _fields_ = [
        ("value", ctypes.c_double),
        ("std_dev", ctypes.c_double),
        ("novelty", ctypes.c_double),
        ("fault", ctypes.c_int32),
        ("reserved", ctypes.c_int32),
    ]


def load_library(path: str) -> ctypes.CDLL:
    library = ctypes.CDLL(path)
    library.torsio_last_error.restype = ctypes.c_char_p
    library.torsio_fault_name.restype = ctypes.c_char_p
    library.torsio_load.restype = ctypes.c_void_p
    library.torsio_load.argtypes = [ctypes.c_char_p, ctypes.c_char_p]
    library.torsio_free.argtypes = [ctypes.c_void_p]
    library.torsio_input_count.restype = ctypes.c_size_t
    library.torsio_input_count.argtypes = [ctypes.c_void_p]
    library.torsio_unset_zero.restype = ctypes.c_char_p
    library.torsio_unset_zero.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
    library.torsio_set_zero.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double]
    library.torsio_step.restype = Estimate
    library.torsio_step.argtypes = [ctypes.c_void_p, ctypes.POINTER(ctypes.c_double), ctypes.c_size_t]
    return library


def main(library_path: str, model_path: str) -> int:
    torsio = load_library(library_path)
    joint = torsio.torsio_load(model_path.encode(), None)
    if not joint:
        print(torsio.torsio_last_error().decode(), file=sys.stderr)
        return 1
    while name := torsio.torsio_unset_zero(joint, 0):  # a real joint measures them at rest
        torsio.torsio_set_zero(joint, name, 0.0)
    inputs = torsio.torsio_input_count(joint)
    raw = (ctypes.c_double * inputs)()
    for line in sys.stdin:
        raw[:] = [float(number) for number in line.split()]
        torque = torsio.torsio_step(joint, raw, inputs)
        print(repr(torque.value), repr(torque.std_dev), torsio.torsio_fault_name(torque.fault).decode())
    torsio.torsio_free(joint)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
