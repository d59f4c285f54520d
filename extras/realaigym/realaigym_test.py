#!/usr/bin/env python3
"""Tests of `upswing realaigym`: scores by the rules of RealAIGym, and the search for a policy."""

import csv
import io
import json
import math
import signal
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "src/cli"))
from testing import ROOT, UPSWING, ProgramTest, read_tensors, write_tensors  # noqa: E402

SMALL = ["--starts", 2, "--alone", 8, "--generations", 2, "--first-population", 64, "--population", 4,
         "--hidden", 8]
SWING_UP = ROOT / "docs/figures/realaigym-pendubot.safetensors"
POLICY = ROOT / "web/public/agents/fast.safetensors"


def score(rows, cost_scale=20, smooth_scale=0.1):
    """The performance score, version 2, of a motion in the boards' format. The normalisers default
    to those of the simulation boards."""
    l1, l2 = 0.2, 0.3
    t = [row["time"] for row in rows]
    q = [(row["pos_meas1"], row["pos_meas2"]) for row in rows]
    v = [(row["vel_meas1"], row["vel_meas2"]) for row in rows]
    u = [(row["tau_con1"], row["tau_con2"]) for row in rows]
    n = len(rows)
    low = [k for k in range(n - 1) if -l1 * math.cos(q[k][0]) - l2 * math.cos(sum(q[k])) <= 0.45]
    swing_up = t[low[-1] + 1] if low else t[0]
    steps = range(n - 1)
    energy = sum(abs((q[k + 1][j] - q[k][j]) * u[k][j]) for k in steps for j in (0, 1))
    cost = sum((u[k][0] ** 2 + u[k][1] ** 2) * (t[k + 1] - t[k]) for k in steps)
    velocity = sum((v[k][0] ** 2 + v[k][1] ** 2) * (t[k + 1] - t[k]) for k in steps)
    smooth = 0
    for j in (0, 1):
        changes = [u[k + 1][j] - u[k][j] for k in steps]
        mean = sum(changes) / len(changes)
        smooth += math.sqrt(sum((x - mean) ** 2 for x in changes) / len(changes))
    penalties = [math.tanh(math.pi * x / scale) for x, scale in
                 ((swing_up, 20), (energy, 60), (cost, cost_scale), (smooth, smooth_scale),
                  (velocity, 400))]
    return 1 - sum(penalties) / 5 if swing_up < t[-1] else 0


class RealAIGym(ProgramTest):
    def search(self, *arguments):
        return json.loads(self.succeed("realaigym", "--search", "p.safetensors", *SMALL, "--json",
                                       *arguments))

    def test_a_search_and_its_scores(self):
        found = self.search("--csv", "motion.csv")
        with open(self.folder / "motion.csv", encoding="utf-8") as file:
            rows = [{k: float(x) for k, x in row.items()} for row in csv.DictReader(file)]
        self.assertEqual(len(rows), 5000)
        self.assertEqual([rows[0][k] for k in ("time", "pos_meas1", "vel_meas2")], [0, 0, 0])
        self.assertAlmostEqual(rows[-1]["time"], 9.998, places=9)
        self.assertAlmostEqual(found["performance"]["score"], score(rows), delta=1e-9)
        self.assertEqual(len(found["curves"]), 14)
        rows = [found["robustness"][name] for name in
                ("model", "velocity noise", "torque noise", "response", "delay", "pushes")]
        self.assertAlmostEqual(found["robustness"]["score"], sum(rows) / 6, delta=1e-12)
        # Scoring the file again, with any number of threads, gives the same scores.
        again = json.loads(self.succeed("realaigym", "p.safetensors", "--json", "--threads", 3))
        for each in (found, again):
            del each["seconds"]
        self.assertEqual(found, again)
        text = self.succeed("realaigym", "p.safetensors")
        for word in ("AR-EAPO", "0.913", "History SAC", "723 simulations"):
            self.assertIn(word, text)

    def test_the_policy_of_the_documentation(self):
        found = json.loads(self.succeed("realaigym", ROOT / "docs/figures/realaigym-pendubot.safetensors",
                                        "--json"))
        self.assertAlmostEqual(found["performance"]["score"], 0.7001, delta=0.001)
        # Cells at an edge depend on rounding.
        self.assertAlmostEqual(found["robustness"]["score"], 0.943, delta=0.02)

        found = json.loads(self.succeed("realaigym", ROOT / "docs/figures/realaigym-acrobot.safetensors",
                                        "--json"))
        self.assertEqual(found["robot"], "acrobot")
        self.assertAlmostEqual(found["performance"]["score"], 0.663, delta=0.002)
        self.assertAlmostEqual(found["robustness"]["score"], 0.913, delta=0.02)

    def test_another_seed_is_another_policy(self):
        one, two = self.search("--seed", 1), self.search("--seed", 2)
        self.assertNotEqual(one["performance"], two["performance"])
        self.assertEqual(self.search("--seed", 1)["performance"], one["performance"])

    def test_a_search_goes_on_from_a_policy(self):
        found = self.search()
        again = json.loads(self.succeed(
            "realaigym", "--search", "q.safetensors", "--from", "p.safetensors", "--generations", 0,
            "--json"))
        self.assertEqual(again["performance"], found["performance"])
        self.refuse(["realaigym", "p.safetensors", "--from", "p.safetensors"], "--from", "--search")
        for flag in ("--hidden", "--starts"):
            self.refuse(["realaigym", "--search", "x", "--from", "p.safetensors", flag, 8], flag)
        self.refuse(["realaigym", "--search", "x", "--from", POLICY], "fast.safetensors", "--search")

    def test_an_interrupted_search_keeps_its_policy(self):
        with subprocess.Popen([UPSWING, "realaigym", "--search", "kept.safetensors", *map(str, SMALL),
                               "--generations", "100000"], cwd=self.folder, stdout=subprocess.PIPE,
                              text=True) as search:
            search.stdout.readline()  # the search has begun
            search.send_signal(signal.SIGINT)
            rest = search.stdout.read()
        self.assertEqual(search.returncode, 130)
        self.assertRegex(rest, r"stopped at generation \d+ of 100016: kept.safetensors")
        self.assertNotIn("AR-EAPO", rest)
        self.succeed("realaigym", "kept.safetensors")
        self.refuse(["realaigym", "--search", "x", "--figure", "rows.txt"], "rows.txt")
        self.refuse(["realaigym", "--search", "x", "--figure", "no/rows.svg"], "--figure", "no")

    def test_the_acrobot(self):
        found = self.search("--robot", "acrobot", "--csv", "motion.csv")
        self.assertEqual(found["robot"], "acrobot")
        with open(self.folder / "motion.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual({row["tau_con1"] for row in rows}, {"0"})
        self.refuse(["realaigym", "p.safetensors", "--robot", "pendubot"], "--robot", "acrobot")

    def test_controllers_are_designed_for_the_twin(self):
        def trials(*arguments):
            return json.loads(self.succeed(
                "realaigym", "mpc", "--mpc-seconds", 0.3, "--lqr-q1", 100, "--lqr-q2", 100,
                "--lqr-torque", 0.3, "--twin", "realaigym-twin", "--json", *arguments))

        self.assertGreaterEqual(trials("--draws", 20)["successes"], 18)
        # --made-for changes the twin's plant: with its own values nothing changes.
        few = ("--draws", 2)
        own = trials(*few)["mean_score"]
        self.assertEqual(own, trials(*few, "--made-for", "coulomb1=0")["mean_score"])
        self.assertNotEqual(own, trials(*few, "--made-for", "mass2=0.7")["mean_score"])
        self.assertNotEqual(own, trials(*few, "--robot", "acrobot")["mean_score"])

    def test_runs_on_hardware(self):
        # A simulated motion in the format of a log, once without and once with pushes.
        text = self.succeed("realaigym", SWING_UP, "--csv", "-")
        self.write("run.csv", text)
        rows = [{k: float(x) for k, x in row.items()} for row in csv.DictReader(io.StringIO(text))]
        lines = text.splitlines()
        self.write("pushed.csv", "\n".join([lines[0] + ",tau_pert1,tau_pert2"] +
                                           [line + ",0,0" for line in lines[1:]]))
        self.write("short.csv", "\n".join(lines[:4000]))
        self.write("slow.csv", "\n".join(",".join(line.split(",")[:3]) for line in lines))

        def scores(*arguments):
            return json.loads(self.succeed("realaigym", "--hardware", *arguments, "--json"))

        found = scores("run.csv", "short.csv")
        self.assertEqual((found["robot"], found["pushed"], found["successes"]),
                         ("pendubot", False, 1))
        expected = score(rows, 100, 4)
        self.assertGreater(expected, 0.5)
        self.assertAlmostEqual(found["runs"][0]["score"], expected, delta=1e-9)
        self.assertEqual(found["runs"][1]["score"], 0)
        self.assertAlmostEqual(found["mean_score"], expected / 2, delta=1e-9)
        # The acrobot's board with pushes has other normalisers.
        self.assertAlmostEqual(scores("pushed.csv")["mean_score"], expected, delta=1e-9)
        found = scores("pushed.csv", "--robot", "acrobot")
        self.assertEqual((found["robot"], found["pushed"]), ("acrobot", True))
        self.assertAlmostEqual(found["mean_score"], score(rows, 20, 1), delta=1e-9)
        table = self.succeed("realaigym", "--hardware", "run.csv", "short.csv")
        self.assertRegex(table, fr"(?m)^  run.csv +yes .* {expected:.3f}$")
        self.assertRegex(table, r"(?m)^  mean +1/2 ")
        self.assertRegex(table, r"(?m)^  MC-PILCO +10/10 .* 0\.591$")
        self.assertIn("  short.csv: the run ends after 8.00 s\n", table)

        refuse = self.refuse
        refuse(["realaigym", "--hardware", "run.csv", "pushed.csv"], "pushed.csv", "with pushes")
        refuse(["realaigym", "--hardware", "run.csv", "--law", "run.csv"], "--law", "--twin")
        refuse(["realaigym", SWING_UP, "--no-pushes"], "--no-pushes", "--twin")
        refuse(["realaigym", SWING_UP, "--twin", "realaigym-twin", "--csv", "x.csv"], "--twin",
               "no --csv")
        refuse(["realaigym", "--hardware", "slow.csv"], "slow.csv", "velocities")
        refuse(["realaigym", "--hardware", "none.csv"], "none.csv")
        refuse(["realaigym", "--hardware", "run.csv", "--csv", "x.csv"], "--hardware")
        refuse(["realaigym", "--hardware", "run.csv", "--robot", "cartpole"], "--robot")
        refuse(["realaigym", "p.safetensors", "--hardware", "run.csv"], "--hardware")

    def test_figure(self):
        self.search("--figure", "rows.svg")
        self.assertIn("delay", (self.folder / "rows.svg").read_text(encoding="utf-8"))

    def test_policies_of_the_double_pendulum(self):
        # These policies have another plant; only check that they act.
        found = json.loads(self.succeed("realaigym", POLICY, "--json"))
        self.assertEqual(found["robot"], "pendubot")
        self.assertGreater(found["performance"]["max_torque"], 1)
        motion = self.succeed("realaigym", POLICY, "--csv", "-")
        torques = [float(row["tau_con1"]) for row in csv.DictReader(io.StringIO(motion))]
        for k in range(0, 5000, 10):  # each torque is held for 20 ms
            self.assertEqual(len(set(torques[k:k + 10])), 1)
        self.refuse(["realaigym", POLICY, "--robot", "acrobot"], "--robot", "joint 1")

    def test_the_baselines_regulator_does_not_swing_up(self):
        found = json.loads(self.succeed("realaigym", "baseline-lqr", "--json"))
        self.assertEqual((found["performance"]["score"], found["robustness"]["score"]), (0, 0))
        self.assertIn("no swing-up", self.succeed("realaigym", "baseline-lqr", "--robot", "acrobot"))

    def test_bad_input(self):
        self.search()
        refuse = self.refuse
        refuse(["realaigym"], "expected a policy to score, --search FILE or --hardware LOG, got none")
        refuse(["realaigym", "p.safetensors", "--search", "q.safetensors"], "--search")
        refuse(["realaigym", "p.safetensors", "--hidden", 8], "--hidden", "--search")
        refuse(["realaigym", "nothing.safetensors"], "nothing.safetensors: no such file")
        refuse(["realaigym", "--search", "no/where"], "--search", "no")
        refuse(["realaigym", "--search", "-"], "--search", "file")
        refuse(["realaigym", "baseline-lqr", "--robot", "cartpole"], "--robot", "pendubot or acrobot")
        refuse(["realaigym", "--search", "x", "--hidden", 7], "--hidden")
        refuse(["realaigym", "--search", "x", "--population", 5], "--population")
        refuse(["realaigym", "baseline-lqr", "--csv", "-", "--json"], "--json")
        refuse(["realaigym", "baseline-lqr", "--figure", "rows.txt"], "rows.txt")
        metadata, tensors = read_tensors(self.folder / "p.safetensors")
        write_tensors(self.folder / "wrong.safetensors", metadata | {"hidden": "16"}, tensors)
        refuse(["realaigym", "wrong.safetensors"], "wrong.safetensors", "numbers")
        for command in ("eval", "info", "simulate"):
            refuse([command, "p.safetensors"], "upswing realaigym")


if __name__ == "__main__":
    unittest.main()
