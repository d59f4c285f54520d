#!/usr/bin/env python3
"""How well does a policy do on plants whose unstable modes are more or less alike?

    tools/upright_modes.py POLICY|RUN [--plants 250] [--episodes 5] [--share 0.25] [--seed 5]

Upright, the pendulum has two unstable modes, which grow as exp(a t) and exp(b t); the nearer b/a is to
1, the less one motor can hold both. Plants are drawn from a box of ± SHARE, and evaluated in closed form.
Needs numpy and a built program (./upswing --version).
"""
import argparse
import json
import pathlib
import subprocess

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
NOMINAL = {"mass1": 1, "mass2": 1, "length1": 0.5, "length2": 0.5, "damping1": 0.2, "damping2": 0.2,
           "gravity": 9.81}
ARMATURE, RADIUS = 0.01, 0.04  # kg·m², m; sim/double_pendulum.h
EDGES = [0, 0.7, 0.75, 0.8, 0.85, 0.9, 1]


def inertia_across(m, l):
    """Of a solid capsule (kg·m²); sim/double_pendulum.cc, CapsuleInertia."""
    cylinder, sphere = np.pi * RADIUS**2 * l, 4 / 3 * np.pi * RADIUS**3
    mc = m * cylinder / (cylinder + sphere)
    ms = m - mc
    return (mc * (3 * RADIUS**2 + l**2) / 12
            + ms * (2 * RADIUS**2 / 5 + l**2 / 4 + 3 * l * RADIUS / 8))


def ratio_of_modes(p):
    """Slower over faster rate of growth upright, of M q'' = G q - D q' linearised there."""
    m1, m2, l1, l2, g = p["mass1"], p["mass2"], p["length1"], p["length2"], p["gravity"]
    I1, I2, c1, c2 = inertia_across(m1, l1), inertia_across(m2, l2), l1 / 2, l2 / 2
    m22 = I2 + m2 * c2**2
    m12 = m22 + m2 * l1 * c2
    m11 = I1 + m1 * c1**2 + m22 + m2 * (l1**2 + 2 * l1 * c2)
    M = np.array([[m11 + ARMATURE, m12], [m12, m22 + ARMATURE]])
    G = g * np.array([[m1 * c1 + m2 * (l1 + c2), m2 * c2], [m2 * c2, m2 * c2]])
    D = np.diag([p["damping1"], p["damping2"]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)],
                  [np.linalg.solve(M, G), -np.linalg.solve(M, D)]])
    slower, faster = sorted(w.real for w in np.linalg.eigvals(A) if w.real > 0)
    return slower / faster


def success(policy, plant, episodes):
    plant_options = [word for name, x in plant.items() for word in ("--set", f"{name}={x}")]
    out = subprocess.run([ROOT / "upswing", "--no-setup", "eval", policy, "--physics", "closed-form",
                          "--episodes", str(episodes), "--threads", "1", "--json", *plant_options],
                         check=True, capture_output=True, text=True).stdout
    return json.loads(out)["success_rate"]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policy")
    parser.add_argument("--plants", type=int, default=250)
    parser.add_argument("--episodes", type=int, default=5)
    parser.add_argument("--share", type=float, default=0.25)
    parser.add_argument("--seed", type=int, default=5)
    a = parser.parse_args()
    rng = np.random.default_rng(a.seed)
    rows = []
    for _ in range(a.plants):
        plant = {name: x * (1 + rng.uniform(-a.share, a.share)) for name, x in NOMINAL.items()}
        rows.append((ratio_of_modes(plant), success(a.policy, plant, a.episodes)))
    ratio, rate = np.array(rows).T
    print("ratio of the modes  share of plants  success")
    for low, high in zip(EDGES, EDGES[1:]):
        chosen = (ratio >= low) & (ratio < high)
        text = f"{100 * rate[chosen].mean():5.0f}%" if chosen.any() else "     -"
        print(f"{low:8.2f} to {high:.2f}  {100 * chosen.mean():14.0f}%  {text}")
    print(f"all                {100:14.0f}%  {100 * rate.mean():5.0f}%")


if __name__ == "__main__":
    main()
