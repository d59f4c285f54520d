#!/usr/bin/env python3
"""Tests that the tools whose numbers the documentation quotes still run (tools/results, tools/peers): each
for a second, and without the other libraries."""

import importlib.util
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parent.parent))
UPSWING = Path(os.environ.get("UPSWING", ROOT / "build/release/bin/upswing"))
BENCHMARKS = UPSWING.with_name("benchmarks")
sys.dont_write_bytecode = True
sys.path[:0] = [str(ROOT / "tools/peers"), str(ROOT / "tools/results")]
import actors  # noqa: E402  pylint: disable=wrong-import-position
import results  # noqa: E402  pylint: disable=wrong-import-position

# Settings whose defaults do not matter here: of features that are off, of schedules that are constant.
NEUTRAL = {"sac": {"priority_exponent", "importance_exponent",
                   "learning_rate_steps", "actor_rate", "tune_alpha"},
           "ppo": {"actions", "levels", "learning_rate_steps"}}


class Peers(unittest.TestCase):
    def test_no_setting_is_left_to_a_default_that_changes(self):
        """A new default of an agent must not change the algorithm that is compared."""
        for agent, neutral in NEUTRAL.items():
            text = actors.run([actors.PROGRAM, "train", "--agent", agent, "--print-config"])
            sections = re.findall(r"^\[(?:agent|network)\]\n((?:\w.*\n)*)", text, re.MULTILINE)
            names = set(re.findall(r"^(\w+) = ", "".join(sections), re.MULTILINE))
            self.assertEqual(names - set(actors.settings(agent, seed=1)), neutral, agent)


@unittest.skipUnless(UPSWING == ROOT / "build/release/bin/upswing", "the tools run the release build")
class Results(unittest.TestCase):
    def succeed(self, *command):
        done = subprocess.run([sys.executable, "-B", *map(str, command)], check=False, cwd=ROOT,
                              stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8")
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_recipes(self):
        for table, words in (("first-training", "steps"), ("perf-c", "`d3qn`")):
            self.assertIn(words, self.succeed("tools/results/results.py", "measure", table, "--try"))

    def test_trainings_for_the_swing_up_of_realaigym(self):
        """Their settings are accepted, and the policy of a training acts every 2 ms."""
        with tempfile.TemporaryDirectory(prefix="upswing-") as folder:
            for robot in results.REALAIGYM_REWARDS:
                slow, fast = (f"{folder}/{robot}-{ms}ms" for ms in (20, 2))
                settings = [UPSWING, "train", *results.swing_up_settings(robot)]
                actors.run([*settings, "--steps", "64", "--out", slow])
                actors.run([*settings, "--start-policy", slow, *results.EVERY_2_MS, "--out", fast])
                info = json.loads(actors.run([UPSWING, "info", f"{fast}/policy.safetensors", "--json"]))
                self.assertEqual(info["control_period"], 0.002)

    @unittest.skipUnless(BENCHMARKS.exists(), "needs Google Benchmark")
    def test_benchmarks_have_the_names_of_the_table(self):
        text = self.succeed("tools/results/results.py", "compare", "perf-parts", "--try")
        self.assertRegex(text, r"\| decision of `mpc` \| [\d,.]+ \| [\d,.]+ \|")
        self.assertIn("time [µs], here", text)

    @unittest.skipUnless(importlib.util.find_spec("casadi"), "needs CasADi")
    def test_the_best_known_return_is_above_its_guess(self):
        text = self.succeed("tools/results/swing_up_bound.py", "--episodes", 1, "--guesses", "sac")
        best, guess = map(float, re.search(r"episode 0: (\S+) from sac, best guess (\S+);", text).groups())
        self.assertGreater(best, guess)

    @unittest.skipUnless(importlib.util.find_spec("casadi"), "needs CasADi")
    def test_a_solver_finds_the_motions_of_mpc(self):
        text = self.succeed("tools/peers/mpc.py", "--episodes", 1)
        self.assertIn("upright at the end: True", text)
        self.assertLess(float(re.search(r"largest (\S+)%", text)[1]), 2)

    def test_upright_modes(self):
        self.assertIn("|delta|", self.succeed("tools/results/upright_modes.py", "fast", "--episodes", 4,
                                              "--physics", "closed-form"))

    @unittest.skipUnless(importlib.util.find_spec("numpy"), "needs NumPy")
    def test_logs_of_drawn_machines(self):
        with tempfile.TemporaryDirectory(prefix="upswing-") as folder:
            text = self.succeed("tools/results/logs.py", "--machines", 2, "--kind", "angle 1 doubled",
                                "--keep", folder)
        self.assertIn("angle 1 doubled: ", text)
        self.assertIn("2 named", text)

    def test_seeds(self):
        with tempfile.TemporaryDirectory(prefix="upswing-") as folder:
            runs = Path(folder, "runs")
            runs.mkdir()
            rows = [f"{agent},{seed},90000,{1000 * seed},{seed},1,{2000 + seed},1,{2000 - seed}\n"
                    for agent in ("fast", "d3qn") for seed in range(1, 201)]
            (runs / "runs.csv").write_text(
                "group,seed,steps,solve_steps,solve_seconds,best_success,best_return,final_success,"
                "final_return\n" + "".join(rows), encoding="utf-8")
            try:
                import numpy  # noqa: F401  pylint: disable=import-outside-toplevel,unused-import
            except ImportError:
                self.skipTest("needs NumPy")
            for tool in ("distribution", "how_many"):
                self.succeed(f"tools/results/seeds/{tool}.py", runs, "--out", Path(folder, tool))


if __name__ == "__main__":
    unittest.main()
