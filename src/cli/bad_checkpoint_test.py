#!/usr/bin/env python3
"""Tests of damaged checkpoints, full disks and diverging trainings: one clear error line, and no
data is lost."""

import math
import resource
import subprocess
import unittest

from testing import (UPSWING, ProgramTest, SmallRunTest, read_tensors, small, snapshot,
                     with_number, write_tensors)


class CheckpointTest(SmallRunTest):
    RESUME = ["train", "--resume", "run", "--steps", "8000"]

    def refuse_checkpoint(self, *words):
        self.refuse(self.RESUME, "run/checkpoint.safetensors", *words)

    def change(self, metadata=(), tensors=(), drop=()):
        old_metadata, old_tensors = read_tensors(self.checkpoint)
        kept = {name: tensor for name, tensor in (old_tensors | dict(tensors)).items()
                if name not in drop}
        write_tensors(self.checkpoint, old_metadata | dict(metadata), kept)

    def test_rewritten_unchanged_it_is_good(self):
        self.change()
        self.succeed(*self.RESUME)

    def test_no_run(self):
        self.refuse(["train", "--resume", "nothing"], "nothing", "expected a run folder")
        (self.folder / "empty").mkdir()
        self.refuse(["train", "--resume", "empty"], "empty", "expected a run folder")

    def test_missing(self):
        self.checkpoint.unlink()
        self.refuse_checkpoint("No such file")

    def test_truncated(self):
        whole = self.checkpoint.read_bytes()
        for size in (0, 7, 1000, len(whole) // 2, len(whole) - 1):
            with self.subTest(size=size):
                self.checkpoint.write_bytes(whole[:size])
                self.refuse_checkpoint("not a valid safetensors file")

    def test_corrupted(self):
        for position in self.places(self.checkpoint):
            with self.subTest(position=position):
                self.flip(self.checkpoint, position)
                self.refuse_checkpoint()
                self.restore()

    def test_tensor_of_another_shape_or_type_or_none(self):
        _, tensors = read_tensors(self.checkpoint)
        for name in ("agent/theta", "agent/adam/m", "agent/n_step/reward", "env/state.0",
                     "env/step_counts", "train/episode_return", "train/steps", "run/size/metrics"):
            dtype, shape, data = tensors[name]
            with self.subTest(name=name):
                longer = shape[:-1] + [shape[-1] + 1] if shape else [2]
                self.change(tensors={name: (dtype, longer, data + data[-8:] if dtype[1:] == "64"
                                            else data + data[-4:])})
                self.refuse_checkpoint(f'"{name}"', "expected", "got")
                self.restore()
                self.change(drop=[name])
                self.refuse_checkpoint(f'"{name}"')
                self.restore()
                self.change(tensors={name: ("U8", [len(data)], data)})
                self.refuse_checkpoint(f'"{name}"', "expected " + dtype)
                self.restore()

    def test_not_finite(self):
        _, tensors = read_tensors(self.checkpoint)
        for name in ("agent/theta", "agent/theta_target", "agent/adam/m", "agent/adam/v",
                     "agent/replay/rows", "env/state.0", "env/obs", "train/episode_return"):
            with self.subTest(name=name):
                self.change(tensors={name: with_number(tensors[name], 2, math.nan)})
                self.refuse_checkpoint(f'"{name}"', "finite", "nan")
                self.restore()

    def test_another_version(self):
        self.change(metadata={"upswing_version": "0.0.1"})
        self.refuse_checkpoint("upswing_version", "0.0.1")
        self.change(metadata={"format": "upswing-checkpoint-99"})
        self.refuse_checkpoint("format", "upswing-checkpoint-99")

    def test_another_configuration(self):
        config = self.folder / "run/config.toml"
        original = config.read_text(encoding="utf-8")
        for before, after, words in (
                ("gamma = 0.99 ", "gamma = 0.98 ", ["agent.gamma", "0.99", "0.98"]),
                ("hidden = [32]", "hidden = [64]", ["network.hidden", "[32]", "[64]"]),
                ("mass2 = 1 ", "mass2 = 1.5 ", ["plant.mass2", "1.5"]),
                ("seed = 1 ", "seed = 2 ", ["train.seed", "1", "2"]),
                ("dueling = true", "dueling = false", ["agent.dueling", "true", "false"])):
            with self.subTest(change=after):
                self.assertIn(before, original)
                config.write_text(original.replace(before, after), encoding="utf-8")
                self.refuse_checkpoint(*words)
        config.write_text(original, encoding="utf-8")
        self.refuse([*self.RESUME, "--gamma", "0.98"], "agent.gamma", "0.99", "0.98")
        self.succeed(*self.RESUME)

    def test_configuration_of_another_version(self):
        config = self.folder / "run/config.toml"
        lines = config.read_text(encoding="utf-8").splitlines(keepends=True)
        config.write_text("".join(line for line in lines if not line.startswith("gamma = ")),
                          encoding="utf-8")
        for command in (self.RESUME, ["info", "run"], ["compare", "run"]):
            with self.subTest(command=command):
                self.refuse(command, "run/config.toml: expected every setting",
                            "got none of agent.gamma; another version wrote the file")
        # A configuration given by the user may be incomplete.
        self.succeed(*small(steps=400, out="again"), "--config", "run/config.toml")

    def test_broken_configuration(self):
        config = self.folder / "run/config.toml"
        text = config.read_text(encoding="utf-8")
        config.write_text(text.replace("gamma = ", "gamma = = "), encoding="utf-8")
        line = text[:text.index("gamma = ")].count("\n") + 1
        self.refuse(self.RESUME, f"run/config.toml:{line}:")

    def test_table_shorter_than_the_checkpoint_knows(self):
        table = self.folder / "run/metrics.csv"
        table.write_bytes(table.read_bytes()[:100])
        self.refuse(self.RESUME, "run/metrics.csv", "expected", "got 100")


class DiskFullTest(ProgramTest):
    """The replay memory grows, and each checkpoint grows with it."""

    SMALL_FILES = 60  # kilobytes of a small run's other files on disk

    def assert_stopped_and_whole(self, done, kept_step, run_name="run"):
        """Asserts one error line that names step and checkpoint, and that the remaining files are
        complete."""
        self.assert_one_line(done, 1, "training stopped at step", f"checkpoint of step {kept_step}",
                             "is kept in " + run_name)
        self.assertNotIn("Done", done.stdout)
        self.assertEqual([str(path) for path in self.folder.rglob("*.tmp")], [])
        self.assertEqual([str(path) for path in self.folder.rglob("*.new")], [])

    def step_of(self, name="run"):
        _, tensors = read_tensors(self.folder / name / "checkpoint.safetensors")
        return int.from_bytes(tensors["train/steps"][2], "little")

    def assert_resumes_to_the_same_bytes(self):
        self.succeed("train", "--resume", "run")
        self.succeed(*small(out="never-stopped"))
        self.assert_same_run("run", "never-stopped")

    def test_in_the_middle_of_a_checkpoint(self):
        self.succeed(*small(steps=2000, out="measured"))
        limit = (self.folder / "measured/checkpoint.safetensors").stat().st_size + 1000
        done = self.run_here(*small(), preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_FSIZE, (limit, limit)))
        self.assert_stopped_and_whole(done, 2000)
        self.assertIn("checkpoint.safetensors: File too large", done.stderr)
        self.assertEqual(self.step_of(), 2000)
        self.assertEqual(self.succeed("info", "run").count("self-check  passed"), 1)
        self.assert_resumes_to_the_same_bytes()

    def test_when_the_first_checkpoint_does_not_fit(self):
        before = snapshot(self.folder)
        done = self.run_here(*small(), preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_FSIZE, (10000, 10000)))
        self.assert_one_line(done, 1, "cannot make the run folder run", "File too large")
        self.assertEqual(snapshot(self.folder), before)

    def test_in_the_middle_of_a_csv(self):
        self.write("out.csv", "t,q1,q2,w1,w2\n")
        self.refuse(["simulate", "--csv", "out.csv"], "out.csv", "File too large", code=1,
                    preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000)))

    def on_small_disk(self, kilobytes, arguments):
        """Runs the program in its own tmpfs, and copies the run here afterwards."""
        script = (f'mount -t tmpfs -o size={kilobytes}k tmpfs "$PWD/disk" || exit 99\n'
                  'cd disk; "$@"; code=$?; cp -a run .. || exit 98; exit $code')
        (self.folder / "disk").mkdir()
        # A separate mount namespace: the disk disappears with the shell.
        done = subprocess.run(["unshare", "--mount", "--map-root-user", "sh", "-c", script, "sh",
                               UPSWING, *arguments], cwd=self.folder, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, encoding="utf-8", check=False)
        if done.returncode == 99 or "unshare:" in done.stderr:
            self.skipTest("mounting is not permitted here: " + done.stderr.strip())
        return done

    def test_on_a_full_disk(self):
        # Two checkpoints exist while one replaces the other. The disk has room for two of step
        # 2000.
        self.succeed(*small(steps=2000, out="measured"))
        checkpoint = (self.folder / "measured/checkpoint.safetensors").stat().st_size
        done = self.on_small_disk(2 * checkpoint // 1024 + self.SMALL_FILES, small())
        kept = self.step_of()
        self.assertTrue(0 < kept < 4000, kept)
        self.assert_stopped_and_whole(done, kept)
        self.assertIn("No space left on device", done.stderr)
        self.assert_resumes_to_the_same_bytes()

    def test_on_a_disk_that_a_table_fills(self):
        # The run writes only its first checkpoint; a row of metrics.csv for each step fills the
        # rest of the disk.
        settings = {"log_every": 8, "checkpoint_every": 10**9, "steps": 8000, "eval_every": 10**6}
        self.succeed(*small(**settings | {"steps": 8, "eval_episodes": 1, "out": "measured"}))
        checkpoint = (self.folder / "measured/checkpoint.safetensors").stat().st_size
        done = self.on_small_disk(checkpoint // 1024 + self.SMALL_FILES, small(**settings))
        self.assert_stopped_and_whole(done, 0)
        self.assertIn("No space left on device", done.stderr)
        self.succeed("train", "--resume", "run")
        self.succeed(*small(**settings, out="never-stopped"))
        self.assert_same_run("run", "never-stopped")


class NotFiniteTest(ProgramTest):
    # A deep network without normalisation and a huge learning rate: its Q-values overflow.
    DIVERGING = {"hidden": ",".join(["64"] * 8), "layer_norm": False, "learning_rate": 10,
                 "learning_starts": 1000}

    def test_training_stops_and_keeps_the_last_checkpoint(self):
        done = self.run_here(*small(**self.DIVERGING))
        self.assert_one_line(done, 1, "training stopped at step 10", "expected a finite number",
                             "checkpoint of step 1000 is kept in run")
        self.assertNotIn("Done", done.stdout)
        self.assertIn("training stopped at step",
                      (self.folder / "run/log.txt").read_text(encoding="utf-8"))
        self.assertFalse(list(self.folder.rglob("*.tmp")))

        # The kept files are complete: resuming leads to the same end again.
        again = self.run_here("train", "--resume", "run")
        self.assertEqual((again.returncode, again.stderr), (1, done.stderr))

    def test_rollout_that_blows_up(self):
        done = self.run_here("simulate", "--start", "0,0,1e9,-1e9", "--csv", "out.csv")
        self.assert_one_line(done, 1, "the simulation diverged after t = ")
        self.assertFalse((self.folder / "out.csv").exists())
        self.assertFalse((self.folder / "MUJOCO_LOG.TXT").exists())


if __name__ == "__main__":
    unittest.main()
