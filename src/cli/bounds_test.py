#!/usr/bin/env python3
"""Tests of `bounds`: the best episodes of a search, and how close policies come to them."""

import csv
import json
import unittest

from testing import ROOT, ProgramTest

POLICY = ROOT / "web/public/agents/fast.safetensors"


class Bounds(ProgramTest):
    def test_nothing_is_better_than_the_best(self):
        found = json.loads(self.succeed("bounds", POLICY, "tvlqr", "--episodes", 2, "--guesses", 6,
                                        "--csv", "bounds.csv", "--json"))
        rows = {row["name"]: row for row in found["rows"]}
        self.assertEqual(list(rows), ["any torque", "9 torques", str(POLICY), "tvlqr"])
        best = rows["any torque"]
        self.assertEqual((best["share"], best["success_rate"]), (1, 1))
        for row in rows.values():
            self.assertLessEqual(row["return"]["mean"], best["return"]["mean"])
            self.assertGreaterEqual(row["swing_up_seconds"], best["swing_up_seconds"])
        # Policies are evaluated on the episodes of `eval`, with the same results.
        judged = json.loads(self.succeed("eval", "tvlqr", "--episodes", 2, "--json"))
        self.assertEqual(rows["tvlqr"]["return"], judged["return"])
        self.succeed("eval", "tvlqr", "--episodes", 2, "--episodes-csv", "eval.csv")

        def read(name):
            with open(self.folder / name, encoding="utf-8", newline="") as file:
                return list(csv.DictReader(file))

        self.assertEqual([row["q1"] for row in read("bounds.csv")], [row["q1"] for row in read("eval.csv")])
        for row in read("bounds.csv"):
            self.assertGreaterEqual(float(row["return"]), float(row["return_table"]))
            self.assertLessEqual(float(row["swing_up_seconds"]), float(row["swing_up_seconds_table"]))

    def test_threads_change_nothing(self):
        one, two = (self.succeed("bounds", "--episodes", 2, "--guesses", 2, "--torques", 3, "--physics",
                                 "closed-form", "--threads", threads) for threads in (1, 2))
        self.assertEqual(one, two)
        self.assertIn("A better result may exist.", one)

    def test_bad_input(self):
        self.refuse(["bounds", "--set", "damping2=0.3897696914"], "lqr: found no gain", "delta")
        self.refuse(["bounds", "--set", "torque_limit=0.1", "--guesses", 2],
                    "found no swing-up of this plant with 0.1 N·m from 2 guesses")
        self.refuse(["bounds", "none"], "none: no such file")
        self.refuse(["bounds", POLICY, "--set", "mass2=1.2", "--mpc-seconds", 3],
                    "--mpc-seconds: expected a controller (", "with it, got")
        self.refuse(["bounds", "hybrid"], "--swing-up")
        self.refuse(["bounds", "--episodes", "0"], "--episodes")
        self.refuse(["bounds", "--torques", "2"], "--torques")
        self.refuse(["bounds", "--csv", "missing/bounds.csv"], "missing/bounds.csv")


if __name__ == "__main__":
    unittest.main()
