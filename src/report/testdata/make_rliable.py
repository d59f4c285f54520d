#!/usr/bin/env python3
"""Writes rliable.json: figures of rliable, the code of Agarwal et al. (2021), for our tests.

    python3 -m venv build/rliable
    build/rliable/bin/pip install --no-deps rliable==1.2.0
    build/rliable/bin/pip install numpy==1.26.4 scipy==1.11.4 arch==5.6.0 pandas==2.1.4 absl-py
    build/rliable/bin/python src/report/testdata/make_rliable.py > src/report/testdata/rliable.json

The tests need nothing but the file. An interval is the mean over REPEATS bootstraps, with the
largest distance of any one of them from it: how far chance alone moves an end.
"""

import json
import sys

import numpy as np
from rliable import library, metrics

REPEATS = 5
RESAMPLES = 2000


def interval(scores, function):
    """Mean ends of the 95% interval over several bootstraps, and their largest deviation."""
    ends = []
    for seed in range(REPEATS):
        np.random.seed(seed)  # rliable draws from NumPy's global stream
        _, estimates = library.get_interval_estimates(
            {"scores": scores}, lambda *s: np.array([function(*s)]), reps=RESAMPLES)
        ends.append(estimates["scores"][:, 0])
    mean = np.mean(ends, axis=0)
    return {"interval": mean.tolist(), "spread": float(np.abs(np.array(ends) - mean).max())}


def case(x, y):
    """Both agents' scores, (runs × tasks), and what rliable makes of them."""
    return {
        "x": x.T.tolist(), "y": y.T.tolist(),  # a list for each task
        "iqm": {"value": float(metrics.aggregate_iqm(x)), **interval(x, metrics.aggregate_iqm)},
        "difference": {
            "value": float(metrics.aggregate_iqm(x) - metrics.aggregate_iqm(y)),
            **interval([x, y],
                       lambda a, b: metrics.aggregate_iqm(a) - metrics.aggregate_iqm(b))},
        "improvement": {
            "value": float(metrics.probability_of_improvement(x, y)),
            **interval([x, y], metrics.probability_of_improvement)},
    }


def main():
    random = np.random.default_rng(1)
    cases = [
        case(random.lognormal(3, 0.4, (5, 1)), random.lognormal(3.2, 0.4, (5, 1))),
        case(random.normal(2600, 80, (10, 1)), random.normal(2550, 60, (7, 1))),
        case(random.integers(0, 5, (8, 3)).astype(float),  # three tasks, many ties
             random.integers(0, 5, (6, 3)).astype(float)),
        case(random.exponential(1, (23, 1)), random.exponential(1, (23, 1)) ** 2),
    ]
    json.dump({"resamples": RESAMPLES, "cases": cases}, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
