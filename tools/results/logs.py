#!/usr/bin/env python3
"""Judges `machine check` by logs whose truth is known: false alarms, and damage that it names.

    logs.py [--machines N] [--seed S] [--good N] [--kind TITLE]... [--identify] [--verbose] [--keep FOLDER]

Draws machines of 5 cm to 2 m with drawn shapes and friction, which move by both motors, by one or by none. Draws
for each a logger: 50 Hz to 2 kHz, encoders of 512 to 2^20 counts, 3 to 9 printed digits, conventions that a file of
columns declares, lost rows and jitter. Prints the false alarms on undamaged logs. For each kind of damage it prints
on how many machines check names it, blames something else, says that no reading explains the motion, or finds
nothing. `--identify` fits a twin to each log in which check finds nothing, from the machine's masses, lengths and
shapes without friction. It prints for how many the twin is distrusted: it does not explain the log, has a value that
no machine has, or contradicts the lengths. The others are silent: neither check nor identify says a word.

A usable log is 60 to 200 natural times of the machine long, with four rows and more in each. Both joints move by
1 rad and more, by less than 1 rad between two rows, and half of the natural times have motion.

Needs NumPy: `./upswing python tools/results/logs.py` has it.
"""

import argparse
import json
import math
import re
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np

from log_damage import KINDS
from log_machines import DRIVES, draw_machine, log_uniform, simulate

BATCH = 250  # machines that are simulated at once
REALAIGYM = {"time": "time", "angle": "pos_meas", "velocity": "vel_meas", "commanded": "tau_con",
             "measured": "tau_meas"}


def is_usable(log, machine):
    """Whether both joints move by 1 rad, and by .25 rad in half of the natural times."""
    q, rows = log["q"], max(1, round(machine["T"] / machine["cycle"]))
    pieces = q[:len(q) // rows * rows].reshape(-1, rows, 2)
    moves = np.ptp(pieces, axis=1).max(axis=1) > 0.25
    return np.ptp(q, axis=0).min() > 1 and moves.mean() > 0.5 and np.abs(np.diff(q, axis=0)).max() < 1


def draw_logger(rng, drive, columns):
    """Habits of a logger: encoder, digits, columns, units, conventions and lost rows."""
    torques = columns or (rng.choice(["commanded", "both", "measured"]) if drive != "free"
                          else rng.choice(["commanded", "none"]))
    return {"counts": round(log_uniform(rng, 512, 2**20)), "digits": int(rng.integers(3, 10)),
            "significant": bool(rng.integers(4) == 0), "velocity": rng.choice(["none", "none", "own", "difference"]),
            "torques": str(torques), "row": int(rng.integers(2)),  # by which the commands come earlier
            "convention": bool(rng.integers(2)), "degrees": bool(rng.integers(2)), "ms": bool(rng.integers(2)),
            "sign": rng.choice([-1, 1], 2), "hanging": rng.choice([0, 1, rng.uniform(-1, 1)], 2) * math.pi,
            "absolute": bool(rng.integers(2)), "torque_sign": rng.choice([-1, 1], 2),
            "constant": log_uniform(rng, 0.05, 20),  # N·m/A
            "lost": rng.choice([0, 0, rng.uniform(0, 0.1)])}


def shifted(values, rows):
    """Values that the file has `rows` rows earlier."""
    return np.concatenate([values[rows:], np.repeat(values[-1:], rows, axis=0)])


def columns_of(log, logger, machine, rng):
    """The columns of a log as a logger sees them, in SI units: encoders round, sensors have noise."""
    step = 2 * math.pi / logger["counts"]
    zero = rng.uniform(0, 1, 2) * step
    table = {"time": log["time"] - log["time"][0], "angle": step * np.floor((log["q"] + zero) / step)}
    if logger["velocity"] == "own":
        noise = 0.01 * np.std(log["w"], axis=0)
        table["velocity"] = log["w"] + noise * rng.normal(size=log["w"].shape)
    elif logger["velocity"] == "difference":
        change = np.diff(table["angle"], axis=0) / np.diff(table["time"])[:, None]
        table["velocity"] = np.concatenate([change[:1], change])
    if logger["torques"] in ("commanded", "both"):
        table["commanded"] = shifted(log["u"], logger["row"])
    if logger["torques"] in ("measured", "both"):
        noise = 0.01 * machine["limit"]
        table["measured"] = log["tau"] + noise * rng.normal(size=log["tau"].shape)
    if logger["lost"]:
        kept = rng.uniform(size=len(log["time"])) >= logger["lost"]
        table = {key: value[kept] for key, value in table.items()}
    return table


def file_of(table, logger):
    """The numbers of a file with the logger's conventions, and the TOML text that declares them."""
    numbers, toml = dict(table), ""
    if not logger["convention"]:
        return numbers, None
    unit, angle_unit = (1e3, "ms") if logger["ms"] else (1, "s")
    numbers["time"] = table["time"] * unit
    toml += f'time = {{column = "time", unit = "{angle_unit}"}}\n'
    turn, name = (180 / math.pi, "deg") if logger["degrees"] else (1, "rad")
    for key in ("angle", "velocity"):
        if key not in table:
            continue
        values = table[key].copy()
        if logger["absolute"]:
            values[:, 1] += values[:, 0]
        values *= turn * logger["sign"]
        rate = "/s" if key == "velocity" else ""
        for j in (0, 1):
            hanging = logger["hanging"][j] * turn if key == "angle" else 0
            values[:, j] += hanging
            more = f", hanging = {float(hanging)!r}" if key == "angle" else ""
            toml += (f'{key}{j + 1} = {{column = "{REALAIGYM[key]}{j + 1}", unit = "{name}{rate}", '
                     f'factor = {int(logger["sign"][j])}{more}}}\n')
        numbers[key] = values
    for key in ("commanded", "measured"):
        if key not in table:
            continue
        factor = logger["torque_sign"] * logger["constant"]
        numbers[key] = table[key] / factor
        for j in (0, 1):
            toml += f'{key}{j + 1} = {{column = "{REALAIGYM[key]}{j + 1}", factor = {float(factor[j])!r}}}\n'
    if logger["absolute"]:
        toml = "absolute = true\n" + toml
    return numbers, toml


def write_log(path, table, logger):
    """Writes a table with its file of columns. Returns the arguments for the program."""
    numbers, toml = file_of(table, logger)
    names, parts, formats = [REALAIGYM["time"]], [numbers["time"][:, None]], ["%.6f"]
    for key in ("angle", "velocity", "commanded", "measured"):
        if key not in numbers:
            continue
        names += [f"{REALAIGYM[key]}1", f"{REALAIGYM[key]}2"]
        parts.append(numbers[key])
        digits = logger["digits"]
        if key == "angle" and logger["convention"] and logger["degrees"]:
            digits = max(2, digits - 2)
        angle = f"%.{max(6, digits)}g" if logger["significant"] else f"%.{digits}f"
        formats += [angle if key == "angle" else "%.6g"] * 2
    np.savetxt(path, np.hstack(parts), fmt=formats, delimiter=",", header=",".join(names), comments="")
    if toml is None:
        return [str(path)]
    columns = path.with_suffix(".toml")
    columns.write_text(toml)
    return [str(path), "--columns", str(columns)]


def findings_of(program, arguments):
    """The faults and warnings of a log, each as `severity aspect joint: text`."""
    done = subprocess.run([*program, "machine", "check", "--json", *arguments], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, encoding="utf-8", check=False)
    if done.returncode > 1:
        sys.exit(f"{arguments}: {done.stderr}")
    found = json.loads(done.stdout)["logs"][0]["findings"]
    return [f"{f['severity']} {f['aspect']}{' ' + str(f['joint']) if 'joint' in f else ''}: {f['text']}"
            for f in found if f["severity"] != "note"]


def distrust_of(program, arguments, machine, logger):
    """Why a twin that is identified from a log is not to be trusted; None if it is."""
    log = Path(arguments[0])
    plant, twin = log.with_suffix(".plant.toml"), log.with_suffix(".twin.toml")
    limit = max(machine["limit"].max(), 1e-3 * machine["gravity"][0], 1e-3)  # N·m, the least of a plant
    plant.write_text("[plant]\n" + "".join(f"{k} = {float(v)!r}\n" for k, v in machine["links"].items())
                     + f"torque_limit = {float(limit)!r}\n")
    if logger["torques"] == "measured":  # identify drives its model by commands
        columns = log.with_suffix(".identify.toml")
        columns.write_text(commands_from_measured(Path(arguments[2]).read_text() if len(arguments) > 1 else ""))
        arguments = [arguments[0], "--columns", str(columns)]
    done = subprocess.run([*program, "machine", "identify", *arguments, "--plant", str(plant), "--folds", "0",
                           "--threads", "1", "--out", str(twin), "--overwrite"], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, encoding="utf-8", check=False)
    if done.returncode > 1:
        return "refused: " + done.stderr.strip()
    if done.returncode == 0:
        return None
    return tomllib.loads(twin.read_text())["distrust"]


def commands_from_measured(toml):
    """A file of columns that names the measured torques as commands."""
    if toml:
        return re.sub(r"^measured([12])", r"commanded\1", toml, flags=re.MULTILINE)
    keys = {"time": "time"} | {f"angle{j}": f"{REALAIGYM['angle']}{j}" for j in (1, 2)}
    keys |= {f"commanded{j}": f"{REALAIGYM['measured']}{j}" for j in (1, 2)}
    return "".join(f'{key} = "{column}"\n' for key, column in keys.items())


def verdict_of(kind, log, findings):
    """`named`, `another`, `unexplained` or `nothing`, of the findings about a damaged log."""
    faults = [f for f in findings if f.startswith("fault")]
    for pattern in kind.names:
        pattern = pattern.replace("{j}", str(log.get("j", "[12]")))
        if any(re.search(pattern, f) for f in (findings if kind.warns else faults)):
            return "named"
    if not faults:
        return "nothing"
    if all("no other reading" in f for f in faults):
        return "unexplained"
    return "another"


class Judge:
    """Draws, damages, writes and checks logs."""

    def __init__(self, program, seed, folder, identifies):
        self.program, self.seed, self.folder, self.identifies = program, seed, folder, identifies
        self.folder.mkdir(parents=True, exist_ok=True)

    def logs(self, kind, count, stream):
        """Yields usable logs of a kind of damage (None: undamaged), each with its machine and generator."""
        number = 0
        while count > 0:
            drawn = []
            for _ in range(min(BATCH, count + count // 3 + 2)):
                rng = np.random.default_rng([self.seed, stream, number, 1])
                drive = str(rng.choice(kind.drives if kind else DRIVES))
                machine = draw_machine([self.seed, stream], number, drive)
                if kind:
                    machine["signal"] = str(rng.choice(kind.signals))
                if kind and kind.motors:
                    kind.motors(machine, rng)
                drawn.append((machine, rng))
                number += 1
            for (machine, rng), log in zip(drawn, simulate([m for m, _ in drawn])):
                if count > 0 and is_usable(log, machine):
                    count -= 1
                    yield machine, log, rng

    def check(self, kind, count, stream):
        """Yields file, verdict, findings and habits of `count` logs."""
        for machine, log, rng in self.logs(kind, count, stream):
            if kind and kind.readings:
                kind.readings(log, machine, rng)
            logger = draw_logger(rng, machine["drive"], kind.columns if kind else "")
            if kind:
                logger |= kind.logger
            path = self.folder / f"{stream:02}-{machine['number']:04}.csv"
            arguments = write_log(path, columns_of(log, logger, machine, rng), logger)
            findings = findings_of(self.program, arguments)
            verdict = verdict_of(kind, log, findings) if kind else (
                "alarm" if any(f.startswith("fault") for f in findings) else "silent")
            if self.identifies and verdict in ("nothing", "silent"):
                distrust = distrust_of(self.program, arguments, machine, logger)
                if distrust:
                    verdict = "refused" if distrust.startswith("refused") else "distrusted"
                    findings = [*findings, f"identify: {distrust}"]
                elif kind:
                    verdict = "silent"
            habits = {k: machine[k] for k in ("T", "cycle", "rows", "drive", "signal")} | {
                k: logger[k] for k in ("counts", "digits", "velocity", "torques", "convention")}
            yield path, verdict, findings, habits


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--machines", type=int, default=100, help="for each kind of damage")
    parser.add_argument("--good", type=int, default=1000, help="undamaged logs")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", action="append", default=[],
                        help="only kinds with this text in their title; may be given more than once")
    parser.add_argument("--program", default="./upswing --no-setup")
    parser.add_argument("--keep", type=Path, help="folder for the logs")
    parser.add_argument("--identify", action="store_true", help="fit a twin to each log in which check finds nothing")
    parser.add_argument("--verbose", action="store_true", help="print the findings of each miss")
    arguments = parser.parse_args()
    judge = Judge(arguments.program.split(), arguments.seed, arguments.keep or Path(tempfile.mkdtemp()),
                  arguments.identify)
    streams = [(None, arguments.good, 0)] if not arguments.kind else []
    streams += [(kind, arguments.machines, i + 1) for i, kind in enumerate(KINDS)
                if not arguments.kind or any(text in kind.title for text in arguments.kind)]
    for kind, count, stream in streams:
        if count == 0:
            continue
        counts = Counter()
        for path, verdict, findings, habits in judge.check(kind, count, stream):
            counts[verdict] += 1
            if arguments.verbose and verdict != ("named" if kind else "silent"):
                print(f"  {path} {verdict} {habits}\n    " + "\n    ".join(f[:220] for f in findings), flush=True)
        title = kind.title if kind else "undamaged"
        print(f"{title}: " + ", ".join(f"{n} {v}" for v, n in sorted(counts.items())), flush=True)


if __name__ == "__main__":
    main()
