"""peer_mat.py ROW FOLDER: MB/s of doubles that scipy reads from the MATLAB file of the row."""
import sys
import time

import scipy.io

row, folder = sys.argv[1:]
path = f"{folder}/{'log_v7' if row == 'mat_read_v7' else 'log'}.mat"
best = float("inf")
for _ in range(5):
    start = time.perf_counter()
    arrays = scipy.io.loadmat(path)
    best = min(best, time.perf_counter() - start)
size = sum(array.nbytes for name, array in arrays.items() if not name.startswith("__"))
print(1e-6 * size / best)
