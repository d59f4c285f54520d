#!/usr/bin/env python3
"""Environment steps per second from Python, beside the C++ rate of the same call and beside
Gymnasium's own vector of environments over MuJoCo's Python package.

    ./upswing python tools/peers/vector.py --rounds 5

Each round measures every side once, in turns; medians of all rounds are printed, by the wall clock and
by the processors' time of this process, which other load disturbs less. An environment step is one
control period (four physics steps) of one double pendulum, with observation, reward and reset.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
from gymnasium.vector import SyncVectorEnv

import upswing  # noqa: F401  # pylint: disable=unused-import

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("UPSWING", ROOT / "build/release/apps/upswing")
sys.path.insert(0, str(Path(__file__).parent))

from pendulum import TorquePendulum  # pylint: disable=wrong-import-position


def in_cpp(physics, envs, threads, seconds):
    """`upswing bench`: the C++ rate, by the wall clock and by the processors' time."""
    done = subprocess.run(
        [PROGRAM, "bench", "env", "--threads", str(threads), "--seconds", str(seconds),
         "--repetitions", "1", "--json", "-"], capture_output=True, check=True)
    name = f"env/{physics}/envs:{envs}/threads:{threads}"
    for case in json.loads(done.stdout)["benchmarks"]:
        if case["name"].startswith(name):
            unit = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1}[case["time_unit"]]
            return (envs / (case["real_time"] * unit), envs / (case["cpu_time"] * unit))
    raise SystemExit(f"vector.py: bench has no case {name}")


def in_python(make, seconds):
    """The same of a vector environment."""
    envs = make()
    envs.reset(seed=0)
    actions = [envs.action_space.sample() for _ in range(16)]
    for k in range(4):
        envs.step(actions[k])
    begin, cpu = time.perf_counter(), time.process_time()
    steps = 0
    while time.perf_counter() - begin < seconds:
        for _ in range(4):
            envs.step(actions[steps % 16])
            steps += 1
    wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
    count = steps * envs.num_envs
    envs.close()
    return count / wall, count / cpu


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=1, help="of each side in a round")
    parser.add_argument("--threads", type=int, default=1)
    a = parser.parse_args()
    envs = 1024

    def ours(physics, **more):
        return lambda: gym.make_vec("upswing/DoublePendulum-v0", num_envs=envs, physics=physics,
                                    threads=a.threads, episode_seconds=10, **more)

    sides = {}
    for physics in ("mujoco", "closed-form"):
        sides[f"{physics}, C++ (upswing bench env)"] = (
            lambda physics=physics: in_cpp(physics, envs, a.threads, a.seconds))
        sides[f"{physics}, Python, copies"] = (
            lambda physics=physics: in_python(ours(physics), a.seconds))
        sides[f"{physics}, Python, views"] = (
            lambda physics=physics: in_python(ours(physics, copy=False), a.seconds))
    sides["MuJoCo's Python package, Gymnasium's SyncVectorEnv"] = lambda: in_python(
        lambda: SyncVectorEnv([TorquePendulum] * envs), a.seconds)

    results = {name: [] for name in sides}
    for _ in range(a.rounds):
        for name, measure in sides.items():
            results[name].append(measure())
    print(f"{envs} environments, {a.threads} threads, medians of {a.rounds} rounds, "
          f"load {os.getloadavg()[0]:.1f}")
    print(f"{'environment steps/s':<55} {'wall':>12} {'CPU':>12}  of C++ (CPU)")
    for name, rates in results.items():
        wall, cpu = (statistics.median(column) for column in zip(*rates))
        base = f"{name.split(',')[0]}, C++ (upswing bench env)"
        share = ""
        if base in results:
            ratios = [rate[1] / cpp[1] for rate, cpp in zip(rates, results[base])]
            share = f"{statistics.median(ratios):6.0%}"
        print(f"{name:<55} {wall:12,.0f} {cpu:12,.0f}  {share}")
    assert np.isfinite(list(results.values())).all()


if __name__ == "__main__":
    main()
