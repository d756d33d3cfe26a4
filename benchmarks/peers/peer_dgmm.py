"""Gaussian mixture regression by vectorised numpy: mean, variance and log density of one query.

Usage: OPENBLAS_NUM_THREADS=1 /usr/bin/python3 peer_dgmm.py FOLDER    (FOLDER: torsio_bench --inputs FOLDER)
Prints {"row": value} for torsio_bench --peers.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np


def read(folder, name, *shape):
    return np.fromfile(Path(folder) / f"{name}.f64").reshape(shape)


def regression(weights, means, covariances):
    """Everything that does not depend on the query is computed here, in float32 and input-major order."""
    inner, cross = covariances[:, 1:, 1:], covariances[:, 0, 1:]
    slope = np.linalg.solve(inner, cross[..., None])[..., 0]
    variance = (covariances[:, 0, 0] - (slope * cross).sum(1)).astype(np.float32)
    cholesky = np.linalg.cholesky(inner)
    whitening = np.linalg.inv(cholesky)
    offset = np.log(weights) - np.log(np.diagonal(cholesky, axis1=1, axis2=2)).sum(1) - 1.5 * np.log(2 * np.pi)
    offset = offset.astype(np.float32)
    output = means[:, 0].astype(np.float32)
    mu = np.ascontiguousarray(means[:, 1:].T.astype(np.float32))
    slope = np.ascontiguousarray(slope.T.astype(np.float32))
    w = [[np.ascontiguousarray(whitening[:, r, c].astype(np.float32)) for c in range(r + 1)] for r in range(3)]

    def query(z):
        d = z[:, None] - mu
        w0 = w[0][0] * d[0]
        w1 = w[1][0] * d[0] + w[1][1] * d[1]
        w2 = w[2][0] * d[0] + w[2][1] * d[1] + w[2][2] * d[2]
        log_weight = offset - np.float32(0.5) * (w0 * w0 + w1 * w1 + w2 * w2)
        largest = log_weight.max()
        share = np.exp(log_weight - largest)
        total = share.sum()
        share /= total
        mean_i = output + slope[0] * d[0] + slope[1] * d[1] + slope[2] * d[2]
        mean = share @ mean_i
        centred = mean_i - mean
        return mean, share @ (variance + centred * centred), largest + np.log(total)

    return query


def main():
    folder = sys.argv[1]
    weights = np.fromfile(Path(folder) / "weights.f64")
    m = len(weights)
    means, covariances = read(folder, "means", m, 4), read(folder, "covariances", m, 4, 4)
    centre, scale = read(folder, "centre", 4), read(folder, "scale", 4)
    queries = ((read(folder, "queries", -1, 3) - centre[1:]) / scale[1:]).astype(np.float32)
    query = regression(weights, means, covariances)
    best = np.inf
    for _ in range(7):
        start = time.perf_counter()
        for z in queries[:1000]:
            query(z)
        best = min(best, time.perf_counter() - start)
    per_query_s = best / 1000
    json.dump({"dgmm_5000_query": per_query_s * 1e6, "dgmm_100k_batch": per_query_s * 1e5}, sys.stdout)
    print()


if __name__ == "__main__":
    main()
