"""What the package costs beside the C++ library:  python measure.py [LIBTORSIO]

Prints the shortest of repeated runs. With the path of libtorsio.so it runs the same rows through torsio_run, which is a
plain loop over the C++ estimator, and compares all bits. Times are for one core of an idle machine.
"""

from __future__ import annotations

import ctypes
import pathlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

import torsio

IMPORT = "import numpy, time; start = time.perf_counter(); import torsio; print(time.perf_counter() - start)"
C_ESTIMATE = np.dtype(
    [("value", "f8"), ("std_dev", "f8"), ("novelty", "f8"), ("fault", "i4"), ("reserved", "i4")]
)


def best_s(work: Callable[[], object], repeats: int = 30) -> float:
    shortest = float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        shortest = min(shortest, time.perf_counter() - start)
    return shortest


def import_s() -> float:
    def once() -> float:
        run = subprocess.run([sys.executable, "-c", IMPORT], capture_output=True, check=True, text=True)
        return float(run.stdout)

    return min(once() for _ in range(10))


def compare_with_c(path: str, model: torsio.Model, rows: npt.NDArray[np.float64]) -> None:
    library = ctypes.CDLL(path)
    library.torsio_load.restype = ctypes.c_void_p
    library.torsio_load.argtypes = [ctypes.c_char_p, ctypes.c_char_p]
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    library.torsio_run.argtypes = [pointer, pointer, size, size, pointer]
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "joint.safetensors"
        model.save(file)
        joint = library.torsio_load(str(file).encode(), None)
    out = np.empty(len(rows), dtype=C_ESTIMATE)
    estimator = model.estimator()

    def run_c() -> None:
        library.torsio_run(joint, rows.ctypes.data, rows.shape[0], rows.shape[1], out.ctypes.data)

    run_c()
    mine = estimator.run(rows)
    for name in ("value", "std_dev"):
        assert (out[name].view("u8") == getattr(mine, name).view("u8")).all(), name
    assert (out["fault"] == mine.fault).all()
    c_s = python_s = float("inf")
    for _ in range(50):  # in turn, so that both meet the same disturbances
        c_s = min(c_s, best_s(run_c, 1))
        python_s = min(python_s, best_s(lambda: estimator.run(rows), 1))
    print(f"run, same bits as C++:   {1e9 * python_s / len(rows):.0f} ns per sample, {python_s / c_s:.2f} x C++")


def main() -> None:
    print(f"import beyond numpy's:   {1e3 * import_s():.1f} ms")
    dataset = torsio.sweep_dataset("dfki-50", seed=1)
    model = torsio.fit(dataset, "grey_box", seed=1)
    estimator = model.estimator()
    test = dataset.recordings[-1]
    rows = np.column_stack([test[name] for name in estimator.raw_inputs])[:20000]
    if len(sys.argv) > 1:
        compare_with_c(sys.argv[1], model, rows)
    pairs = [(float(a), float(b)) for a, b in rows[:2000]]

    def steps() -> None:
        step = estimator.step
        for a, b in pairs:
            step(a, b)

    print(f"step(a, b):              {1e6 * best_s(steps) / len(pairs):.2f} us")
    rows = np.column_stack([test[name] for name in estimator.raw_inputs])
    ticks = [np.ascontiguousarray(rows[k : k + 4096]) for k in range(600)]
    for name, of in (("grey_box", model), ("lstm32", torsio.fit(dataset, "lstm", layers="32", epochs=1))):
        joints = of.batch(4096)
        times = []
        for tick in ticks:  # each joint moves through the record; the filters settle first
            start = time.perf_counter()
            out = joints.step(tick)
            times.append(time.perf_counter() - start)
        usable = float(np.mean(out.fault == 0))
        print(f"batch_4096_{name}: {1e3 * min(times[-300:]):.2f} ms, {100 * usable:.0f} % of the joints without fault")


if __name__ == "__main__":
    main()
