#!/usr/bin/env python3
"""Tests of trainings on Gymnasium environments: learning, ends of episodes, vector environments,
bits, files, Ctrl-C, bad input."""

import hashlib
import json
import os
import shutil
import subprocess
import tempfile
import threading
import unittest
import warnings
from pathlib import Path

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import upswing
from testing import BadInputTest, interrupted

TINY = {"hidden": [16], "threads": 1, "progress": False}
# A training of a fraction of a second.
SHORT = TINY | {"steps": 600, "learning_starts": 100, "batch": 16, "eval_every": 300,
                "eval_episodes": 2, "log_every": 200}


class Reach(gym.Env):
    """A point x that the action moves by up to 0.5; the reward is -x²."""

    observation_space = spaces.Box(-np.inf, np.inf, (2,), np.float32)

    def __init__(self, low=-1.0, high=1.0, size=1, length=20):
        self.action_space = spaces.Box(low, high, (size,), np.float32)
        self._length, self._x, self._steps = length, 0.0, 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._x, self._steps = self.np_random.uniform(-1, 1), 0
        return self._obs(), {}

    def step(self, action):
        assert self.action_space.contains(action), action
        self._x += 0.5 * float(np.mean(action))
        self._steps += 1
        return self._obs(), -self._x**2, False, self._steps >= self._length, {}

    def _obs(self):
        return np.array([self._x, 1.0], np.float32)


class Broken(Reach):
    """An environment with a fault in a chosen step, counted over all episodes."""

    def __init__(self, fault, at=150):
        super().__init__()
        self._fault, self._at, self._count = fault, at, 0

    def step(self, action):
        self._count += 1
        obs, reward, terminated, truncated, info = super().step(action)
        if self._count != self._at:
            return obs, reward, terminated, truncated, info
        if self._fault == "raise":
            raise ValueError("the gear\nis broken")
        if self._fault == "nan":
            obs = np.array([np.nan, 0], np.float32)
        if self._fault == "shape":
            obs = np.zeros(3, np.float32)
        if self._fault == "reward":
            reward = float("inf")
        return obs, reward, terminated, truncated, info


class OneStep(gym.Env):
    """Episodes of one step with the reward 1, which end by a termination or a time limit."""

    observation_space = spaces.Box(-1, 1, (1,), np.float32)
    action_space = spaces.Discrete(2)

    def __init__(self, terminates):
        self._terminates = terminates

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.ones(1, np.float32), {}

    def step(self, action):
        return np.ones(1, np.float32), 1.0, self._terminates, not self._terminates, {}


def sha(policy):
    with tempfile.TemporaryDirectory() as folder:
        policy.save(Path(folder) / "policy")
        return hashlib.sha256((Path(folder) / "policy").read_bytes()).hexdigest()


def program(*arguments):
    return subprocess.run([os.environ["UPSWING"], *map(str, arguments)], capture_output=True,
                          encoding="utf-8", check=False)


class InFolder(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)


class Learns(unittest.TestCase):
    def test_dqn_balances_the_cart(self):
        training = upswing.train("fast", env="CartPole-v1", seed=1, steps=15000, solved_return=195,
                                 eval_every=2500, eval_episodes=10, hidden=[64, 64],
                                 **{k: v for k, v in TINY.items() if k != "hidden"})
        self.assertGreater(training.best_return, 150)
        self.assertEqual(training.best.task, "gymnasium/CartPole-v1")

    def test_sac_and_ppo_reach(self):
        # At rest the mean return is about -20/3.
        for agent, more in (("sac", {"steps": 2500, "learning_starts": 300, "batch": 64,
                                     "learning_rate": 3e-3, "learning_rate_end": 3e-3}),
                            ("ppo", {"steps": 20480, "num_envs": 4, "horizon": 128,
                                     "learning_rate": 3e-3})):
            with self.subTest(agent):
                training = upswing.train(agent, env=lambda: Reach(size=2), max_episode_steps=20,
                                         eval_every=10**6, eval_episodes=20, **TINY | more)
                self.assertGreater(training.best_return, -2)
                action = training.last.act([[1.0, 1], [-1, 1]])
                self.assertEqual(action.shape, (2, 2))
                self.assertLess(action[0].mean(), -0.5)
                self.assertGreater(action[1].mean(), 0.5)

    def test_dqn_chooses_from_levels_of_a_box(self):
        policy = upswing.train("dqn", env=Reach(-3.0, 3.0), max_episode_steps=20, levels=3,
                               **SHORT).last
        np.testing.assert_array_equal(policy.value_actions, [-3, 0, 3])

    def test_a_time_limit_has_a_future_and_a_termination_has_none(self):
        settings = SHORT | {"steps": 4000, "gamma": 0.9, "n_step": 1, "learning_rate": 0.01,
                            "layer_norm": False, "tau": 0.1, "updates_per_step": 0.5}
        for terminates, value in ((True, 1), (False, 10)):
            training = upswing.train("dqn", env=lambda: OneStep(terminates), max_episode_steps=9,
                                     **settings)
            np.testing.assert_allclose(training.last.values([1.0]), value, rtol=0.1)
        # A limit of its own is a time limit too.
        limited = upswing.train("dqn", env=lambda: OneStep(True), max_episode_steps=1, **settings)
        self.assertEqual(limited.episodes, 4000)

    def test_solved_ends_the_training(self):
        training = upswing.train("dqn", env=lambda: OneStep(True), max_episode_steps=1,
                                 solved_return=1, **SHORT | {"steps": 10**6})
        self.assertTrue(training.solved)
        self.assertEqual((training.steps, training.solved_step), (600, 300))
        self.assertEqual(training.best_success_rate, 1)


class Bits(unittest.TestCase):
    def test_a_seed_gives_the_same_policy(self):
        def train(seed, **more):
            return upswing.train("sac", env=Reach, max_episode_steps=20, seed=seed,
                                 **SHORT | more).last

        self.assertEqual(sha(train(1)), sha(train(1)))
        # Evaluations have environments of their own. The settings are in the file.
        obs = np.linspace(-1, 1, 20).reshape(10, 2)
        np.testing.assert_array_equal(train(1).act(obs), train(1, eval_every=200).act(obs))
        self.assertTrue((train(1).act(obs) != train(2).act(obs)).all())

    def test_an_environment_and_its_maker_are_the_same(self):
        settings = SHORT | {"num_envs": 3, "max_episode_steps": 20}
        self.assertEqual(sha(upswing.train("sac", env=Reach(), **settings).last),
                         sha(upswing.train("sac", env=Reach, **settings).last))

    def test_the_modes_of_vector_environments_are_the_same(self):
        seen = set()
        for mode in AutoresetMode:
            env = SyncVectorEnv([Reach] * 3, autoreset_mode=mode)
            training = upswing.train("sac", env=env, max_episode_steps=20, **SHORT)
            self.assertEqual(training.episodes, 30)
            seen.add(sha(training.last))
            # Episodes that the training's own limit ends.
            env = SyncVectorEnv([Reach] * 3, autoreset_mode=mode)
            self.assertEqual(upswing.train("sac", env=env, max_episode_steps=10, **SHORT).episodes,
                             60)
        self.assertEqual(len(seen), 1)


class Closing(unittest.TestCase):
    def test_only_environments_of_the_training_are_closed(self):
        closed = []

        class Noted(Reach):
            def close(self):
                closed.append(self)

        env = Noted()
        upswing.train("sac", env=env, num_envs=2, max_episode_steps=20, **SHORT)
        self.assertEqual((len(closed), env in closed), (3, False))
        closed.clear()
        upswing.train("sac", env=Noted, num_envs=2, max_episode_steps=20, **SHORT)
        self.assertEqual(len(closed), 4)


class Files(InFolder):
    def test_the_limit_of_a_wrapper(self):
        def env():
            return gym.wrappers.TimeLimit(Reach(length=100), 10)

        self.assertEqual(upswing.train("sac", env=env, **SHORT).episodes,
                         upswing.train("sac", env=Reach, max_episode_steps=10, **SHORT).episodes)

    def test_a_run_has_its_files(self):
        run = self.path / "run"
        training = upswing.train("ppo", env="CartPole-v1", out=run, num_envs=2, horizon=64,
                                 **{k: v for k, v in SHORT.items() if k != "learning_starts"})
        self.assertEqual({path.name for path in run.iterdir()} >= {
            "config.toml", "policy.safetensors", "evals.csv", "episodes.csv", "metrics.csv"}, True)
        policy = upswing.load_policy(run)
        obs = np.random.default_rng(0).normal(size=(50, 4)).astype(np.float32)
        np.testing.assert_array_equal(policy.act(obs), training.best.act(obs))
        self.assertEqual(set(np.unique(policy.act(obs))) - {0.0, 1.0}, set())
        info = program("info", run)
        self.assertEqual(info.returncode, 0, info.stderr)
        self.assertIn("gymnasium/CartPole-v1", info.stdout)
        self.assertIn("one of 0, 1", info.stdout)
        # A description from the run folder trains again.
        again = upswing.train(env="CartPole-v1", config=run / "config.toml", progress=False)
        self.assertEqual(sha(again.best), sha(training.best))

    def test_what_needs_the_environment_is_refused(self):
        run = self.path / "run"
        upswing.train("sac", env=lambda: Reach(size=2), max_episode_steps=20, out=run, **SHORT)
        for command in (["eval", run], ["map", run], ["view", run], ["plot", run],
                        ["simulate", run], ["train", "--resume", run],
                        ["train", "--config", run / "config.toml", "--out", self.path / "x"],
                        ["export", run, "--c", self.path / "x.h"],  # two numbers per action
                        ["export", run, "--page", self.path / "page"],
                        ["train", "--task", "gymnasium", "--out", self.path / "x"]):
            with self.subTest(command[0]):
                done = program(*command)
                self.assertEqual(done.returncode, 2, done.stdout)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertRegex(done.stderr, "gymnasium/Reach|upswing.train|one number per action")
        self.assertEqual(sorted(os.listdir(self.path)), ["run"])
        with self.assertRaisesRegex(upswing.InputError, "gymnasium/Reach: expected a task"):
            upswing.evaluate(run)
        onnx = program("export", run, "--onnx", self.path / "policy.onnx")
        self.assertEqual(onnx.returncode, 0, onnx.stderr)

    @unittest.skipUnless(shutil.which("gcc"), "no gcc")
    def test_c_code_acts_as_the_policy(self):
        (self.path / "main.c").write_text(
            '#include "policy.h"\n#include <stdio.h>\n'
            "int main(void) {\n  float obs[POLICY_OBSERVATION_SIZE], action;\n"
            "  policy_state state;\n  policy_init(&state);\n"
            "  while (fread(obs, sizeof(obs), 1, stdin) == 1) {\n"
            "    if (policy_control(&state, obs, &action) != POLICY_OK) return 1;\n"
            "    fwrite(&action, sizeof(action), 1, stdout);\n  }\n"
            "  return policy_selftest() == POLICY_OK ? 0 : 2;\n}\n")
        for agent, env in (("fast", "CartPole-v1"), ("sac", lambda: Reach(-2.0, 2.0))):
            policy = upswing.train(agent, env=env, max_episode_steps=20, **SHORT).last
            policy.save(self.path / "policy.safetensors")
            done = program("export", self.path / "policy.safetensors", "--c", self.path / "policy.h")
            self.assertEqual(done.returncode, 0, done.stderr)
            subprocess.run(["gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "main.c",
                            "-o", "main", "-lm"], cwd=self.path, check=True)
            obs = np.random.default_rng(1).normal(size=(200, policy.obs_size)).astype(np.float32)
            done = subprocess.run([self.path / "main"], input=obs.tobytes(), capture_output=True,
                                  check=True)
            np.testing.assert_allclose(np.frombuffer(done.stdout, np.float32),
                                       policy.act(obs)[:, 0], atol=1e-4)

    def test_ctrl_c_leaves_a_checkpoint(self):
        run = self.path / "run"
        script = ("import time, gymnasium as gym, upswing\n"
                  "class Slow(gym.Wrapper):\n"
                  "    def step(self, action):\n"
                  "        time.sleep(0.002)\n"
                  "        return self.env.step(action)\n"
                  "try:\n"
                  "    upswing.train('dqn', env=lambda: Slow(gym.make('CartPole-v1')),\n"
                  f"                  out={str(run)!r}, steps=10**6, eval_every=100, hidden=[16],\n"
                  "                  eval_episodes=1, learning_starts=50, threads=1)\n"
                  "except KeyboardInterrupt:\n"
                  "    print('interrupted')\n")
        done = interrupted(script, (run / "policy.safetensors").exists, timeout=60)
        self.assertEqual(done, ("interrupted\n", 0))
        info = program("info", run)
        self.assertEqual(info.returncode, 0, info.stderr)
        self.assertRegex(info.stdout, "checkpoint  step [1-9]")
        with self.assertRaisesRegex(upswing.InputError, "gymnasium/CartPole-v1"):
            upswing.train(resume=run)
        upswing.load_policy(run)


class BadInput(InFolder, BadInputTest):
    def refuse_env(self, what, env, agent=None, **settings):
        """Asserts that nothing is written."""
        out = self.path / "run"
        self.refuse(what, upswing.train, agent, env=env, out=out,
                    **{"max_episode_steps": 20} | settings)
        self.assertFalse(out.exists())

    def test_spaces(self):
        def with_spaces(**both):
            env = Reach()
            for name, space in both.items():
                setattr(env, name, space)
            return env

        box = spaces.Box(-1, 1, (2,), np.float32)
        for obs in (spaces.Dict({"a": box}), spaces.Discrete(3), spaces.Box(0, 1, (2, 2)),
                    spaces.Tuple([box])):
            self.refuse_env("env: expected a Box observation space of one dimension, got",
                            with_spaces(observation_space=obs))
        self.refuse_env("env: expected a Box or Discrete action space, got MultiDiscrete",
                        with_spaces(action_space=spaces.MultiDiscrete([2, 3])))
        self.refuse_env("env: expected finite bounds of the actions, got Box(-inf, inf",
                        with_spaces(action_space=spaces.Box(-np.inf, np.inf, (1,), np.float32)))
        self.refuse_env("env: expected actions of floating-point numbers",
                        with_spaces(action_space=spaces.Box(0, 9, (1,), np.int64)))
        self.refuse_env("agent: expected an agent of dqn or ppo, because the actions of CartPole-v1",
                        "CartPole-v1", "sac")
        self.refuse_env("dqn: expected a task with one torque, got 2", Reach(size=2), "dqn")
        self.refuse_env("eval_env: expected the spaces of env", Reach(), eval_env="CartPole-v1")

    def test_environments(self):
        self.refuse_env("env: expected the id of an environment that gymnasium.make knows", "No-v0")
        self.refuse_env("env: expected the id of an environment, a gymnasium.Env", 3)
        self.refuse_env("got a function that returns int", lambda: 3)
        self.refuse_env("but it raised ZeroDivisionError", lambda: 1 // 0)
        self.refuse_env("max_episode_steps: expected a number of steps, because Reach has no",
                        Reach(), max_episode_steps=None)
        self.refuse_env("max_episode_steps: expected 1 or more, got 0", Reach(), max_episode_steps=0)
        closed = SyncVectorEnv([Reach])
        closed.close()
        self.refuse_env("env: expected an open environment, got a closed one", closed)
        locked = Reach()
        locked.lock = threading.Lock()
        self.refuse_env("env: expected an environment that copy.deepcopy can copy", locked)
        self.refuse_env("num_envs: expected none with a vector environment of 2, got 3",
                        SyncVectorEnv([Reach] * 2), num_envs=3)
        self.refuse_env("got CartPoleVectorEnv, whose reset resets every environment",
                        gym.make_vec("CartPole-v1", 2, vectorization_mode="vector_entry_point"))
        self.refuse_env("env: expected an environment that works, but its step raised ValueError: "
                        "the gear is broken", Broken("raise", at=1))
        self.refuse_env("env: step: expected finite observations, got nan", Broken("nan", at=1))
        self.refuse_env("env: step: expected observations of shape (2,)", Broken("shape", at=1))
        self.refuse_env("env: expected finite rewards, got inf", Broken("reward", at=1))

    def test_descriptions(self):
        good = {"name": "A", "observations": 2, "action_limit": [1], "choices": [],
                "episode_steps": 9}
        for text, what in (("", "expected a description of an environment"), ("[]", "a JSON object"),
                           ({"name": "A\n"}, '"name"'), ({"observations": 0}, '"observations"'),
                           ({"action_limit": []}, '"action_limit"'),
                           ({"action_limit": [0]}, '"action_limit"'),
                           ({"action_limit": [1] * 2000}, '"action_limit"'),
                           ({"choices": [1]}, '"choices"'), ({"episode_steps": 1e99}, "episode_steps"),
                           ({"solved_return": "x"}, "solved_return"),
                           ({}, "gymnasium/A: expected a task of the program")):
            text = json.dumps(good | text) if isinstance(text, dict) else text
            done = program("train", "--agent", "ppo", "--task", "gymnasium", "--environment", text,
                           "--out", self.path / "run")
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn(what, done.stderr)
        self.refuse("environment: expected none, because the task double-pendulum", upswing.train,
                    environment="x")
        self.assertEqual(os.listdir(self.path), [])

    def test_settings(self):
        for name in ("num_envs", "eval_env", "max_episode_steps", "solved_return"):
            self.refuse(f"{name}: expected env with it", upswing.train, "fast", **{name: 1})
        self.refuse_env("resume: expected none with env", Reach(), resume="x")
        self.refuse_env("envs: expected none with env; set num_envs", Reach(), envs=2)
        self.refuse_env("levels: expected none with discrete actions", "CartPole-v1", levels=3)
        self.refuse_env("mirror: expected a task with mirror symmetry", Reach(), mirror=True)
        self.refuse_env("mass2: expected none, because the task gymnasium", Reach(), mass2=2)
        self.refuse_env("solved_return: expected a finite number", Reach(), solved_return=np.nan)
        self.refuse_env("got \"fsat\" (did you mean fast?)", "CartPole-v1", "fsat")

    def test_faults_stop_a_training_with_its_checkpoint(self):
        for fault, what in (("raise", "step raised ValueError: the gear is broken"),
                            ("nan", "environment 0: expected finite numbers, got nan in the obs"),
                            ("shape", "environment 0: expected observations of shape (2,)"),
                            ("reward", "environment 0: expected finite numbers, got inf in the rew")):
            with self.subTest(fault):
                run = self.path / fault
                with self.assertRaises(upswing.Failure) as caught:
                    upswing.train("sac", env=lambda: Broken(fault), max_episode_steps=20, out=run,
                                  checkpoint_every=100, **SHORT)
                self.assertIn(what, str(caught.exception))
                self.assertIn("the checkpoint of step 100 is kept", str(caught.exception))
                self.assertNotIn("\n", str(caught.exception))
                if fault == "raise":
                    self.assertIsInstance(caught.exception.__cause__, ValueError)
                self.assertEqual(program("info", run).returncode, 0)

    def test_bounds_that_are_not_symmetric_are_rescaled(self):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            training = upswing.train("sac", env=lambda: Reach(0.0, 3.0), max_episode_steps=20,
                                     **SHORT)
        self.assertIn("RescaleAction(env, -1, 1)", str(caught[0].message))
        self.assertLessEqual(np.abs(training.last.act(np.zeros((1, 2)))).max(), 1)


if __name__ == "__main__":
    unittest.main()
