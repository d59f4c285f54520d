#!/usr/bin/env python3
"""Shows the distribution of results over very many seeds of one agent.

    ./upswing study configs/studies/ten-thousand.toml
    ./upswing python tools/results/seeds/distribution.py runs/ten-thousand --out docs/figures/seeds

Prints the share of seeds that solve the task with its 95% interval, and quantiles of steps and
return. Writes GROUP.csv, a row for each seed, and histograms by gnuplot, GROUP.svg and GROUP.png.
"""

import argparse
import csv
import math
import subprocess
import sys
from pathlib import Path

import numpy as np

from wilson import wilson

QUANTILES = [0, 0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999, 1]
COLUMNS = {"solve_steps": "steps until solved", "best_return": "return of the best policy",
           "final_return": "return at the end", "final_success": "success at the end"}


def read(folder, group):
    """The columns of each seed of the group; NaN if the seed never solved the task."""
    try:
        with open(folder / "runs.csv", newline="", encoding="utf-8") as file:
            rows = [row for row in csv.DictReader(file) if row["group"] == group]
            seeds = np.array([int(row["seed"]) for row in rows])
            values = {name: np.array([float(row[name]) for row in rows]) for name in COLUMNS}
    except (OSError, KeyError, ValueError) as error:
        sys.exit(f"distribution: {folder}/runs.csv: expected the table of a study: {error}")
    if not rows:
        sys.exit(f"distribution: {folder}/runs.csv: expected runs of {group}, found none")
    return seeds, values


def show(seeds, values):
    solved = int(np.isfinite(values["solve_steps"]).sum())
    low, high = wilson(solved, len(seeds))
    print(f"{solved:,} of {len(seeds):,} solve the task: {solved / len(seeds):.4%} "
          f"(95% interval {low:.4%} to {high:.4%})")
    if solved < len(seeds):
        print("not solved:", *seeds[~np.isfinite(values["solve_steps"])])
    print(f"{'':26}" + "".join(f"{q:>9.1%}" for q in QUANTILES))
    for name, title in COLUMNS.items():
        numbers = values[name][np.isfinite(values[name])]
        print(f"{title:<26}" + "".join(
            f"{x:>9,.{2 if x < 100 else 0}f}" for x in np.quantile(numbers, QUANTILES)))


def write(seeds, values, file):
    with open(file, "w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out)
        writer.writerow(["seed", "solve_steps", "best_return", "final_return", "final_success"])
        for k, seed in enumerate(seeds):
            steps = values["solve_steps"][k]
            writer.writerow([seed, int(steps) if math.isfinite(steps) else "",
                             *(f"{values[name][k]:.0f}" for name in ("best_return", "final_return")),
                             f"{values['final_success'][k]:g}"])


def plot(seeds, values, title, file):
    """Histograms of steps and return. Counts have a logarithmic axis, which shows the tails."""
    lines = [f"set terminal {'svg' if file.suffix == '.svg' else 'pngcairo'} size 1200,420 "
             "font 'sans,12' background 'white'", f"set output '{file}'",
             f"set multiplot layout 1,2 title \"{title}: {len(seeds):,} seeds\"",
             "set grid lt 1 lw 1 lc rgb '#d0d0d0'", "set logscale y", "set ylabel 'seeds'",
             "set style fill solid", "unset key", "set yrange [0.7:*]", "set xtics rotate by 0"]
    for name, scale, unit in (("solve_steps", 1e-3, "steps until solved (thousands)"),
                              ("best_return", 1, "return of the best policy")):
        numbers = values[name][np.isfinite(values[name])] * scale
        counts, edges = np.histogram(numbers, bins=60)
        points = "\n".join(f"{(a + b) / 2} {n}" for a, b, n in zip(edges, edges[1:], counts) if n)
        lines += [f"set boxwidth {edges[1] - edges[0]}", f"set xlabel '{unit}'",
                  f"$data << EOD\n{points}\nEOD", "plot $data with boxes lc rgb '#0072B2'"]
    subprocess.run(["gnuplot"], input="\n".join(lines) + "\n", text=True, check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of a study, with runs.csv")
    parser.add_argument("--group", default="fast", help="agent or variant (default fast)")
    parser.add_argument("--out", type=Path, help="folder for the table and the figures")
    a = parser.parse_args()
    seeds, values = read(a.folder, a.group)
    show(seeds, values)
    if a.out:
        a.out.mkdir(parents=True, exist_ok=True)
        write(seeds, values, a.out / f"{a.group}.csv")
        for ending in ("svg", "png"):
            plot(seeds, values, a.group, a.out / f"{a.group}.{ending}")


if __name__ == "__main__":
    main()
