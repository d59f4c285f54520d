#!/usr/bin/env python3
"""Shows how often a study with few seeds comes to a wrong conclusion.

    ./upswing study configs/studies/how-many-seeds.toml
    ./upswing python tools/results/seeds/how_many.py runs/how-many-seeds --out docs/figures/seeds

Treats a study with very many seeds as the truth, draws small studies from it many times, and counts
their conclusions: the better agent is better, the worse agent is better, or undecided. Writes seeds.csv
and, with gnuplot, SCORE.svg and SCORE.png for each score.
"""

import argparse
import csv
import math
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

# A statistic compares two samples x and y (draws × n): -1, 0, 1 for x smaller, undecided, larger.
LEVEL = 0.05


def interquartile_mean(x):
    """The interquartile mean over the last axis, as docs/results/seeds.md defines it."""
    cut = x.shape[-1] // 4
    return np.sort(x, axis=-1)[..., cut:x.shape[-1] - cut].mean(axis=-1)


def by(figure):
    """The sign of a figure's difference, as in a paper that reports bare numbers."""
    return lambda x, y, rng: np.sign(figure(x) - figure(y))


def welch(x, y, _rng):
    """Welch's t test at 5%, two-sided."""
    n = x.shape[-1]
    vx, vy = x.var(axis=-1, ddof=1) / n, y.var(axis=-1, ddof=1) / n
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (x.mean(axis=-1) - y.mean(axis=-1)) / np.sqrt(vx + vy)
        freedom = (vx + vy) ** 2 / ((vx ** 2 + vy ** 2) / (n - 1))
    return np.sign(t) * (two_sided_t(np.nan_to_num(np.abs(t)), np.nan_to_num(freedom, nan=1)) < LEVEL)


def effect(x, y):
    """Cohen's d: the difference of the means over the standard deviation within the groups."""
    return (x.mean() - y.mean()) / math.sqrt((x.var(ddof=1) + y.var(ddof=1)) / 2)


def seeds_for(d):
    """Number of seeds per agent with which a test at 5% finds an effect of size d in 80% of the
    studies."""
    return math.ceil(2 * (1.959963984540054 + 0.8416212335729143) ** 2 / max(d * d, 1e-12)) + 1


def two_sided_t(t, freedom):
    """P(|T| > t) by Simpson's rule over the angle θ = atan(t / √ν), where T's density is cos^(ν-1) θ."""
    steps = 400
    theta = np.arctan(t / np.sqrt(freedom))[..., None] * np.linspace(0, 1, steps + 1)
    weights = np.ones(steps + 1)
    weights[1:-1:2], weights[2:-1:2] = 4, 2
    inside = (np.cos(theta) ** (freedom[..., None] - 1) * weights).sum(-1) * theta[..., -1] / steps / 3
    whole = np.vectorize(
        lambda v: math.sqrt(math.pi) / 2 * math.exp(math.lgamma(v / 2) - math.lgamma((v + 1) / 2)))
    return 1 - inside / whole(freedom)


def mann_whitney(x, y, _rng):
    """Mann and Whitney's U test at 5%, two-sided: normal approximation, corrected for ties."""
    n, m = x.shape[-1], y.shape[-1]
    greater = (x[:, :, None] > y[:, None, :]).sum((1, 2)) + (x[:, :, None] == y[:, None, :]).sum((1, 2)) / 2
    both = np.sort(np.concatenate([x, y], axis=-1), axis=-1)
    ties = np.array([sum(k ** 3 - k for k in np.unique(row, return_counts=True)[1]) for row in both])
    total = n + m
    variance = n * m / 12 * (total + 1 - ties / (total * (total - 1)))
    off = greater - n * m / 2
    z = np.maximum(np.abs(off) - 0.5, 0) / np.sqrt(np.maximum(variance, 1e-12))
    return np.sign(off) * (z > 1.959963984540054)


def interval(a, b, rng, resamples=1000):
    """The 95% interval of the difference of two groups' IQMs, by a percentile bootstrap."""
    drawn = (interquartile_mean(a[rng.integers(len(a), size=(resamples, len(a)))])
             - interquartile_mean(b[rng.integers(len(b), size=(resamples, len(b)))]))
    return np.quantile(drawn, [0.025, 0.975])


def bootstrap(x, y, rng):
    """Whether the 95% interval of the difference of IQMs excludes 0."""
    low, high = np.array([interval(a, b, rng) for a, b in zip(x, y)]).T
    return np.where(low > 0, 1, np.where(high < 0, -1, 0))


STATISTICS = {
    "mean": by(lambda x: x.mean(axis=-1)),
    "median": by(lambda x: np.median(x, axis=-1)),
    "IQM": by(interquartile_mean),
    "Welch's t, 5%": welch,
    "Mann-Whitney, 5%": mann_whitney,
    "bootstrap of IQM, 95%": bootstrap,
}


def read(folder, column):
    """The scores of each group. An unsolved run counts with all its steps."""
    groups = defaultdict(list)
    try:
        with open(folder / "runs.csv", newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                score = float(row[column])
                groups[row["group"]].append(score if math.isfinite(score) else float(row["steps"]))
    except (OSError, KeyError, ValueError) as error:
        sys.exit(f"how_many: {folder}/runs.csv: expected the table of a study with a column {column}: "
                 f"{error}")
    return {name: np.array(scores) for name, scores in groups.items()}


def samples(scores, n, draws, rng):
    """Draws studies of n different seeds (draws × n)."""
    return np.array([scores[rng.choice(len(scores), n, replace=False)] for _ in range(draws)])


def count(x, y, truth, a):
    """A row for each size and statistic: shares of right, undecided and wrong conclusions."""
    for n in a.sizes:
        rng = np.random.default_rng(1)
        if truth == 0:  # the same agent: two samples without a common seed
            both = samples(x, 2 * n, a.draws, rng)
            left, right = both[:, :n], both[:, n:]
        else:
            left, right = samples(x, n, a.draws, rng), samples(y, n, a.draws, rng)
        for name, statistic in STATISTICS.items():
            said = statistic(left, right, rng)
            yield n, name, (said == truth).mean() if truth else 0.0, (said == 0).mean(), (
                (said == -truth).mean() if truth else (said != 0).mean())


def plot(rows, groups, a, file):
    """The share of wrong conclusions over the number of seeds, a panel for each comparison."""
    columns = 3
    layout = f"{math.ceil(len(groups) / columns)},{columns}"
    lines = [f"set terminal {'svg' if file.suffix == '.svg' else 'pngcairo'} size 1200,"
             f"{320 * math.ceil(len(groups) / columns)} font 'sans,12' background 'white'",
             f"set output '{file}'", f"set multiplot layout {layout}", "set logscale x",
             f"set xtics ({', '.join(map(str, a.sizes))})", "set yrange [0:50]",
             f"set xrange [{0.8 * min(a.sizes)}:{1.25 * max(a.sizes)}]",
             "set xlabel 'seeds of each agent'", "set ylabel 'wrong conclusions (%)'",
             "set grid lt 1 lw 1 lc rgb '#d0d0d0'", "set key top right samplen 2 spacing 0.9"]
    colors = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"]
    for index, group in enumerate(groups):
        title = group if index == 0 else f"{a.baseline} or {group}"
        lines += [f"set title '{title}'", "unset key" if index else ""]
        curves = []
        for color, name in zip(colors, STATISTICS):
            points = "\n".join(f"{r[1]} {100 * r[5]}" for r in rows if r[0] == group and r[2] == name)
            lines.append(f"$d{len(curves)} << EOD\n{points}\nEOD")
            curves.append(f"$d{len(curves)} with linespoints pt 7 ps 0.5 lw 2 lc rgb '{color}' "
                          f"title \"{name}\"")
        lines.append("plot " + ", ".join(curves))
    subprocess.run(["gnuplot"], input="\n".join(lines) + "\n", text=True, check=True)


def compare(groups, score, a):
    """Prints and returns the rows of all comparisons with the baseline."""
    if a.baseline not in groups:
        sys.exit(f"how_many: --baseline: expected one of {', '.join(groups)}, got {a.baseline}")
    for name, scores in groups.items():
        if len(scores) < 2 * max(a.sizes):
            sys.exit(f"how_many: {name}: expected at least {2 * max(a.sizes)} runs, got {len(scores)}")
    base = groups.pop(a.baseline)
    print(f"{score}: {a.baseline}: IQM {interquartile_mean(base):,.6g} over {len(base)} seeds, "
          f"standard deviation {base.std(ddof=1):,.6g}\n")
    rows = []
    for name, scores in [(f"{a.baseline} against itself", base), *groups.items()]:
        difference = interquartile_mean(scores) - interquartile_mean(base)
        print(f"{name}: IQM {interquartile_mean(scores):,.6g}", end="")
        if scores is not base:
            low, high = interval(scores, base, np.random.default_rng(1))
            d = effect(scores, base)
            print(f", {difference:+,.6g} (95% interval {low:+,.6g} to {high:+,.6g}); d = {d:.2f}: for 80% "
                  f"right Welch's t needs some {seeds_for(d):,} seeds", end="")
        print(f"\n  {'seeds':>5}  {'statistic':<24}{'right':>8}{'undecided':>11}{'wrong':>8}")
        for n, statistic, right, undecided, wrong in count(base, scores, -np.sign(difference), a):
            rows.append((name, n, statistic, right, undecided, wrong))
            print(f"  {n:>5}  {statistic:<24}{right:>8.1%}{undecided:>11.1%}{wrong:>8.1%}")
        print()
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of a study, with runs.csv")
    parser.add_argument("--baseline", default="fast", help="group that the others are compared with (default fast)")
    parser.add_argument("--scores", default="solve_steps,best_return", help="columns of runs.csv (default solve_steps,best_return)")
    parser.add_argument("--sizes", default="3,5,10,30,100", help="seeds per small study (default 3,5,10,30,100)")
    parser.add_argument("--draws", type=int, default=2000, help="number of small studies per size (default 2000)")
    parser.add_argument("--out", type=Path, help="folder for seeds.csv and the figures")
    a = parser.parse_args()
    a.sizes = [int(n) for n in a.sizes.split(",")]
    a.scores = a.scores.split(",")
    rows = {score: compare(read(a.folder, score), score, a) for score in a.scores}
    if a.out:
        a.out.mkdir(parents=True, exist_ok=True)
        with open(a.out / "seeds.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["score", "comparison", "seeds", "statistic", "right", "undecided", "wrong"])
            writer.writerows((score, *row) for score in a.scores for row in rows[score])
        for score in a.scores:
            groups = list(dict.fromkeys(row[0] for row in rows[score]))
            for ending in ("svg", "png"):
                plot(rows[score], groups, a, a.out / f"{score}.{ending}")


if __name__ == "__main__":
    main()
