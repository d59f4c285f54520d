#!/usr/bin/env python3
"""Checks that pendulum.py and the program have the same task.

  build/peers-venv/bin/python tools/peers/check_task.py

Compares two rollouts of `upswing simulate`, one with nine torque levels and one with any torque, row by
row: state, observation, reward. Then repeats each transition in the replay memory of `upswing train`:
torque, successor, reward, end of the episode. Prints one line, or the differences with exit code 1.
"""

import csv
import json
import random
import struct
import sys
import tempfile
from math import atan2, cos, sin
from pathlib import Path

import numpy as np

import ours
import pendulum

# Both sides run the same MuJoCo in double precision. Only the last digits of the formulas differ,
# and grow in ten seconds of motion.
ROLLOUT_TOLERANCE = 1e-8
# The replay memory has single precision, and the state is computed from it (w up to 20 rad/s).
REPLAY_TOLERANCE = 1e-5

STEPS = pendulum.EPISODE_STEPS + 100  # of the training: enough for an episode to end
OBS = 8


def expect_close(what, expected, got, tolerance):
    """Fails if numbers differ by more than the tolerance."""
    expected, got = np.asarray(expected, float), np.asarray(got, float)
    if not np.max(np.abs(expected - got)) <= tolerance:
        raise ours.Failed(f"{what}: expected {expected.tolist()}, got {got.tolist()} "
                          f"(tolerance {tolerance:g})")


def check_rollout(start, torques, folder):
    """Compares a rollout from a start under these torques."""
    schedule, table = Path(folder, "torques.csv"), Path(folder, "rollout.csv")
    schedule.write_text("torque\n" + "".join(f"{tau}\n" for tau in torques), encoding="utf-8")
    ours.run([ours.PROGRAM, "simulate", "--torque", schedule,
              "--start=" + ",".join(map(str, start)), "--csv", table])
    with open(table, encoding="utf-8", newline="") as file:
        rows = [{name: float(text) for name, text in row.items()} for row in csv.DictReader(file)]

    env = pendulum.TorquePendulum()
    env.set_state(start)
    for row, tau in zip(rows, [*torques, 0.0], strict=True):
        where = f"upswing simulate --start={start}, t = {row['t']} s"
        q1, q2, w1, w2 = (row[name] for name in ("qpos0", "qpos1", "qvel0", "qvel1"))
        expect_close(f"{where}, state", [q1, q2, w1, w2], env.state(), ROLLOUT_TOLERANCE)
        target = pendulum.ENERGY_TARGET
        obs = [cos(q1), sin(q1), w1 / 10, cos(q2), sin(q2), w2 / 20,
               (row["energy"] + target) / (2 * target), row["height"]]
        expect_close(f"{where}, observation", obs, pendulum.observe(*env.state()), 1e-6)
        expect_close(f"{where}, reward", row["reward"], pendulum.reward(*env.state(), tau),
                     ROLLOUT_TOLERANCE)
        env.apply(env.torque([tau]))
    return sum(row["inverted"] for row in rows)


def read_replay(path):
    """The replay memory of a checkpoint; a row is obs, next_obs, action, reward, discount."""
    data = path.read_bytes()
    length = struct.unpack_from("<Q", data)[0]
    begin, end = json.loads(data[8:8 + length])["agent/replay/rows"]["data_offsets"]
    return np.frombuffer(data[8 + length + begin:8 + length + end], "<f4").reshape(-1, 2 * OBS + 3)


def check_replay(folder):
    """Repeats each transition of a short training from its own observation."""
    out = Path(folder, "run")
    flags = ours.train_flags(width=8, batch=8, threads=1, steps=STEPS, out=out)
    ours.run([ours.PROGRAM, "train", *flags, "--epsilon-start=1", "--epsilon-decay=1",
              f"--learning-starts={STEPS}"])
    rows = read_replay(out / "checkpoint.safetensors").astype(float)
    expect_close("transitions in the replay memory", STEPS, len(rows), 0)

    env = pendulum.DoublePendulum()
    for step, row in enumerate(rows):
        obs, next_obs, (action, reward, discount) = row[:OBS], row[OBS:2 * OBS], row[2 * OBS:]
        env.set_state([atan2(obs[1], obs[0]), atan2(obs[4], obs[3]),
                       obs[2] * pendulum.MAX_VELOCITY1, obs[5] * pendulum.MAX_VELOCITY2])
        env.steps = step % pendulum.EPISODE_STEPS
        got_obs, got_reward, terminated, truncated, _ = env.step(int(action))
        where = f"upswing train, step {step}"
        expect_close(f"{where}, next observation", next_obs, got_obs, REPLAY_TOLERANCE)
        expect_close(f"{where}, reward", reward, got_reward, REPLAY_TOLERANCE)
        expect_close(f"{where}, discount", discount, 0 if terminated else ours.GAMMA, 1e-6)
        if step + 1 < STEPS:
            went_on = np.array_equal(next_obs, rows[step + 1][:OBS])
            expect_close(f"{where}, end of the episode", not went_on, truncated, 0)


def main():
    try:
        with tempfile.TemporaryDirectory(prefix="upswing-peers-") as folder:
            draw, steps = random.Random(1), range(pendulum.EPISODE_STEPS)
            nine = [draw.choice(pendulum.TORQUES) for _ in steps]
            limit = pendulum.TORQUE_LIMIT
            any_torque = [draw.uniform(-limit, limit) for _ in steps]
            inverted = check_rollout((0.1, -0.05, 0.2, -0.1), any_torque, folder)
            inverted += check_rollout((3.0, 0.1, 0.0, 0.0), nine, folder)
            expect_close("rows of the rollouts that are inverted, some", True, inverted > 0, 0)
            check_replay(folder)
    except ours.Failed as failed:
        sys.exit(f"check_task: {failed}")
    rows = 2 * (pendulum.EPISODE_STEPS + 1)
    print(f"the same task: {rows} rows of rollouts, {STEPS} transitions of a training")


if __name__ == "__main__":
    main()
