#!/usr/bin/env python3
"""Tests of policies: files act as in the program; broken and foreign files are refused."""

import copy
import csv
import hashlib
import io
import multiprocessing
import os
import pickle
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
AGENTS = ROOT / "web/public/agents"
ID = "upswing/DoublePendulum-v0"


def simulate(policy, *arguments):
    """The rows of the program's `simulate`."""
    done = subprocess.run([os.environ["UPSWING"], "simulate", policy, *arguments],
                          capture_output=True, encoding="utf-8", check=True)
    return [{name: float(text) for name, text in row.items()}
            for row in csv.DictReader(io.StringIO(done.stdout))]


class Policies(unittest.TestCase):
    def test_closed_loops_are_the_programs(self):
        """Acting on the environment's observations gives the motion of `simulate`, bit for bit."""
        start = [0.3, -0.1, 0.2, 0]
        for name in ("d3qn", "d3qn-randomized", "sac", "ppo"):
            path = AGENTS / f"{name}.safetensors"
            with self.subTest(name):
                policy = upswing.load_policy(path)
                rows = simulate(path, "--seconds", "4", "--start", ",".join(map(str, start)))
                env = gym.make(ID, memory=policy.memory, episode_seconds=10).unwrapped
                obs, _ = env.reset(seed=0, options={"state": start})
                for row in rows[:-1]:
                    np.testing.assert_array_equal(
                        env.state, [row[key] for key in ("q1", "q2", "w1", "w2")])
                    obs, _, _, _, info = env.step(policy.act(obs))
                    self.assertEqual(info["torque"], row["torque"])

    def test_a_policy_for_any_pose_reaches_the_goals_of_its_environment(self):
        policy = upswing.load_policy(AGENTS / "any-pose.safetensors")
        self.assertTrue(policy.any_pose)
        env = gym.make(ID, any_pose=True, random_start_share=0, episode_seconds=12,
                       physics="closed-form")
        self.assertEqual(env.observation_space.shape, (policy.obs_size,))
        goals = set()
        for seed in range(12):
            obs, _ = env.reset(seed=seed)
            goal, truncated = tuple(obs[8:]), False
            goals.add(goal)
            while not truncated:
                obs, _, _, truncated, info = env.step(policy.act(obs))
                self.assertEqual(tuple(obs[8:]), goal)
            self.assertTrue(info["at_goal"])
        self.assertEqual(goals, {(1, 1), (1, -1), (-1, 1), (-1, -1)})
        for seed in range(12):  # an episode begins in another pose than its goal
            obs, _ = env.reset(seed=seed, options={"goal": np.array("down-down")})
            self.assertEqual(tuple(obs[8:]), (-1, -1))
            self.assertLess(min(np.cos(env.unwrapped.state[0]), np.cos(env.unwrapped.state[:2].sum())), 0)
        start = [np.pi, 0, 0, 0]
        obs, _ = env.reset(options={"state": start, "goal": "up-down"})
        np.testing.assert_array_equal(env.unwrapped.state, start)
        for _ in range(300):
            obs, _, _, _, info = env.step(policy.act(obs))
            self.assertEqual(tuple(obs[8:]), (1, -1))
        self.assertTrue(info["at_goal"])
        self.assertGreater(np.cos(env.unwrapped.state[:2].sum()), np.cos(0.5))

    def test_one_and_many_observations(self):
        obs = np.random.default_rng(0).normal(size=(70, 8)).astype(np.float32)
        for name in ("d3qn", "sac"):
            policy = upswing.load_policy(AGENTS / f"{name}.safetensors")
            actions = policy.act(obs)
            self.assertEqual((actions.shape, actions.dtype), ((70, 1), np.float64))
            for k in (0, 33, 69):
                np.testing.assert_array_equal(policy(obs[k]), actions[k])
            np.testing.assert_array_equal(policy.act(obs.astype(np.float64)), actions)
            np.testing.assert_array_equal(policy.act(obs[::2]), actions[::2])
            np.testing.assert_array_equal(policy.act(obs.tolist()), actions)
            self.assertEqual(policy.act(np.empty((0, 8))).shape, (0, 1))

    def test_values(self):
        obs = np.random.default_rng(1).normal(size=(50, 8))
        policy = upswing.load_policy(AGENTS / "d3qn.safetensors")
        values = policy.values(obs)
        self.assertEqual((values.shape, values.dtype), ((50, 9), np.float32))
        np.testing.assert_array_equal(policy.value_actions, np.linspace(-5, 5, 9))
        np.testing.assert_array_equal(policy.value_actions[values.argmax(axis=1)],
                                      policy.act(obs)[:, 0])
        np.testing.assert_array_equal(policy.values(obs[3]), values[3])
        self.assertIsNone(policy.spread(obs))

    def test_spread_of_an_actor(self):
        obs = np.random.default_rng(1).normal(size=(50, 8))
        policy = upswing.load_policy(AGENTS / "sac.safetensors")
        low, high = policy.spread(obs)
        self.assertEqual(low.shape, (50, 1))
        middle = policy.act(obs)
        self.assertTrue(((low <= middle) & (middle <= high)).all())
        self.assertTrue((low < high).any())

    def test_what_a_file_says(self):
        policy = upswing.load_policy(AGENTS / "d3qn-randomized.safetensors")
        self.assertEqual((policy.task, policy.memory, policy.obs_size), ("double-pendulum", 4, 20))
        self.assertEqual(policy.info["agent"], "d3qn-randomized")
        self.assertEqual(policy.info["plant"]["mass1"], 1)
        self.assertGreater(policy.num_parameters, 10000)
        self.assertIn("d3qn-randomized", repr(policy))
        said = subprocess.run([os.environ["UPSWING"], "info", AGENTS / "d3qn-randomized.safetensors"],
                              capture_output=True, check=True, encoding="utf-8").stdout
        self.assertIn(f"step {policy.info['step']},", said)
        self.assertIn(f"{policy.num_parameters:,}", said)

    def test_saved_is_the_same_file(self):
        for path in sorted(AGENTS.glob("*.safetensors")):
            policy = upswing.load_policy(path)
            with tempfile.TemporaryDirectory() as folder:
                copy, again = Path(folder, "a.safetensors"), Path(folder, "b.safetensors")
                policy.save(copy)
                upswing.load_policy(copy).save(again)
                self.assertEqual(*(hashlib.sha256(file.read_bytes()).hexdigest()
                                   for file in (copy, again)))

    def test_controllers(self):
        policy = upswing.load_policy("lqr", lqr_torque=0.1, made_for={"mass2": 1.2})
        self.assertEqual((policy.kind, policy.info["plant"]["mass2"]), ("lqr", 1.2))
        env = gym.make(ID, mass2=1.2, episode_seconds=5).unwrapped
        obs, _ = env.reset(seed=0, options={"state": [np.pi + 0.05, -0.05, 0, 0]})
        for _ in range(200):
            obs, _, _, _, info = env.step(policy.act(obs))
        self.assertTrue(info["at_goal"])
        self.assertLess(abs(env.state[0] - np.pi), 1e-3)

    def test_shipped_policy(self):
        policy, file = upswing.load_policy("sac"), upswing.load_policy(AGENTS / "sac.safetensors")
        obs = np.ones((3, 8))
        self.assertEqual(policy.name, "sac")
        np.testing.assert_array_equal(policy.act(obs), file.act(obs))

    def test_threads_share_a_policy(self):
        policy = upswing.load_policy(AGENTS / "d3qn.safetensors")
        obs = np.random.default_rng(0).normal(size=(500, 8))
        expected = policy.act(obs)
        wrong = []

        def work():
            for _ in range(20):
                if not np.array_equal(policy.act(obs), expected):
                    wrong.append(1)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])


class Copies(unittest.TestCase):
    def test_pickled_policies_act_alike(self):
        obs = np.random.default_rng(1).normal(size=(50, 8)).astype(np.float32)
        for policy in (upswing.load_policy(AGENTS / "sac.safetensors"),
                       upswing.load_policy("lqr", made_for={"mass2": 1.2}, lqr_torque=2)):
            copy = pickle.loads(pickle.dumps(policy))
            np.testing.assert_array_equal(copy.act(obs), policy.act(obs))
            self.assertEqual(copy.info, policy.info)


    def test_copies_do_not_read_files_again(self):
        rng = np.random.default_rng(1)
        near = np.array([np.pi, 0, 0, 0]) + rng.normal(scale=0.02, size=(20, 4))
        upright = gym.make_vec(ID, 20).reset(seed=0, options={"state": near})[0]
        obs = np.concatenate([upright, rng.normal(size=(50, 8)).astype(np.float32)])
        with tempfile.TemporaryDirectory() as folder:
            plant, file = Path(folder, "plant.toml"), Path(folder, "policy.safetensors")
            policies = {}

            def write(mass2, agent):
                plant.write_text(f"[plant]\nmass2 = {mass2}\n")
                file.write_bytes((AGENTS / f"{agent}.safetensors").read_bytes())

            write(1.2, "d3qn")
            for name, made_for in (("lqr", plant), ("energy", str(plant)), ("pfl", plant)):
                policies[name] = upswing.load_policy(name, made_for=made_for, lqr_torque=2)
            policies["hybrid"] = upswing.load_policy("hybrid", swing_up=file, made_for=plant)
            policies["file"] = upswing.load_policy(file)
            expected = {name: policy.act(obs) for name, policy in policies.items()}
            pickled = pickle.dumps(policies)
            handles = {name: policy._handle for name, policy in policies.items()}

            def check():
                for copies in (pickle.loads(pickled), copy.deepcopy(policies),
                               {name: copy.copy(policy) for name, policy in policies.items()},
                               pickle.loads(pickle.dumps(pickle.loads(pickled)))):
                    for name, policy in copies.items():
                        np.testing.assert_array_equal(policy.act(obs), expected[name], name)
                        self.assertEqual(policy.info, policies[name].info)
                        self.assertEqual(repr(policy), repr(policies[name]))
                        self.assertIsNot(policy._handle, handles[name])

            check()
            write(2.5, "sac")
            # Read again, they are others.
            other = upswing.load_policy("lqr", made_for=plant, lqr_torque=2).act(obs)
            self.assertFalse(np.array_equal(other, expected["lqr"]))
            check()
            plant.unlink()
            file.unlink()
            check()
            before = os.getcwd()
            os.chdir(folder)
            self.addCleanup(os.chdir, before)
            Path("lqr").write_text("a file with the name of a controller")
            check()
            os.chdir(before)
            if "spawn" in multiprocessing.get_all_start_methods():
                with multiprocessing.get_context("spawn").Pool(1) as pool:
                    np.testing.assert_array_equal(pool.apply(policies["hybrid"].act, (obs,)),
                                                  expected["hybrid"])
        # An evaluation of a copy designs it for each plant, as one of the original does.
        settings = {"episodes": 3, "physics": "closed-form", "randomize": 0.2}
        policy = upswing.load_policy("lqr", lqr_torque=2, made_for={"mass2": 1.2})
        self.assertEqual(upswing.evaluate(copy.deepcopy(policy), **settings),
                         upswing.evaluate(policy, **settings))


class BadInput(BadInputTest):
    def test_files(self):
        self.refuse("no such file", lambda: upswing.load_policy("nothing.safetensors"))
        self.refuse("did you mean lqr?", lambda: upswing.load_policy("lqrr"))
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "x.safetensors")
            content = (AGENTS / "d3qn.safetensors").read_bytes()
            for broken in (b"", b"hello", content[:-1], content[:5000], bytes([255] * 100),
                           content[:-1] + bytes([content[-1] ^ 1])):
                file.write_bytes(broken)
                self.refuse(str(file), lambda: upswing.load_policy(file))
            self.refuse(folder, lambda: upswing.load_policy(folder))

    def test_a_long_message(self):
        name = '{"another --%s": 1}' % ("a" * 1_000_000)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "x.safetensors")
            file.write_bytes(len(name).to_bytes(8, "little") + name.encode())
            self.refuse("another aaa", lambda: upswing.load_policy(file))

    def test_observations(self):
        policy = upswing.load_policy(AGENTS / "d3qn.safetensors")
        self.refuse("expected 8 numbers", lambda: policy.act(np.zeros((3, 9))))
        self.refuse("got nan in observation 1", lambda: policy.act([[0] * 8, [np.nan] * 8]))
        self.refuse("expected shape (N, 8)", lambda: policy.act(np.zeros((1, 1, 8))))
        self.refuse("expected shape (N, 8)", lambda: policy.act(0))

    def test_settings_of_controllers(self):
        self.refuse("lqr_torq: expected a setting", lambda: upswing.load_policy("lqr", lqr_torq=1))
        self.refuse("made_for mass2: expected",
                    lambda: upswing.load_policy("lqr", made_for={"mass2": -1}))
        self.refuse("expected a controller", lambda: upswing.load_policy(
            AGENTS / "d3qn.safetensors", lqr_torque=1))

    def test_places_that_cannot_be_written(self):
        policy = upswing.load_policy(AGENTS / "d3qn.safetensors")
        with self.assertRaises(upswing.Error):
            policy.save("/nowhere/at/all.safetensors")
        self.refuse("expected a policy that has a file", lambda: upswing.load_policy("lqr").save("/tmp/x.safetensors"))


if __name__ == "__main__":
    unittest.main()
