#!/usr/bin/env python3
"""Tests of `upswing map`: its table, its files, that a cell matches `eval`, and bad input."""

import csv
import json
import math
import re
import shutil
import struct
import unittest
import xml.dom.minidom

from testing import ProgramTest, train_once

GRID = ("--x", "gravity=0.05:3:3", "--y", "mass2=-50%:+50%:3")


class MapTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        # An easy plant, so that there are successes and failures to test.
        cls.policy = train_once(cls, gravity=0.05, damping=1, hidden="64,64", head=32,
                                eval_episodes=1, steps=60000, checkpoint_every=20000)

    def map(self, *more, out="map"):
        return json.loads(self.succeed("map", self.policy, "--json", "--out", out, *more))

    def rows(self, out="map"):
        with open(self.folder / out / "map.csv", encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def test_files_and_fields_agree(self):
        result = self.map(*GRID, "--episodes", 4)
        self.assertEqual(result["x"], {"name": "gravity", "unit": "m/s²",
                                       "values": [0.05, 1.525, 3]})
        self.assertEqual(result["y"], {"name": "mass2", "unit": "kg", "values": [0.5, 1, 1.5]})
        rows = self.rows()
        self.assertEqual([(float(row["gravity"]), float(row["mass2"])) for row in rows],
                         [(x, y) for y in result["y"]["values"] for x in result["x"]["values"]])
        rates = [float(row["success_rate"]) for row in rows]
        self.assertEqual(sum(result["success_rate"], []), rates)
        self.assertEqual(rates, [int(row["successes"]) / 4 for row in rows])
        self.assertGreater(max(rates), 0)
        self.assertLess(min(rates), 1)
        self.assertAlmostEqual(result["mean_success_rate"], sum(rates) / 9)
        self.assertAlmostEqual(result["cells_without_failure"], rates.count(1) / 9)
        for row, seconds in zip(rows, sum(result["swing_up_seconds"], [])):
            self.assertEqual(row["swing_up_seconds"] == "", int(row["successes"]) == 0)
            self.assertEqual(row["swing_up_seconds"], "" if seconds is None else
                             row["swing_up_seconds"])
            self.assertTrue(seconds is None or 0 < seconds <= 10)
        png = (self.folder / "map/map.png").read_bytes()
        self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">II", png[16:24]), (1100, 530))
        text = (self.folder / "map/map.svg").read_text(encoding="utf-8")
        xml.dom.minidom.parseString(text)
        for word in ("gravity (m/s²)", "mass2 (kg)", "Success", "Swing-up time, median",
                     "as in training", "successful episodes (%)", "swing-up time (s)",
                     "4 episodes per cell (4 of 4: 95% interval 51.0% to 100%); closed-form; seed 0"):
            self.assertIn(word, text)
        self.assertEqual(result["files"], ["map/map.csv", "map/map.svg", "map/map.png"])

    def test_a_cell_equals_an_evaluation_of_its_plant(self):
        result = self.map("--x", "gravity=0.05:0.1:2", "--y", "torque_limit=4:5:2", "--episodes",
                          100)
        for row, torque in enumerate((4, 5)):
            for column, gravity in enumerate((0.05, 0.1)):
                judged = json.loads(self.succeed(
                    "eval", self.policy, "--json", "--set", f"gravity={gravity}", "--set",
                    f"torque_limit={torque}", "--physics", "closed-form"))
                rate = result["success_rate"][row][column]
                # Different starts: allow five standard deviations of two samples of 100.
                p = (rate + judged["success_rate"]) / 2
                self.assertAlmostEqual(rate, judged["success_rate"],
                                       delta=5 * math.sqrt(p * (1 - p) / 50) + 1e-9)

    def test_flags_change_the_plant_as_set_does(self):
        def cells(out, *changes):
            self.succeed("map", "lqr", "--x", "mass2=-10%:+10%:2", "--y", "q1=178deg:179deg:2", "--episodes", 1,
                         "--out", out, *changes)
            return (self.folder / out / "map.csv").read_text(encoding="utf-8")
        by_flags = cells("a", "--mass1", 1.2, "--torque-limit", 0.05)
        self.assertEqual(by_flags, cells("b", "--set", "mass1=1.2", "--set", "torque_limit=0.05"))
        self.assertNotEqual(by_flags, cells("c"))
        self.refuse(["map", "lqr", "--mas1", 1], "--mas1", "did you mean --mass1?")
        self.refuse(["map", "lqr", "--mass2", 1.2], "--mass2: expected a quantity that is on no axis")

    def test_threads_engine_and_neighbours_change_nothing(self):
        grid = ("--x", "gravity=0.05:3:3", "--y", "sensor_noise=0:0.05:2", "--episodes", 12)
        one = self.map(*grid, "--threads", 1, out="one")
        many = self.map(*grid, "--threads", 3, out="many")
        mujoco = self.map(*grid, "--physics", "mujoco", out="mujoco")
        for key in ("success_rate", "swing_up_seconds"):
            self.assertEqual(one[key], many[key])
        # In a chaotic motion, rounding can make the engines differ, but it rarely does.
        for a, b in zip(sum(one["success_rate"], []), sum(mujoco["success_rate"], [])):
            self.assertAlmostEqual(a, b, delta=0.1)
        self.assertNotEqual(self.map(*grid, "--seed", 1, out="seed")["swing_up_seconds"],
                            one["swing_up_seconds"])

    def test_from_given_starts(self):
        result = self.map("--x", "q1=-180deg:180deg:9", "--y", "q2=-20deg:20deg:3", "--set", "w1=0.1")
        self.assertEqual(result["episodes_per_cell"], 1)
        for rate, seconds in zip(sum(result["success_rate"], []),
                                 sum(result["swing_up_seconds"], [])):
            self.assertIn(rate, (0, 1))
            self.assertEqual(seconds is None, rate == 0)
        # The same state one turn away has the same observation.
        self.assertEqual([row[0] for row in result["success_rate"]],
                         [row[-1] for row in result["success_rate"]])
        # Compare with the episode of `simulate` from this start.
        table = self.succeed("simulate", self.policy, "--physics", "closed-form", "--start",
                             f"{-math.pi / 2},0,0.1,0").splitlines()
        inverted = [line.split(",")[8] == "1" for line in table[1:]]
        since = len(inverted)
        while since > 0 and inverted[since - 1]:
            since -= 1
        self.assertEqual(result["success_rate"][1][2], int(since <= 500))
        if since <= 500:
            self.assertAlmostEqual(result["swing_up_seconds"][1][2], 0.02 * max(since, 1))

    def test_delay_has_a_cell_for_each_control_period(self):
        result = self.map("--x", "delay=0.02:0.08", "--y", "gravity=0.05:0.1:2", "--episodes", 1)
        self.assertEqual(result["x"]["unit"], "s")
        for value, expected in zip(result["x"]["values"], (0.02, 0.04, 0.06, 0.08), strict=True):
            self.assertAlmostEqual(value, expected, delta=1e-12)

    def test_the_control_period_of_a_controller(self):
        def delays(*more):
            result = json.loads(self.succeed("map", "lqr", "--x", "delay=0.01:0.02", "--y", "q1=178deg:179deg:2",
                                          "--episodes", 1, "--out", "period", "--json", *more))
            return result["x"]["values"]

        self.refuse(["map", "lqr", "--x", "delay=0.01:0.02", "--y", "q1=178deg:179deg:2"], "a multiple of 0.02")
        self.assertEqual(delays("--control-period", 0.01), [0.01, 0.02])

    def test_sensors_may_be_axes(self):
        result = self.map("--x", "encoder_counts=0:4096:2", "--y", "sensor_latency=0:0.01:2",
                          "--set", "velocity_window=0.01", "--episodes", 1)
        self.assertEqual(result["y"]["unit"], "s")
        self.assertEqual(result["x"]["values"], [0, 4096])

    def test_table(self):
        text = self.succeed("map", self.policy, *GRID, "--episodes", 2)
        for word in ("gravity 0.05 to 3 m/s² × mass2 0.5 to 1.5 kg: 3 × 3 cells, 2 episodes each",
                     "% of all episodes",
                     "(2 of 2: 95% interval 34.2% to 100%)",
                     f"{self.policy}/map-gravity-mass2/map.csv"):
            self.assertIn(word, text)
        self.assertTrue((self.policy / "map-gravity-mass2/map.svg").is_file())
        # A second map gets a new folder next to the first.
        self.assertIn("map-gravity-mass2-2/map.csv",
                      self.succeed("map", self.policy, *GRID, "--episodes", 1))
        shutil.rmtree(self.policy / "map-gravity-mass2")
        shutil.rmtree(self.policy / "map-gravity-mass2-2")

    def figure(self, *more, out):
        result = self.map(*GRID, *more, out=out)
        return result, (self.folder / out / "map.svg").read_text(encoding="utf-8")

    def test_differences_from_the_training_are_on_the_figure(self):
        usual, text = self.figure("--episodes", 1, out="usual")
        self.assertEqual(usual["changes"], "")
        self.assertIn(">as in training<", text)
        changed, text = self.figure("--episodes", 1, "--set", "mass1=1.2", "--set",
                                    "sensor_noise=0.01", "--seed", 9, "--unknown-plant", out="other")
        self.assertEqual(changed["changes"], "mass1 1.2 kg (training: 1), sensor_noise 0.01 rad, "
                         "rad/s (training: 0), the plant unknown to the policy")
        self.assertTrue(changed["unknown_plant"])
        plain = re.sub(r"<[^>]*>\s*", " ", text)
        for words in ("mass1 1.2 kg (training: 1)", "sensor_noise 0.01", "seed 9", "closed-form",
                      "unknown", "gravity as in training, mass2 as in training"):
            self.assertIn(words, plain)
        self.assertNotIn(">as in training<", text)
        self.assertNotEqual(changed["swing_up_seconds"], usual["swing_up_seconds"])
        # With one exact start, nothing is random.
        _, text = self.figure("--set", "q1=20deg", out="start")
        self.assertIn("q1 20 °", text)
        self.assertNotIn("interval", text)

    def test_several_policies_side_by_side(self):
        grid = ("--x", "gravity=0.05:3:3", "--y", "mass2=0.9:1.1:2", "--episodes", 2)
        maps = json.loads(self.succeed("map", self.policy, "lqr", *grid, "--lqr-torque", 2, "--out",
                                       "both", "--json"))
        self.assertEqual([m["policy"] for m in maps][1], "lqr (lqr_torque 2)")
        alone = self.map(*grid, out="alone")
        self.assertEqual(maps[0]["success_rate"], alone["success_rate"])
        self.assertEqual(maps[1]["mean_success_rate"], 0)  # lqr does not swing up
        self.assertEqual(sorted(path.name for path in (self.folder / "both").iterdir()),
                         ["map-1.csv", "map-2.csv", "maps.png", "maps.svg"])
        self.assertEqual((self.folder / "both/map-1.csv").read_bytes(),
                         (self.folder / "alone/map.csv").read_bytes())
        svg = (self.folder / "both/maps.svg").read_text(encoding="utf-8")
        for words in ("/run<", ">lqr (lqr_torque 2)<", ">training or design<"):
            self.assertIn(words, svg)
        self.assertEqual(svg.count(">successful episodes (%)<"), 1)  # a single scale
        self.refuse(["map", self.policy, "lqr", *grid], "--out: expected a folder")
        self.refuse(["map", self.policy, "lqr", "--x", "gravity=-20%:+20%", "--out", "other"],
                    "lqr: expected a policy with the same plant as ", "/run,")

    def test_bad_axes(self):
        for axis, *words in (
                ("gravty=1:2", "gravty", "did you mean gravity?"),
                ("mass2", "--x", "NAME=FROM:TO", '"mass2"'),
                ("mass2=1", "NAME=FROM:TO"),
                ("mass2=1:2:3:4", "NAME=FROM:TO"),
                ("mass2=2:1", "mass2", "FROM < TO", "2 and 1"),
                ("mass2=1:1", "FROM < TO"),
                ("mass2=1:2:1", "2 to 1000 cells", '"1"'),
                ("mass2=1:2:x", "cells", '"x"'),
                ("mass2=1:2:2000", "cells"),
                ("mass2=-1:2", "mass2", "expected a number"),
                ("mass2=-150%:0%", "mass2", "expected a number"),
                ("mass2=a:2", "mass2", '"a"'),
                ("mass2=:2", "mass2", '""'),
                ("mass2=1:nan", "mass2", '"nan"'),
                ("delay=0:2", "delay", "in [0, 1]"),
                ("delay=-50%:50%", "delay", "percentage of a training value of 0"),
                ("delay=0:0.05", "delay", "a multiple of 0.02", "the nearest are 0.04 and 0.06"),
                ("delay=0:0.1:5", "--x delay", '"0.025"', "the nearest are 0.02 and 0.04"),
                ("q1=-400deg:0", "q1", "in [-360, 360] °")):
            with self.subTest(axis=axis):
                self.refuse(["map", self.policy, "--x", axis], *words)
        self.refuse(["map", self.policy, "--x", "mass=1:2", "--y", "mass2=1:2"], "two different",
                    "both set mass2")

    def test_angles_are_those_of_simulate(self):
        # The same text means the same start in both.
        for text, degrees in (("20deg", 20), ("20°", 20), ("0.5", math.degrees(0.5)), ("0.5rad", math.degrees(0.5))):
            with self.subTest(text=text):
                out = f"map-{text}"
                result = self.map("--x", f"q1={text}:4:3", "--y", "w2=-90deg/s:2:2", "--set", f"q2={text}", out=out)
                self.assertAlmostEqual(result["x"]["values"][0], degrees)
                self.assertAlmostEqual(result["x"]["values"][-1], math.degrees(4))
                self.assertAlmostEqual(result["y"]["values"][0], -math.pi / 2)
                self.assertEqual(result["y"]["values"][-1], 2)
                first = next(csv.DictReader(self.succeed("simulate", "--start", f"{text},0,0,0").splitlines()))
                self.assertAlmostEqual(float(first["q1"]), math.radians(degrees))
        meant = "expected an angle in rad within ±4π, or one with its unit, got"
        for words in (["--x", "q1=-180:180:9"], ["--y", "q2=0:13"], ["--set", "q1=178"]):
            with self.subTest(words=words):
                self.refuse(["map", self.policy, *words], f"{words[0]} {words[1][:2]}: {meant}", "did you mean")
        self.refuse(["simulate", "--start", "180,0,0,0"], f"--start: {meant} 180 (did you mean 180deg?")

    def test_other_bad_input(self):
        self.refuse(["map"], "policy")
        self.refuse(["map", "nowhere"], "nowhere", "no such file")
        self.refuse(["map", self.policy, "--set", "mass2=1"], "--set mass2: expected a quantity that is on no axis; the axis mass2 sets it")
        self.refuse(["map", self.policy, "--set", "gravit=1"], "did you mean gravity?")
        self.refuse(["map", self.policy, "--episodes", "0"], "--episodes")
        self.refuse(["map", self.policy, "--episodes", "20000"], "10,000,000 episodes")
        self.refuse(["map", self.policy, "--physics", "own"], "closed-form")
        self.write("taken", "")
        self.refuse(["map", self.policy, "--out", "taken"],
                    "taken: expected a new or empty folder, got a file")
        (self.folder / "full/mine").mkdir(parents=True)
        self.refuse(["map", self.policy, "--out", "full"],
                    "full: expected a new or empty folder, got one that is not empty")

    def test_without_gnuplot_there_is_only_a_table(self):
        done = self.run_here("map", self.policy, "--x", "mass2=0.9:1.1:2", "--y", "gravity=9:10:2",
                            "--json", "--out", "map", env={"PATH": str(self.folder)})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"^upswing: tables only, no figures: .*gnuplot-nox.*\n$")
        self.assertEqual(json.loads(done.stdout)["files"], ["map/map.csv"])


if __name__ == "__main__":
    unittest.main()
