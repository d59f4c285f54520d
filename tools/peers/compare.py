#!/usr/bin/env python3
"""Measures trainings of SAC and PPO with Upswing and RLtools in turns, and prints a table.

  tools/peers/compare.py              five rounds, about five minutes
  tools/peers/compare.py --rounds 2
  UPSWING_VECTORS=avx2 tools/peers/compare.py     both sides without AVX-512

Both learn Pendulum-v1 on one thread. The seed is the number of the round. A ratio is the median of the
rounds' ratios, so that load on both sides of a round cancels out. The first call installs RLtools into
build/rltools-venv.
"""

import argparse
import json
import shutil
import statistics
import sys
from pathlib import Path

import actors

HERE = Path(__file__).resolve().parent
VENV = actors.ROOT / "build/rltools-venv"
PYTHON = VENV / "bin/python"


def install():
    """Makes RLtools' virtual environment unless it already has its requirements."""
    requirements = HERE / "requirements-rltools.txt"
    wanted, done = requirements.read_text(encoding="utf-8"), VENV / "installed.txt"
    if done.is_file() and done.read_text(encoding="utf-8") == wanted:
        return
    print(f"installing {requirements.name} into {VENV}", file=sys.stderr)
    actors.run([sys.executable, "-m", "venv", "--clear", VENV])
    actors.run([PYTHON, "-m", "pip", "--disable-pip-version-check", "install", "--quiet",
                "--only-binary=:all:", "--require-hashes", "-r", requirements])
    done.write_text(wanted, encoding="utf-8")


def rltools(what, seed):
    output = actors.run([PYTHON, "-B", HERE / "rltools_actor.py", what, f"--seed={seed}"])
    return json.loads(output.splitlines()[-1])


SIDES = {"Upswing": actors.measure, "RLtools": rltools}


def measure(what, rounds):
    """{side: results of all rounds}; the sides begin in turns."""
    results = {side: [] for side in SIDES}
    for number in range(rounds):
        for side in list(SIDES)[::1 if number % 2 == 0 else -1]:
            result = SIDES[side](what, number + 1)
            results[side].append(result)
            print(f"{what}, round {number + 1} of {rounds}, {side}: "
                  f"{1e6 * result['cpu_seconds_per_step']:,.2f} µs of CPU a step", file=sys.stderr)
    return results


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, help="number of measurements of each side (default 5)")
    a = parser.parse_args()
    if a.rounds < 1:
        parser.error(f"--rounds: expected 1 or more, got {a.rounds}")
    try:
        if not shutil.which(actors.PROGRAM):
            raise actors.Failed(f"expected the built program {actors.PROGRAM}, which ./upswing train --help makes")
        install()
        print("| training | side | CPU of a step [µs]: median (range) | steps/s | return: median (range) |\n"
              "|---|---|---|---|---|")
        for what in actors.STEPS:
            results = measure(what, a.rounds)
            for side, rounds in results.items():
                cpu, rate, value = ([each[name] for each in rounds] for name in
                                    ("cpu_seconds_per_step", "steps_per_second", "mean_return"))
                cpu = [1e6 * seconds for seconds in cpu]
                print(f"| {what} | {side} | {statistics.median(cpu):.2f} ({min(cpu):.2f} to {max(cpu):.2f}) "
                      f"| {statistics.median(rate):,.0f} | {statistics.median(value):.0f} "
                      f"({min(value):.0f} to {max(value):.0f}) |")
            for figure in ("cpu_seconds_per_step", "steps_per_second"):
                ratios = [ours[figure] / theirs[figure] for ours, theirs in zip(*results.values())]
                print(f"{what}: {figure}, Upswing / RLtools: {statistics.median(ratios):.2f}")
    except (actors.Failed, OSError) as failed:
        sys.exit(f"compare: {failed}")


if __name__ == "__main__":
    main()
