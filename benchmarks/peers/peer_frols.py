"""Forward regression with orthogonal least squares in numpy on the same samples, one thread.

Usage: OPENBLAS_NUM_THREADS=1 /usr/bin/python3 peer_frols.py FOLDER
Prints the milliseconds that 8 of 165 terms take, the table of candidates included. As ours: only the products of all
candidates with the newest direction are kept; nothing is orthogonalised but what is chosen.
"""

import itertools
import sys
import time
from pathlib import Path

import numpy as np

DEGREE = 3
TERMS = 8


def candidates(x):
    n, inputs = x.shape
    columns = np.empty((sum(1 for _ in monomials(inputs)), n))
    made = {}
    for j, monomial in enumerate(monomials(inputs)):
        if not monomial:
            columns[j] = 1.0
        else:
            np.multiply(columns[made[monomial[:-1]]], x[:, monomial[-1]], out=columns[j])
        made[monomial] = j
    return columns


def monomials(inputs):
    for degree in range(DEGREE + 1):
        yield from itertools.combinations_with_replacement(range(inputs), degree)


def frols(x, y):
    phi = candidates(x)
    squares = np.einsum("ij,ij->i", phi, phi)
    left = squares.copy()
    with_y = phi @ y
    basis = []
    chosen = []
    for _ in range(TERMS):
        gain = np.where(left > 1e-12 * squares, with_y**2 / np.maximum(left, 1e-300), 0.0)
        best = int(np.argmax(gain))
        q = phi[best].copy()
        for _ in range(2):
            for direction in basis:
                q -= (direction @ q) * direction
        q /= np.linalg.norm(q)
        products = phi @ q
        left -= products**2
        with_y -= products * (q @ y)
        basis.append(q)
        chosen.append(best)
    return chosen


def main():
    (folder,) = sys.argv[1:]
    y = np.fromfile(Path(folder) / "target.f64")
    x = np.fromfile(Path(folder) / "regressors.f64").reshape(len(y), -1)
    best = np.inf
    for _ in range(5):
        start = time.perf_counter()
        frols(x, y)
        best = min(best, time.perf_counter() - start)
    print(1e3 * best)


main()
