#!/usr/bin/env python3
"""Tests of evaluations and maps: the program's numbers, functions as policies, Ctrl-C, bad
input."""

import _thread
import csv
import json
import os
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

import gymnasium as gym
import numpy as np

import upswing
from testing import BadInputTest

ROOT = Path(os.environ["UPSWING_ROOT"])
POLICY = ROOT / "web/public/agents/d3qn.safetensors"


def program(*arguments):
    return subprocess.run([os.environ["UPSWING"], *map(str, arguments)], capture_output=True,
                          encoding="utf-8", check=True).stdout


class Evaluations(BadInputTest):
    def test_figures_are_the_programs(self):
        words = ["--episodes", 20, "--seed", 4, "--physics", "closed-form", "--set", "mass2=1.1",
                 "--sensor-noise", 0.01, "--delay", 0.02, "--randomize", 0.05]
        settings = {"episodes": 20, "seed": 4, "physics": "closed-form", "mass2": 1.1,
                    "sensor_noise": 0.01, "delay": 0.02, "randomize": 0.05}
        theirs = json.loads(program("eval", POLICY, *words, "--json"))
        ours = upswing.evaluate(POLICY, **settings)
        self.assertEqual(ours, theirs)
        rows = list(csv.DictReader(program("eval", POLICY, *words, "--episodes-csv", "-")
                                   .splitlines()))
        self.assertEqual(list(ours.per_episode), list(rows[0]))
        for name, column in ours.per_episode.items():
            expected = [float(row[name]) if row[name] else np.nan for row in rows]
            np.testing.assert_array_equal(column, expected)
        self.assertIn("of 20 episodes succeed", repr(ours))

    def test_gymnasium_environments(self):
        name = "upswing/DoublePendulumSwingUp-v0"
        policy = upswing.load_policy(POLICY)
        env = gym.make(name, physics="closed-form")
        # The return of each episode, by Gymnasium's own loop.
        returns = []
        for seed in (5, 6):
            obs, total, ended = env.reset(seed=seed)[0], 0.0, False
            while not ended:
                obs, reward, terminated, truncated, _ = env.step(policy.act(obs).astype(np.float32))
                total, ended = total + reward, terminated or truncated
            returns.append(total)
        for given in (lambda: gym.make(name, physics="closed-form"), env,
                      gym.wrappers.RecordEpisodeStatistics(env)):
            for acts in (POLICY, policy, policy.act, lambda obs: policy.act(obs)[:, 0]):
                result = upswing.evaluate(acts, env=given, episodes=2, seed=5)
                np.testing.assert_allclose(result.per_episode["return"], returns, rtol=1e-12)
        self.assertEqual(result["return"]["mean"], np.mean(result.per_episode["return"]))
        self.assertEqual(result["length"], {"mean": 1000, "deviation": 0})
        self.assertIn("2 episodes, mean return", repr(result))
        short = upswing.evaluate(policy, env=name, episodes=1, max_episode_steps=7)
        self.assertEqual(short["length"]["mean"], 7)
        for what, arguments in (
                ("policy: expected one for observations", {"env": "CartPole-v1"}),
                ("mass2: expected none with env", {"env": name, "mass2": 2}),
                ("threads: expected none with env", {"env": name, "threads": 2}),
                ("env: expected a single environment", {"env": gym.make_vec(name, 2)}),
                ("episodes: expected 1 or more, got 0", {"env": name, "episodes": 0}),
                ("max_episode_steps: expected env with it", {"max_episode_steps": 7})):
            self.refuse(what, upswing.evaluate, policy, **arguments)
        for wrong in ([1, 2], "x", None, np.nan):
            self.refuse(f"policy: expected an action of 1 finite number, got {wrong}",
                        upswing.evaluate, lambda obs, wrong=wrong: wrong, env=name)
        for wrong in (2, 0.5):
            self.refuse(f"policy: expected an action of Discrete(2), got {wrong}",
                        upswing.evaluate, lambda obs, wrong=wrong: wrong, env="CartPole-v1")
        self.refuse("policy: expected a Policy, a path or a function", upswing.evaluate, 3, env=name)

    def test_mujoco_is_usual_and_a_policy_will_do(self):
        policy = upswing.load_policy(POLICY)
        result = upswing.evaluate(policy, episodes=3)
        self.assertEqual((result["physics"], result["success_rate"]), ("mujoco", 1))

    def test_a_function_is_judged_as_the_policy_that_it_asks(self):
        policy = upswing.load_policy(POLICY)
        shapes = set()

        def flat(obs):
            shapes.add((obs.shape[1:], obs.dtype))
            return policy.act(obs)[:, 0]

        arguments = {"episodes": 60, "physics": "closed-form", "threads": 2}
        direct = upswing.evaluate(policy, **arguments)
        for function in (flat, policy.act, lambda obs: policy.act(obs).astype(np.float32)):
            result = upswing.evaluate(function, **arguments)
            np.testing.assert_array_equal(result.per_episode["return"],
                                          direct.per_episode["return"])
        self.assertEqual(shapes, {((8,), np.dtype(np.float32))})
        remembering = upswing.load_policy(POLICY.with_name("d3qn-randomized.safetensors"))
        result = upswing.evaluate(remembering.act, memory=4, episodes=3, physics="closed-form")
        self.assertEqual(result["success_rate"], 1)
        for memory in (-1, 101, 2**31 - 1):
            with self.assertRaisesRegex(upswing.InputError, "memory: expected 0 to 100 steps"):
                upswing.evaluate(remembering.act, memory=memory, episodes=3)

    def test_a_goal_is_drawn_or_given(self):
        policy = upswing.load_policy(POLICY.with_name("any-pose.safetensors"))
        arguments = {"episodes": 6, "physics": "closed-form"}
        drawn = upswing.evaluate(policy, **arguments)
        self.assertEqual(sum(t["episodes"] for t in drawn["transitions"].values()), 6)
        self.assertGreater(len(set(drawn.per_episode["goal1"])), 1)
        given = upswing.evaluate(policy, goal="up-down", **arguments)
        self.assertEqual(given["transitions"],
                         {"down-down to up-down": {"episodes": 6, "successes": 6}})
        with self.assertRaisesRegex(upswing.InputError, "goal: expected one of up-up"):
            upswing.evaluate(policy, goal="up", **arguments)
        with self.assertRaisesRegex(upswing.InputError, "expected a policy for any pose"):
            upswing.evaluate(POLICY, goal="up-down", **arguments)

    def test_an_episode_does_not_depend_on_how_many_there_are(self):
        arguments = {"physics": "closed-form", "randomize": 0.1, "sensor_noise": 0.01}
        many = upswing.evaluate("lqr", episodes=4100, **arguments).per_episode
        for name, column in upswing.evaluate("lqr", episodes=20, **arguments).per_episode.items():
            np.testing.assert_array_equal(many[name][:20], column)
        self.assertEqual(len(set(many["q1"])), 4100)  # every start is different

    def test_progress_and_exceptions(self):
        shares = []
        upswing.evaluate(POLICY, episodes=500, physics="closed-form", threads=1, progress=shares.append)
        self.assertEqual(shares, sorted(shares))
        self.assertTrue(shares and 0 < shares[0] <= 1)

        def broken(obs):
            raise KeyError("mine")

        with self.assertRaises(KeyError):
            upswing.evaluate(broken, episodes=100, threads=2)

    def test_ctrl_c_ends_it(self):
        for work in (lambda: upswing.evaluate(POLICY, episodes=1000000, physics="closed-form"),
                     lambda: upswing.map(POLICY, "mass2=0.5:2:300", "mass1=0.5:2:300")):
            timer = threading.Timer(0.7, _thread.interrupt_main)
            timer.start()
            with self.assertRaises(KeyboardInterrupt):
                work()
            timer.join()

    def test_a_policy_acts_on_a_plant_of_another_size(self):
        small = {"mass1": 0.01, "mass2": 0.01, "length1": 0.05, "length2": 0.05, "armature": 1e-6,
                 "damping1": 6e-5, "damping2": 6e-5, "torque_limit": 0.005}
        with tempfile.TemporaryDirectory() as folder:
            plant = Path(folder) / "small.toml"
            plant.write_text("[plant]\n" + "".join(f"{k} = {v}\n" for k, v in small.items()))
            for policy in ("sac", "tvlqr"):
                result = upswing.evaluate(policy, plant=plant, episodes=10, physics="closed-form")
                self.assertEqual(result["success_rate"], 1, policy)

    def test_bad_input(self):
        policy = upswing.load_policy(POLICY)
        for what, settings in {
                "episodes: expected an integer in [1, 1000000]": {"episodes": 0},
                "seed: expected": {"seed": -1},
                "threads: expected": {"threads": 1000},
                'physics: expected one of mujoco, closed-form, got "x"': {"physics": "x"},
                'mas: expected a setting, got "mas" (did you mean mass?)': {"mas": 1},
                "mass2: expected a number in [0.001, 100000]": {"mass2": "heavy"},
                "delay: expected a multiple of 0.02": {"delay": 0.01},
                'model: expected a setting, got "model"': {"model": "own.xml"}}.items():
            self.refuse(what, upswing.evaluate, policy, **settings)
        for what, function in {"for each of 1 observations, got 2": lambda obs: [1, 2],
                               "finite torques": lambda obs: [np.nan] * len(obs)}.items():
            self.refuse(what, upswing.evaluate, function, episodes=1)
        self.refuse("got int", upswing.evaluate, 3)
        self.refuse("memory: expected none with a policy", upswing.evaluate, policy, memory=2)
        self.refuse("memory: expected an integer", upswing.evaluate, policy, memory="2")


class Maps(unittest.TestCase):
    def test_cells_are_the_programs(self):
        with tempfile.TemporaryDirectory() as folder:
            theirs = json.loads(program(
                "map", POLICY, "--x", "mass2=-30%:+30%:5", "--y", "delay=0:0.04", "--episodes", 4,
                "--set", "gravity=9.7", "--seed", 2, "--out", f"{folder}/a", "--json"))
            ours = upswing.map(POLICY, "mass2=-30%:+30%:5", "delay=0:0.04", episodes=4,
                               gravity=9.7, seed=2, out=f"{folder}/b")
            self.assertEqual(Path(folder, "b/map.csv").read_text(),
                             Path(folder, "a/map.csv").read_text())
            self.assertTrue(Path(folder, "b/map.png").stat().st_size > 1000)
        theirs.pop("files")
        self.assertEqual({key: ours[key] for key in theirs}, theirs)
        self.assertEqual(ours.successes.shape, (3, 5))
        np.testing.assert_array_equal(ours.success_rate, theirs["success_rate"])
        np.testing.assert_array_equal(ours.x, theirs["x"]["values"])
        self.assertEqual((ours.x_label, ours.y_label), ("mass2 (kg)", "delay (s)"))
        seconds = np.array(theirs["swing_up_seconds"], float)
        np.testing.assert_array_equal(ours.swing_up_seconds, seconds)

    def test_nothing_is_written_unless_asked_for(self):
        with tempfile.TemporaryDirectory() as folder:
            before = os.getcwd()
            os.chdir(folder)
            try:
                upswing.map("lqr", "q1=170deg:190deg:3", "q2=-10deg:10deg:3")
            finally:
                os.chdir(before)
            self.assertEqual(os.listdir(folder), [])

    def test_bad_input(self):
        for what, arguments in {
                'x: expected NAME=FROM:TO': {"x": "mass2"},
                "y: expected a setting, got": {"y": "mas=1:2"},
                "x and --y: expected two different": {"x": "mass=1:2", "y": "mass1=1:2"},
                "mass2: expected a quantity that is on no axis": {"mass2": 1},
                "gravity: expected a number": {"gravity": -1},
                "episodes: expected": {"episodes": 0}}.items():
            with self.assertRaises(upswing.InputError) as caught:
                upswing.map("lqr", **arguments)
            self.assertIn(what, str(caught.exception))


if __name__ == "__main__":
    unittest.main()
