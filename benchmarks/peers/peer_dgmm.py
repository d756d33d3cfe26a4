"""Gaussian mixture regression by vectorised numpy, float32: mean, variance and log density of given queries.

Usage: OPENBLAS_NUM_THREADS=1 /usr/bin/python3 peer_dgmm.py ROW FOLDER
Prints the microseconds of ROW: of one query, or of 100 000 together.
"""

import sys
import time
from pathlib import Path

import numpy as np


def read(folder, name, *shape):
    return np.fromfile(Path(folder) / f"{name}.f64").reshape(shape)


class Regression:
    """Everything that does not depend on the query is computed here; M components, d = 3 inputs."""

    def __init__(self, folder):
        weights = read(folder, "weights", -1)
        m = len(weights)
        means, covariances = read(folder, "means", m, 4), read(folder, "covariances", m, 4, 4)
        self.centre, self.scale = read(folder, "centre", 4), read(folder, "scale", 4)
        inner, cross = covariances[:, 1:, 1:], covariances[:, 0, 1:]
        slope = np.linalg.solve(inner, cross[..., None])[..., 0]
        cholesky = np.linalg.cholesky(inner)
        whitening = np.linalg.inv(cholesky)
        log_root = np.log(np.diagonal(cholesky, axis1=1, axis2=2)).sum(1)
        single = lambda a: np.ascontiguousarray(a.T.astype(np.float32))
        self.variance = single(covariances[:, 0, 0] - (slope * cross).sum(1))
        self.offset = single(np.log(weights) - log_root - 1.5 * np.log(2 * np.pi))
        self.output, self.mu, self.slope = single(means[:, 0]), single(means[:, 1:]), single(slope)
        # -|w|^2 / 2 is what the log weight needs: the half goes into the whitening.
        self.w = [[single(whitening[:, r, c] * np.sqrt(0.5)) for c in range(r + 1)] for r in range(3)]

    def __call__(self, queries):
        """queries [N, 3], raw; returns mean, variance and log density, each [N]."""
        z = ((queries - self.centre[1:]) / self.scale[1:]).astype(np.float32)
        d = [z[:, j, None] - self.mu[j] for j in range(3)]  # each [N, M]
        w0 = self.w[0][0] * d[0]
        w1 = self.w[1][0] * d[0] + self.w[1][1] * d[1]
        w2 = self.w[2][0] * d[0] + self.w[2][1] * d[1] + self.w[2][2] * d[2]
        log_weight = self.offset - (w0 * w0 + w1 * w1 + w2 * w2)
        largest = log_weight.max(1, keepdims=True)
        share = np.exp(log_weight - largest)
        total = share.sum(1, keepdims=True)
        share /= total
        mean_i = self.output + self.slope[0] * d[0] + self.slope[1] * d[1] + self.slope[2] * d[2]
        mean = np.einsum("nm,nm->n", share, mean_i)
        mean_i -= mean[:, None]
        variance = np.einsum("nm,nm->n", share, self.variance + mean_i * mean_i)
        log_density = largest + np.log(total)
        return mean * self.scale[0] + self.centre[0], variance * self.scale[0] ** 2, log_density[:, 0]


def best_seconds(work, runs):
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def main():
    row, folder = sys.argv[1:]
    regression = Regression(folder)
    queries, wanted = read(folder, "queries", -1, 3), read(folder, "conditionals", -1, 3)
    np.testing.assert_allclose(np.transpose(regression(queries)), wanted, rtol=1e-2, atol=1e-2)

    def blocks(size):
        for k in range(0, len(queries), size):
            regression(queries[k : k + size])

    # Several queries share the overhead of a call until their 5000 weights each leave the cache.
    sizes = (1,) if row == "dgmm_5000_query" else (1, 2, 4, 8, 16, 32)
    per_query_s = min(best_seconds(lambda: blocks(size), 5) for size in sizes) / len(queries)
    print(per_query_s * 1e6 * (1 if row == "dgmm_5000_query" else 100_000))


if __name__ == "__main__":
    main()
