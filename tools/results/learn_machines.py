#!/usr/bin/env python3
"""Machines drawn from a wide box, for `upswing machine learn` in simulated time.

    learn_machines.py FIRST LAST [--program PROGRAM] [--out FOLDER] [--robot ROBOT] [--friction FACTOR]
                      [--gain SHARE] [--lag SECONDS] [--counts COUNTS] [--twin TWIN] [-- ARGUMENTS]

Draws the machine of each seed from FIRST to LAST, lets the program learn it in simulated time, and
prints how many balance for 10 s by their true angles, within the time of motion and the limits.
Masses, lengths, centres and inertias are within 50% of RealAIGym's design C.1. The options lead out
of this box. With --twin, the machines are drawn from the covariance of a twin.
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


def outside(machine, options):
    """The machine with the changes that the options name."""
    plant, actuator, sensors = machine["plant"], machine["actuator"], machine["sensors"]
    for name in ("coulomb1", "coulomb2"):
        plant[name] *= options.friction
    # A torque that arrives as a share of its command moves a machine that much heavier.
    for name in ("mass1", "mass2", "inertia1", "inertia2", "armature", "damping1", "damping2", "coulomb1",
                 "coulomb2"):
        plant[name] /= options.gain
    if options.lag is not None:
        actuator["lag"] = options.lag
    if options.counts is not None:
        sensors["quantum"] = 2 * math.pi / options.counts
    return machine


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


def largest(log, column):
    """Largest absolute value in a column of a log."""
    with open(log, encoding="utf-8") as file:
        return max((abs(float(row[column])) for row in csv.DictReader(file)), default=0)


def first_angles(log):
    """The first angles of a log, of links that hang."""
    with open(log, encoding="utf-8") as file:
        row = next(csv.DictReader(file))
    return float(row["pos_meas1"]), float(row["pos_meas2"])


def motion_in(log, hz):
    """Time in a log in which torques may act, s: the loop probes, drives or brakes."""
    with open(log, encoding="utf-8") as file:
        return sum(row["state"] in ("2", "3", "5") for row in csv.DictReader(file)) / hz


def arguments_of(seed, folder, options):
    """The link and the encoders of a seed's machine, and its encoders' zeros (rad) if they are known."""
    if options.twin:
        return ["--link", options.twin, "--draw", "--encoder-counts", "131112"], None
    machine, counts = draw(seed)
    machine = outside(machine, options)
    file = folder / f"machine-{seed}.toml"
    file.write_text(toml(machine))
    zeros = machine["sensors"]["zero1"], machine["sensors"]["zero2"]
    return ["--link", file, "--encoder-counts", str(options.counts or counts)], zeros


def judge(seed, folder, options, extra):
    """Whether the machine balances, its time upright (s), its motion (s), its largest velocity (rad/s)
    and the program's result."""
    link, zeros = arguments_of(seed, folder, options)
    out = folder / f"today-{seed}"
    said_file = folder / f"said-{seed}.txt"
    with open(said_file, "w", encoding="utf-8") as said:
        done = subprocess.run([*options.program.split(), "machine", "learn", *link, "--out", out, "--robot",
                               options.robot, "--seed", str(seed), "--threads", "1", *extra],
                              stderr=said, stdout=subprocess.PIPE, encoding="utf-8", check=False)
    logs = sorted(out.glob("log-*.csv"))
    seconds = balanced_seconds(logs[-1], zeros or first_angles(logs[0])) if logs else 0
    motion = sum(motion_in(log, 500) for log in logs)
    velocity = max((largest(log, f"vel_meas{j}") for log in logs for j in (1, 2)), default=0)
    said = said_file.read_text(encoding="utf-8").strip().splitlines()
    result = (done.stdout.splitlines() or said[-1:] or [""])[0]
    return done.returncode == 0 and seconds >= 9.9, seconds, motion, velocity, result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    parser.add_argument("--program", default="./upswing")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--robot", default="pendubot")
    parser.add_argument("--friction", type=float, default=1, help="factor of the dry friction")
    parser.add_argument("--gain", type=float, default=1, help="share of a commanded torque that arrives")
    parser.add_argument("--lag", type=float, help="time constant of the torques [s]")
    parser.add_argument("--counts", type=int, help="counts of the encoders")
    parser.add_argument("--twin", help="twin from whose covariance the machines are drawn")
    options, extra = parser.parse_known_args()
    extra = [word for word in extra if word != "--"]
    folder = options.out or Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    count = 0
    motions, velocities = [], []
    for seed in range(options.first, options.last + 1):
        good, seconds, motion, velocity, result = judge(seed, folder, options, extra)
        count += good
        motions.append(motion)
        velocities.append(velocity)
        print(f"{seed} {'balanced' if good else 'FAILED'} {seconds:.2f} s: {result}", flush=True)
    print(f"{count} of {options.last - options.first + 1} balance; up to {max(motions):.2f} s of motion and "
          f"{max(velocities):.2f} rad/s")


if __name__ == "__main__":
    main()
