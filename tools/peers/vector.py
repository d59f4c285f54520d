#!/usr/bin/env python3
"""Measures environment steps per second from Python, next to Gymnasium's own vector.

Gymnasium's vector steps MuJoCo's Python package.

    ./upswing python tools/peers/vector.py --rounds 5

Each round measures every side once, in turn. Prints medians of all rounds, by the wall clock and by
this process's CPU time, which other load disturbs less. An environment step is one control period
(four physics steps) of one double pendulum, with observation, reward and reset.
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

import upswing  # noqa: F401  # pylint: disable=unused-import

ENVS = 1024
GYMNASIUM = "MuJoCo's Python package, Gymnasium's SyncVectorEnv"


def make(side, threads):
    """The vector environment of a side in Python."""
    if side == GYMNASIUM:
        # Imported only here. The package makes MuJoCo time each stage of a step, in all engines of
        # the process, which halves the speed of small models.
        sys.path.insert(0, str(Path(__file__).parent))
        from pendulum import DoublePendulum  # pylint: disable=import-outside-toplevel
        return gym.vector.SyncVectorEnv([DoublePendulum] * ENVS)
    physics, _, copies = side.split(", ")
    return gym.make_vec("upswing/DoublePendulum-v0", num_envs=ENVS, physics=physics,
                        threads=threads, episode_seconds=10, copy=copies == "copies")


def in_new_process(side, threads, seconds):
    """The rate of a side, measured in a separate process."""
    done = subprocess.run([sys.executable, __file__, "--threads", str(threads), "--seconds",
                           str(seconds), "--side", side], stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout)


def measure(side, threads, seconds):
    """Steps per second, by the wall clock and by CPU time."""
    envs = make(side, threads)
    envs.reset(seed=0)
    actions = [envs.action_space.sample() for _ in range(16)]
    for k in range(4):
        envs.step(actions[k])
    begin, cpu_begin = time.perf_counter(), time.process_time()
    steps = 0
    while time.perf_counter() - begin < seconds:
        for _ in range(4):
            envs.step(actions[steps % 16])
            steps += 1
    count = steps * envs.num_envs
    return (count / (time.perf_counter() - begin), count / (time.process_time() - cpu_begin))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5,
                        help="number of measurements of each side (default 5)")
    parser.add_argument("--seconds", type=float, default=1, help="length of a measurement [s] (default 1)")
    parser.add_argument("--threads", type=int, default=1, help="number of threads (default 1)")
    parser.add_argument("--side", help=argparse.SUPPRESS)
    a = parser.parse_args()
    if a.side:
        print(json.dumps(measure(a.side, a.threads, a.seconds)))
        return

    sides = [f"{physics}, gym.make_vec, {copies}" for physics in ("mujoco", "closed-form")
             for copies in ("copies", "views")] + [GYMNASIUM]
    results = {side: [] for side in sides}
    for _ in range(a.rounds):
        for side in sides:
            results[side].append(in_new_process(side, a.threads, a.seconds))
    print(f"{ENVS} environments, {a.threads} threads, medians of {a.rounds} rounds, "
          f"load {os.getloadavg()[0]:.1f}")
    print(f"{'environment steps/s':<55} {'wall':>12} {'CPU':>12}  ratio (CPU)")
    for side, rates in results.items():
        wall, cpu = (statistics.median(column) for column in zip(*rates))
        ratio = statistics.median(rate[1] / peer[1] for rate, peer in zip(rates, results[GYMNASIUM]))
        print(f"{side:<55} {wall:12,.0f} {cpu:12,.0f}  {ratio:11.3g}")


if __name__ == "__main__":
    main()
