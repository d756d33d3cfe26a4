#!/usr/bin/python3
"""Golden values of numpy and scipy for golden_test.cpp. `./run oracles` runs this in its own folder.

Inputs are rounded to a few decimals and results to 13 digits, so that every machine writes the same bytes.
"""

import json

import numpy as np
from scipy import interpolate, signal, special

RESULT_DIGITS = 13


def inputs(values, decimals=4):
    return np.round(np.asarray(values, dtype=float), decimals).tolist()


def results(values):
    if np.ndim(values) == 0:
        return float(f"{float(values):.{RESULT_DIGITS}g}")
    return [results(value) for value in values]


def write(name, document):
    with open(name, "w", encoding="ascii") as file:
        json.dump(document, file, indent=1)
        file.write("\n")


def lowpass():
    cases = []
    for cutoff, rate in ((10.0, 1000.0), (10.0, 125.0), (45.0, 100.0), (0.5, 2000.0)):
        b, a = signal.butter(2, cutoff, fs=rate)
        frequencies = [cutoff / 2, cutoff, (cutoff + rate / 2) / 2]
        cases.append({
            "cutoff_Hz": cutoff,
            "sample_rate_Hz": rate,
            "frequencies_Hz": frequencies,
            "gains": results(abs(signal.freqz(b, a, worN=frequencies, fs=rate)[1])),
            "step": results(signal.lfilter(b, a, np.ones(40))),
        })
    return cases


def log_normal(x, mean, covariance):
    off = x - mean
    return -0.5 * (off @ np.linalg.solve(covariance, off) + np.linalg.slogdet(covariance)[1]
                   + len(x) * np.log(2 * np.pi))


def condition(mixture, output, known):
    """Mean, variance and log density of the known quantities: the textbook, component by component."""
    centre, scale = np.array(mixture["centre"]), np.array(mixture["scale"])
    rest = [j for j in range(len(centre)) if j != output]
    z = (known - centre[rest]) / scale[rest]
    logs, means, variances = [], [], []
    for weight, mean, covariance in zip(mixture["weights"], mixture["means"], mixture["covariances"]):
        mean, covariance = np.array(mean), np.array(covariance).reshape(len(centre), -1)
        inner, cross = covariance[np.ix_(rest, rest)], covariance[output, rest]
        logs.append(np.log(weight) + log_normal(z, mean[rest], inner))
        means.append(mean[output] + cross @ np.linalg.solve(inner, z - mean[rest]))
        variances.append(covariance[output, output] - cross @ np.linalg.solve(inner, cross))
    shares = special.softmax(logs)
    mean = shares @ means
    variance = shares @ (variances + (np.array(means) - mean) ** 2)
    return (centre[output] + scale[output] * mean, scale[output] ** 2 * variance, special.logsumexp(logs))


def mixture():
    random = np.random.RandomState(20261121)
    components, dimension = 6, 3
    weights = np.round(random.uniform(0.1, 1.0, components), 4)
    weights = np.round(weights / weights.sum(), 4)
    weights[-1] = np.round(1 - weights[:-1].sum(), 4)
    covariances = []
    for _ in range(components):
        root = 0.4 * random.normal(size=(dimension, dimension))
        covariances.append(inputs(root @ root.T + 0.05 * np.eye(dimension)))
    document = {
        "centre": inputs(random.normal(size=dimension)),
        "scale": inputs(random.uniform(0.2, 40.0, dimension)),
        "weights": weights.tolist(),
        "means": inputs(random.normal(size=(components, dimension))),
        "covariances": [np.ravel(covariance).tolist() for covariance in covariances],
    }
    queries = []
    for output in range(dimension):
        rest = [j for j in range(dimension) if j != output]
        for _ in range(8):
            known = inputs(np.array(document["centre"])[rest]
                           + np.array(document["scale"])[rest] * 1.5 * random.normal(size=dimension - 1))
            mean, variance, log_density = condition(document, output, np.array(known))
            queries.append({"output": output, "inputs": known, "mean": results(mean),
                            "variance": results(variance), "log_density": results(log_density)})
    return {"mixture": document, "queries": queries}


def pchip():
    random = np.random.RandomState(7)
    cases = []
    for knots in (2, 3, 4, 9):
        x = inputs(np.cumsum(random.uniform(0.1, 2.0, knots)))
        y = inputs(random.normal(size=knots) * 10)
        at = inputs(np.linspace(x[0], x[-1], 25)[1:-1])
        cases.append({"knots": x, "values": y, "at": at,
                      "expected": results(interpolate.PchipInterpolator(x, y)(at))})
    return cases


def least_squares():
    random = np.random.RandomState(11)
    features = random.normal(size=(60, 3)) * [0.05, 0.6, 3.0] + [0.01, -0.2, 8.0]
    target = features @ [350.0, -2.5, 0.75] + 4.0 + random.normal(size=60)
    features, target = inputs(features), inputs(target)
    design = np.column_stack([np.ones(60), features])
    return {"features": features, "target": target,
            "coefficients": results(np.linalg.lstsq(design, target, rcond=None)[0])}


write("lowpass.json", lowpass())
write("mixture.json", mixture())
write("pchip.json", pchip())
write("least_squares.json", least_squares())
