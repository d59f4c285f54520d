#!/usr/bin/env python3
"""Tests of many environments: Gymnasium's own tests of vector environments, comparison with single
environments in Gymnasium's SyncVectorEnv, and views, copies, threads."""

import gc
import threading
import unittest

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import upswing

ID = "upswing/DoublePendulum-v0"
ROUGH = {"sensor_noise": 0.02, "delay": 0.04, "encoder_counts": 4096, "velocity_window": 0.03,
         "randomize_sensor_latency": 0.02, "randomize": 0.2, "memory": 2,
         "random_start_share": 0.5}


def make(num_envs=3, **more):
    return gym.make_vec(ID, num_envs=num_envs, **{"physics": "closed-form"} | more)


class Vector(unittest.TestCase):
    def test_spaces_and_metadata(self):
        envs = make(4)
        self.assertIsInstance(envs, upswing.DoublePendulumVectorEnv)
        self.assertEqual(envs.num_envs, 4)
        self.assertEqual(envs.single_observation_space.shape, (8,))
        self.assertEqual(envs.observation_space.shape, (4, 8))
        self.assertEqual(envs.action_space.shape, (4, 1))
        self.assertEqual(envs.metadata["autoreset_mode"], AutoresetMode.NEXT_STEP)
        self.assertEqual(make(actions="levels").action_space, gym.spaces.MultiDiscrete([9] * 3))
        for mode in (AutoresetMode.SAME_STEP, "SameStep"):
            self.assertEqual(make(autoreset_mode=mode).metadata["autoreset_mode"],
                             AutoresetMode.SAME_STEP)
        # The class itself is unchanged.
        self.assertEqual(upswing.DoublePendulumVectorEnv.metadata["autoreset_mode"],
                         AutoresetMode.NEXT_STEP)

    def test_shapes_and_types(self):
        for more in ({}, {"actions": "levels"}, {"autoreset_mode": "SameStep"}, {"copy": False}):
            envs = make(5, **more)
            obs, infos = envs.reset(seed=1)
            self.assertIn(obs, envs.observation_space)
            self.assertEqual(infos, {})
            obs, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())
            self.assertIn(obs, envs.observation_space)
            for array, dtype in ((rewards, np.float64), (terminated, np.bool_),
                                 (truncated, np.bool_)):
                self.assertEqual((array.shape, array.dtype), ((5,), dtype))

    def against_gymnasium(self, mode, **settings):
        """Asserts the same steps as Gymnasium's own vector of single environments, over several
        episodes."""
        ours = make(3, autoreset_mode=mode, **settings)
        kinds = {"physics": "closed-form"} | settings
        theirs = SyncVectorEnv([lambda: gym.make(ID, **kinds)] * 3, autoreset_mode=mode)
        np.testing.assert_array_equal(ours.reset(seed=11)[0], theirs.reset(seed=11)[0])
        ours.action_space.seed(3)
        for step in range(60):
            if step == 25:  # one of the three restarts, so they are out of step
                mask = np.array([False, True, False])
                a, b = (envs.reset(seed=[None, 5, None], options={"reset_mask": mask})[0]
                        for envs in (ours, theirs))
                np.testing.assert_array_equal(a, b)
            action = ours.action_space.sample()
            a, b = ours.step(action), theirs.step(action)
            for x, y in zip(a[:4], b[:4]):
                np.testing.assert_array_equal(x, y, strict=True)
            if mode == AutoresetMode.SAME_STEP and (a[2] | a[3]).any():
                np.testing.assert_array_equal(a[4]["_final_obs"], b[4]["_final_obs"])
                for x, y in zip(a[4]["final_obs"], b[4]["final_obs"]):
                    np.testing.assert_array_equal(x, y)
                for name in ("torque", "at_goal", "_torque"):
                    ended = a[4]["_final_obs"]
                    np.testing.assert_array_equal(a[4]["final_info"][name][ended],
                                                  b[4]["final_info"][name][ended])
            elif mode == AutoresetMode.SAME_STEP:
                self.assertNotIn("final_obs", a[4])

    def test_next_step_autoreset_is_gymnasiums(self):
        for settings in ({"episode_seconds": 0.2}, {"episode_seconds": 0.2, "actions": "levels"},
                         {"episode_seconds": 0.1, "physics": "mujoco"},
                         {"episode_seconds": 0.02},
                         ROUGH | {"episode_seconds": 0.2}):
            with self.subTest(settings):
                self.against_gymnasium(AutoresetMode.NEXT_STEP, **settings)

    def test_same_step_autoreset_is_gymnasiums(self):
        for settings in ({"episode_seconds": 0.2}, {"episode_seconds": 0.02},
                         {"episode_seconds": 0.1, "physics": "mujoco"},
                         ROUGH | {"episode_seconds": 0.2}):
            with self.subTest(settings):
                self.against_gymnasium(AutoresetMode.SAME_STEP, **settings)

    def test_next_step_ignores_the_action_and_gives_the_new_start(self):
        envs = make(2, episode_seconds=0.1)
        envs.reset(seed=1)
        zero = np.zeros((2, 1), np.float32)
        for step in range(5):
            last, _, terminated, truncated, infos = envs.step(zero)
            self.assertEqual(truncated.tolist(), [step == 4] * 2)
        start, rewards, terminated, truncated, infos = envs.step(zero + 5)
        self.assertEqual((rewards.tolist(), truncated.tolist(), infos), ([0, 0], [False] * 2, {}))
        self.assertFalse(terminated.any())
        self.assertFalse(np.array_equal(start, last))
        np.testing.assert_array_equal(envs.torque, 0)
        # The new episode has its full length: five steps from its start.
        ends = [envs.step(zero)[3].any() for _ in range(5)]
        self.assertEqual(ends, [False] * 4 + [True])

    def test_episodes_of_one_step_end_in_every_second_step(self):
        envs = make(2, episode_seconds=0.02)
        envs.reset(seed=1)
        zero = np.zeros((2, 1))
        ends = [envs.step(zero)[3].tolist() for _ in range(6)]
        self.assertEqual(ends, [[True] * 2, [False] * 2] * 3)

    def test_environment_i_has_the_episodes_of_seed_s_plus_i(self):
        for physics in ("closed-form", "mujoco"):
            settings = ROUGH | {"episode_seconds": 0.2, "physics": physics}
            envs = make(3, **settings)
            obs, _ = envs.reset(seed=40)
            single = gym.make(ID, **settings)
            expected, _ = single.reset(seed=42)
            rng = np.random.default_rng(0)
            np.testing.assert_array_equal(obs[2], expected)
            for _ in range(10):
                torque = rng.uniform(-5, 5, (3, 1))
                obs, rewards, _, truncated, _ = envs.step(torque)
                expected, reward, _, ended, _ = single.step(torque[2])
                np.testing.assert_array_equal(obs[2], expected)
                self.assertEqual((rewards[2], truncated[2]), (reward, ended))
            self.assertTrue(ended)

    def test_seeds(self):
        envs, again = make(), make()
        a = envs.reset(seed=1)[0]
        np.testing.assert_array_equal(again.reset(seed=[1, 2, 3])[0], a)
        b = envs.reset()[0]
        self.assertFalse(np.array_equal(a, b))
        np.testing.assert_array_equal(again.reset()[0], b)
        np.testing.assert_array_equal(envs.reset(seed=[1, None, 3])[0][[0, 2]], a[[0, 2]])
        self.assertEqual(len(np.unique(a[:, 0])), 3)
        # Without a seed, starts are random.
        self.assertFalse(np.array_equal(make().reset()[0], make().reset()[0]))
        for seed in (-1, [1, 2], [1, -2, 3], 1.5, "abc", [0.5, 1, 2]):
            with self.assertRaises((upswing.InputError, gym.error.Error)):
                envs.reset(seed=seed)

    def test_states_are_set_for_all_or_for_some(self):
        envs = make()
        envs.reset(seed=0, options={"state": [3, 0, 1, 0]})
        np.testing.assert_array_equal(envs.states, [[3, 0, 1, 0]] * 3)
        mask = np.array([True, False, True])
        envs.reset(options={"state": np.arange(12).reshape(3, 4), "reset_mask": mask})
        np.testing.assert_array_equal(envs.states[[0, 2]], [[0, 1, 2, 3], [8, 9, 10, 11]])
        np.testing.assert_array_equal(envs.states[1], [3, 0, 1, 0])
        envs = make(any_pose=True)
        goals = envs.reset(seed=0)[0][:, 8:].copy()
        obs, _ = envs.reset(options={"goal": ["up-up", None, "down-up"], "reset_mask": mask})
        np.testing.assert_array_equal(obs[:, 8:], [[1, 1], goals[1], [-1, 1]])
        for bad in ([True] * 2, np.array([1, 0, 1]), np.zeros(3, bool)):
            with self.assertRaises(upswing.InputError):
                envs.reset(options={"reset_mask": bad})
        for bad in (3.0, [3.0], [[1.0]] * 3, [1.0, 2.0, 3.0], np.zeros((4, 3))):
            with self.assertRaisesRegex(upswing.InputError, "state: expected"):
                envs.reset(options={"state": bad})

    def test_a_seed_is_drawn_where_none_was_ever_given(self):
        first, second = make(), make()
        obs = [envs.reset(seed=[1, None, None])[0] for envs in (first, second)]
        np.testing.assert_array_equal(obs[0][0], obs[1][0])
        self.assertFalse(np.array_equal(obs[0][1:], obs[1][1:]))

    def test_copies_are_the_callers_and_views_are_not(self):
        for mode in AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP:
            envs = make(autoreset_mode=mode)
            kept = [envs.reset(seed=1)[0]]
            kept += [envs.step(np.ones((3, 1)))[0] for _ in range(3)]
            self.assertEqual(len({array[0, 2] for array in kept}), 4)
            views = make(autoreset_mode=mode, copy=False)
            first = views.reset(seed=1)[0]
            np.testing.assert_array_equal(first, kept[0])
            for k in range(3):
                obs, rewards, *_ = views.step(np.ones((3, 1)))
                np.testing.assert_array_equal(obs, kept[k + 1])
                self.assertTrue(np.shares_memory(obs, first))
                self.assertFalse(obs.flags.writeable)
            # A view stays valid after its environments are gone.
            expected = obs.copy()
            del views, first
            gc.collect()
            np.testing.assert_array_equal(obs, expected)

    def test_the_number_of_threads_changes_no_bit(self):
        results = []
        for threads in (1, 2, 5):
            envs = make(200, threads=threads, physics="mujoco", episode_seconds=0.1)
            envs.reset(seed=3)
            envs.action_space.seed(1)
            for _ in range(12):
                obs, rewards, *_ = envs.step(envs.action_space.sample())
            results.append((obs, rewards))
        for obs, rewards in results[1:]:
            np.testing.assert_array_equal(obs, results[0][0])
            np.testing.assert_array_equal(rewards, results[0][1])

    def test_the_interpreter_runs_while_environments_step(self):
        envs = make(1024, physics="mujoco", threads=1)
        envs.reset(seed=0)
        action = np.zeros((1024, 1))
        counts, stop = [0], threading.Event()

        def count():
            while not stop.wait(1e-4):
                counts[0] += 1

        counter = threading.Thread(target=count)
        counter.start()
        try:
            before = counts[0]
            for _ in range(10):
                envs.step(action)
            during = counts[0] - before
        finally:
            stop.set()
            counter.join()
        # Each step takes milliseconds. A counter blocked by the ten steps would only reach about
        # ten.
        self.assertGreater(during, 20)

    def test_calls_from_several_threads_wait_for_each_other(self):
        envs = make(64, episode_seconds=100)
        envs.reset(seed=0)
        action = np.zeros((64, 1))

        def work():
            for _ in range(50):
                envs.step(action)

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        other = make(64, episode_seconds=100)
        other.reset(seed=0)
        for _ in range(200):
            obs = other.step(action)[0]
        np.testing.assert_array_equal(envs.reset(seed=1)[0], other.reset(seed=1)[0])
        self.assertEqual(obs.shape, (64, 8))

    def test_wrappers_of_gymnasium_work(self):
        envs = gym.wrappers.vector.RecordEpisodeStatistics(make(4, episode_seconds=0.2))
        envs.reset(seed=0)
        total = np.zeros(4)
        for _ in range(10):
            _, rewards, _, _, infos = envs.step(envs.action_space.sample())
            total += rewards
        np.testing.assert_allclose(infos["episode"]["r"], total)
        self.assertEqual(infos["episode"]["l"].tolist(), [10] * 4)
        scaled = gym.wrappers.vector.RescaleAction(make(2), -1, 1)
        scaled.reset(seed=0)
        scaled.step(np.ones((2, 1), np.float32))
        np.testing.assert_array_equal(scaled.unwrapped.torque, 5)

    def test_properties(self):
        envs = make(2)
        envs.reset(seed=0, options={"state": [np.pi, 0, 0, 0]})
        _, rewards, *_ = envs.step(np.full((2, 1), 100.0))
        np.testing.assert_array_equal(envs.torque, 5)  # cut at the limit
        self.assertTrue(envs.at_goal.all())
        np.testing.assert_allclose(sum(envs.reward_terms.values()), rewards)
        self.assertEqual(envs.plants[1]["length2"], 0.5)

    def test_closed_and_not_yet_reset(self):
        envs = make()
        with self.assertRaises(gym.error.ResetNeeded):
            envs.step(np.zeros((3, 1)))
        envs.reset(seed=0)
        envs.close()
        envs.close()
        for call in (envs.reset, lambda: envs.step(np.zeros((3, 1)))):
            with self.assertRaises(gym.error.ClosedEnvironmentError):
                call()

    def test_bad_actions(self):
        envs = make()
        envs.reset(seed=0)
        before = envs.states
        bad = np.zeros((3, 1))
        bad[1] = np.nan
        for what, action in (("of environment 1: expected a finite", bad),
                             ("expected an array of shape (3, 1), got (3,)", np.zeros(3)),
                             ("expected an array of shape (3, 1), got (1, 3)", np.zeros((1, 3))),
                             ("got int64", np.zeros((3, 1), int)),
                             ("got object", [None] * 3)):
            with self.assertRaises(upswing.InputError) as caught:
                envs.step(action)
            self.assertIn(what, str(caught.exception))
        np.testing.assert_array_equal(envs.states, before)  # unchanged
        levels = make(actions="levels")
        levels.reset(seed=0)
        with self.assertRaises(upswing.InputError) as caught:
            levels.step(np.array([0, 8, 9]))
        self.assertIn("action of environment 2: expected a torque level from 0 to 8, got 9",
                      str(caught.exception))
        for mode in ("Disabled", "x", AutoresetMode.DISABLED):
            with self.assertRaises(upswing.InputError):
                make(autoreset_mode=mode)


if __name__ == "__main__":
    unittest.main()
