#!/usr/bin/env python3
"""Writes riccati.json, test data: SciPy's solutions of discrete algebraic Riccati equations.

    python3 -m venv build/scipy
    build/scipy/bin/pip install numpy==2.4.6 scipy==1.17.1
    build/scipy/bin/python src/control/testdata/make_riccati.py > src/control/testdata/riccati.json

The tests need only the file. SciPy solves by the QZ algorithm, not by doubling. Its P are off by at
most 2e-10 of their norm, compared with mpmath in 60 digits. This script derives the pendulum's
model a second time, in absolute angles, with the torque held exactly over 0.02 s.
"""

import json

import numpy as np
import scipy
from scipy.linalg import eigvals, expm, solve, solve_discrete_are

ARMATURE, RADIUS, PERIOD = 0.01, 0.04, 0.02  # kg·m², m, s
NOMINAL = {"mass1": 1.0, "mass2": 1.0, "length1": 0.5, "length2": 0.5,
           "damping1": 0.2, "damping2": 0.2, "gravity": 9.81}


def capsule_inertia(m, l):
    """Moment of inertia across the axis, about the centre (kg·m²)."""
    cylinder, ball = RADIUS**2 * l, 4 / 3 * RADIUS**3
    mc, mb = m * cylinder / (cylinder + ball), m * ball / (cylinder + ball)
    half = mb / 2 * (83 / 320 * RADIUS**2 + (l / 2 + 3 / 8 * RADIUS)**2)
    return mc * (RADIUS**2 / 4 + l**2 / 12) + 2 * half


def pendulum(**changes):
    """A, B (x = [q1 - π, q2, w1, w2]) over one control period about upright."""
    p = {**NOMINAL, **changes}
    m1, m2, l1, l2, g = p["mass1"], p["mass2"], p["length1"], p["length2"], p["gravity"]
    # Absolute angles φ from upright; joint velocities w1 = φ1', w2 = φ2' - φ1'.
    M = np.array([[capsule_inertia(m1, l1) + m1 * l1**2 / 4 + m2 * l1**2 + 2 * ARMATURE,
                   m2 * l1 * l2 / 2 - ARMATURE],
                  [m2 * l1 * l2 / 2 - ARMATURE,
                   capsule_inertia(m2, l2) + m2 * l2**2 / 4 + ARMATURE]])
    G = np.diag([(m1 * l1 / 2 + m2 * l1) * g, m2 * l2 / 2 * g])
    D = np.array([[p["damping1"] + p["damping2"], -p["damping2"]], [-p["damping2"], p["damping2"]]])
    F = np.zeros((5, 5))
    F[:2, 2:4] = np.eye(2)
    F[2:4] = np.hstack([solve(M, G), -solve(M, D), solve(M, [[1.0], [0.0]])])
    held = expm(PERIOD * F)
    T = np.kron(np.eye(2), [[1.0, 0.0], [-1.0, 1.0]])  # x = T [φ1, φ2, φ1', φ2']
    return T @ held[:4, :4] @ np.linalg.inv(T), T @ held[:4, 4:]


def drawn(rng, n, m, growth):
    """A system of n states and m inputs whose largest |eigenvalue| is `growth`."""
    A = rng.normal(size=(n, n))
    return A * growth / np.abs(np.linalg.eigvals(A)).max(), rng.normal(size=(n, m))


def case(name, A, B, Q, R):
    Q, R = np.atleast_2d(Q), np.atleast_2d(R)
    P = solve_discrete_are(A, B, Q, R)
    K = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    lists = {key: x.tolist() for key, x in {"A": A, "B": B, "Q": Q, "R": R, "P": P}.items()}
    return {"name": name, **lists, "spectral_radius": np.abs(eigvals(A - B @ K)).max()}


def main():
    rng = np.random.default_rng(1)
    acrobot = np.diag([10.0, 10.0, 1.0, 1.0])
    cases = [case("pendulum", *pendulum(), acrobot, 1),
             case("pendulum, dear torque", *pendulum(), acrobot, 100),
             case("pendulum, cheap torque", *pendulum(), acrobot, 0.01),
             case("pendulum, angle of link 1 alone", *pendulum(), np.diag([1.0, 0, 0, 0]), 1),
             case("heavy link 2", *pendulum(mass2=3.0), acrobot, 1),
             case("no damping", *pendulum(damping1=0.0, damping2=0.0), acrobot, 1)]
    for n, m, growth in [(1, 1, 2), (2, 1, 0.9), (3, 2, 1.1), (4, 1, 1.3), (5, 3, 1.5), (6, 6, 3)]:
        A, B = drawn(rng, n, m, growth)
        root = rng.normal(size=(n, n))
        cases.append(case(f"drawn, {n} states, {m} inputs", A, B, root @ root.T, np.eye(m)))
    # A delay of two steps: A is singular.
    delay = np.array([[1.2, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    cases.append(case("delay", delay, np.array([[0.0], [0.0], [1.0]]), np.eye(3), 1))
    made_by = f"scipy {scipy.__version__}, numpy {np.__version__}"
    print(json.dumps({"made_by": made_by, "cases": cases}))


if __name__ == "__main__":
    main()
