#!/usr/bin/env python3
"""Shows the success of policies on plants that are easier or harder to hold upright.

    tools/results/upright_modes.py POLICY|RUN|'CONTROLLER FLAGS' ... [--episodes 1000] [--share 0.25] [--seed 1]
        [--physics mujoco] [--figure FILE.svg|FILE.png]
    tools/results/upright_modes.py runs/d3qn-adaptive-seed1 'mpc --known-plant' --figure delta.svg

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

from seeds.wilson import wilson

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


def name_of(policy):
    """A label such as d3qn-adaptive-seed1 or mpc --known-plant."""
    return policy if " " in policy else pathlib.Path(policy.removesuffix("/policy.safetensors")).stem


def plot(policies, results, file):
    """Success over |delta|, with Wilson's 95% interval, by gnuplot."""
    lines = [f"set terminal {'svg' if file.endswith('.svg') else 'pngcairo'} size 900,460 font 'sans,12' "
             "background 'white'", f"set output '{file}'", "set yrange [0:103]", "set ylabel 'success (%)'",
             "set xlabel '|δ| of the plant'", "set grid lt 1 lw 1 lc rgb '#d0d0d0'",
             "set key bottom right samplen 2", f"set xrange [-0.5:{len(EDGES) - 1.5}]",
             "set xtics (" + ", ".join(
                 f"'{low:g} to {high:g}' {k}" if high < math.inf else f"'above {low:g}' {k}"
                 for k, (low, high) in enumerate(zip(EDGES, EDGES[1:]))) + ")"]
    curves = []
    for k, (policy, result) in enumerate(zip(policies, results)):
        points = []
        for at, (low, high) in enumerate(zip(EDGES, EDGES[1:])):
            chosen = [success for size, success in result if low <= size < high]
            if not chosen:
                continue
            shares = sum(chosen) / len(chosen), *wilson(sum(chosen), len(chosen))
            x = at + 0.12 * (k - (len(policies) - 1) / 2)
            points.append(" ".join(str(number) for number in (x, *(100 * share for share in shares))))
        color = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"][k % 5]
        lines.append(f"$d{k} << EOD\n" + "\n".join(points) + "\nEOD")
        curves.append(f"$d{k} with yerrorlines pt 7 ps 0.8 lw 2 lc rgb '{color}' "
                      f"title \"{name_of(policy)}\"")
    lines.append("plot " + ", ".join(curves))
    subprocess.run(["gnuplot"], input="\n".join(lines) + "\n", text=True, check=True)


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
    parser.add_argument("--figure", help="figure to draw with gnuplot: success over |delta|, with 95%% intervals")
    a = parser.parse_args()
    results = [episodes(policy, a) for policy in a.policies]
    print("|delta|       plants  success")
    for low, high in zip([*EDGES[:-1], 0], [*EDGES[1:], math.inf]):
        chosen = [[success for size, success in result if low <= size < high] for result in results]
        shares = "  ".join(f"{100 * sum(each) / len(each):6.1f}%" if each else "      -"
                           for each in chosen)
        print(f"{low:4.2f} to {high:4.2f}  {len(chosen[0]):6}  {shares}")
    if a.figure:
        plot(a.policies, results, a.figure)


if __name__ == "__main__":
    main()
