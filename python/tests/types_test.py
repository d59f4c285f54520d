#!/usr/bin/env python3
"""Checks the type hints by mypy --strict: of the package, and of a user's script with every public
name."""

import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ["UPSWING_ROOT"])
sys.path.insert(0, str(ROOT / "src/cli"))
import test_environment  # noqa: E402

test_environment.make("python-test")
MYPY = test_environment.folder("python-test") / "bin/mypy"

SCRIPT = '''
from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
import upswing
from upswing import (DoublePendulumEnv, DoublePendulumVectorEnv, Error, Evaluation, Failure, InputError, Map, Policy,
                     Setting, Training, agents, evaluate, load_policy, machine, map, settings, train)


def stop(row: dict[str, Any]) -> bool:
    return bool(row["step"] < 1000)


def act(obs: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    return -0.5 * obs[:, 2]


version: str = upswing.__version__
training: Training = train("fast", seed=1, hidden=[64, 64], mass2=1.1, out=Path("run"), on_metrics=stop,
                           logging=logging.INFO, reward="E", start_policy=Path("x"), physics="closed-form")
train(agent="sac", logging="INFO", progress=False, on_best=lambda policy: policy.save("x"))
best: Policy = training.best
torque: npt.NDArray[np.float64] = best.act(np.zeros(8))
values: npt.NDArray[np.float32] = best.values(np.zeros((2, 8)))
spread = best.spread(np.zeros(8))
if spread is not None:
    low, high = spread
step: int | None = training.solved_step
result: Evaluation = evaluate(act, episodes=3, randomize=0.1, sensor_noise=0.01)
result.per_episode["return"].mean()
chart: Map = map(best, x="mass=-30%:+30%", y="delay=0:0.1", episodes=2)
chart.success_rate.shape
every: dict[str, Setting] = settings("fast")
names: dict[str, str] = agents()
env = DoublePendulumEnv(mass2=1.2, render_mode="rgb_array")
obs, info = env.reset(seed=1, options={"state": [0, 0, 0, 0]})
obs, reward, terminated, truncated, info = env.step(np.array([1.0]))
r: float = reward
envs = DoublePendulumVectorEnv(num_envs=3, physics="closed-form")
obs, infos = envs.reset(seed=[1, 2, 3])
obs, rewards, ends, cuts, infos = envs.step(envs.action_space.sample())
rewards.mean()
made = gym.make("upswing/DoublePendulum-v0")
controller: machine.Controller = machine.Controller(best, twin=Path("twin.toml"), start=[0, 0, 0, 0], latency=None,
                                                    max_torque=0.1)
torques: list[float] = controller(0.1, np.zeros(2), [0, 0])
stopped: str | None = controller.stopped
fake = machine.FakeMachine("cloudpendulum", draw=1)
fake.send(torques)
angles: list[float] = fake.read()
train("ppo", env=made, steps=100, num_envs=2)
train("ppo", env=lambda: gym.make("CartPole-v1"))
try:
    load_policy("lqr", made_for={"mass2": 1.2}, lqr_torque=2)
except (InputError, Failure) as error:
    e: Error = error
'''


class Types(unittest.TestCase):
    def check(self, *what, **more):
        done = subprocess.run(
            [MYPY, "--strict", "--ignore-missing-imports", "--cache-dir", ROOT / "build/mypy",
             "--python-executable", sys.executable, *what], encoding="utf-8", check=False,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_package(self):
        self.check("-p", "upswing", env=os.environ | {"MYPYPATH": os.environ["PYTHONPATH"]})

    def test_script_with_every_name(self):
        import upswing  # pylint: disable=import-outside-toplevel
        for name in upswing.__all__:
            self.assertRegex(SCRIPT, rf"\b{re.escape(name)}\b")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "script.py"
            path.write_text(SCRIPT, encoding="utf-8")
            self.check(path, env=os.environ | {"MYPYPATH": os.environ["PYTHONPATH"]})


if __name__ == "__main__":
    unittest.main()
