#!/usr/bin/env python3
"""Machines drawn from a wide box, for `upswing machine learn` in simulated time.

    learn_machines.py FIRST LAST [--program PROGRAM] [--out FOLDER] [--robot ROBOT] [-- ARGUMENTS]

Draws the machine of each seed from FIRST to LAST, lets the program learn it as `--link MACHINE.toml`,
and prints how many balance for 10 s by their true angles. Masses, lengths, centres and inertias are
within 50% of RealAIGym's design C.1.
"""

import argparse
import csv
import math
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

CENTRE = {"mass1": 0.5235, "mass2": 0.6256, "length1": 0.2, "length2": 0.3, "center1": 0.166,
          "center2": 0.259, "inertia1": 0.01075, "inertia2": 0.00669, "armature": 0.00565,
          "damping1": 0.005, "damping2": 0.003}


def draw(seed):
    """The machine of a seed: tables of a twin's file."""
    rng = random.Random(seed)
    plant = {name: value * rng.uniform(0.5, 1.5) for name, value in CENTRE.items()}
    plant |= {"coulomb1": rng.uniform(0, 0.25), "coulomb2": rng.uniform(0, 0.25), "torque_limit": 5,
              "gravity": 9.81}
    counts = 2 ** rng.uniform(10, 14)
    sensors = {"quantum": 2 * math.pi / round(counts), "zero1": rng.uniform(-0.05, 0.05),
               "zero2": rng.uniform(-0.05, 0.05), "angle_range": 1000}
    actuator = {"delay": rng.uniform(0, 0.008), "lag": rng.uniform(0, 0.008), "passive_limit": 0.5}
    return {"plant": plant, "actuator": actuator, "sensors": sensors}, round(counts)


def toml(tables):
    return "\n".join(f"[{name}]\n" + "\n".join(f"{k} = {v!r}" for k, v in table.items())
                     for name, table in tables.items()) + "\n"


def balanced_seconds(log, zeros):
    """Time for which both links were within 30° of upright at the end of the controller's drive."""
    upright_since = end = None
    with open(log, encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["state"] != "2":
                continue
            end = float(row["time"])
            q1 = float(row["pos_meas1"]) - zeros[0]
            q12 = q1 + float(row["pos_meas2"]) - zeros[1]
            inverted = max(math.cos(q1), math.cos(q12)) < -math.cos(math.pi / 6)
            upright_since = (upright_since or end) if inverted else None
    return end - upright_since if upright_since else 0


def judge(seed, folder, program, robot, extra):
    machine, counts = draw(seed)
    file = folder / f"machine-{seed}.toml"
    file.write_text(toml(machine))
    out = folder / f"today-{seed}"
    said_file = folder / f"said-{seed}.txt"
    with open(said_file, "w", encoding="utf-8") as said:
        done = subprocess.run([*program, "machine", "learn", "--link", file, "--out", out, "--robot",
                               robot, "--encoder-counts", str(counts), "--seed", str(seed),
                               "--threads", "1", *extra],
                              stderr=said, stdout=subprocess.PIPE, encoding="utf-8", check=False)
    logs = sorted(out.glob("log-*.csv"))
    zeros = machine["sensors"]["zero1"], machine["sensors"]["zero2"]
    seconds = balanced_seconds(logs[-1], zeros) if logs else 0
    said = said_file.read_text(encoding="utf-8").strip().splitlines()
    result = (done.stdout.splitlines() or said[-1:] or [""])[0]
    return done.returncode == 0 and seconds >= 9.9, seconds, result


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    parser.add_argument("--program", default="./upswing")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--robot", default="pendubot")
    known, extra = parser.parse_known_args()
    folder = known.out or Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    count = 0
    for seed in range(known.first, known.last + 1):
        good, seconds, result = judge(seed, folder, known.program.split(), known.robot, extra)
        count += good
        print(f"{seed} {'balanced' if good else 'FAILED'} {seconds:.2f} s: {result}", flush=True)
    print(f"{count} of {known.last - known.first + 1} balance", file=sys.stdout)


if __name__ == "__main__":
    main()
