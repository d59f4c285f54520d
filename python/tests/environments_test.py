#!/usr/bin/env python3
"""Tests of a single environment: Gymnasium's own checks, agreement with the program, bad input."""

import copy
import csv
import io
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest
import warnings
from pathlib import Path
from unittest import mock

import gymnasium as gym
import numpy as np
from gymnasium.utils.env_checker import check_env

import upswing
from testing import BadInputTest

ID = "upswing/DoublePendulum-v0"


def play(env, actions, **reset):
    """Observations, rewards and torques of an episode under these actions."""
    rows = [env.reset(**reset)[0]]
    rewards, torques = [], []
    for action in actions:
        obs, reward, terminated, truncated, info = env.step(action)
        rows.append(obs)
        rewards.append(reward)
        torques.append(info["torque"])
        if terminated or truncated:
            break
    return np.array(rows), np.array(rewards), np.array(torques)


class Environments(unittest.TestCase):
    def test_the_control_period_is_in_the_metadata(self):
        for settings, period in (({}, 0.02), ({"control_period": 0.005}, 0.005),
                                 ({"plant": "cloudpendulum"}, 0.0067)):
            with self.subTest(settings):
                env = gym.make(ID, physics="closed-form", **settings)
                self.assertAlmostEqual(env.metadata["control_period"], period, 4)
                self.assertEqual(env.metadata["render_fps"], round(1 / env.metadata["control_period"]))
        vector = gym.make_vec(ID, 2, physics="closed-form", control_period=0.01, max_episode_steps=7)
        vector.reset(seed=1)
        ends = [vector.step(np.zeros((2, 1)))[3].all() for _ in range(7)]
        self.assertEqual(ends, [False] * 6 + [True])

    def test_gymnasium_finds_nothing_wrong(self):
        for settings in ({}, {"physics": "closed-form"}, {"actions": "levels"},
                         {"sensor_noise": 0.1, "delay": 0.04, "randomize": 0.25, "memory": 4},
                         {"encoder_counts": 4096, "velocity_window": 0.01, "sensor_latency": 0.005},
                         {"actions": "levels", "levels": 3, "physics": "closed-form"}):
            with self.subTest(settings), warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                check_env(gym.make(ID, **settings).unwrapped, skip_render_check=True)
                # Gymnasium warns about spaces that are deliberate: torques in N·m, velocities
                # without a bound.
                said = [str(warning.message) for warning in caught]
                self.assertEqual([text for text in said if "Box" not in text], [])

    def test_the_task_of_evaluations_is_registered(self):
        name = "upswing/DoublePendulumSwingUp-v0"
        env = gym.make(name)
        self.assertEqual(env.spec.max_episode_steps, 1000)
        check_env(env.unwrapped, skip_render_check=True)
        hanging = env.reset(seed=1)[0]
        np.testing.assert_allclose(hanging[[0, 3, 7]], [1, 1, -1], atol=0.1)
        self.assertEqual(len(play(env, [np.zeros(1, np.float32)] * 2000, seed=1)[1]), 1000)
        for limit in (None, 30):
            more = {} if limit is None else {"max_episode_steps": limit}
            for vector in (gym.make_vec(name, 2, **more),
                           gym.make_vec(name, 2, vectorization_mode="sync", **more)):
                np.testing.assert_array_equal(vector.reset(seed=1)[0][0], hanging)
                steps = 0
                while not vector.step(np.zeros((2, 1), np.float32))[3].all():
                    steps += 1
                self.assertEqual(steps + 1, limit or 1000)

    def test_spaces_are_of_the_settings(self):
        env = gym.make(ID, torque_limit=3, memory=2)
        self.assertEqual(env.observation_space.shape, (14,))
        self.assertEqual(env.observation_space.dtype, np.float32)
        self.assertEqual(env.action_space, gym.spaces.Box(-3, 3, (1,), np.float32))
        env = gym.make(ID, actions="levels", levels=5)
        self.assertEqual(env.action_space, gym.spaces.Discrete(5))
        np.testing.assert_array_equal(env.unwrapped.torques, [-5, -2.5, 0, 2.5, 5])

    def test_levels_and_torques_are_the_same_environment(self):
        rng = np.random.default_rng(0)
        levels = rng.integers(9, size=150)
        a = gym.make(ID, actions="levels").unwrapped
        b = gym.make(ID).unwrapped
        torques = a.torques[levels]
        for x, y in zip(play(a, levels, seed=5), play(b, torques[:, None], seed=5)):
            np.testing.assert_array_equal(x, y)
        np.testing.assert_array_equal(play(a, levels, seed=5)[2], torques)

    def test_a_motion_is_that_of_the_programs_simulate(self):
        rng = np.random.default_rng(1)
        schedule = np.round(rng.uniform(-5, 5, 100), 3)
        table = "torque\n" + "\n".join(map(str, schedule)) + "\n"
        start = [0.1, -0.2, 0.3, -0.4]
        for physics in ("mujoco", "closed-form"):
            done = subprocess.run(
                [os.environ["UPSWING"], "simulate", "--torque", "-", "--seconds", "2",
                 "--physics", physics, "--set", "mass2=1.2", "--delay", "0.04",
                 "--start", ",".join(map(str, start))],
                input=table, capture_output=True, encoding="utf-8", check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            rows = list(csv.DictReader(io.StringIO(done.stdout)))
            env = gym.make(ID, physics=physics, mass2=1.2, delay=0.04).unwrapped
            env.reset(seed=0, options={"state": start})
            for k, torque in enumerate(schedule):
                wanted = [float(rows[k][name]) for name in ("q1", "q2", "w1", "w2")]
                np.testing.assert_array_equal(env.state, wanted)
                _, _, _, _, info = env.step(np.array([torque]))
                self.assertEqual(info["torque"], float(rows[k]["torque"]))
            self.assertEqual(env.plant["mass2"], 1.2)

    def test_the_motor_is_at_either_joint(self):
        # From hanging, a torque accelerates its own joint most, and the two joints in opposite
        # directions.
        for joint, signs in ((1, [1, -1]), (2, [-1, 1])):
            env = gym.make(ID, actuated_joint=joint).unwrapped
            env.reset(seed=0, options={"state": [0, 0, 0, 0]})
            env.step(np.array([1.0]))
            np.testing.assert_array_equal(np.sign(env.state[2:]), signs)
        with self.assertRaisesRegex(ValueError, "actuated_joint: expected 1 or 2"):
            gym.make(ID, actuated_joint=1.5)

    def test_a_plant_comes_from_a_file(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "m.toml"
            path.write_text("[plant]\nmass1 = 0.8\ncenter2 = 0.15\n[disturbance]\ndelay = 0.02\n")
            env = gym.make(ID, plant=path, mass2=1.2).unwrapped
            same = gym.make(ID, mass1=0.8, center2=0.15, delay=0.02, mass2=1.2).unwrapped
            self.assertEqual(env.plant, same.plant)
            self.assertEqual(env.plant["mass2"], 1.2)
            for one, two in zip(play(env, [[3.0]] * 20, seed=1), play(same, [[3.0]] * 20, seed=1)):
                np.testing.assert_array_equal(one, two)
        board = gym.make(ID, plant="realaigym", physics="closed-form").unwrapped
        self.assertEqual(board.action_space, gym.spaces.Box(-6, 6, (1,), np.float32))
        one = upswing.load_policy("lqr", made_for="realaigym")
        self.assertEqual(one.info["plant"]["armature"], 0)
        figures = upswing.evaluate("lqr", plant="realaigym", episodes=1, torque_limit=5)
        self.assertEqual((figures["plant"]["center1"], figures["plant"]["torque_limit"]), (0.2, 5))

    def test_the_reward_is_the_sum_of_its_terms(self):
        env = gym.make(ID, energy_weight=0.5, random_start_share=1)
        env.reset(seed=2)
        for _ in range(50):
            _, reward, _, _, info = env.step(env.action_space.sample())
            self.assertAlmostEqual(reward, sum(info["reward_terms"].values()), delta=1e-12)

    def test_the_reward_is_an_expression(self):
        env = gym.make(ID, reward="up: h; 2*tau")
        env.reset(seed=2)
        _, reward, _, _, info = env.step(np.array([1.5]))
        self.assertEqual(list(info["reward_terms"]), ["up", "term2"])
        self.assertEqual(info["reward_terms"]["term2"], 3)
        self.assertEqual(reward, sum(info["reward_terms"].values()))
        with self.assertRaisesRegex(ValueError, "did you mean w1"):
            gym.make(ID, reward="w3")

    def test_an_episode_is_truncated_after_its_time(self):
        env = gym.make(ID, episode_seconds=0.1, physics="closed-form")
        env.reset(seed=1)
        ends = [env.step(np.zeros(1))[2:4] for _ in range(5)]
        self.assertEqual(ends, [(False, False)] * 4 + [(False, True)])
        with self.assertRaises(gym.error.ResetNeeded):
            env.step(np.zeros(1))
        env.reset()
        self.assertEqual(env.step(np.zeros(1))[2:4], (False, False))

    def test_seeds_and_streams(self):
        env = gym.make(ID, physics="closed-form", random_start_share=1).unwrapped
        first = env.reset(seed=7)[0]
        second = env.reset()[0]
        self.assertFalse(np.array_equal(first, second))
        np.testing.assert_array_equal(env.reset(seed=7)[0], first)
        np.testing.assert_array_equal(env.reset()[0], second)
        unseeded = [gym.make(ID, physics="closed-form").reset()[0] for _ in range(2)]
        self.assertFalse(np.array_equal(*unseeded))

    def test_an_agents_environment_is_that_of_its_training(self):
        fast, usual = (gym.make(ID, agent=agent).unwrapped for agent in ("fast", "d3qn"))
        self.assertIn('physics = "closed-form"', fast._core.settings)
        self.assertIn('physics = "mujoco"', usual._core.settings)

    def test_noise_is_seen_and_the_state_is_true(self):
        quiet, noisy = (gym.make(ID, sensor_noise=noise).unwrapped for noise in (0, 0.1))
        quiet_obs, noisy_obs = quiet.reset(seed=3)[0], noisy.reset(seed=3)[0]
        np.testing.assert_array_equal(quiet.state, noisy.state)
        self.assertFalse(np.array_equal(quiet_obs, noisy_obs))

    def test_a_closed_environment_refuses(self):
        env = gym.make(ID).unwrapped
        env.reset(seed=0)
        env.close()
        env.close()
        for call in (env.reset, lambda: env.step(np.zeros(1))):
            with self.assertRaises(gym.error.ClosedEnvironmentError):
                call()

    def test_a_step_before_reset_is_refused(self):
        with self.assertRaises(gym.error.ResetNeeded):
            gym.make(ID).unwrapped.step(np.zeros(1))

    def test_environments_in_threads_do_not_disturb_each_other(self):
        actions = np.random.default_rng(3).uniform(-5, 5, (100, 1))
        expected = play(gym.make(ID), actions, seed=1)
        results = [None] * 4

        def work(k):
            results[k] = play(gym.make(ID), actions, seed=1)

        threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for result in results:
            for x, y in zip(expected, result):
                np.testing.assert_array_equal(x, y)


class NothingToDrawWith(unittest.TestCase):
    """Environments where the packages of upswing[view] are not installed."""

    def test_the_message_says_what_to_install(self):
        for missing, mode, call in (("OpenGL", "rgb_array", "env.render()"), ("glfw", "human", "env.step([0.0])")):
            with self.subTest(missing=missing):
                script = (
                    "import sys\n"
                    "class Missing:\n"
                    "    def find_spec(self, name, path=None, target=None):\n"
                    f"        if name.partition('.')[0] == {missing!r}:\n"
                    "            raise ModuleNotFoundError(f'No module named {name!r}', name=name)\n"
                    "sys.meta_path.insert(0, Missing())\n"
                    "import gymnasium as gym, upswing\n"
                    f"env = gym.make({ID!r}, render_mode={mode!r}).unwrapped\n"
                    "try:\n"
                    "    env.reset(seed=0)\n"
                    f"    {call}\n"
                    "except upswing.Failure as failure:\n"
                    "    print(failure)\n")
                done = subprocess.run([sys.executable, "-c", script], check=False, capture_output=True,
                                      encoding="utf-8")
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertRegex(done.stdout, rf"render: cannot .*No module named '{missing}': expected its Python "
                                              r"packages: pip install .*mujoco-core\[rendering\].* pip install "
                                              r"'upswing\[view\]'\)\n\Z")


class Rendering(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        env = gym.make(ID, render_mode="rgb_array").unwrapped
        env.reset(seed=0)
        try:
            env.render()
        except upswing.Failure as failure:
            if os.environ.get("UPSWING_REQUIRE_PICTURES"):
                raise
            raise unittest.SkipTest(f"nothing can be drawn here: {failure}") from failure

    def draw(self, state, **settings):
        env = gym.make(ID, render_mode="rgb_array", **settings).unwrapped
        env.reset(seed=0, options={"state": state})
        return env.render()

    def test_pictures(self):
        hanging, upright = self.draw([0, 0, 0, 0]), self.draw([np.pi, 0, 0, 0])
        self.assertEqual((hanging.shape, hanging.dtype), ((480, 640, 3), np.uint8))
        # Software rendering with several threads may draw an edge differently each time.
        self.assertLess((hanging != self.draw([0, 0, 0, 0])).mean(), 0.001)
        # The links are in the lower half when hanging and in the upper half when upright.
        changed = (hanging.astype(int) - upright).any(axis=2)
        self.assertGreater(changed[:240].sum(), 500)
        self.assertGreater(changed[240:].sum(), 500)
        self.assertLess(changed[:, :200].sum() + changed[:, 440:].sum(), 200)
        self.assertEqual(self.draw([0] * 4, width=100, height=50).shape, (50, 100, 3))
        self.assertGreater((hanging != self.draw([0] * 4, length2=1)).mean(), 0.005)

    def test_gymnasium_finds_nothing_wrong_with_pictures(self):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            env = gym.make(ID, render_mode="rgb_array").unwrapped
            env.metadata = {**env.metadata, "render_modes": ["rgb_array"]}  # others need a display
            check_env(env)
        self.assertEqual([str(w.message) for w in caught if "Box" not in str(w.message)], [])

    def test_many_environments(self):
        envs = gym.make_vec(ID, num_envs=3, render_mode="rgb_array", width=64, height=48,
                            randomize_length=0.5)
        envs.reset(seed=1)
        pictures = envs.render()
        self.assertEqual([picture.shape for picture in pictures], [(48, 64, 3)] * 3)
        self.assertFalse(np.array_equal(pictures[0], pictures[1]))

    def test_sizes_that_cannot_be(self):
        with self.assertRaises(upswing.InputError):
            self.draw([0] * 4, width=1)

    def test_a_window_shows_every_step_in_real_time(self):
        if shutil.which("xvfb-run") is None:
            if os.environ.get("UPSWING_REQUIRE_PICTURES"):
                self.fail("xvfb-run is missing")
            self.skipTest("needs xvfb-run")
        script = ("import time, gymnasium as gym, upswing\n"
                  f"env = gym.make({ID!r}, render_mode='human')\n"
                  "env.reset(seed=0); begin = time.monotonic()\n"
                  "for _ in range(10): env.step(env.action_space.sample())\n"
                  "assert env.render() is None\n"
                  "print(time.monotonic() - begin)\n"
                  "env.reset(); env.close()")
        done = subprocess.run(["xvfb-run", "-a", sys.executable, "-c", script], check=False,
                              capture_output=True, encoding="utf-8")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertGreater(float(done.stdout), 0.15)

    def test_a_window_needs_a_display(self):
        env = gym.make(ID, render_mode="human").unwrapped
        with mock.patch.dict(os.environ):
            for name in ("DISPLAY", "WAYLAND_DISPLAY"):
                os.environ.pop(name, None)
            with self.assertRaisesRegex(upswing.Failure, "render: cannot open a window: DISPLAY"):
                env.reset()


class Copies(unittest.TestCase):
    def test_pickled_environments_are_made_again(self):
        env = pickle.loads(pickle.dumps(upswing.DoublePendulumEnv(mass2=1.2, actions="levels")))
        env.reset(seed=1)
        self.assertEqual(env.plant["mass2"], 1.2)
        self.assertEqual(len(env.torques), 9)
        envs = pickle.loads(pickle.dumps(upswing.DoublePendulumVectorEnv(3, gravity=9)))
        envs.reset(seed=1)
        self.assertEqual([plant["gravity"] for plant in envs.plants], [9] * 3)

    def test_copies_do_not_read_the_plant_file_again(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "plant.toml")
            file.write_text("[plant]\nmass2 = 1.2\ncoulomb1 = 0.0\n[disturbance]\ndelay = 0.02\n")
            # The agent's plant has another friction.
            single = gym.make(ID, plant=file, agent="pendubot", gravity=9.5)
            many = upswing.DoublePendulumVectorEnv(2, plant=str(file), mass=1.1)
            pickled = pickle.dumps((single, many))

            def check():
                for one, two in (pickle.loads(pickled), copy.deepcopy((single, many)),
                                 pickle.loads(pickle.dumps(pickle.loads(pickled)))):
                    for env, original in ((one, single), (two, many)):
                        obs = [each.reset(seed=3)[0] for each in (env, original)]
                        np.testing.assert_array_equal(*obs)
                        self.assertEqual(env.unwrapped._core.settings,
                                         original.unwrapped._core.settings)
                    self.assertEqual(one.unwrapped.plant["mass2"], 1.2)
                    self.assertEqual(two.plants[0]["mass2"], 1.1)

            check()
            file.write_text("[plant]\nmass2 = 2.5\n")
            check()
            file.unlink()
            check()

    def test_evaluations_do_not_read_the_plant_file_again(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "plant.toml")
            results = []
            for later in (1.2, 2.5):
                file.write_text("[plant]\nmass2 = 1.2\n")
                env = gym.make_vec(ID, 2, physics="closed-form", episode_seconds=0.4, plant=file)
                file.write_text(f"[plant]\nmass2 = {later}\n")
                training = upswing.train("sac", env=env, seed=1, steps=300, eval_every=300,
                                         learning_starts=100, hidden=[16], batch=16, threads=1,
                                         eval_episodes=2, progress=False)
                results.append(training.evaluations[-1]["mean_return"])
            self.assertEqual(*results)


class BadInput(BadInputTest):
    def test_actions(self):
        env = gym.make(ID).unwrapped
        env.reset(seed=0)
        for what, action in {"got int64": 3, "got nan": [np.nan], "got inf": [np.inf],
                             "got (2,)": [1.0, 2.0], "got <U1": "x", "got object": None,
                             "got (1, 1)": [[1.0]]}.items():
            self.refuse(what, lambda action=action: env.step(action))
        env = gym.make(ID, actions="levels").unwrapped
        env.reset(seed=0)
        for what, action in {"0 to 8, got 9": 9, "0 to 8, got -1": -1, "got float64": 2.0,
                             "got (1,)": [3]}.items():
            self.refuse(what, lambda action=action: env.step(action))
        env.step(np.int8(8))  # integers of any type are accepted

    def test_settings_as_the_program_has_them(self):
        for text, settings in {
                'mass2: expected a number in [0.001, 100000] kg, got "-1"': {"mass2": -1},
                'gravty: expected a setting, got "gravty" (did you mean gravity?)': {"gravty": 1},
                "gamma: expected a setting of an environment": {"gamma": 0.9},
                "num_envs: expected": None,
                'levels: expected an integer in [2, 1001], got "1"':
                    {"actions": "levels", "levels": 1},
                "levels: expected actions=": {"levels": 5},
                "threads: expected several environments": {"threads": 2},
                "expected 16 to 8192 pixels": {"width": 1},
                "height: expected an integer": {"height": 4.5},
                "actions: expected one of continuous, levels": {"actions": "discrete"},
                "delay: expected a multiple of 0.02": {"delay": 0.03},
                'mass1: expected a number in [0.001, 100000] kg, got "nan"': {"mass1": np.nan},
                'expected an agent, one of': {"agent": "acrobot-v1"},
                'got "fsat"': {"agent": "fsat"},
                "render_mode: expected": {"render_mode": "ansi"},
                'model: expected a setting, got "model"': {"model": "own.xml"}}.items():
            if settings is not None:
                self.refuse(text, lambda settings=settings: upswing.DoublePendulumEnv(**settings))
        for number in (0, 4097, "x", -1):
            self.refuse("num_envs: expected an integer in [1, 4096]",
                        lambda number=number: upswing.DoublePendulumVectorEnv(number))

    def test_resets(self):
        env = upswing.DoublePendulumEnv()
        self.refuse("options: expected state", lambda: env.reset(options={"low": 1}))
        self.refuse("options: expected state", lambda: env.reset(options={"reset_mask": [True]}))
        self.refuse("state: expected q1, q2, w1, w2",
                    lambda: env.reset(options={"state": [1, 2, 3]}))
        self.refuse("state: expected finite", lambda: env.reset(options={"state": [np.nan] * 4}))
        self.refuse("goal: expected an environment with any_pose",
                    lambda: env.reset(options={"goal": "up-down"}))
        env = upswing.DoublePendulumEnv(any_pose=True)
        for goal in ("up", "", 3, np.array(3), ["up-up", "up-up"], [["up-up"]], [None]):
            self.refuse("goal: expected up-up, up-down, down-up, down-down",
                        lambda goal=goal: env.reset(options={"goal": goal}))


if __name__ == "__main__":
    unittest.main()
