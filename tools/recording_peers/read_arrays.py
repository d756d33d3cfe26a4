#!/usr/bin/python3
"""read_arrays.py RUN.csv RUN.npz RUN.mat: whether numpy, scipy and Octave read the numbers that torsio wrote."""
import csv
import subprocess
import sys

import numpy
import scipy.io

csv_path, npz_path, mat_path = sys.argv[1:]
with open(csv_path) as file:
    rows = list(csv.DictReader(file))
columns = {name: numpy.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}
for path, arrays in ((npz_path, numpy.load(npz_path)), (mat_path, scipy.io.loadmat(mat_path))):
    for name, expected in columns.items():
        numpy.testing.assert_array_equal(arrays[name].ravel(), expected, f"{path}: {name}")
    print(f"{path}: equal to {csv_path}")
text = ", ".join(f"sum(isfinite({name}))" for name in columns)
finite = subprocess.run(["octave-cli", "--norc", "--eval", f"load('{mat_path}'); printf('%d ', {text})"],
                        check=True, capture_output=True, text=True).stdout.split()
expected = [str(int(numpy.isfinite(column).sum())) for column in columns.values()]
if finite != expected:
    sys.exit(f"{mat_path}: Octave finds {finite} finite values, not {expected}")
print(f"{mat_path}: read by Octave")
