#!/usr/bin/env python3
"""Shows the success of policies on plants that are easier or harder to hold upright.

    tools/results/upright_modes.py POLICY|RUN|'CONTROLLER FLAGS' ... [--episodes 1000] [--share 0.25] [--seed 1]
        [--physics mujoco]
    tools/results/upright_modes.py runs/d3qn-adaptive-seed1 'mpc --known-plant'

With delta = 0, no torque reaches one of the two modes in which the upright pendulum falls. Each episode
draws its plant from a box of ± SHARE, as `upswing eval --randomize` does. Needs a built program
(./upswing --version).
"""
import argparse
import csv
import math
import pathlib
import shlex
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
EDGES = [0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, math.inf]


def episodes(policy, a):
    """|delta| and success of each episode."""
    words = ["--randomize", a.share, "--episodes", a.episodes, "--seed", a.seed, "--physics", a.physics,
             "--episodes-csv", "-"]
    out = subprocess.run([ROOT / "upswing", "--no-setup", "eval", *shlex.split(policy), *map(str, words)],
                         check=True, stdout=subprocess.PIPE, text=True).stdout
    rows = [{name: float(text or "nan") for name, text in row.items()}
            for row in csv.DictReader(out.splitlines())]
    return [(abs(row["delta"]), row["success"]) for row in rows]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policies", nargs="+", metavar="policy",
                        help="policy file, run folder or 'CONTROLLER FLAGS'")
    parser.add_argument("--episodes", type=int, default=1000,
                        help="number of episodes per policy (default 1000)")
    parser.add_argument("--share", type=float, default=0.25,
                        help="half-width of the box of plants (default 0.25)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the episodes (default 1)")
    parser.add_argument("--physics", default="mujoco",
                        help="mujoco or closed-form (default mujoco)")
    a = parser.parse_args()
    results = [episodes(policy, a) for policy in a.policies]
    print("|delta|       plants  success")
    for low, high in zip([*EDGES[:-1], 0], [*EDGES[1:], math.inf]):
        chosen = [[success for size, success in result if low <= size < high] for result in results]
        shares = "  ".join(f"{100 * sum(each) / len(each):6.1f}%" if each else "      -"
                           for each in chosen)
        print(f"{low:4.2f} to {high:4.2f}  {len(chosen[0]):6}  {shares}")


if __name__ == "__main__":
    main()
