#!/usr/bin/env python3
"""Tests of `upswing train --seeds`: many runs at a time equal single runs, also after
interruptions."""

import fcntl
import os
import re
import signal
import time
import unittest
from pathlib import Path

from testing import RUN_FILES, ProgramTest, run, small, snapshot

TINY = {"steps": 400, "hidden": 8, "head": 8, "eval_episodes": 2, "eval_every": 200,
        "log_every": 200, "learning_starts": 50, "threads": None, "out": "many"}
# Long enough for an interruption right after the start.
SHORT = TINY | {"steps": 12000, "eval_every": 6000, "checkpoint_every": 1000}
ENDLESS = TINY | {"steps": 10**9, "stop_when_solved": False}


class SeedsTest(ProgramTest):
    def assert_same_runs(self, a, b, seeds):
        for seed in seeds:
            self.assert_same_run(f"{a}/seed{seed}", f"{b}/seed{seed}")

    def children(self, process):
        path = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        return [int(word) for word in path.read_text(encoding="ascii").split()]

    def wait_until_free(self, name):
        """Waits until no process works in a run's folder."""
        descriptor = os.open(self.folder / name, os.O_RDONLY)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        os.close(descriptor)

    # ---- Results.

    def test_each_seed_equals_a_single_run(self):
        output = self.succeed(*small(**TINY), "--seeds", "2,5-6")
        self.assertTrue(output.startswith("Training d3qn-small in many\n  seeds 2, 5-6: 3 runs"),
                        output)
        self.assertNotIn("\x1b", output)
        self.assertEqual({path.name for path in (self.folder / "many").iterdir()},
                         {"settings.toml", "plan.json"} | {f"seed{seed}{end}" for seed in (2, 5, 6)
                                                           for end in ("", ".log", ".done")})
        for seed in (2, 5, 6):
            self.succeed(*small(**TINY | {"seed": seed, "out": f"alone/seed{seed}", "threads": 2}))
            files = {path.name for path in (self.folder / f"many/seed{seed}").iterdir()}
            self.assertEqual(files, RUN_FILES)
            self.assertIn(f"seed {seed}) in many/seed{seed}",
                          (self.folder / f"many/seed{seed}.log").read_text(encoding="utf-8"))
        self.assert_same_runs("many", "alone", (2, 5, 6))

    def test_a_number_of_seeds_counts_from_one_in_a_folder_of_the_agent(self):
        output = self.succeed(*small(**TINY | {"out": None}), "--seeds", 2, "--jobs", 1)
        self.assertEqual(sorted(path.name for path in (self.folder / "runs/d3qn-small").iterdir()),
                         ["plan.json", "seed1", "seed1.done", "seed1.log", "seed2", "seed2.done",
                          "seed2.log", "settings.toml"])
        self.assertRegex(output, r"\nd3qn-small\n  seeds +2 \(1-2\)\n")  # the comparison

    def test_the_comparison_matches_the_runs(self):
        # Almost without gravity the pendulum stays where it stops, so it is solved soon.
        easy = {"gravity": 0.05, "damping": 1, "hidden": "64,64", "head": 32, "eval_episodes": 1,
                "eval_every": 2000, "steps": 100000, "threads": None, "out": "easy"}
        output = self.succeed(*small(**easy), "--seeds", "1,2,3")
        solved = {}
        for seed in (1, 2, 3):
            info = self.succeed("info", f"easy/seed{seed}")
            step = re.search(r"solved +at step ([\d,]+), after", info)[1]
            solved[seed] = int(step.replace(",", ""))
            self.assertRegex(output, rf"(?m)^  seed{seed} .* solved at {step} ")
        self.assertRegex(output, rf"(?m)^  steps to solve +(median )?{sorted(solved.values())[1]:,} ?")

    # ---- Resuming.

    def test_finished_runs_stay_and_others_are_added(self):
        self.succeed(*small(**TINY), "--seeds", 2)
        before = snapshot(self.folder)
        self.assertIn("2 already done", self.succeed(*small(**TINY), "--seeds", 2))
        self.assertEqual(snapshot(self.folder), before)
        self.succeed(*small(**TINY), "--seeds", 3)
        after = snapshot(self.folder)
        self.assertIn("many/seed3", after)
        before.pop("many/plan.json")
        self.assertEqual({name: after[name] for name in before}, before)

    def test_more_steps_equal_as_many_at_once(self):
        self.succeed(*small(**TINY), "--seeds", 2)
        self.succeed(*small(**TINY | {"steps": 800}), "--seeds", 2)
        self.succeed(*small(**TINY | {"steps": 800, "out": "at-once"}), "--seeds", 2)
        self.assert_same_runs("many", "at-once", (1, 2))

    def test_as_many_at_a_time_as_wanted_and_none_outlives_its_parent(self):
        process = self.start(*small(**ENDLESS), "--seeds", 3, "--jobs", 2)
        many = self.folder / "many"
        self.wait_for(lambda: (many / "seed1").exists() and (many / "seed2").exists())
        self.assertEqual(len(self.children(process)), 2)
        self.assertFalse((many / "seed3").exists())
        refused = run(*small(**ENDLESS), "--seeds", 3, cwd=self.folder)
        self.assert_one_line(refused, 2, "many: another process is at work here")
        self.end(process, signal.SIGKILL)
        for name in ("many/seed1", "many/seed2"):
            self.wait_until_free(name)

    def check_restart(self, number, code):
        process = self.start(*small(**SHORT), "--seeds", 2, "--jobs", 1)
        self.wait_for(lambda: (self.folder / "many/seed1/metrics.csv").exists())
        ended, output = self.end(process, number)
        self.assertEqual(ended, code, output)
        self.wait_until_free("many/seed1")
        self.assertFalse((self.folder / "many/seed2/policy.safetensors").exists())
        self.succeed(*small(**SHORT), "--seeds", 2)
        self.succeed(*small(**SHORT | {"out": "never-stopped"}), "--seeds", 2)
        self.assert_same_runs("many", "never-stopped", (1, 2))
        return output

    def test_interrupted_and_restarted_equals_never_stopped(self):
        output = self.check_restart(signal.SIGINT, 130)
        self.assertIn("Stopped with 0 of 2 runs done; the same command resumes the others.", output)
        self.assertIn("stopped at step",
                      (self.folder / "many/seed1/log.txt").read_text(encoding="utf-8"))

    def test_killed_and_restarted_equals_never_stopped(self):
        self.check_restart(signal.SIGKILL, -signal.SIGKILL)

    def test_sigterm_ends_in_order_too(self):
        process = self.start(*small(**ENDLESS), "--seeds", 1)
        self.wait_for(lambda: (self.folder / "many/seed1/metrics.csv").exists())
        self.assertEqual(self.end(process, signal.SIGTERM)[0], 143)
        self.assertIn("stopped at step",
                      (self.folder / "many/seed1/log.txt").read_text(encoding="utf-8"))

    def test_a_second_signal_ends_at_once(self):
        process = self.start(*small(**ENDLESS), "--seeds", 1)
        self.wait_for(lambda: (self.folder / "many/seed1/metrics.csv").exists())
        child = self.children(process)[0]
        os.kill(child, signal.SIGSTOP)  # this child cannot end in order
        process.send_signal(signal.SIGINT)

        def caught():
            status = Path(f"/proc/{process.pid}/status").read_text(encoding="ascii")
            mask = int(status.split("SigCgt:")[1].split()[0], 16)
            return mask >> (signal.SIGINT - 1) & 1
        self.wait_for(lambda: not caught())  # the first signal has arrived
        time.sleep(0.1)
        self.assertIsNone(process.poll())
        self.assertEqual(self.end(process, signal.SIGINT)[0], -signal.SIGINT)
        self.wait_until_free("many/seed1")

    # ---- Errors.

    def test_a_run_that_fails_is_named_and_the_others_go_on(self):
        self.succeed(*small(**TINY), "--seeds", "1-1")
        (self.folder / "many/seed2").mkdir()
        self.write("many/seed2/precious", "mine")
        failed = self.run_here(*small(**TINY), "--seeds", 3)
        self.assert_one_line(failed, 1, "1 of 3 runs in many failed",
                             "seed2: many/seed2: expected")
        self.assertRegex(failed.stdout, r"(?m)^  seed2 +failed: .*expected a new or "
                                        r"empty folder.*many/seed2\.log")
        self.assertIn("2 of 3 runs done", failed.stdout)
        self.assertEqual([path.name for path in (self.folder / "many/seed2").iterdir()],
                         ["precious"])

        (self.folder / "many/seed2/precious").unlink()
        self.succeed(*small(**TINY), "--seeds", 3)
        self.succeed(*small(**TINY | {"out": "at-once"}), "--seeds", 3)
        self.assert_same_runs("many", "at-once", (1, 2, 3))

    def test_a_broken_checkpoint_is_named_and_the_others_go_on(self):
        self.succeed(*small(**TINY), "--seeds", 2)
        checkpoint = self.folder / "many/seed1/checkpoint.safetensors"
        checkpoint.write_bytes(checkpoint.read_bytes()[:1000])
        failed = self.run_here(*small(**TINY | {"steps": 800}), "--seeds", 3)
        reason = f"many/seed1/{checkpoint.name}: not a valid safetensors file"
        self.assert_one_line(failed, 1, "1 of 3 runs in many failed", "seed1: " + reason)
        # Reported before the others run.
        self.assertRegex(failed.stdout, rf"(?m)\A.*\n.*\n.*already done.*\n  seed1 +failed: {reason}")
        self.assertIn("./upswing compare many --unfinished\n", failed.stdout)
        self.succeed(*small(**TINY | {"steps": 800, "out": "alone"}), "--seeds", "2-3")
        self.assert_same_runs("many", "alone", (2, 3))

    def test_settings_count_where_no_run_has_begun(self):
        (self.folder / "many").mkdir()
        self.write("many/plan.json", "{}")
        self.write("many/settings.toml", "")
        self.refuse([*small(**TINY), "--seeds", "1"], "many/settings.toml: made with",
                    "choose another --out")

    def test_other_settings_are_refused_with_the_difference(self):
        self.succeed(*small(**TINY), "--seeds", 1)
        for changes, words in (({"gamma": 0.9}, ["agent.gamma = 0.99", "has 0.9"]),
                               ({"agent": "d3qn"}, ["train.agent", "d3qn-small"]),
                               ({"steps": 300}, ["train.steps = 400", "has 300"]),
                               ({"steps": None}, ["train.steps = 400", "has 1000000"]),
                               ({"stop_when_solved": False}, ["train.stop_when_solved"])):
            with self.subTest(changes=changes):
                self.refuse([*small(**TINY | changes), "--seeds", "2"], "many/seed1: made with",
                            *words, "choose another --out")

    def test_a_folder_of_something_else_is_refused(self):
        self.succeed(*small(**TINY))
        self.refuse([*small(**TINY), "--seeds", "2"], "many: expected a new or empty folder",
                    "no plan.json")

    def test_bad_seeds(self):
        for text, words in (("0", "1 to 10000"), ("-3", "1 to 10000"), ("0-", "3,5,8-12"),
                            ("-", "3,5,8-12"), ("5-3", "3,5,8-12"), ("1,,2", "3,5,8-12"),
                            ("1,2,", "3,5,8-12"), ("x", "3,5,8-12"), ("1.5", "3,5,8-12"),
                            ("1-2-3", "3,5,8-12"), ("3,1-4", "3 is twice"), ("7,7", "7 is twice"),
                            ("1-1e9", "1 to 10000"), ("0-9000000000000000", "1 to 10000"),
                            ("9000000000000001,1", "3,5,8-12"), ("20000", "1 to 10000")):
            with self.subTest(seeds=text):
                self.refuse([*small(**TINY), f"--seeds={text}"], "--seeds: expected", words,
                            f'got "{text}"')
        self.refuse([*small(**TINY), "--seeds", ""], "--seeds: expected a number of seeds")

    def test_what_does_not_go_together(self):
        self.refuse([*small(**TINY), "--seeds", "2", "--seed", "3"], "--seeds", "--seed")
        self.refuse(["train", "--resume", "x", "--seeds", "2"], "--seeds", "--resume")
        self.refuse([*small(**TINY), "--jobs", "2"], "--jobs", "--seeds")
        self.refuse([*small(**TINY), "--seeds", "2", "--jobs", "0"], "--jobs")

    def test_progress_on_a_terminal(self):
        shown = self.watch(150, [*small(**ENDLESS), "--seeds", 2, "--jobs", 2],
                           r"\r\x1b\[K\[[= ]{16}\] +\d+%  0 of 2 runs  about [^\r]+ left  "
                           r"[1-9][\d,]* steps/s  seed1 \d+%  seed2 \d+%")
        self.assertIn("Stopped with 0 of 2 runs done", shown)


if __name__ == "__main__":
    unittest.main()
