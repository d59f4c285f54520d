#!/usr/bin/env python3
"""Tests of folders. Untrusted ones: the program writes nothing through a link, and bounds every
counter of a checkpoint. New ones: the program creates them where requested, complete or not at
all."""

import os
import random
import shutil
import signal
import time
import unittest

from testing import (PATIENCE, ROOT, ProgramTest, SmallRunTest, read_tensors, run, small, snapshot,
                     with_number, without_locks, write_tensors)

GROWING = ["metrics.csv", "episodes.csv", "evals.csv", "events.out.tfevents.0.upswing", "log.txt"]
REPLACED = ["config.toml", "checkpoint.safetensors", "policy.safetensors"]
TINY = {"steps": 400, "hidden": 8, "head": 8, "eval_episodes": 2, "eval_every": 200,
        "log_every": 200, "learning_starts": 50, "threads": None, "out": "many"}


class RunTest(SmallRunTest):
    """Tests of a small run next to another user's files."""

    RESUME = ["train", "--resume", "run", "--steps", "8000"]

    def setUp(self):
        super().setUp()
        (self.folder / "precious").mkdir()

    def link_away(self, path, hard=False):
        """Moves a file to `precious` and leaves a link to it. Returns its new path."""
        path = self.folder / path
        away = self.folder / "precious" / path.name
        shutil.move(path, away)
        if hard:
            os.link(away, path)
        else:
            path.symlink_to(away)
        return away


@unittest.skipIf("UPSWING_EMULATOR" in os.environ and os.environ["UPSWING_EMULATOR"],
                 "an emulator needs its own system calls")
class NoLocksTest(ProgramTest):
    """On a file system without locks a command names the cause and leaves nothing."""

    def test_new_folders(self):
        for out in ("run", "new/parent/run"):
            self.refuse(small(out=out), f"cannot lock {out}: No locks available",
                        preexec_fn=without_locks)
        (self.folder / "empty").mkdir()
        self.refuse(small(out="empty"), "empty: No locks available", preexec_fn=without_locks)
        self.refuse(small(out=None), "runs/d3qn-small-seed1: No locks", preexec_fn=without_locks)
        policy = ROOT / "web/public/agents/d3qn.safetensors"
        self.refuse(["export", policy, "--page", "site/agents"], "cannot lock site/agents: No locks",
                    preexec_fn=without_locks)

    def test_many_runs(self):
        many = small(**TINY) + ["--seeds", "2"]
        self.refuse(many, "cannot lock many: No locks", preexec_fn=without_locks)
        # NFS may have locks of folders only.
        self.refuse(many, "cannot lock many/.locks-", "No locks",
                    preexec_fn=lambda: without_locks(folders=False))

    def test_a_folder_that_exists_stays_as_it_is(self):
        self.succeed(*small(**TINY | {"out": "run"}))
        self.refuse(["train", "--resume", "run", "--steps", "800"], "cannot lock run: No locks",
                    preexec_fn=without_locks)
        self.write("little.toml", '[settings]\nagent = "d3qn-small"\nsteps = 400\n[variants.one]\n')
        self.succeed("study", "little.toml", "--out", "study", "--seeds", "4", "--prepare")
        # A worker calls no run failed.
        self.refuse(["study", "--work", "study"], "cannot lock study/one/seed1.claim: No locks",
                    preexec_fn=without_locks)
        self.refuse(["study", "little.toml", "--out", "study", "--seeds", "4"],
                    "cannot lock study: No locks", preexec_fn=without_locks)


class LinkTest(RunTest):
    def test_growing_files_are_neither_cut_nor_appended_to_through_a_link(self):
        for name in GROWING:
            for hard in (False, True):
                with self.subTest(name=name, hard=hard):
                    self.restore()
                    away = self.link_away(f"run/{name}", hard)
                    self.refuse(self.RESUME, f"run/{name}", "a regular file that only this folder has",
                                "hard links" if hard else "a link")
                    away.unlink()

    def test_a_link_that_leads_nowhere_makes_no_file_there(self):
        for name in GROWING:
            with self.subTest(name=name):
                self.restore()
                self.link_away(f"run/{name}").unlink()
                self.refuse(self.RESUME, f"run/{name}")

    def test_a_link_is_replaced_not_its_target(self):
        whole = {name: self.link_away(f"run/{name}") for name in REPLACED}
        before = {name: path.read_bytes() for name, path in whole.items()}
        self.succeed(*self.RESUME)
        self.assertEqual({name: path.read_bytes() for name, path in whole.items()}, before)
        self.succeed(*small(steps=8000, out="at-once"))
        self.assert_same_run("run", "at-once")

    def test_no_name_of_a_temporary_file_can_be_foreseen(self):
        self.write("precious/file", "mine")
        for name in REPLACED:
            for end in (".upswing-tmp", ".tmp", ".new"):
                (self.folder / f"run/.{name}{end}").symlink_to("../precious/file")
        self.succeed(*self.RESUME)
        self.assertEqual((self.folder / "precious/file").read_text(encoding="utf-8"), "mine")

    def test_a_pipe_is_not_waited_for(self):
        for name in [*GROWING, *REPLACED]:
            with self.subTest(name=name):
                self.restore()
                (self.folder / "run" / name).unlink()
                os.mkfifo(self.folder / "run" / name)
                done = self.run_here(*(self.RESUME if name != "policy.safetensors" else
                                       ["eval", "run"]), timeout=PATIENCE)
                self.assert_one_line(done, 2, f"run/{name}")
        self.restore()
        (self.folder / "run/evals.csv").unlink()
        os.mkfifo(self.folder / "run/evals.csv")
        self.assertEqual(self.run_here("compare", "run", timeout=PATIENCE).returncode, 2)

    def test_the_page_is_not_written_through_a_link(self):
        self.succeed("export", "run", "--page", "page", "--id", "a")
        for name in ("agents.json", "a.safetensors"):
            self.link_away(f"page/{name}")
        self.write("precious/file", "mine")
        for name in ("agents.json", "a.safetensors"):
            (self.folder / f"page/.{name}.upswing-tmp").symlink_to("../precious/file")
        before = snapshot(self.folder / "precious")
        (self.folder / "run/evals.csv").unlink()  # the index then differs from before
        self.succeed("export", "run", "--page", "page", "--id", "a")
        self.assertEqual(snapshot(self.folder / "precious"), before)
        self.assertFalse((self.folder / "page/agents.json").is_symlink())

    def test_runs_among_many_are_not_trained_through_a_link(self):
        self.succeed(*small(**TINY), "--seeds", 2)
        shutil.move(self.folder / "many/seed1", self.folder / "precious/seed1")
        (self.folder / "many/seed1").symlink_to("../precious/seed1")
        away = self.link_away("many/seed2.log")
        before = snapshot(self.folder / "precious")
        failed = self.run_here(*small(**TINY | {"steps": 800}), "--seeds", 3)
        self.assert_one_line(failed, 1, "2 of 3 runs in many failed",
                             "many/seed1: expected a folder, got a link")
        self.assertRegex(failed.stdout, r"(?m)^  seed2 +failed: .*seed2\.log.*, got a link")
        self.assertIn("1 of 3 runs done", failed.stdout)
        self.assertEqual(snapshot(self.folder / "precious"), before)
        self.assertTrue(away.exists())

    def test_a_variant_is_no_link(self):
        study = 'seeds = 1\n[settings]\nagent = "d3qn-small"\n[variants.a]\n'
        (self.folder / "many").mkdir()
        for name in ("s.toml", "many/plan.json"):
            self.write(name, study)
        (self.folder / "many/a").symlink_to("../precious")
        self.refuse(["study", "s.toml", "--out", "many"], "many/a: expected a folder, got a link")

    def test_a_link_that_the_user_names_is_followed(self):
        self.write("precious/out.csv", "t,q1,q2,w1,w2\n")
        (self.folder / "out.csv").symlink_to("precious/out.csv")
        self.succeed("simulate", "--seconds", "1", "--csv", "out.csv")
        self.assertTrue((self.folder / "out.csv").is_symlink())
        self.assertIn("q1", (self.folder / "precious/out.csv").read_text(encoding="utf-8"))


class CounterTest(RunTest):
    """Tests of numbers that no training writes."""

    def setUp(self):
        super().setUp()
        self.metadata, self.tensors = read_tensors(self.checkpoint)

    def refuse_number(self, name, number, index=0):
        with self.subTest(name=name, number=number):
            changed = {name: with_number(self.tensors[name], index, number)}
            write_tensors(self.checkpoint, self.metadata, self.tensors | changed)
            self.refuse(self.RESUME, "run/checkpoint.safetensors: tensor", "expected", timeout=PATIENCE)

    def test_counters(self):
        steps = 4000
        for name, numbers in {
                "agent/steps": (-1, steps - 8, steps + 8, 2**40, 2**63 - 1, -2**63),
                "agent/episodes": (-1, steps + 1, 2**62),
                "agent/updates": (-1, 0, 2**62, -2**62),
                "agent/report_updates": (-1, 2**62),
                "agent/adam/steps": (-1, 2**62),
                "agent/loss_sum": (-1.0, float("nan")), "agent/q_sum": (float("inf"),),
                "agent/td_sum": (-1.0,), "agent/norm_sum": (-1.0, float("nan")),
                "agent/adam/v": (-1.0,),
                "agent/replay/next": (-1, 10**9, 7),
                "agent/replay/largest_priority": (0.0, 0.5, 1e300, float("inf")),
                "agent/replay/priorities/numbers": (0.0, -1.0, 1e300),
                "agent/n_step/count": (-1, 3, 2**40), "agent/n_step/action": (-1, 9, 2**40),
                "env/step_counts": (-1, 10**6, 2**62), "env/start_noise": (-1.0, 1e9, float("nan")),
                "train/episodes": (-1, steps + 1, 2**62), "train/seconds": (-1.0, 1e300),
                "train/streak": (-1, 1 << 40, 2), "train/streak_step": (-1, steps + 1),
                "train/streak_seconds": (-1.0, 1e9), "train/solved": (-1, 1, 2),
                "train/last_success_rate": (-0.1, 1.1),
                "train/best_success_rate": (-0.5, -1.0, 2.0),
                "train/best_step": (-1, 0, steps + 1), "train/best_return": (float("nan"),),
                "train/episode_length": (-1, 2**62),
                "train/steps": (-8, 3999, 4008, 2**40, 2**62),
                "run/size/metrics": (-1, -2**63, 2**62), "run/size/events": (-1,)}.items():
            for number in numbers:
                self.refuse_number(name, number)

    def test_tables(self):
        for name in ("metrics", "episodes", "evals", "events"):
            size = f"run/size/{name}"
            for number in (10**9, 2**59):
                with self.subTest(name=name, number=number):
                    changed = {size: with_number(self.tensors[size], 0, number)}
                    write_tensors(self.checkpoint, self.metadata, self.tensors | changed)
                    self.refuse(self.RESUME, f"run/{name}", "expected at least the", str(number))

    def test_discounts_and_actions_in_the_memory(self):
        shape = self.tensors["agent/replay/rows"][1]
        self.assertEqual(shape[0] % 19, 0)
        for index, number in ((16, -1.0), (16, 9.0), (16, 0.5), (18, -0.5), (18, 1.5)):
            self.refuse_number("agent/replay/rows", number, index)

    def test_random_streams_that_have_died(self):
        for name, tensor in self.tensors.items():
            if name.endswith("rng/state") or name == "env/rng.0/state":
                with self.subTest(name=name):
                    changed = {name: (tensor[0], tensor[1], bytes(32))}
                    write_tensors(self.checkpoint, self.metadata, self.tensors | changed)
                    self.refuse(self.RESUME, f'"{name}"', timeout=PATIENCE)


class PlaceTest(ProgramTest):
    def made(self, path):
        return (self.folder / path / "checkpoint.safetensors").is_file()

    def test_the_way_is_the_systems_not_the_texts(self):
        (self.folder / "d/below").mkdir(parents=True)
        (self.folder / "x").symlink_to("d/below")
        self.succeed(*small(**TINY | {"out": "x/../run"}))
        self.assertTrue(self.made("d/run"))
        self.assertFalse((self.folder / "run").exists())
        self.refuse(small(**TINY | {"out": "x/../run"}), "x/../run: expected a new or empty folder")
        self.assertIn('"id": "run"', self.page_of("x/../run"))

    def page_of(self, run_path):
        self.succeed("export", run_path, "--page", "page")
        return (self.folder / "page/agents.json").read_text(encoding="utf-8")

    def test_missing_folders_are_made(self):
        self.succeed(*small(**TINY | {"out": "none/../run"}))
        self.assertTrue(self.made("run"))
        self.succeed(*small(**TINY | {"out": "deep/er/run//"}))
        self.assertTrue(self.made("deep/er/run"))
        self.assertEqual([path.name for path in (self.folder / "deep/er").iterdir()], ["run"])

    def test_an_empty_folder_is_taken_also_through_a_link(self):
        (self.folder / "empty").mkdir()
        self.succeed(*small(**TINY | {"out": "empty/"}))
        (self.folder / "other").mkdir()
        (self.folder / "link").symlink_to("other")
        self.succeed(*small(**TINY | {"out": "link"}))
        self.assertTrue(self.made("other"))
        self.assertTrue((self.folder / "link").is_symlink())

    def test_the_current_folder_is_not_replaced(self):
        (self.folder / "here").mkdir()
        done = run(*small(**TINY | {"out": "."}), cwd=self.folder / "here")
        self.assert_one_line(done, 2, "expected a new folder, got the current one")
        self.assertEqual(snapshot(self.folder / "here"), {})

    def test_modes_follow_the_umask(self):
        for umask in (0o077, 0o027, 0o022):
            out = f"run{umask:o}"
            self.succeed(*small(**TINY | {"out": out}),
                         preexec_fn=lambda umask=umask: os.umask(umask))
            self.assertEqual((self.folder / out).stat().st_mode & 0o777, 0o777 & ~umask)
            for path in (self.folder / out).iterdir():
                self.assertEqual(path.stat().st_mode & 0o777, 0o666 & ~umask, path)

    def test_a_killed_run_leaves_nothing_that_stays(self):
        # A large network: its first checkpoint takes some time.
        slow = small(**TINY | {"hidden": "512,512", "out": "runs/a"})
        moments = random.Random(3)
        for _ in range(20):
            process = self.start(*slow, wait=False)
            runs = self.folder / "runs"
            self.wait_for(lambda: process.poll() is not None or
                          (runs.is_dir() and any(runs.iterdir())))
            time.sleep(moments.uniform(0, 0.02))
            self.end(process, signal.SIGKILL)
            names = [path.name for path in runs.iterdir()]
            self.assertLessEqual(len(names), 1, names)  # the complete run, or its leftovers
            if (runs / "a").exists():
                self.assertTrue(self.made("runs/a"))
            shutil.rmtree(runs / "a", ignore_errors=True)
        self.succeed(*small(**TINY | {"out": "runs/b"}))
        self.assertEqual([path.name for path in (self.folder / "runs").iterdir()], ["b"])

    def test_leftovers_are_no_run(self):
        self.succeed(*small(**TINY), "--seeds", 2)
        expected = self.succeed("compare", "many")
        left = self.folder / "many/.seed3.making-0123456789abcdef"
        shutil.copytree(self.folder / "many/seed1", left)
        (left / "config.toml").write_text("half", encoding="utf-8")
        os.utime(left, (0, 0))  # of another host, and old
        self.assertEqual(self.succeed("compare", "many"), expected)
        self.succeed(*small(**TINY), "--seeds", 3)
        self.assertFalse(left.exists())

    def test_a_policy_that_is_gone_is_not_named(self):
        self.succeed(*small(**TINY))
        (self.folder / "many/policy.safetensors").unlink()
        output = self.succeed("train", "--resume", "many")
        self.assertRegex(output, r"Best policy: from step \d+, but many/policy\.safetensors no longer "
                                 r"exists")
        self.assertNotIn("upswing eval", output)
        self.assertRegex(self.succeed("info", "many"),
                         r"policy +the best one, from step \d+, no longer exists")
        self.refuse(["eval", "many"], "many: expected a run with a policy.safetensors")


if __name__ == "__main__":
    unittest.main()
