#!/usr/bin/env python3
"""Measures Upswing and other libraries on this machine in turn and prints a table.

Examples:
  tools/peers/compare.py                                   gradient and training, about six minutes
  tools/peers/compare.py --measure training --threads 1 --rounds 3
  tools/peers/compare.py --width 64 --json peers.json
  tools/peers/compare.py --measure sac,ppo --threads 1
  tools/peers/compare.py --measure sac --task double-pendulum --width 256 --batch 256 --steps 2000
  tools/peers/compare.py --measure ppo --threads 1 --sides rltools,stable-baselines3

gradient: updates of DQN on a full replay memory. training: steps of a DQN training with one
environment and one update per step. sac, ppo: whole trainings with SAC and PPO, and their returns. The
seed is the number of the round. The first call installs the other libraries into build/.
"""

import argparse
import json
import os
import platform
import shutil
import sys
import time
from pathlib import Path

import actors
import ours
import tables

HERE = Path(__file__).resolve().parent


class Peer:
    """A library: its virtual environment, its requirements, and the script of each measure. The
    scripts take the arguments of sb3_dqn.py and print the same JSON line."""

    def __init__(self, venv, requirements, pip_flags, scripts):
        self.venv, self.pip_flags = ours.ROOT / "build" / venv, pip_flags
        self.python = self.venv / "bin/python"
        self.requirements = HERE / requirements
        self.scripts = {what: HERE / script for what, script in scripts.items()}


PEERS = {
    "rltools": Peer("rltools-venv", "requirements-rltools.txt", ["--require-hashes", "--no-deps"],
                    {"sac": "rltools_actor.py", "ppo": "rltools_actor.py"}),
    "stable-baselines3": Peer("peers-venv", "requirements.txt", [],
                              {"gradient": "sb3_dqn.py", "training": "sb3_dqn.py",
                               "sac": "sb3_actor.py", "ppo": "sb3_actor.py"})}
SIDES = ["upswing", *PEERS]
MEASURES = ours.MEASURES | {"sac": actors.sac, "ppo": actors.ppo}
# Arguments of each measure, and their defaults.
ARGUMENTS = ours.ARGUMENTS | {what: ["task", "width", "batch", "threads", "steps", "seed"]
                              for what in actors.DEFAULTS}
DEFAULTS = {"gradient": {"width": 256, "batch": 128},
            "training": {"width": 256, "batch": 128}} | actors.DEFAULTS


def say(text):
    """Prints progress to standard error, so that the table can be piped."""
    print(text, file=sys.stderr, flush=True)


def install(peer):
    """Recreates a peer's virtual environment unless it already has its requirements."""
    wanted = peer.requirements.read_text(encoding="utf-8")
    done = peer.venv / "installed.txt"
    if done.is_file() and done.read_text(encoding="utf-8") == wanted:
        return
    say(f"installing {peer.requirements.name} into {peer.venv}, see tools/peers/README.md")
    try:
        ours.run([sys.executable, "-m", "venv", "--clear", peer.venv])
        ours.run([peer.python, "-m", "pip", "--disable-pip-version-check", "install", "--quiet",
                  "--only-binary=:all:", *peer.pip_flags, "-r", peer.requirements])
    except ours.Failed as failed:
        raise ours.Failed(f"the peers cannot be installed (no network, no python3-venv, no space "
                          f"on the disk?): {failed}") from None
    done.write_text(wanted, encoding="utf-8")


def takes_part(side, what, threads, a):
    """Whether a side supports the measure. RLtools has one thread and its own Pendulum-v1."""
    if side not in a.sides:
        return False
    if side == "rltools":
        return what in PEERS[side].scripts and threads == 1 and a.task == "pendulum-v1"
    return side == "upswing" or what in PEERS[side].scripts


def settings(a):
    """{measure: {name: value}} of the selectable settings, without threads and seeds."""
    values = {"seconds": a.seconds, "task": a.task} | a.given
    return {what: {name: (DEFAULTS[what] | values)[name] for name in ARGUMENTS[what]
                   if name not in ("threads", "seed")} for what in a.measure}


def measure(side, what, threads, seed, a):
    """Measures one side once: steps_per_second, cpu_seconds_per_step; for a whole training also
    seconds, mean_return."""
    arguments = settings(a)[what] | {"threads": threads}
    if "seed" in ARGUMENTS[what]:
        arguments["seed"] = seed
    if side == "upswing":
        return MEASURES[what](**arguments)
    flags = [f"--{name}={value}" for name, value in arguments.items()]
    output = ours.run([PEERS[side].python, "-B", PEERS[side].scripts[what], what, *flags])
    return json.loads(output.splitlines()[-1])


def measure_in_turns(a):
    """Runs all rounds, with the order of the sides alternating between rounds. Returns {(what,
    threads, side): list of measurements}."""
    results = {}
    for number in range(a.rounds):
        for what in a.measure:
            for threads in a.threads:
                sides = [side for side in SIDES if takes_part(side, what, threads, a)]
                for side in sides if number % 2 == 0 else sides[::-1]:
                    result = measure(side, what, threads, number + 1, a)
                    results.setdefault((what, threads, side), []).append(result)
                    say(f"round {number + 1} of {a.rounds}, {what}, threads {threads}, {side}: "
                        f"{result['steps_per_second']:,.0f} steps/s, "
                        f"{1e6 * result['cpu_seconds_per_step']:,.2f} µs of CPU a step"
                        + ("" if "mean_return" not in result else
                           f", return {result['mean_return']:.1f}"))
    return results


def processor():
    """The processor's name from /proc/cpuinfo, else the machine's architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def describe(a):
    """Metadata of the measurements."""
    return {"date": time.strftime("%Y-%m-%dT%H:%M:%S%z"), "processor": processor(),
            "processors": os.cpu_count(), "load_average": os.getloadavg(), "task": a.task,
            "settings": settings(a), "rounds": a.rounds}


def number(least, most, kind=int):
    """An argparse type: a number within a range."""
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
    """An argparse type: comma-separated values without duplicates."""
    return lambda text: list(dict.fromkeys(kind(piece) for piece in text.split(",")))


def one_of(names):
    """An argparse type: a name."""
    def parse(text):
        if text not in names:
            raise argparse.ArgumentTypeError(f"expected one of {', '.join(names)}, got '{text}'")
        return text
    return parse


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--measure", type=several(one_of(MEASURES)),
                        default=["gradient", "training"], metavar="LIST",
                        help=f"measures, of {', '.join(MEASURES)} (default gradient,training)")
    parser.add_argument("--sides", type=several(one_of(SIDES)), default=SIDES, metavar="LIST",
                        help=f"libraries, of {', '.join(SIDES)} (default all)")
    parser.add_argument("--task", type=one_of(actors.TASKS), default="pendulum-v1", metavar="TASK",
                        help=f"task of sac and ppo: {' or '.join(actors.TASKS)} (default pendulum-v1)")
    parser.add_argument("--width", type=number(1, 4096), metavar="W",
                        help="width of both hidden layers (default 256; sac and ppo 64)")
    parser.add_argument("--batch", type=number(1, 65536), metavar="B",
                        help="transitions per minibatch (default 128; sac 100; ppo 256)")
    parser.add_argument("--steps", type=number(1, 10**9), metavar="N",
                        help="steps of a training (default sac 20000, ppo 300000)")
    parser.add_argument("--threads", type=several(number(1, 256)), default=[1, 2], metavar="LIST",
                        help="numbers of threads, one measurement each (default 1,2)")
    parser.add_argument("--rounds", type=number(1, 1000), default=5, metavar="N",
                        help="number of measurements of each side (default 5)")
    parser.add_argument("--seconds", type=number(0.1, 3600, float), default=3.0, metavar="S",
                        help="length of a measurement of gradient or training [s] (default 3)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="JSON file to write, with all figures")
    a = parser.parse_args()
    a.given = {name: getattr(a, name) for name in ("width", "batch", "steps") if getattr(a, name)}
    if a.json and a.json.is_dir():
        parser.error(f"--json {a.json}: expected a file, got a folder")
    if a.json and not a.json.resolve().parent.is_dir():
        parser.error(f"--json {a.json}: there is no folder {a.json.resolve().parent}")
    return a


def prepare(a):
    """Installs the peers, and checks that both sides have the same double pendulum task."""
    if "upswing" in a.sides and not shutil.which(ours.PROGRAM):
        raise ours.Failed(f"the program is not built: expected {ours.PROGRAM}, "
                          "which ./upswing train --help makes")
    for side, peer in PEERS.items():
        if any(takes_part(side, what, threads, a) for what in a.measure for threads in a.threads):
            install(peer)
    on_double_pendulum = [what for what in a.measure if what in ("gradient", "training") or
                          what in actors.DEFAULTS and a.task == "double-pendulum"]
    if on_double_pendulum and {"upswing", "stable-baselines3"} <= set(a.sides):
        say("checking that both sides have the same task")
        python = PEERS["stable-baselines3"].python
        say(ours.run([python, "-B", HERE / "check_task.py"]).strip())


def compare(a):
    """Prepares, measures and prints."""
    prepare(a)
    context = describe(a)
    rows = tables.summarize(measure_in_turns(a), SIDES)
    if not rows:
        raise ours.Failed("none of these sides supports the requested measures "
                          "(tools/peers/README.md)")
    context["load_average_after"] = os.getloadavg()
    context["versions"] = sorted({result["version"] for row in rows for result in row["rounds"]
                                  if "version" in result})
    load, load_after = context["load_average"][0], context["load_average_after"][0]
    print(f"{context['processor']}, {context['processors']} processors, "
          f"load average {load:.1f} before and {load_after:.1f} after")
    print(f"{'; '.join(context['versions'])}; medians of {a.rounds} rounds")
    tables.print_heading(a.measure, context["settings"])
    print()
    tables.print_table(rows)
    whole_trainings = [row for row in rows if "mean_return" in row]
    if whole_trainings:
        tables.print_returns(whole_trainings)
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
