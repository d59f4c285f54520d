#!/usr/bin/env python3
"""Tests of other tasks than the double pendulum: every command supports them, or refuses with a
reason."""

import csv
import json
import re
import statistics
import tempfile
import unittest
from pathlib import Path

from testing import read_csv, run

TASKS = {"pendulum-v1": (2, 200, ["angle", "velocity", "effort"]),
         "acrobot-v1": (4, 500, ["time"])}  # state variables, longest episode, reward terms


class TaskTest(unittest.TestCase):
    """A short training of each task, shared by the tests."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.root = Path(cls.folder.name)
        for task in TASKS:
            result = run("train", "--task", task, "--levels", 3, "--hidden", "16", "--head", 8,
                         "--steps", 2500, "--envs", 4, "--eval-every", 1000, "--eval-episodes", 5,
                         "--learning-starts", 200, "--threads", 1, "--out", cls.root / task)
            assert result.returncode == 0, result.stderr
            assert f"task {task}" in result.stdout and "demo" not in result.stdout, result.stdout

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_the_tables_have_the_tasks_terms(self):
        for task, (_, longest, terms) in TASKS.items():
            episodes = read_csv(self.root / task / "episodes.csv")
            self.assertEqual(list(episodes[0])[5:], terms)
            for row in episodes:
                self.assertLessEqual(row["length"], longest)
                self.assertAlmostEqual(row["return"], sum(row[term] for term in terms), places=9)

    def test_no_column_of_an_episode_stands_twice(self):
        for task in TASKS:
            result = run("simulate", self.root / task, "--csv", "-")
            names = result.stdout.split("\n", 1)[0].split(",")
            self.assertIn("torque", names, result.stderr)
            self.assertEqual(len(names), len(set(names)), names)

    def test_an_evaluation_is_judged_by_the_return(self):
        for task, (states, _, terms) in TASKS.items():
            table = self.root / f"{task}.csv"
            result = run("eval", self.root / task, "--episodes", 20, "--json", "--episodes-csv", table)
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads(result.stdout)
            self.assertEqual(report["task"], task)
            self.assertEqual(list(report["reward_terms"]), terms)
            with open(table, encoding="utf-8", newline="") as file:
                rows = list(csv.DictReader(file))
            self.assertEqual(len(rows), 20)
            self.assertEqual(list(rows[0]).index("success"), 1 + states)
            threshold = {"pendulum-v1": -160, "acrobot-v1": -100}[task]
            for row in rows:
                self.assertEqual(int(row["success"]), int(float(row["return"]) >= threshold))
            returns = [float(row["return"]) for row in rows]
            self.assertAlmostEqual(report["return"]["mean"], sum(returns) / len(returns), places=9)

    def test_the_energy_is_that_of_the_length_of_the_episodes(self):
        def energy_line(policy, *flags):
            table = run("eval", self.root / policy, "--episodes", 20, *flags)
            self.assertEqual(table.returncode, 0, table.stderr)
            return next(line for line in table.stdout.splitlines() if "energy used" in line)
        self.assertTrue(energy_line("pendulum-v1").endswith(" J   in 10 s"))  # fixed length
        # Long enough to reach the goal. Each step costs 1, except the last one, which reaches the
        # goal and ends the episode.
        trained = run("train", "--task", "acrobot-v1", "--levels", 3, "--hidden", "16", "--head", 8,
                      "--steps", 20000, "--envs", 4, "--eval-every", 5000, "--eval-episodes", 5,
                      "--learning-starts", 200, "--threads", 1, "--out", self.root / "reaches")
        self.assertEqual(trained.returncode, 0, trained.stderr)
        table = self.root / "lengths.csv"
        line = energy_line("reaches", "--episodes-csv", table)
        with open(table, encoding="utf-8", newline="") as file:
            steps = [min(500, 1 - float(row["return"])) for row in csv.DictReader(file)]
        self.assertLess(min(steps), 500)
        mean, deviation = map(float, re.search(r" J   in (\S+) ± (\S+) s per", line).groups())
        self.assertAlmostEqual(mean, 0.2 * statistics.mean(steps), delta=0.51)
        self.assertAlmostEqual(deviation, 0.2 * statistics.stdev(steps), delta=0.51)

    def test_simulate_makes_the_episode_of_eval(self):
        for task, (states, _, _) in TASKS.items():
            table = self.root / f"{task}-episodes.csv"
            run("eval", self.root / task, "--episodes", 3, "--episodes-csv", table)
            with open(table, encoding="utf-8", newline="") as file:
                episode = list(csv.DictReader(file))[2]
            out = self.root / f"{task}-rollout.csv"
            result = run("simulate", self.root / task, "--episode", 2, "--csv", out)
            self.assertEqual(result.returncode, 0, result.stderr)
            rows = read_csv(out)
            for name in list(episode)[1:1 + states]:
                self.assertEqual(rows[0][name], float(episode[name]))
            # The row after the last step has no step of its own, unless the goal ended the episode.
            rewards = [row["reward"] for row in rows]
            self.assertIn(True, [abs(sum(rewards[:n]) - float(episode["return"])) < 1e-9
                                 for n in (len(rewards) - 1, len(rewards))])

    def test_plot_info_and_compare_work(self):
        for task in TASKS:
            result = run("plot", self.root / task, "--out", self.root / f"{task}-plot")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertTrue((self.root / f"{task}-plot" / "episode.svg").is_file())
            self.assertFalse((self.root / f"{task}-plot" / "phase.svg").exists())
            info = run("info", self.root / task)
            self.assertIn(task, info.stdout)
            self.assertNotIn("plant", info.stdout)
        both = run("compare", *(self.root / task for task in TASKS))
        self.assertEqual(both.returncode, 0, both.stderr)
        self.assertIn("2 different tasks", both.stdout + both.stderr)

    def test_what_does_not_apply_is_refused(self):
        policy = self.root / "acrobot-v1"
        for arguments, words in (
                (["map", policy], "acrobot-v1"),
                (["export", policy, "--page", self.root / "page"], "acrobot-v1"),
                (["eval", policy, "--set", "mass1=2"], "--set: expected none"),
                (["eval", policy, "--randomize", "0.2"], "--randomize: expected none"),
                (["eval", policy, "--unknown-plant"], "--unknown-plant: expected none"),
                (["simulate", policy, "--start", "1,2"], "4 numbers theta1"),
                (["train", "--task", "acrobot-v1", "--mass1", "2"], "mass1: expected none"),
                (["train", "--task", "acrobot-v1", "--agent", "fast"], "agent fast"),
                (["train", "--task", "acrobot"], "expected one of")):
            with self.subTest(words):
                result = run(*arguments)
                self.assertEqual(result.returncode, 2)
                self.assertEqual(result.stderr.count("\n"), 1)
                self.assertIn(words, result.stderr)

    def test_a_resumed_run_keeps_its_task(self):
        policy = self.root / "pendulum-v1"
        result = run("train", "--resume", policy, "--steps", 3000)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("task pendulum-v1", result.stdout)


if __name__ == "__main__":
    unittest.main()
