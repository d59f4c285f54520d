#!/usr/bin/env python3
"""Tests of `upswing realaigym`: scores of policies and logs by the rules of RealAIGym."""

import csv
import io
import json
import math
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "src/cli"))
from testing import ROOT, ProgramTest  # noqa: E402

POLICY = ROOT / "web/public/agents/fast.safetensors"
# Swings up the board's plant.
TVLQR = ("tvlqr", "--made-for", "realaigym")


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


def rows_of(text):
    return [{k: float(x) for k, x in row.items()} for row in csv.DictReader(io.StringIO(text))]


def above(row):
    q1, q2 = row["pos_meas1"], row["pos_meas2"]
    return -0.2 * math.cos(q1) - 0.3 * math.cos(q1 + q2) > 0.45


class RealAIGym(ProgramTest):
    def score(self, *arguments):
        return json.loads(self.succeed("realaigym", "score", *arguments, "--json"))

    def test_version_2(self):
        rows = rows_of(self.succeed("realaigym", "score", *TVLQR, "--score-version", 2, "--csv", "-"))
        self.assertEqual(len(rows), 5000)
        self.assertEqual([rows[0][k] for k in ("time", "pos_meas1", "vel_meas2")], [0, 0, 0])
        self.assertAlmostEqual(rows[-1]["time"], 9.998, places=9)
        self.assertEqual({row["tau_con2"] for row in rows}, {0})
        found = self.score(*TVLQR, "--score-version", 2)
        self.assertGreater(found["performance"]["score"], 0.2)
        self.assertAlmostEqual(found["performance"]["score"], score(rows), delta=1e-9)
        self.assertEqual(len(found["curves"]), 15)
        shares = [found["robustness"][name] for name in
                  ("model", "velocity noise", "torque noise", "response", "delay", "pushes")]
        self.assertAlmostEqual(found["robustness"]["score"], sum(shares) / 6, delta=1e-12)
        # Any number of threads gives the same scores.
        self.assertEqual(self.score(*TVLQR, "--score-version", 2, "--threads", 3), found)
        text = self.succeed("realaigym", "score", *TVLQR, "--score-version", 2)
        for word in (f"S {found['performance']['score']:.3f}", "723 simulations",
                     *(f"{100 * share:.1f}%" for share in shares)):
            self.assertIn(word, text)

    def test_version_3(self):
        few = ("--runs", 2, "--seed", 5)
        text = self.succeed("realaigym", "score", *TVLQR, *few, "--csv", "-")
        rows = rows_of(text)
        self.assertEqual(len(rows), 30000)
        # Both motors act in fifteen resets of 0.2 s.
        resets = [row["tau_con2"] != 0 for row in rows]
        begins = [k for k in range(1, 30000) if resets[k] and not resets[k - 1]]
        self.assertEqual(len(begins), 15)
        self.assertAlmostEqual(sum(resets), 1500, delta=15)
        for k, begin in enumerate(begins):
            self.assertAlmostEqual(0.002 * begin, 3.75 * (k + 1), delta=1.01)
        uptime = sum(above(row) for row in rows[1:]) * 0.002
        found = self.score(*TVLQR, *few)
        self.assertEqual(len(found["runs"]), 2)
        self.assertAlmostEqual(found["runs"][0]["score"], uptime / 60, delta=1e-9)
        self.assertAlmostEqual(found["mean_score"], sum(run["score"] for run in found["runs"]) / 2,
                               delta=1e-12)
        self.assertEqual(self.score(*TVLQR, *few, "--threads", 3), found)
        # The log of the run has the same score.
        self.write("run.csv", text)
        log = json.loads(self.succeed("realaigym", "hardware", "run.csv", "--score-version", 3, "--json"))
        self.assertAlmostEqual(log["runs"][0]["score"], uptime / 60, delta=1e-9)
        self.assertEqual(log["runs"][0]["swing_ups"], found["runs"][0]["swing_ups"])
        self.assertIn(f" {found['mean_score']:.3f} ", self.succeed("realaigym", "score", *TVLQR, *few))

    def test_controllers_are_designed_for_the_twin(self):
        def trials(*arguments):
            return self.score("mpc", "--mpc-seconds", 0.3, "--lqr-q1", 100, "--lqr-q2", 100,
                              "--lqr-torque", 0.3, "--twin", "realaigym-twin", "--score-version", 2,
                              *arguments)

        self.assertGreaterEqual(trials("--runs", 20)["successes"], 18)
        # --made-for changes the twin's plant: with its own values nothing changes.
        few = ("--runs", 2)
        own = trials(*few)["mean_score"]
        self.assertEqual(own, trials(*few, "--made-for", "coulomb1=0")["mean_score"])
        self.assertNotEqual(own, trials(*few, "--made-for", "mass2=0.7")["mean_score"])
        self.assertNotEqual(own, trials(*few, "--robot", "acrobot")["mean_score"])
        text = self.succeed("realaigym", "score", "lqr", "--twin", "realaigym-twin", "--runs", 2)
        self.assertIn("machines of realaigym-twin", text)

    def test_runs_on_hardware(self):
        # A simulated motion in the format of a log, once without and once with pushes.
        text = self.succeed("realaigym", "score", *TVLQR, "--score-version", 2, "--csv", "-")
        self.write("run.csv", text)
        rows = [{k: float(x) for k, x in row.items()} for row in csv.DictReader(io.StringIO(text))]
        lines = text.splitlines()
        self.write("pushed.csv", "\n".join([lines[0] + ",tau_pert1,tau_pert2"] +
                                           [line + ",0,0" for line in lines[1:]]))
        self.write("short.csv", "\n".join(lines[:4000]))
        self.write("slow.csv", "\n".join(",".join(line.split(",")[:3]) for line in lines[:100]))

        def scores(*arguments):
            return json.loads(self.succeed("realaigym", "hardware", *arguments, "--json"))

        found = scores("run.csv", "short.csv")
        self.assertEqual((found["robot"], found["pushed"], found["successes"]),
                         ("pendubot", False, 1))
        expected = score(rows, 100, 4)
        self.assertGreater(expected, 0.2)
        self.assertAlmostEqual(found["runs"][0]["score"], expected, delta=1e-9)
        self.assertEqual(found["runs"][1]["score"], 0)
        self.assertAlmostEqual(found["mean_score"], expected / 2, delta=1e-9)
        # The acrobot's board with pushes has other normalisers.
        self.assertAlmostEqual(scores("pushed.csv")["mean_score"], expected, delta=1e-9)
        found = scores("pushed.csv", "--robot", "acrobot")
        self.assertEqual((found["robot"], found["pushed"]), ("acrobot", True))
        self.assertAlmostEqual(found["mean_score"], score(rows, 20, 1), delta=1e-9)
        table = self.succeed("realaigym", "hardware", "run.csv", "short.csv")
        self.assertRegex(table, fr"(?m)^  run.csv +yes .* {expected:.3f}$")
        self.assertRegex(table, r"(?m)^  mean +1/2 ")
        self.assertIn("  short.csv: the run ends after 8.00 s\n", table)

        refuse = self.refuse
        refuse(["realaigym", "hardware", "run.csv", "pushed.csv"], "pushed.csv", "with pushes")
        refuse(["realaigym", "hardware", "slow.csv"], "slow.csv", "velocities")
        refuse(["realaigym", "hardware", "none.csv"], "none.csv")
        refuse(["realaigym", "hardware", "run.csv", "--robot", "cartpole"], "--robot",
               "pendubot or acrobot")

    def test_policies_of_the_double_pendulum(self):
        # These policies have another plant; only check that they act.
        found = self.score(POLICY, "--score-version", 2)
        self.assertEqual(found["robot"], "pendubot")
        self.assertGreater(found["performance"]["max_torque"], 1)
        motion = self.succeed("realaigym", "score", POLICY, "--score-version", 2, "--csv", "-")
        torques = [float(row["tau_con1"]) for row in csv.DictReader(io.StringIO(motion))]
        for k in range(0, 5000, 10):  # each torque is held for 20 ms
            self.assertEqual(len(set(torques[k:k + 10])), 1)
        self.refuse(["realaigym", "score", POLICY, "--robot", "acrobot"], "--robot", "joint 1")

    def test_bad_input(self):
        refuse = self.refuse
        refuse(["realaigym", "score"], "expected a policy, got none")
        refuse(["realaigym", "score", "nothing.safetensors"], "nothing.safetensors: no such file")
        refuse(["realaigym", "score", "lqr", "--robot", "cartpole"], "--robot", "pendubot or acrobot")
        refuse(["realaigym", "score", "lqr", "--csv", "-", "--json"], "--json")
        self.write("log.csv", "time,pos_meas1\n")
        refuse(["realaigym", "score", "lqr", "--csv", "log.csv"], "log.csv: expected a new file or an older table")
        refuse(["realaigym", "score", "lqr", "--no-pushes"], "--no-pushes", "--twin")
        for version in (2, 3):
            refuse(["realaigym", "score", "lqr", "--twin", "cloudpendulum", "--score-version", version],
                   "--twin: expected a machine of about the size of RealAIGym's robots",
                   f"--score-version {version} is", "times × 0.415 and torques × 0.0307")
        refuse(["realaigym", "score", "lqr", "--twin", "realaigym-twin", "--csv", "x.csv"], "--twin",
               "no --csv")


if __name__ == "__main__":
    unittest.main()
