#!/usr/bin/env python3
"""Measures Upswing and other libraries on this machine, alternating, and prints a table.

Examples:
  tools/peers/compare.py                                   gradient and training, about six minutes
  tools/peers/compare.py --measure training --threads 1 --rounds 3
  tools/peers/compare.py --width 64 --json peers.json
  tools/peers/compare.py --measure acrobot --threads 1 --rounds 10

gradient: gradient steps alone, on a filled replay memory. training: steps of a training with one
environment and one update a step. acrobot: our agent of that name from its first step to its last,
and the return that it reaches; the number of the round is the seed. The peers are installed into
build/peers-venv first (once).
"""

import argparse
import json
import os
import platform
import shutil
import statistics
import sys
import textwrap
import time
from pathlib import Path

import ours

HERE = Path(__file__).resolve().parent
VENV = ours.ROOT / "build/peers-venv"
PYTHON = VENV / "bin/python"
REQUIREMENTS = HERE / "requirements.txt"

# Each peer is a script that is called as sb3_dqn.py is, and prints the same JSON line.
PEERS = {"stable-baselines3": HERE / "sb3_dqn.py"}
SIDES = ["upswing", *PEERS]

SAME = (
    "Both sides: plain network 8-W-W-9 with ReLU, batch of B transitions, single precision; no "
    "double, dueling or layer normalisation; one-step targets, Huber loss (smooth L1), Adam, "
    f"gradient norm clipped to {ours.MAX_GRADIENT_NORM}, discount {ours.GAMMA}, replay memory of "
    f"{ours.REPLAY:,}. In training: one environment, one update a step from step "
    f"{ours.LEARNING_STARTS} on, Polyak target at each with tau {ours.TAU}, epsilon "
    f"{ours.EPSILON}.")


SAME_ON_ACROBOT = (
    "acrobot: Gymnasium's Acrobot-v1 and the settings of our agent `acrobot`, as far as both sides "
    "have them (tools/peers/README.md); one round for each seed.")


def say(text):
    """Progress goes to standard error, so that the table can be piped."""
    print(text, file=sys.stderr, flush=True)


def install_peers():
    """Makes the virtual environment again unless it already holds requirements.txt."""
    wanted = REQUIREMENTS.read_text(encoding="utf-8")
    done = VENV / "installed.txt"
    if done.is_file() and done.read_text(encoding="utf-8") == wanted:
        return
    say(f"installing the peers into {VENV}: up to 3 GB to fetch, see tools/peers/README.md")
    try:
        ours.run([sys.executable, "-m", "venv", "--clear", VENV])
        ours.run([PYTHON, "-m", "pip", "--disable-pip-version-check", "install", "--quiet",
                  "--only-binary=:all:", "-r", REQUIREMENTS])
    except ours.Failed as failed:
        raise ours.Failed(f"the peers cannot be installed (no network, no python3-venv, no space "
                          f"on the disk?): {failed}") from None
    done.write_text(wanted, encoding="utf-8")


def measure(side, what, threads, seed, a):
    """One measurement of one side: steps_per_second, cpu_seconds_per_step; on Acrobot-v1 also
    seconds, mean_return."""
    values = {"width": a.width, "batch": a.batch, "threads": threads, "seconds": a.seconds,
              "seed": seed}
    arguments = {name: values[name] for name in ours.ARGUMENTS[what]}
    if side == "upswing":
        return ours.MEASURES[what](**arguments)
    flags = [f"--{name}={value}" for name, value in arguments.items()]
    return json.loads(ours.run([PYTHON, "-B", PEERS[side], what, *flags]).splitlines()[-1])


def measure_in_turns(a):
    """All rounds; the order of the sides alternates from one round to the next. Returns
    {(what, threads, side): list of measurements}."""
    results = {}
    for number in range(a.rounds):
        for what in a.measure:
            for threads in a.threads:
                for side in SIDES if number % 2 == 0 else SIDES[::-1]:
                    result = measure(side, what, threads, number + 1, a)
                    results.setdefault((what, threads, side), []).append(result)
                    say(f"round {number + 1} of {a.rounds}, {what}, threads {threads}, {side}: "
                        f"{result['steps_per_second']:,.0f} steps/s, "
                        f"{1000 * result['cpu_seconds_per_step']:.2f} ms of CPU a step"
                        + ("" if "mean_return" not in result else
                           f", return {result['mean_return']:.1f}"))
    return results


def summarize(results):
    """One row for each measurement, with medians and our rate and CPU time over theirs. A ratio is
    the median over the rounds, so that load on both sides of a round cancels out; the ratio of the
    fastest rounds estimates that of a machine without other load."""
    rows = []
    for (what, threads, side), rounds in results.items():
        row = {"measure": what, "threads": threads, "side": side, "rounds": rounds}
        for figure in ("steps_per_second", "cpu_seconds_per_step"):
            values = [result[figure] for result in rounds]
            our_values = [result[figure] for result in results[what, threads, "upswing"]]
            row[figure] = statistics.median(values)
            row[f"{figure}_range"] = [min(values), max(values)]
            row[f"{figure}_upswing_ratio"] = statistics.median(
                mine / theirs for mine, theirs in zip(our_values, values, strict=True))
            if figure == "steps_per_second":
                row["fastest_upswing_ratio"] = max(our_values) / max(values)
        returns = [result["mean_return"] for result in rounds if "mean_return" in result]
        if returns:
            row["mean_return"] = statistics.median(returns)
            row["mean_return_range"] = [min(returns), max(returns)]
        rows.append(row)
    return sorted(rows, key=lambda row: (row["measure"], row["threads"], SIDES.index(row["side"])))


def print_table(rows):
    """Medians, ranges and ratios."""
    line = "{:<10}{:>7}  {:<18}{:>8}{:>16}{:>8}{:>10}{:>10}{:>10}"
    print(line.format("measure", "threads", "side", "steps/s", "(range)", "CPU ms", "our rate",
                      "fastest", "our CPU"))
    print(line.format("", "", "", "", "", "a step", "/ theirs", "/ fastest", "/ theirs"))
    for row in rows:
        low, high = row["steps_per_second_range"]
        ratios = ("", "", "")
        if row["side"] != "upswing":
            ratios = [f"{row[name]:.2f}" for name in
                      ("steps_per_second_upswing_ratio", "fastest_upswing_ratio",
                       "cpu_seconds_per_step_upswing_ratio")]
        print(line.format(row["measure"], row["threads"], row["side"],
                          f"{row['steps_per_second']:,.0f}", f"({low:,.0f}-{high:,.0f})",
                          f"{1000 * row['cpu_seconds_per_step']:.2f}", *ratios).rstrip())


def print_returns(rows):
    """What was reached on Acrobot-v1, and in how long."""
    line = "{:<10}{:>7}  {:<18}{:>10}{:>14}  {}"
    print("\n" + line.format("measure", "threads", "side", "seconds", "mean return", "(range)"))
    for row in rows:
        seconds = statistics.median(result["seconds"] for result in row["rounds"])
        low, high = row["mean_return_range"]
        print(line.format(row["measure"], row["threads"], row["side"], f"{seconds:.1f}",
                          f"{row['mean_return']:.1f}", f"({low:.1f} to {high:.1f})"))


def processor():
    """The processor's name by /proc/cpuinfo, else the machine's architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def describe(a):
    """What the figures are of."""
    return {"date": time.strftime("%Y-%m-%dT%H:%M:%S%z"), "processor": processor(),
            "processors": os.cpu_count(), "load_average": os.getloadavg(), "width": a.width,
            "batch": a.batch, "seconds": a.seconds, "rounds": a.rounds}


def number(least, most, kind=int):
    """A type for argparse: a number within a range."""
    def parse(text):
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not least <= value <= most:
            what = "a whole number" if kind is int else "a number"
            raise argparse.ArgumentTypeError(
                f"expected {what} from {least:g} to {most:g}, got '{text}'")
        return value
    return parse


def several(kind):
    """A type for argparse: values between commas, each once."""
    return lambda text: list(dict.fromkeys(kind(piece) for piece in text.split(",")))


def one_measure(text):
    """A type for argparse: the name of a measure."""
    if text not in ours.MEASURES:
        names = ", ".join(ours.MEASURES)
        raise argparse.ArgumentTypeError(f"expected one of {names}, got '{text}'")
    return text


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--measure", type=several(one_measure), default=["gradient", "training"],
                        metavar="LIST", help="of gradient, training, acrobot [gradient,training]")
    parser.add_argument("--width", type=number(1, 4096), default=256, metavar="W",
                        help="of both hidden layers [256]")
    parser.add_argument("--batch", type=number(1, 65536), default=128, metavar="B",
                        help="transitions in a minibatch [128]")
    parser.add_argument("--threads", type=several(number(1, 256)), default=[1, 2], metavar="LIST",
                        help="how many threads, one measurement for each [1,2]")
    parser.add_argument("--rounds", type=number(1, 1000), default=5, metavar="N",
                        help="measurements of each side [5]")
    parser.add_argument("--seconds", type=number(0.1, 3600, float), default=3.0, metavar="S",
                        help="length of a measurement, about [3]")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures there, too")
    a = parser.parse_args()
    if a.json and a.json.is_dir():
        parser.error(f"--json {a.json}: expected a file, got a folder")
    if a.json and not a.json.resolve().parent.is_dir():
        parser.error(f"--json {a.json}: there is no folder {a.json.resolve().parent}")
    return a


def compare(a):
    """Installs, checks, measures, prints."""
    if not shutil.which(ours.PROGRAM):
        raise ours.Failed(f"the program is not built: expected {ours.PROGRAM}, "
                          "which ./upswing train --help makes")
    install_peers()
    if set(a.measure) != {"acrobot"}:
        say("checking that both sides have the same task")
        say(ours.run([PYTHON, "-B", HERE / "check_task.py"]).strip())

    context = describe(a)
    rows = summarize(measure_in_turns(a))
    context["load_average_after"] = os.getloadavg()
    context["versions"] = sorted({result["version"] for row in rows for result in row["rounds"]
                                  if "version" in result})
    load, load_after = context["load_average"][0], context["load_average_after"][0]
    print(f"{context['processor']}, {context['processors']} processors, "
          f"load average {load:.1f} before and {load_after:.1f} after")
    print(f"{'; '.join(context['versions'])}; medians of {a.rounds} rounds")
    if set(a.measure) != {"acrobot"}:
        print(f"W = {a.width}, B = {a.batch}, {a.seconds:g} s a round")
        print(textwrap.fill(SAME, 96))
    if "acrobot" in a.measure:
        print(textwrap.fill(SAME_ON_ACROBOT, 96))
    print()
    print_table(rows)
    if "acrobot" in a.measure:
        print_returns([row for row in rows if row["measure"] == "acrobot"])
    if a.json:
        text = json.dumps({"context": context, "results": rows}, indent=1)
        a.json.write_text(text + "\n", encoding="utf-8")


def main():
    a = parse_arguments()
    try:
        compare(a)
    except (ours.Failed, OSError) as failed:
        sys.exit(f"compare: {failed}")
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
