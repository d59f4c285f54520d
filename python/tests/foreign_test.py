#!/usr/bin/env python3
"""Tests of trainings on Gymnasium environments: learning, ends of episodes, vector environments,
bits, files, Ctrl-C, bad input."""

import copy
import functools
import hashlib
import itertools
import json
import os
import shutil
import subprocess
import tempfile
import threading
import traceback
import unittest
import warnings
from pathlib import Path

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import EzPickle
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv

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
        if self._fault == "nan":
            obs = np.array([np.nan, 0], np.float32)
        if self._fault == "big":
            obs = np.array([0, 1e39])
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

    def test_the_default_for_discrete_actions_solves_the_cart(self):
        training = upswing.train(env="CartPole-v1", steps=40_000, threads=1, progress=False)
        self.assertEqual((training.agent, training.best_return), ("ppo", 500))
        result = upswing.evaluate(training.best, env="CartPole-v1", episodes=5, seed=7)
        self.assertEqual(result["return"], {"mean": 500, "deviation": 0})

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


class Resume(InFolder):
    OBS = np.linspace(-1, 1, 20).reshape(10, 2)

    def test_a_run_continues_with_new_episodes(self):
        for agent, more in (("sac", {"n_step": 3}), ("ppo", {"horizon": 64, "num_envs": 2}),
                            ("dqn", {"levels": 3})):
            with self.subTest(agent):
                settings = {k: v for k, v in SHORT.items()
                            if agent != "ppo" or k != "learning_starts"}
                one, other = self.path / agent, self.path / f"{agent}-copy"
                part = upswing.train(agent, env=Reach, max_episode_steps=20, out=one, **more,
                                     **settings, on_evaluation=lambda row: False)
                self.assertEqual((part.steps, part.finished), (300, False))
                shutil.copytree(one, other)
                # An instance or a vector environment continues what a function began.
                ends = [upswing.train(resume=run, env=env, max_episode_steps=20, progress=False)
                        for run, env in ((one, Reach), (other, Reach()))]
                self.assertEqual([end.steps for end in ends], [600, 600])
                self.assertTrue(ends[0].finished)
                np.testing.assert_array_equal(*[end.last.act(self.OBS) for end in ends])
                self.assertGreater(ends[0].updates, part.updates)
                # The unfinished episodes of the checkpoint count for nothing.
                self.assertIn(ends[0].episodes, range(28, 31))

    def test_another_environment_is_refused(self):
        run = self.path / "run"
        upswing.train("sac", env=Reach, max_episode_steps=20, out=run, **SHORT)
        for what, env, more in (("environment", lambda: Reach(-2.0, 2.0), {}),
                                ("environment", Reach, {"max_episode_steps": 9}),
                                ("envs", Reach, {"num_envs": 3})):
            with self.assertRaisesRegex(upswing.InputError, f"made with .*{what}"):
                upswing.train(resume=run, env=env, progress=False, steps=900,
                              **{"max_episode_steps": 20} | more)


class Exceptions(InFolder):
    """What the user's code raises arrives unchanged."""

    def test_steps_resets_and_makers(self):
        class Odd(Exception):
            def __str__(self):
                raise RuntimeError("no text")

        for wanted in (Odd(), KeyError("gear"), ValueError("s\udc80"), StopIteration(), OSError(5)):
            def fail(at, wanted=wanted, calls=None):
                calls = itertools.count(1)

                def act(*_):
                    if next(calls) == at:
                        raise wanted
                return act

            for at in (1, 150):
                for env in (lambda: Looks(fail(at)), SyncVectorEnv([lambda: Looks(fail(at))] * 2)):
                    for out in (None, self.path / f"{type(wanted).__name__}{at}{type(env).__name__}"):
                        frames = []
                        try:
                            upswing.train("sac", env=env, out=out, max_episode_steps=20, **SHORT)
                        except type(wanted) as error:
                            self.assertIs(error, wanted)
                            frames = list(traceback.walk_tb(error.__traceback__))
                        self.assertEqual(frames[-1][0].f_code.co_name, "act")
                        if out is not None and at > 1 and hasattr(wanted, "__notes__"):
                            self.assertIn("keeps the last checkpoint", wanted.__notes__[-1])
        with self.assertRaises(ZeroDivisionError):
            upswing.train(env=lambda: 1 // 0)
        gym.register("test/Odd-v0", lambda: 1 // 0)
        self.addCleanup(gym.registry.pop, "test/Odd-v0")
        with self.assertRaises(ZeroDivisionError):
            upswing.train(env="test/Odd-v0")


class Looks(Reach):
    """An environment that passes each action to a function."""

    def __init__(self, look, space=None):
        super().__init__()
        self._look = look
        self.action_space = space or self.action_space

    def step(self, action):
        self._look(action)
        self._steps += 1
        return self._obs(), 1.0, False, self._steps >= 20, {}


class Answers(Reach):
    """An environment whose steps return the given parts instead of its own."""

    def __init__(self, **parts):
        super().__init__()
        self._parts = parts

    def step(self, action):
        names = ("obs", "reward", "terminated", "truncated", "info")
        return tuple((dict(zip(names, super().step(action))) | self._parts).values())


class AnswersMany(gym.vector.VectorWrapper):
    """The same for a vector environment; `change` changes the parts."""

    def __init__(self, env, **change):
        super().__init__(env)
        self._change = change

    def step(self, actions):
        names = ("obs", "reward", "terminated", "truncated", "info")
        return tuple(self._change.get(name, lambda part: part)(part)
                     for name, part in zip(names, self.env.step(actions)))


class Invariance(unittest.TestCase):
    """The policy and its returns depend on the environment, not on how it is given or evaluated."""

    OBS = np.linspace(-1, 1, 20).reshape(10, 2)

    def train(self, env, **more):
        """The policy's actions, and the evaluations' steps and mean returns."""
        training = upswing.train("sac", env=env, seed=3,
                                 **SHORT | {"max_episode_steps": 20} | more)
        returns = {row["step"]: row["mean_return"] for row in training.evaluations}
        return training.last.act(self.OBS).tolist(), returns

    def test_actions_have_the_types_of_gymnasium(self):
        kinds = set()

        def look(action):
            kinds.add(type(action))
            self.assertIn(action.item(), (-1, 0, 1))

        space = spaces.Discrete(3, start=-1)
        for env in (lambda: Looks(look, space), SyncVectorEnv([lambda: Looks(look, space)] * 2)):
            upswing.train("dqn", env=env, max_episode_steps=20, **SHORT)
        self.assertEqual(kinds, {type(space.sample())})

    def test_an_environment_that_ends_itself_needs_no_limit(self):
        self.assertEqual(self.train(Reach, max_episode_steps=None), self.train(Reach))
        with self.assertWarnsRegex(UserWarning, "did not end within 10,000 steps") as caught:
            upswing.train("dqn", env=lambda: Reach(length=10**9), levels=3,
                          **SHORT | {"steps": 200, "eval_every": 10**6, "eval_episodes": 1})
        self.assertEqual(caught.filename, __file__)

    def test_numbers_of_double_precision(self):
        class Doubles(Reach):
            observation_space = spaces.Box(-np.inf, np.inf, (2,), np.float64)

            def _obs(self):
                return super()._obs().astype(np.float64)

        self.assertEqual(self.train(Doubles), self.train(Reach))
        with self.assertRaisesRegex(upswing.InputError, r"got 1e\+39 in the observation, component 1"):
            upswing.train("sac", env=lambda: Broken("big"), max_episode_steps=20, **SHORT)

    def test_how_environments_are_given(self):
        gym.register("test/Reach-v0", Reach, disable_env_checker=True)
        self.addCleanup(gym.registry.pop, "test/Reach-v0")
        vector, plain = gym.wrappers.vector, gym.wrappers
        expected = self.train(Reach, num_envs=3)
        for env in ("test/Reach-v0", Reach(), plain.RecordEpisodeStatistics(Reach()),
                    lambda: plain.TimeLimit(Reach(), 1000)):
            self.assertEqual(self.train(env, num_envs=3), expected)
        for mode in AutoresetMode:
            def many(mode=mode):
                return SyncVectorEnv([Reach] * 3, autoreset_mode=mode)

            for env in (many(), many, vector.RecordEpisodeStatistics(many())):
                self.assertEqual(self.train(env), expected)
        self.assertEqual(self.train(gym.make_vec("test/Reach-v0", 3)), expected)
        wrapped = vector.RescaleObservation(SyncVectorEnv([Bounded] * 3), np.float32(-1),
                                            np.float32(1))
        self.assertEqual(self.train(wrapped, eval_env=rescaled), self.train(rescaled, num_envs=3))

    def test_the_double_pendulum_as_one_and_as_vector(self):
        name, settings = "upswing/DoublePendulum-v0", {"physics": "closed-form"}
        settings |= {"episode_seconds": 0.4}
        results = []
        for env, more in ((lambda: gym.make(name, **settings), {"num_envs": 2}),
                          (gym.make_vec(name, 2, **settings), {})):
            training = upswing.train("sac", env=env, seed=1, max_episode_steps=20,
                                     **SHORT | more)
            results.append([row["mean_return"] for row in training.evaluations])
        self.assertEqual(*results)

    def test_evaluations_change_nothing(self):
        for env in (Reach, Reach(), lambda: SyncVectorEnv([Reach] * 2)):
            act, returns = self.train(env)
            for more in ({"eval_every": 200}, {"eval_env": Reach}, {"eval_env": Reach()}):
                again, others = self.train(env, **more)
                self.assertEqual(again, act)
                self.assertEqual(others[600], returns[600])

    def test_evaluations_take_functions_in_turn(self):
        env = SyncVectorEnv([lambda k=k: Answers(reward=k) for k in (1, 2)])
        self.assertEqual(set(self.train(env)[1].values()), {30})

    def test_numbers_of_other_types(self):
        expected = self.train(lambda: Answers(reward=1.0))
        for part in ({"reward": np.array([1.0])}, {"reward": np.array(1)}, {"reward": True},
                     {"reward": 1, "terminated": np.array([False])},
                     {"reward": np.float32(1), "terminated": 0, "truncated": np.bool_(False)}):
            self.assertEqual(self.train(Answers(**part)), self.train(Answers(**part | {
                "reward": 1.0})), part)
        self.assertEqual(self.train(AnswersMany(
            SyncVectorEnv([lambda: Answers(reward=1.0)]), terminated=lambda part: part.astype(int)),
            eval_env=lambda: Answers(reward=1)), expected)


class Bounded(Reach):
    observation_space = spaces.Box(-20, 20, (2,), np.float32)


def rescaled():
    return gym.wrappers.RescaleObservation(Bounded(), np.float32(-1), np.float32(1))


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

    def test_large_returns(self):
        class Costly(Reach):
            def step(self, action):
                obs, _, *others = super().step(action)
                return obs, -1e12, *others

        training = upswing.train("sac", env=Costly, max_episode_steps=20, out=self.path / "run",
                                 **SHORT)
        self.assertAlmostEqual(training.best_return / -2e13, 1)
        self.assertEqual(program("info", self.path / "run").returncode, 0)

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

    def test_commands_that_need_the_environment_are_refused(self):
        run = self.path / "run"
        upswing.train("sac", env=lambda: Reach(size=2), max_episode_steps=20, out=run, **SHORT)
        for command in (["eval", run], ["map", run], ["view", run], ["plot", run],
                        ["simulate", run], ["train", "--resume", run],
                        ["train", "--config", run / "config.toml", "--out", self.path / "x"],
                        ["export", run, "--c", self.path / "x.h"],  # two numbers per action
                        ["export", run, "--page", self.path / "page"],
                        ["train", "--environment", "x", "--out", self.path / "x"]):
            with self.subTest(command[0]):
                done = program(*command)
                self.assertEqual(done.returncode, 2, done.stdout)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertRegex(done.stderr, "gymnasium/Reach|environment: |one number per action")
        self.assertEqual(sorted(os.listdir(self.path)), ["run"])
        for refused in (upswing.evaluate, upswing.map):
            with self.assertRaisesRegex(upswing.InputError, "expected a policy of double-pendulum, got "
                                                            "one of gymnasium/Reach"):
                refused(run)
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
        with self.assertRaisesRegex(upswing.InputError, "gymnasium/CartPole-v1.*with env"):
            upswing.train(resume=run)
        upswing.load_policy(run)


class BadInput(InFolder, BadInputTest):
    def refuse_env(self, what, env, agent=None, **settings):
        """Asserts that nothing is written."""
        out = self.path / "run"
        self.refuse(what, upswing.train, agent, env=env, out=out,
                    **{"max_episode_steps": 20, "steps": 200} | settings)
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
        self.refuse_env("env: expected lower bounds of the actions below the upper ones, got Box(1.0",
                        with_spaces(action_space=spaces.Box(1, 1, (1,), np.float32)))
        self.refuse_env("env: expected actions of floating-point numbers",
                        with_spaces(action_space=spaces.Box(0, 9, (1,), np.int64)))
        self.refuse_env("agent: expected an agent of dqn or ppo, because the actions of CartPole-v1",
                        "CartPole-v1", "sac")
        self.refuse_env("dqn: expected a task with one torque, got 2", Reach(size=2), "dqn")
        self.refuse_env("eval_env: expected the spaces of env", Reach(), eval_env="CartPole-v1")

    def test_environments(self):
        self.refuse_env("env: expected the id of an environment that gymnasium.make can make, got "
                        "'No-v0'", "No-v0")
        self.refuse_env("env: expected the id of an environment, a gymnasium.Env", 3)
        self.refuse_env("got a function that returns int", lambda: 3)
        self.refuse_env("max_episode_steps: expected 1 or more, got 0", Reach(), max_episode_steps=0)
        closed = SyncVectorEnv([Reach])
        closed.close()
        self.refuse_env("env: expected an open environment, got a closed one", closed)
        locked = Reach()
        locked.lock = threading.Lock()
        self.refuse_env("env: expected an environment that copy.deepcopy can copy", locked)
        self.refuse_env("num_envs: expected none with a vector environment of 2, got 3",
                        SyncVectorEnv([Reach] * 2), num_envs=3)
        self.refuse_env("got CartPoleVectorEnv, whose reset resets or changes every environment",
                        gym.make_vec("CartPole-v1", 2, vectorization_mode="vector_entry_point"))
        self.refuse_env("expected actions within ±1e+06", Reach(-1e9, 1e9))
        self.refuse_env("expected finite float32 numbers as observations, got nan",
                        Broken("nan", at=1))
        self.refuse_env("environment 0: expected observations of shape (2,)", Broken("shape", at=1))
        self.refuse_env("env: step: expected finite float32 numbers as rewards, got inf",
                        Broken("reward", at=1))

    def test_shared_environments(self):
        class Hidden(Reach):
            """An environment around another one that `unwrapped` does not know."""

            def __init__(self, inner):
                super().__init__()
                self.reset, self.step = inner.reset, inner.step

        class Single(Reach):
            def __deepcopy__(self, memo):
                return self

        what = ("an environment of its own for each training environment and for evaluations, "
                "got the")
        one, other = Reach(), Reach()
        for n in (None, 1, 4):
            self.refuse_env(f"env: expected {what} same Reach twice", lambda: one, num_envs=n)
            self.refuse_env(f"env: expected {what} same Reach twice",
                            lambda: gym.wrappers.TimeLimit(one, 5), num_envs=n)
            self.refuse_env("env: expected environments that share no state, got Hidden",
                            lambda: Hidden(one), num_envs=n)
        self.refuse_env(f"env: expected {what} same Single twice", Single(), num_envs=2)
        self.refuse_env(f"env: expected {what} same Reach twice", lambda: one, num_envs=2,
                        eval_env=other)
        self.refuse_env("env: expected environments that share no state", lambda: Hidden(one),
                        num_envs=2, eval_env=other)
        self.refuse_env("env: expected environments that share no state", one,
                        eval_env=Hidden(one))
        for eval_env in (one, lambda: one, gym.wrappers.TimeLimit(one, 5)):
            for env in (one, gym.wrappers.RecordEpisodeStatistics(one),
                        SyncVectorEnv([lambda: one])):
                self.refuse_env(f"eval_env: expected {what}", env, eval_env=eval_env)
        self.refuse_env(f"eval_env: expected {what}", one, eval_env=lambda: other)
        for kind in (SyncVectorEnv, AsyncVectorEnv):
            env = kind([lambda: one] * 2)
            self.refuse_env(f"env: expected {what}", env)
            env.close()
        self.refuse_env(f"env: expected {what}", SyncVectorEnv([lambda: one] * 2), eval_env=Reach)
        turns = itertools.cycle([Reach(), Reach(), Reach()])
        self.refuse_env(f"env: expected {what}", lambda: next(turns), num_envs=2)

    def test_shared_state(self):
        class AtRest(Reach):
            """A point that begins at rest and stays there under the action 0."""

            def __init__(self, simulator):
                super().__init__()
                self._simulator = simulator

            def reset(self, *, seed=None, options=None):
                super().reset(seed=seed)
                self._simulator["x"] = 0.0
                return self._obs(), {}

            def step(self, action):
                self._simulator["x"] += float(action[0])
                self._steps += 1
                return self._obs(), -abs(self._simulator["x"]), False, self._steps >= 20, {}

            def _obs(self):
                return np.array([self._simulator.get("x", 0), 1], np.float32)

        class Clock(Reach):
            """An environment whose time limit counts the steps of all."""

            steps, limit = 0, 200

            def reset(self, **how):
                type(self).steps = 0
                return super().reset(**how)

            def step(self, action):
                type(self).steps += 1
                return *super().step(action)[:3], self.steps >= self.limit, {}

        class LateClock(Clock):
            limit = 30

        class Goal(Reach):
            """An environment whose reset sets the goal of all."""

            goal = 0.0

            def reset(self, **how):
                returned = super().reset(**how)
                type(self).goal = self.np_random.uniform()
                return returned

            def step(self, action):
                obs, _, *others = super().step(action)
                return obs, -abs(self.goal - self._x), *others

        class Random(Reach):
            """An environment that draws from a generator of all, which a reset seeds."""

            rng = None

            def reset(self, *, seed=None, options=None):
                if seed is not None:
                    type(self).rng = np.random.default_rng(seed)
                super().reset()
                self._x = self.rng.uniform(-1, 1)
                return self._obs(), {}

        class Around(gym.Wrapper):
            """A wrapper with the last action of all."""

            last = 0.0

            def reset(self, **how):
                type(self).last = 0.0
                return self.env.reset(**how)

            def step(self, action):
                obs, reward, *others = self.env.step(action)
                before, type(self).last = self.last, float(action[0])
                return obs, reward + before, *others

        simulator = {}
        cached = functools.lru_cache(lambda: {})
        pool = itertools.cycle([{}, {}, {}])
        for make in (lambda: AtRest(simulator), lambda: AtRest(cached()),
                     lambda: AtRest(next(pool)), Clock, LateClock, Goal, Random,
                     lambda: Around(Reach())):
            for n in (1, 3):
                self.refuse_env("env: expected environments that share no state, got ", make,
                                num_envs=n, max_episode_steps=300)
        # The parts of a vector environment share, its evaluations have their own.
        self.refuse_env("env: expected environments that share no state, got AtRest, where calls "
                        "of one change what another returns as observation",
                        SyncVectorEnv([lambda: AtRest(simulator)] * 2), eval_env=lambda: AtRest({}))
        upswing.train("sac", env=lambda: AtRest({}), num_envs=3, **SHORT)

    def test_random_environments_are_not_accused(self):
        rng = np.random.default_rng(0)

        class Unseeded(Reach):
            """An environment that ignores its seed; rarely, so that some episodes repeat."""

            def __init__(self, share):
                super().__init__()
                self._share = share

            def step(self, action):
                obs, reward, *others = super().step(action)
                return obs, reward + (rng.uniform() < self._share), *others

        class Seeded(Reach):
            def step(self, action):
                obs, reward, *others = super().step(action)
                return obs, reward + self.np_random.normal(), *others

        quick = SHORT | {"steps": 200, "eval_every": 10**6, "eval_episodes": 1}
        for share in (0.5, 0.02, 0.02, 0.02, 0.02):
            for env in (lambda: Unseeded(share), copy.deepcopy(Unseeded(share))):
                with self.assertWarnsRegex(UserWarning, "two episodes after reset") as caught:
                    rng = np.random.default_rng(2)
                    upswing.train("sac", env=env, num_envs=3, **quick)
                self.assertEqual(caught.filename, __file__)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for env in (Seeded, Seeded(), SyncVectorEnv([Seeded] * 2)):
                upswing.train("sac", env=env, **quick)

    def test_global_random_numbers(self):
        class Global(Reach):
            def reset(self, *, seed=None, options=None):
                if seed is not None:
                    np.random.seed(seed)
                super().reset(seed=seed)
                self._x = np.random.uniform(-1, 1)
                return self._obs(), {}

        with self.assertWarnsRegex(UserWarning, "global random numbers") as caught:
            upswing.train("sac", env=Global, num_envs=2, **SHORT)
        self.assertEqual(caught.filename, __file__)

    def test_changed_instances(self):
        class Gain(Reach, EzPickle):
            """An environment whose copies are made again by its arguments."""

            def __init__(self, gain=1.0, length=20):
                EzPickle.__init__(self, gain, length)
                super().__init__(length=length)
                self.gain = gain

            def step(self, action):
                obs, reward, *others = super().step(action)
                return obs, self.gain * reward, *others

        def changed(name="gain", value=10.0, wrap=lambda env: env):
            env = wrap(Gain())
            env.set_wrapper_attr(name, value)
            return env

        what = "expected an environment whose copies act as it does, got Gain, whose copy returns "
        for env in (changed(), changed(wrap=gym.wrappers.RecordEpisodeStatistics),
                    changed("_length", 9), changed("_length", 300)):
            for n in (1, 4):
                self.refuse_env("env: " + what, env, num_envs=n)
            self.refuse_env("env: " + what, env, num_envs=2, eval_env=Gain)
            self.refuse_env("eval_env: " + what, Gain, eval_env=env)
        env = SyncVectorEnv([Gain] * 3)
        env.set_attr("gain", 10.0)
        self.refuse_env("env: expected evaluations to have the environments of SyncVectorEnv, but "
                        "another Gain of its function 0 returns", env)
        upswing.train("sac", env=env, eval_env=changed, **SHORT)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            used = Gain(2.0)
            used.reset(seed=5)
            used.step(np.ones(1, np.float32))
            for env in (used, SyncVectorEnv([Gain] * 3)):
                upswing.train("sac", env=env, **SHORT)
            upswing.train("sac", env=changed(), eval_env=Gain, **SHORT)  # no copy of it
        # A change whose effect comes late.
        late = Gain(length=100)
        late._length = 200
        with self.assertWarnsRegex(UserWarning, "copy of Gain has Gain._length 100 in place of 200"
                                   ) as caught:
            upswing.train("sac", env=late, num_envs=2, **SHORT)
        self.assertEqual(caught.filename, __file__)

    def test_vector_wrappers(self):
        class Own(gym.vector.VectorWrapper):
            pass

        class OwnSync(SyncVectorEnv):
            pass

        class OwnStatistics(gym.wrappers.vector.RecordEpisodeStatistics):
            pass

        wrap, many = gym.wrappers.vector, SyncVectorEnv([Bounded] * 2)
        wrapped = [
            wrap.RescaleObservation(many, np.float32(-1), np.float32(1)),
            wrap.TransformObservation(many, lambda obs: -obs),
            wrap.TransformReward(many, lambda reward: -reward), wrap.ClipReward(many, -1, 1),
            wrap.NormalizeReward(many), wrap.NormalizeObservation(many), wrap.ClipAction(many),
            wrap.TransformAction(many, lambda action: -action), Own(many), OwnStatistics(many),
            wrap.DtypeObservation(many, np.float64), OwnSync([Bounded] * 2)]
        for env in wrapped:
            for outer in (env, wrap.RecordEpisodeStatistics(env)):
                self.refuse_env("eval_env: expected a single environment or a function that makes "
                                "one, because evaluations cannot take theirs from "
                                f"{type(env).__name__}, got none", outer)
        self.refuse_env("eval_env: expected the spaces of env", wrap.RescaleAction(
            many, np.float32(-0.5), np.float32(0.5)))
        self.refuse_env("eval_env: expected the spaces of env", wrapped[0], eval_env=Bounded)
        self.refuse_env("got ValueError: NormalizeObservation does not support partial resets",
                        wrap.NormalizeObservation(many),
                        eval_env=lambda: gym.wrappers.NormalizeObservation(Bounded()))

    def test_statistics_of_wrappers(self):
        for wrapper in (gym.wrappers.NormalizeObservation, gym.wrappers.NormalizeReward):
            def make(wrapper=wrapper):
                return gym.wrappers.TimeLimit(wrapper(Reach()), 9)

            what = ("eval_env: expected a function that makes an environment, because copies of "
                    f"{wrapper.__name__} do not share its statistics, got ")
            for env in (make, make(), SyncVectorEnv([make])):
                self.refuse_env(what + "none", env)
                self.refuse_env(what + "an environment", env, eval_env=make())

    def test_numbers(self):
        def both(what, change, single):
            """A vector environment's and a single environment's part."""
            env = AnswersMany(SyncVectorEnv([Reach] * 4), **change)
            self.refuse_env(f"env: {what}", env, eval_env=Reach)
            for given in (Answers(**single), lambda: Answers(**single)):
                self.refuse_env(f"environment 0: {what}".replace(
                    "rewards", "a reward"), given)

        shapes = {"reward": "rewards", "terminated": "terminated", "truncated": "truncated"}
        for name, what in shapes.items():
            for wrong in (np.ones(4), [1, 2], None, "1", {}, 1j, np.ones(0)):
                both(f"expected {what} of ", {name: lambda part, wrong=wrong: (
                    wrong if np.shape(wrong) != (4,) else wrong[:1])}, {name: wrong})
            for wrong in (np.ones(1), np.array(1.0), np.ones((4, 1)), np.ones((1, 4))):
                env = AnswersMany(SyncVectorEnv([Reach] * 4), **{name: lambda _, w=wrong: w})
                self.refuse_env(f"env: expected {what} of shape (4,), got float64 of shape "
                                f"{wrong.shape}", env, eval_env=Reach)
        for name in ("terminated", "truncated"):
            for wrong in (0.5, 2, np.nan):
                both(f"expected {name} of True or False", {
                    name: lambda part, wrong=wrong: np.full(4, wrong)}, {name: wrong})
        for wrong in (np.ones((1, 2)), np.ones(1), 1.0, None, ["1", "2"], np.ones(2, complex),
                      np.array([1, None])):
            both("expected observations of shape ", {"obs": lambda part, wrong=wrong: wrong},
                 {"obs": wrong})
        for name, wrong, text in (("reward", 1e39, "rewards, got 1e+39"), ("reward", np.nan, "nan"),
                                  ("obs", [1e39, 0], "observations, got 1e+39")):
            self.refuse_env("env: step: expected finite float32 numbers as ",
                            Answers(**{name: wrong}))
            self.refuse_env(text, Answers(**{name: wrong}))

    def test_what_reset_and_step_return(self):
        class Returns(Reach):
            def __init__(self, name, change):
                super().__init__()
                self._change = {name: change}

            def reset(self, *, seed=None, options=None):
                return self._change.get("reset", tuple)(super().reset(seed=seed))

            def step(self, action):
                return self._change.get("step", tuple)(super().step(action))

        for name, change, got in (("reset", lambda r: r[0], "ndarray"),
                                  ("reset", lambda r: None, "NoneType"),
                                  ("reset", lambda r: (*r, 1), "tuple of 3"),
                                  ("step", lambda r: r[:4], "tuple of 4; Gym before 0.26 had"),
                                  ("step", lambda r: None, "NoneType"),
                                  ("step", lambda r: (*r, 1), "tuple of 6")):
            for env in (lambda: Returns(name, change), Returns(name, change)):
                self.refuse_env(f"environment 0: expected {name} to return (obs, ", env)
                self.refuse_env(f"), got {got}", env)
        upswing.train("sac", env=lambda: Returns("step", list), **SHORT)

    def test_final_observations(self):
        def spoil(info):
            if "final_obs" in info:
                info["final_obs"][0] = np.ones(1)
            return info

        def remove(info):
            info.pop("final_obs", None)
            return info

        for change, got in ((spoil, r"float64 of shape \(1,\)"), (remove, "NoneType")):
            env = AnswersMany(SyncVectorEnv([Reach] * 2, autoreset_mode=AutoresetMode.SAME_STEP),
                              info=change)
            with self.assertRaisesRegex(upswing.InputError, r"expected infos\[.*, got " + got):
                upswing.train("sac", env=env, eval_env=Reach, max_episode_steps=20, **SHORT)

    def test_observations_in_the_same_array(self):
        class Same(Reach):
            """An environment whose observations are one array."""

            def _obs(self):
                self.array = getattr(self, "array", np.zeros(2, np.float32))
                self.array[:] = super()._obs()
                return self.array

        class CopiesAtReset(Same):
            def reset(self, **how):
                obs, info = super().reset(**how)
                return obs.copy(), info

        class CopiesAtStep(Same):
            def step(self, action):
                obs, *others = super().step(action)
                return obs.copy(), *others

        expected = upswing.train("sac", env=Reach, num_envs=2, **SHORT).last.act([1, 1])
        for env_class in (Same, CopiesAtReset, CopiesAtStep):
            for mode in AutoresetMode:
                for kind in (SyncVectorEnv, AsyncVectorEnv):
                    env = kind([env_class] * 2, autoreset_mode=mode)
                    self.addCleanup(env.close)
                    if mode == AutoresetMode.SAME_STEP and env_class is not CopiesAtStep:
                        self.refuse_env(f"for AutoresetMode.SAME_STEP, got {env_class.__name__}, "
                                        "which returns the same array again", env)
                    else:
                        np.testing.assert_array_equal(
                            upswing.train("sac", env=env, **SHORT).last.act([1, 1]), expected)

        class InTuple(Same):
            """The array is part of a larger observation."""

            observation_space = spaces.Tuple([Reach.observation_space, spaces.Box(0, 1, (1,))])

            def _obs(self):
                return super()._obs(), np.zeros(1, np.float32)

        class First(gym.vector.VectorWrapper):
            """The first part of the observations."""

            def __init__(self, env):
                super().__init__(env)
                self.single_observation_space = env.single_observation_space[0]
                self.observation_space = env.observation_space[0]

            def reset(self, **how):
                obs, info = self.env.reset(**how)
                return obs[0], info

            def step(self, actions):
                obs, *others, info = self.env.step(actions)
                if "final_obs" in info:
                    info["final_obs"] = [last and last[0] for last in info["final_obs"]]
                return obs[0], *others, info

        # The environment of evaluations returns other arrays.
        self.refuse_env("got InTuple, which returns the same array again",
                        First(SyncVectorEnv([InTuple] * 2, autoreset_mode="SameStep")),
                        eval_env=Reach)

    def test_observations_in_one_array_of_all(self):
        array = np.zeros(2, np.float32)

        class One(Reach):
            def _obs(self):
                array[:] = super()._obs()
                return array

        for mode in AutoresetMode:
            self.refuse_env("env: expected observations that other environments do not change, got "
                            "One, where environments 0 and 1 return the same array",
                            SyncVectorEnv([One] * 2, autoreset_mode=mode))
        # One after the other, each observation is read before the next one.
        np.testing.assert_array_equal(
            upswing.train("sac", env=One, num_envs=2, **SHORT).last.act([1, 1]),
            upswing.train("sac", env=Reach, num_envs=2, **SHORT).last.act([1, 1]))

    def test_resets_that_swallow_a_step(self):
        expected = upswing.train("sac", env=Reach, num_envs=2, **SHORT).last.act([1, 1])
        for mode in AutoresetMode:
            for n in (1, 2):
                env = AsyncVectorEnv([Reach] * n, shared_memory=False, autoreset_mode=mode)
                self.addCleanup(env.close)
                if mode == AutoresetMode.NEXT_STEP:
                    for wrapped in (env, gym.wrappers.vector.RecordEpisodeStatistics(env)):
                        self.refuse_env("env: expected AsyncVectorEnv with shared_memory=True or "
                                        "another autoreset mode, got shared_memory=False", wrapped)
                elif n == 2:
                    np.testing.assert_array_equal(
                        upswing.train("sac", env=env, **SHORT).last.act([1, 1]), expected)

    def test_own_vector_environments_that_swallow_a_step(self):
        class Swallows(SyncVectorEnv):
            """A vector environment that resets ended episodes again after a reset with a mask."""

            def reset(self, *, seed=None, options=None):
                pending = self._autoreset_envs.copy()
                returned = super().reset(seed=seed, options=options)
                self._autoreset_envs |= pending
                return returned

        class Own(SyncVectorEnv):
            pass

        self.refuse_env("env: expected a reset with a mask after which the next step counts, got "
                        "Swallows, whose next step ignores its actions and resets environment 0",
                        Swallows([Reach] * 2), eval_env=Reach)
        upswing.train("sac", env=Own([Reach] * 2), eval_env=Reach, **SHORT)

    def test_episodes_that_do_not_repeat(self):
        class Drifting(Reach):
            drift = 0.0

            def step(self, action):
                self.drift += 1
                obs, reward, *others = super().step(action)
                return obs, reward - self.drift, *others

        with self.assertWarnsRegex(UserWarning, "two episodes after reset") as caught:
            upswing.train("sac", env=Drifting, max_episode_steps=20, **SHORT)
        self.assertEqual(caught.filename, __file__)

    def test_descriptions(self):
        good = {"name": "A", "observations": 2, "action_limit": [1], "choices": [],
                "episode_steps": 9}
        for text, what in (("[]", "a JSON object"),
                           ({"name": "A\n"}, '"name"'), ({"observations": 0}, '"observations"'),
                           ({"action_limit": []}, '"action_limit"'),
                           ({"action_limit": [0]}, '"action_limit"'),
                           ({"action_limit": [1] * 2000}, '"action_limit"'),
                           ({"choices": [1]}, '"choices"'), ({"episode_steps": 1e99}, "episode_steps"),
                           ({"solved_return": "x"}, "solved_return"),
                           ({}, "gymnasium/A: expected a task of the program")):
            text = json.dumps(good | text) if isinstance(text, dict) else text
            done = program("train", "--agent", "ppo", "--environment", text, "--out", self.path / "run")
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn(what, done.stderr)
        self.assertEqual(os.listdir(self.path), [])

    def test_settings(self):
        for name in ("num_envs", "eval_env", "max_episode_steps", "solved_return"):
            self.refuse(f"{name}: expected env with it", upswing.train, "fast", **{name: 1})
        self.refuse_env("envs: expected none with env; set num_envs", Reach(), envs=2)
        self.refuse_env("levels: expected none with discrete actions", "CartPole-v1", levels=3)
        self.refuse_env("mirror: expected a task with mirror symmetry", Reach(), mirror=True)
        self.refuse_env("mass2: expected none with a Gymnasium environment", Reach(), mass2=2)
        self.refuse_env("solved_return: expected a finite number", Reach(), solved_return=np.nan)
        self.refuse_env("got \"fsat\" (did you mean fast?)", "CartPole-v1", "fsat")

    def test_faults_stop_a_training_with_its_checkpoint(self):
        for fault, what in (("nan", "environment 0: expected finite float32 numbers, got nan in the"),
                            ("shape", "environment 0: expected observations of shape (2,)"),
                            ("reward", "environment 0: expected finite float32 numbers, got inf in th")):
            with self.subTest(fault):
                run = self.path / fault
                with self.assertRaises(upswing.Failure) as caught:
                    upswing.train("sac", env=lambda: Broken(fault), max_episode_steps=20, out=run,
                                  checkpoint_every=100, **SHORT)
                self.assertIn(what, str(caught.exception))
                self.assertIn("the checkpoint of step 100 is kept", str(caught.exception))
                self.assertNotIn("\n", str(caught.exception))
                self.assertEqual(program("info", run).returncode, 0)

    def test_bounds_that_are_not_symmetric_are_rescaled(self):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            training = upswing.train("sac", env=lambda: Reach(0.0, 3.0), max_episode_steps=20,
                                     **SHORT)
        self.assertIn("RescaleAction(env, -1, 1)", str(caught[0].message))
        self.assertEqual(caught[0].filename, __file__)
        self.assertLessEqual(np.abs(training.last.act(np.zeros((1, 2)))).max(), 1)
        # Reach refuses actions beyond its bounds, where a rounding would carry these.
        for low, high in ((0.1, 0.4), (0.2, 0.7)):
            for env in (Reach(low, high), SyncVectorEnv([lambda: Reach(low, high)] * 2)):
                with self.assertWarnsRegex(UserWarning, "not symmetric"):
                    upswing.train("dqn", env=env, max_episode_steps=20, levels=2, **SHORT)
        # A function acts within the bounds themselves.
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            result = upswing.evaluate(lambda obs: [0.4], env=Reach(0.1, 0.4), episodes=1)
        self.assertEqual(result["length"]["mean"], 20)

    def test_a_policy_of_other_actions_is_not_evaluated(self):
        discrete = upswing.train("dqn", env=lambda: OneStep(True), max_episode_steps=1, **SHORT).last
        wide = upswing.train("sac", env=lambda: Reach(-3, 3), max_episode_steps=20, **SHORT).last
        box = OneStep(True)
        box.action_space = spaces.Box(-1, 1, (1,), np.float32)
        for policy, env, got in ((discrete, box, "the actions [0.0, 1.0]"),
                                 (wide, Reach(), "actions within ±[3.0]")):
            self.refuse(f"got one of {policy.task} for {got}", upswing.evaluate, policy, env=env)
        self.assertEqual(upswing.evaluate(wide, env=Reach(-3, 3), episodes=1)["length"]["mean"], 20)


if __name__ == "__main__":
    unittest.main()
