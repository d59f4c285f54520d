#!/usr/bin/env python3
"""Writes boxed.json, test data: linear-quadratic problems with a limited torque, solved by SciPy.

    build/scipy/bin/python src/control/testdata/make_boxed.py > src/control/testdata/boxed.json

(make_riccati.py explains build/scipy.) Minimising Σ x' Q x + R u² + x_T' P x_T over |u| ≤ limit is
a bounded least-squares problem in the torques. SciPy solves it by an active-set method (BVLS).
"""

import json

import numpy as np
import scipy
from make_riccati import pendulum
from scipy.linalg import solve_discrete_are
from scipy.optimize import lsq_linear

STEPS = 40


def solve(x0, limit, Q, R):
    A, B = pendulum()
    P = solve_discrete_are(A, B, Q, [[R]])
    # x_t = A^t x0 + Σ A^(t-1-s) B u_s; the square of each row is one term of the cost.
    roots = [np.linalg.cholesky(Q).T] * STEPS + [np.linalg.cholesky(P).T]
    rows, rest = [], []
    free, responses = np.array(x0), np.zeros((4, STEPS))
    for t in range(STEPS + 1):
        rows.append(roots[t] @ responses)
        rest.append(-roots[t] @ free)
        if t < STEPS:
            free, responses = A @ free, A @ responses
            responses[:, t] += B[:, 0]
    rows.append(np.sqrt(R) * np.eye(STEPS))
    rest.append(np.zeros(STEPS))
    found = lsq_linear(np.vstack(rows), np.concatenate(rest), (-limit, limit), method="bvls", tol=1e-15)
    assert found.success
    return {"start": list(x0), "limit": limit, "torques": found.x.tolist(), "cost": 2 * found.cost}


def main():
    Q = np.diag([10.0, 10.0, 1.0, 1.0])
    # Deviations so small that the pendulum is linear to about 1e-8 of them.
    cases = [solve(x0, limit, Q, 1.0)
             for x0 in ([1e-5, 0, 0, 0], [0, 2e-5, 0, 0], [1e-5, -1e-5, 3e-5, 0], [0, 1e-5, 0, -8e-5])
             for limit in (1, 6e-4, 3e-4)]
    print(json.dumps({"made_by": f"scipy {scipy.__version__}, numpy {np.__version__}", "cases": cases}))


if __name__ == "__main__":
    main()
