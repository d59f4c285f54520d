#!/usr/bin/env python3
"""How well do policies do on plants that are harder or easier to hold upright?

    tools/upright_modes.py POLICY|RUN ... [--episodes 1000] [--share 0.25] [--seed 1] [--physics mujoco]

Where delta (docs/control.md) is 0, no torque reaches one of the two modes in which the upright pendulum
falls. Each episode has a plant from a box of ± SHARE, as in `upswing eval --randomize`. Needs
a built program (./upswing --version).
"""
import argparse
import csv
import math
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
EDGES = [0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, math.inf]


def episodes(policy, a):
    """|delta| and success of each."""
    words = ["--randomize", a.share, "--episodes", a.episodes, "--seed", a.seed, "--physics", a.physics,
             "--episodes-csv", "-"]
    out = subprocess.run([ROOT / "upswing", "--no-setup", "eval", policy, *map(str, words)], check=True,
                         stdout=subprocess.PIPE, text=True).stdout
    rows = [{name: float(text or "nan") for name, text in row.items()}
            for row in csv.DictReader(out.splitlines())]
    return [(abs(row["delta"]), row["success"]) for row in rows]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policies", nargs="+", metavar="policy")
    parser.add_argument("--episodes", type=int, default=1000)
    parser.add_argument("--share", type=float, default=0.25)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--physics", default="mujoco")
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
