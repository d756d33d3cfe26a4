#!/usr/bin/python3
"""Golden values of scikit-learn for gaussian_process_golden_test.cpp. `./run oracles` runs this in its own folder.

Inputs are rounded to a few decimals and results to 10 digits, so that every machine writes the same bytes.
"""

import json
import warnings

import numpy as np
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import (RBF, ConstantKernel, DotProduct, ExpSineSquared, Matern,
                                              RationalQuadratic, WhiteKernel)

RESULT_DIGITS = 10


def inputs(values):
    return np.round(np.asarray(values, dtype=float), 4).tolist()


def results(values):
    if np.ndim(values) == 0:
        return float(f"{float(values):.{RESULT_DIGITS}g}")
    return [results(value) for value in values]


def scaled(amplitude, kernel):
    return ConstantKernel(amplitude**2) * kernel


# Our text, the numbers of each of its leaves in order (amplitude, length scales, shape; None: not used), theirs.
def cases():
    yield 2, "se", [(1.3, [0.7], None)], scaled(1.3, RBF(0.7))
    yield 2, "se_ard", [(0.8, [0.5, 1.9], None)], scaled(0.8, RBF([0.5, 1.9]))
    yield 2, "matern32_ard", [(1.1, [1.5, 0.9], None)], scaled(1.1, Matern([1.5, 0.9], nu=1.5))
    yield 2, "matern52", [(1.2, [1.4], None)], scaled(1.2, Matern(1.4, nu=2.5))
    yield 2, "rq", [(0.9, [1.2], 0.7)], scaled(0.9, RationalQuadratic(1.2, alpha=0.7))
    yield 1, "periodic", [(1.2, [1.3], 2.1)], scaled(1.2, ExpSineSquared(1.3, 2.1))
    yield (2, "linear+se", [(1.0, [2.5], 0.0), (0.6, [0.8], None)],
           ConstantKernel(2.5**-2) * DotProduct(0.0, "fixed") + scaled(0.6, RBF(0.8)))
    yield (1, "se*(linear+periodic*rq)",
           [(1.0, [1.7], None), (1.0, [1.4], 0.0), (0.8, [1.3], 2.1), (1.0, [0.9], 1.4)],
           RBF(1.7) * (ConstantKernel(1.4**-2) * DotProduct(0.0, "fixed")
                       + scaled(0.8, ExpSineSquared(1.3, 2.1)) * RationalQuadratic(0.9, alpha=1.4)))


def fixed(random):
    documents = []
    for dimension, text, numbers, kernel in cases():
        x = np.array(inputs(random.normal(size=(40, dimension))))
        y = np.array(inputs(np.sin(2 * x[:, 0]) + 0.2 * random.normal(size=40)))
        at = np.array(inputs(1.2 * random.normal(size=(12, dimension))))
        noise = 0.03
        process = GaussianProcessRegressor(kernel, alpha=noise, optimizer=None).fit(x, y)
        mean, deviation = process.predict(at, return_std=True)
        documents.append({
            "kernel": text, "noise_variance": noise,
            "nodes": [{"amplitude": a, "length_scales": scales, "shape": shape} for a, scales, shape in numbers],
            "points": x.tolist(), "target": y.tolist(), "at": at.tolist(), "mean": results(mean),
            "std_dev": results(np.sqrt(deviation**2 + noise)),  # theirs is without the noise of alpha
            "log_likelihood": results(process.log_marginal_likelihood_value_)})
    return documents


def optimised(random):
    """Their best of ten starts: what ours must reach."""
    warnings.simplefilter("ignore")  # a number at its bound
    documents = []
    for text, kernel in (("se_ard", ConstantKernel(1.0) * RBF([1.0, 1.0])),
                         ("matern52", ConstantKernel(1.0) * Matern(1.0, nu=2.5)),
                         ("se+rq", ConstantKernel(1.0) * RBF(1.0) + ConstantKernel(1.0) * RationalQuadratic(1.0))):
        x = np.array(inputs(random.uniform(-2, 2, size=(120, 2))))
        y = np.sin(3 * x[:, 0]) + 0.5 * np.tanh(4 * x[:, 1]) + 0.1 * random.normal(size=120)
        x = (x - x.mean(0)) / x.std(0)
        y = (y - y.mean()) / y.std()
        process = GaussianProcessRegressor(kernel + WhiteKernel(0.01, (1e-6, 10)), alpha=0.0,
                                           n_restarts_optimizer=9, random_state=1).fit(x, y)
        documents.append({"kernel": text, "points": results(x), "target": results(y),
                          "log_likelihood": round(process.log_marginal_likelihood_value_, 3)})
    return documents


def main():
    random = np.random.RandomState(20261122)
    document = {"fixed": fixed(random), "optimised": optimised(random)}
    with open("gaussian_process.json", "w", encoding="ascii") as file:
        json.dump(document, file)
        file.write("\n")


main()
