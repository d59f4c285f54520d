#!/usr/bin/env python3
"""Tests that a training stopped at any moment and resumed equals one that was never stopped."""

import os
import random
import signal
import time
import unittest

from testing import ProgramTest, read_csv, read_tensors, run, small, snapshot

ENDLESS = 10**9  # more steps than any test waits for
EVAL_EVERY = 2000


class ResumeTest(ProgramTest):
    def step_of(self, name="run"):
        """The checkpoint's step of a run."""
        _, tensors = read_tensors(self.folder / name / "checkpoint.safetensors")
        return int.from_bytes(tensors["train/steps"][2], "little")

    def finish(self, name="run"):
        """Continues a stopped endless run to the second next evaluation, and makes a run of that
        length that was never stopped. Returns the number of steps."""
        steps = (self.step_of(name) // EVAL_EVERY + 2) * EVAL_EVERY
        self.succeed("train", "--resume", name, "--steps", steps)
        self.succeed(*small(steps=steps, stop_when_solved=False, out="never-stopped"))
        return steps

    def test_killed_at_ten_random_moments(self):
        moments = random.Random(1)
        arguments = small(steps=ENDLESS, stop_when_solved=False)
        for _ in range(10):
            process = self.start(*arguments)
            time.sleep(moments.uniform(0, 0.3))
            code, _ = self.end(process, signal.SIGKILL)
            self.assertEqual(code, -signal.SIGKILL)
            arguments = ["train", "--resume", "run"]
        # Even if those moments were short on this machine, some steps have been trained.
        self.finish()
        self.assert_same_run("run", "never-stopped")

    def test_fewer_steps_than_were_made_are_refused(self):
        self.succeed(*small())
        self.refuse(["train", "--resume", "run", "--steps", "3000"], "--steps", "4000", "3000")

    def test_a_run_with_settings_of_another_version(self):
        self.succeed(*small(steps=2000))
        config = self.folder / "run/config.toml"
        settings = config.read_text()
        config.write_text(settings.replace("[plant]\n", '[plant]\nmodel = "model.xml"\n'))
        for command in (["info", "run"], ["train", "--resume", "run"], ["compare", "run"]):
            self.refuse(command, "run/config.toml: expected only settings of this version, got "
                        "plant.model; another version wrote the file")
        config.write_text(settings)
        self.succeed("info", "run")

    def test_a_run_that_is_being_trained_is_not_resumed(self):
        process = self.start(*small(steps=ENDLESS, stop_when_solved=False))
        refused = run("train", "--resume", "run", cwd=self.folder)
        self.assert_one_line(refused, 2, "run: another process is at work here")
        self.end(process, signal.SIGKILL)
        self.finish()
        self.assert_same_run("run", "never-stopped")

    def test_killed_before_it_trains_leaves_a_whole_run_or_none(self):
        moments = random.Random(2)
        short = {"steps": 1000, "eval_every": 1000}
        for i in range(10):
            run = self.folder / f"run{i}"
            process = self.start(*small(out=run.name, **short), wait=False)
            time.sleep(moments.uniform(0, 0.01))
            self.end(process, signal.SIGKILL)
            again = (["train", "--resume", run.name] if run.exists() else
                     small(out=run.name, **short))
            self.succeed(*again)
        self.assertEqual(len({(self.folder / f"run{i}/policy.safetensors").read_bytes()
                              for i in range(10)}), 1)

    def check_stop_signal(self, number, expected_code):
        process = self.start(*small(steps=ENDLESS, checkpoint_every=ENDLESS,
                                    stop_when_solved=False))
        self.wait_for(lambda: (self.folder / "run/policy.safetensors").exists())
        code, output = self.end(process, number)
        self.assertEqual(code, expected_code, output)
        self.assertIn("Stopped at step", output)
        self.assertIn("upswing train --resume run", output)
        self.assertGreater(self.step_of(), 0)
        self.assertIn(f"stopped at step {self.step_of()}",
                      (self.folder / "run/log.txt").read_text(encoding="utf-8"))
        self.finish()
        self.assert_same_run("run", "never-stopped")

    def test_sigint_leaves_a_checkpoint_of_its_step(self):
        self.check_stop_signal(signal.SIGINT, 130)

    def test_sigterm_leaves_a_checkpoint_of_its_step(self):
        self.check_stop_signal(signal.SIGTERM, 143)

    def test_sigusr1_writes_a_checkpoint_and_goes_on(self):
        process = self.start(*small(steps=ENDLESS, checkpoint_every=ENDLESS,
                                    stop_when_solved=False))
        checkpoint = self.folder / "run/checkpoint.safetensors"
        before = os.stat(checkpoint).st_ino
        process.send_signal(signal.SIGUSR1)
        self.wait_for(lambda: os.stat(checkpoint).st_ino != before)
        step = self.step_of()
        self.assertIsNone(process.poll())
        evaluations = (self.folder / "run/evals.csv").read_text
        seen = evaluations()
        self.wait_for(lambda: evaluations() != seen)
        self.end(process, signal.SIGKILL)
        self.assertEqual(self.step_of(), step)
        self.finish()
        self.assert_same_run("run", "never-stopped")

    def test_resuming_a_finished_run_changes_nothing(self):
        self.succeed(*small())
        before = snapshot(self.folder)
        self.succeed("train", "--resume", "run")
        after = snapshot(self.folder)
        log = "run/log.txt"
        self.assertTrue(after.pop(log).startswith(before.pop(log)))
        self.assertEqual(after, before)

    def test_more_steps_equal_a_run_of_that_many(self):
        self.succeed(*small(steps=4000))
        self.succeed("train", "--resume", "run", "--steps", 8000)
        self.succeed(*small(steps=8000, out="at-once"))
        self.assert_same_run("run", "at-once")
        self.assertIn("steps = 8000", (self.folder / "run/config.toml").read_text())

    def test_more_steps_in_closed_form_equal_a_run_of_that_many(self):
        self.succeed(*small(steps=4000, physics="closed-form"))
        self.succeed("train", "--resume", "run", "--steps", 8000)
        self.succeed(*small(steps=8000, physics="closed-form", out="at-once"))
        self.assert_same_run("run", "at-once")
        self.assertIn('physics = "closed-form"', (self.folder / "run/config.toml").read_text())

    def test_more_steps_with_random_plants_equal_a_run_of_that_many(self):
        # Episodes have 21 steps, so the run resumes within them, with delayed torques pending.
        for physics in ("mujoco", "closed-form"):
            changes = {"physics": physics, "episode_seconds": 0.42, "randomize": 0.25,
                       "sensor_noise": 0.01, "randomize_delay": 0.06}
            self.succeed(*small(steps=4000, out=f"{physics}-run", **changes))
            self.succeed("train", "--resume", f"{physics}-run", "--steps", 8000)
            self.succeed(*small(steps=8000, out=f"{physics}-at-once", **changes))
            self.assert_same_run(f"{physics}-run", f"{physics}-at-once")
        self.assertIn("randomize_length2 = 0.25",
                      (self.folder / "mujoco-run/config.toml").read_text())

    def test_more_steps_on_a_posterior_equal_a_run_of_that_many(self):
        for physics in ("mujoco", "closed-form"):
            changes = {"physics": physics, "episode_seconds": 0.42, "plant": "realaigym-twin",
                       "randomize_posterior": True}
            self.succeed(*small(steps=4000, threads=1, out=f"{physics}-run", **changes))
            # The run folder has the covariance, so resuming needs no plant.
            self.succeed("train", "--resume", f"{physics}-run", "--steps", 8000, "--threads", 2)
            self.succeed(*small(steps=8000, out=f"{physics}-at-once", **changes))
            self.assert_same_run(f"{physics}-run", f"{physics}-at-once")
        config = (self.folder / "mujoco-run/config.toml").read_text()
        self.assertIn("randomize_posterior = true", config)
        self.assertRegex(config, r'posterior = "center1 \S+; inertia1 ')

    def test_more_steps_with_encoders_equal_a_run_of_that_many(self):
        for physics in ("mujoco", "closed-form"):
            changes = {"physics": physics, "episode_seconds": 0.42, "identify": True,
                       "encoder_counts": 4096, "velocity_window": 0.03, "velocity_filter": 0.01,
                       "randomize_sensor_latency": 0.04}
            self.succeed(*small(steps=4000, out=f"{physics}-run", **changes))
            self.succeed("train", "--resume", f"{physics}-run", "--steps", 8000)
            self.succeed(*small(steps=8000, out=f"{physics}-at-once", **changes))
            self.assert_same_run(f"{physics}-run", f"{physics}-at-once")
        self.assertIn("encoder_counts = 4096", (self.folder / "mujoco-run/config.toml").read_text())

    def test_another_number_of_threads_may_resume(self):
        self.succeed(*small(steps=4000, threads=1))
        self.succeed("train", "--resume", "run", "--steps", 8000, "--threads", 2)
        self.succeed(*small(steps=8000, out="at-once"))
        self.assert_same_run("run", "at-once")

    def test_no_stop_when_solved_goes_on(self):
        # Almost without gravity the pendulum stays where it stops, so it is solved soon.
        easy = {"gravity": 0.05, "damping": 1, "hidden": "64,64", "head": 32, "eval_episodes": 1,
                "eval_every": EVAL_EVERY, "steps": 100000, "checkpoint_every": 5000}
        self.assertIn("Solved after", self.succeed(*small(**easy)))
        solved_at = self.step_of()
        self.assertLess(solved_at, 100000)
        evaluations = read_csv(self.folder / "run/evals.csv")
        self.assertEqual([row["success_rate"] for row in evaluations[-2:]], [1, 1])

        self.succeed("train", "--resume", "run")
        self.assertEqual(self.step_of(), solved_at)
        steps = solved_at + 2 * EVAL_EVERY
        self.succeed("train", "--resume", "run", "--no-stop-when-solved", "--steps", steps)
        self.assertEqual(self.step_of(), steps)
        self.succeed(*small(**easy | {"steps": steps, "stop_when_solved": False, "out": "at-once"}))
        self.assert_same_run("run", "at-once")


if __name__ == "__main__":
    unittest.main()
