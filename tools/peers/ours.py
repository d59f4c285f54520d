"""Upswing's side of the comparison: the program's settings, and figures from its files."""

import csv
import json
import math
import os
import resource
import statistics
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PROGRAM = Path(os.environ.get("UPSWING", ROOT / "build/release/bin/upswing"))

# Settings of both sides, besides width and batch.
LEARNING_RATE = 5e-4
GAMMA = 0.99
TAU = 0.005
MAX_GRADIENT_NORM = 10
EPSILON = 0.05
REPLAY = 100_000
LEARNING_STARTS = 256  # steps before the first update

EPISODES = 100  # per evaluation of SAC and PPO
LOG_EVERY = 200  # steps between rows of metrics.csv; learning begins before the second row


class Failed(Exception):
    """An error with a one-line message for the user."""


def run(command, **more):
    """Runs a command to its end and returns its output. Raises Failed with the last line of its
    output."""
    done = subprocess.run(list(map(str, command)), stdin=subprocess.DEVNULL, capture_output=True,
                          encoding="utf-8", check=False, **more)
    if done.returncode != 0:
        words = (done.stderr.strip() or done.stdout.strip() or "it said nothing").splitlines()
        name = " ".join(Path(word).name for word in map(str, command[:3]))
        raise Failed(f"{name} ended with {done.returncode}: {words[-1]}")
    return done.stdout


def train_flags(width, batch, threads, steps, out):
    """`upswing train` as a plain DQN with one environment and one update per step."""
    settings = {
        "agent": "dqn", "hidden": f"{width},{width}", "batch": batch, "threads": threads,
        "steps": steps, "out": out, "envs": 1, "n-step": 1, "updates-per-step": 1,
        "reward-scale": 1, "gamma": GAMMA, "tau": TAU, "max-gradient-norm": MAX_GRADIENT_NORM,
        "learning-rate": LEARNING_RATE, "learning-rate-end": LEARNING_RATE,
        "epsilon-start": EPSILON, "epsilon-end": EPSILON, "replay": REPLAY,
        "learning-starts": LEARNING_STARTS, "episode-seconds": 10, "random-start-share": 0,
        "start-noise": 0.1, "start-noise-end": 0.1, "log-every": LOG_EVERY,
        "reward-centering": 0,
        # One evaluation at the end, of one episode; only the last checkpoint.
        "eval-every": steps + 1, "eval-episodes": 1, "checkpoint-every": steps + 1,
    }
    flags = ["--no-double", "--no-dueling", "--no-layer-norm", "--no-prioritized", "--no-mirror",
             "--policy-tau=1", "--no-stop-when-solved"]
    return flags + [f"--{name}={value}" for name, value in settings.items()]


def children_cpu_seconds():
    """CPU time of all finished child processes."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def read_rows(path):
    """The rows of a table, each a dictionary from column name to number."""
    with open(path, encoding="utf-8", newline="") as file:
        return [{name: float(text) for name, text in row.items()} for row in csv.DictReader(file)]


def train(width, batch, threads, steps):
    """Trains for `steps` steps. The rate comes from the log's rows after learning began; the CPU
    time is of the whole process."""
    with tempfile.TemporaryDirectory(prefix="upswing-peers-") as folder:
        out = Path(folder, "run")
        cpu = children_cpu_seconds()
        run([PROGRAM, "train", *train_flags(width, batch, threads, steps, out)])
        cpu = children_cpu_seconds() - cpu
        rows = [row for row in read_rows(out / "metrics.csv") if row["updates"] > 0]
    first, last = rows[0], rows[-1]
    return {"steps_per_second": (last["updates"] - first["updates"]) /
                                (last["seconds"] - first["seconds"]),
            "cpu_seconds_per_step": cpu / last["updates"]}


def training(width, batch, threads, seconds):
    """Training steps per second, from a run of about `seconds` seconds."""
    probe = train(width, batch, threads, 7 * LOG_EVERY)
    rows = max(5, math.ceil(seconds * probe["steps_per_second"] / LOG_EVERY))
    return train(width, batch, threads, (rows + 2) * LOG_EVERY)


def read_bench(text):
    """Rate and CPU time of the only benchmark in a JSON file of Google Benchmark."""
    entries = [entry for entry in json.loads(text)["benchmarks"]
               if entry["name"].startswith("gradient/") and entry.get("run_type") != "aggregate"]
    if not entries:
        raise Failed("upswing bench gradient: expected a benchmark gradient/…, got none")
    rate = statistics.median(entry["items_per_second"] for entry in entries)
    # Both times are per iteration, which may have several steps.
    cpu_share = statistics.median(entry["cpu_time"] / entry["real_time"] for entry in entries)
    return {"steps_per_second": rate, "cpu_seconds_per_step": cpu_share / rate}


def gradient(width, batch, threads, seconds):
    """Gradient steps per second, without the rest of the training."""
    with tempfile.TemporaryDirectory(prefix="upswing-peers-") as folder:
        file = Path(folder, "bench.json")
        run([PROGRAM, "bench", "gradient/plain", "--hidden", f"{width},{width}",
             "--batch", batch, "--threads", threads, "--seconds", seconds, "--repetitions", 1,
             "--json", file])
        return read_bench(file.read_text(encoding="utf-8"))


MEASURES = {"gradient": gradient, "training": training}
# Arguments of each measure.
ARGUMENTS = dict.fromkeys(MEASURES, ["width", "batch", "threads", "seconds"])
