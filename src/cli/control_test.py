#!/usr/bin/env python3
"""Tests of controllers computed from the equations of motion, used in place of a policy file."""

import csv
import io
import json
import math
import unittest

from testing import ROOT, ProgramTest

POLICY = ROOT / "web/public/agents/fast.safetensors"
# u = -K x of the standard plant and weights, x = [q1 - pi, q2, w1, w2]; made with SciPy
# (src/control/testdata/make_riccati.py).
GAIN = [-107.58763, -107.94453, -32.48366, -16.87634]
# Damping of joint 2 at which no gain exists.
LOST = "damping2=0.3897696914"
REGION = 62.95  # x'Px of the ellipsoid of attraction, by simulation
ALL = "energy, hybrid, lqr, mpc, pfl, tvlqr"


def deviation(row):
    return [row["q1"] - math.pi, row["q2"], row["w1"], row["w2"]]


class Lqr(ProgramTest):
    def simulate(self, *arguments):
        table = self.succeed("simulate", "lqr", *arguments)
        return [{name: float(text) for name, text in row.items()}
                for row in csv.DictReader(io.StringIO(table))]

    def test_acts_by_its_gain_and_holds_the_pendulum(self):
        for physics in ("mujoco", "closed-form"):
            rows = self.simulate("--start", "3.11,0.02,0.1,-0.05", "--seconds", 5, "--physics", physics)
            for row in rows[:-1]:
                u = -sum(k * x for k, x in zip(GAIN, deviation(row)))
                # Observations have single precision.
                self.assertAlmostEqual(row["torque"], min(max(u, -5), 5), delta=2e-3)
            self.assertLess(max(map(abs, deviation(rows[-1]))), 1e-4)
            self.assertTrue(all(row["inverted"] for row in rows))
            self.assertLess(max(abs(row["torque"]) for row in rows[:-1]), 5.0000001)

    def test_falls_without_it_and_from_too_far(self):
        self.assertEqual(self.simulate("--start", "2.9,0,0,0", "--seconds", 1)[-1]["inverted"], 0)
        fall = self.succeed("simulate", "--start", "3.11,0.02,0.1,-0.05", "--seconds", 5)
        self.assertEqual(list(csv.DictReader(io.StringIO(fall)))[-1]["inverted"], "0")

    def test_eval_describes_it(self):
        result = json.loads(self.succeed("eval", "lqr", "--lqr-torque", 0.1, "--made-for", "mass2=1.2",
                                         "--episodes", 4, "--physics", "closed-form", "--json"))
        self.assertEqual(result["policy"], "lqr (lqr_torque 0.1, for mass2 1.2)")
        self.assertEqual(result["plant"]["mass2"], 1.2)  # evaluated on its design plant
        self.assertEqual(result["successes"], 0)         # lqr does not swing up
        other = json.loads(self.succeed("eval", "lqr", "--set", "mass2=1.2", "--episodes", 4,
                                        "--physics", "closed-form", "--json"))
        self.assertEqual((other["policy"], other["plant"]["mass2"]), ("lqr", 1.2))
        note = "the controller balances and does not swing up"
        for name, balances in (("lqr", True), ("energy", False)):
            table = self.succeed("eval", name, "--episodes", 1, "--physics", "closed-form")
            self.assertEqual(note in table, balances, name)

    def test_info(self):
        text = self.succeed("info", "lqr")
        self.assertIn("weights 10, 10, 1, 1 and 1, gain -107.6, -107.9, -32.48, -16.88\n", text)
        self.assertIn("grow at 4.97/s and 3.6/s (ratio 0.723), delta -0.40\n", text)
        region = float(text.rsplit("x'Px < ", 1)[1])
        self.assertAlmostEqual(region, REGION, delta=0.01 * REGION)
        self.assertIn("delta -0.50\n", self.succeed("info", "lqr", "--made-for", "mass2=1.2"))

    def test_a_motor_at_joint_2(self):
        text = self.succeed("info", "lqr", "--made-for", "actuated_joint=2")
        self.assertIn("actuated_joint 2", text)
        self.assertIn("delta -0.04\n", text)
        for physics in ("mujoco", "closed-form"):
            rows = self.simulate("--made-for", "actuated_joint=2", "--start", "3.131,0.02,0,0",
                                 "--seconds", 8, "--physics", physics)
            self.assertLess(max(map(abs, deviation(rows[-1]))), 1e-3)
        # A controller for the other joint does not hold this one.
        done = self.run_here("simulate", "lqr", "--set", "actuated_joint=2", "--start", "3.131,0.02,0,0",
                             "--seconds", 3)
        self.assertEqual(done.stderr, "upswing: lqr: its design has the motor at joint 1, this plant has "
                         "it at joint 2\n")
        self.assertEqual(list(csv.DictReader(io.StringIO(done.stdout)))[-1]["inverted"], "0")
        self.refuse(["eval", "lqr", "--made-for", "actuated_joint=2", "--made-for",
                     "damping1=0.5659823434"], "lqr: found no gain", "damping of joint 1 cancels")
        for law in ("energy", "pfl"):
            self.refuse(["eval", law, "--made-for", "actuated_joint=2"], f"{law}: ", "motor at joint 1")
        for joint in ("0", "1.5", "3"):
            self.refuse(["eval", "lqr", "--set", f"actuated_joint={joint}"], "actuated_joint",
                        f'expected 1 or 2, got "{joint}"')

    def test_map_of_where_it_catches(self):
        result = json.loads(self.succeed("map", "lqr", "--x", "q1=150deg:210deg:61", "--y", "q2=-30deg:30deg:61",
                                         "--json", "--out", "map"))
        caught = result["success_rate"]
        at = lambda q1, q2: caught[q2 + 30][q1 - 150]  # a cell is a degree
        self.assertEqual([at(180 + q1, 0) for q1 in (-30, -15, -3, 0, 3, 15, 30)],
                         [0, 0, 1, 1, 1, 0, 0])
        self.assertEqual([at(180 - q2, q2) for q2 in (-20, 20)], [1, 1])  # link 2 upright
        self.assertEqual([at(180 + q2, q2) for q2 in (-20, 20)], [0, 0])
        mirrored = [row[::-1] for row in caught[::-1]]
        self.assertEqual(caught, mirrored)
        self.assertTrue((self.folder / "map/map.png").read_bytes().startswith(b"\x89PNG"))

    def test_map_over_plants_names_the_design_plant(self):
        result = json.loads(self.succeed(
            "map", "lqr", "--x", "mass2=-40%:+40%:3", "--y", "damping2=0.1:0.3:3", "--set", "q1=178deg",
            "--set", "mass1=1.1", "--json", "--out", "map"))
        self.assertEqual(result["changes"], "mass1 1.1 kg (design: 1), q1 178 °")
        self.assertEqual(result["success_rate"][1][1], 1)
        self.assertLess(min(map(min, result["success_rate"])), 1)
        figure = (self.folder / "map/map.svg").read_text(encoding="utf-8")
        self.assertIn("mass2 as in design, damping2 as in design", figure)
        self.assertNotIn("0.0202", figure)  # the colour bar if all times are 0.02 s

    def test_plot(self):
        text = self.succeed("plot", "lqr", "--start", "3.1,0,0,0", "--seconds", 2)
        self.assertIn("upright    from 0.00 s to the end", text)
        self.assertTrue((self.folder / "runs/plot-lqr/episode.svg").exists())
        self.succeed("plot", "lqr", "--start", "3.1,0,0,0", "--seconds", 2)
        self.assertTrue((self.folder / "runs/plot-lqr-2/episode.png").exists())

    def test_what_cannot_be_held(self):
        self.refuse(["eval", "lqr", "--made-for", LOST], "lqr: found no gain", "3.804/s",
                    "ratio 0.891", "delta")
        self.refuse(["map", "lqr", "--made-for", LOST], "lqr: found no gain")
        self.refuse(["eval", "lqr", "--made-for", "damping2=90000"], "are too long", "51200/s")
        self.refuse(["eval", "lqr", *"--lqr-q1 0 --lqr-q2 0 --lqr-w1 0 --lqr-w2 0".split()],
                    "expected a weight above 0")

    def test_bad_settings(self):
        self.refuse(["eval", "lqr", "--lqr-q1", "-1"], "--lqr-q1", "[0, 1000000000]", "-1")
        self.refuse(["eval", "lqr", "--lqr-torque", "0"], "--lqr-torque")
        self.refuse(["eval", "lqr", "--lqr-q3", "1"], "--lqr-q3", "did you mean --lqr-q")
        self.refuse(["eval", "lqr", "--made-for", "mas2=1"], "--made-for mas2", "did you mean mass")
        self.refuse(["eval", "lqr", "--made-for", "mass2"], "--made-for: expected NAME=VALUE")
        for command in ("eval", "simulate", "plot", "map", "info"):
            self.refuse([command, POLICY, "--lqr-q1", "3"], f"--lqr-q1: expected a controller ({ALL})",
                        POLICY)
            self.refuse([command, POLICY, "--made-for", "mass1=2"], "--made-for: expected a controller")
        for command in ("simulate", "info"):  # without a policy
            self.refuse([command, "--lqr-q1", "3"], f"expected a controller ({ALL}) with it, got none")

    def test_bad_names(self):
        for command in ("eval", "simulate", "plot", "map", "info"):
            self.refuse([command, "lqrr"], "lqrr: no such file", "did you mean lqr?")
        self.refuse(["export", "lqr", "--page", "page"], "lqr: expected a policy.safetensors", "got a controller")

    def test_a_file_of_that_name(self):
        self.write("lqr", "no policy")
        for command in ("eval", "simulate", "plot", "map", "info"):
            self.refuse([command, "lqr"], "expected a controller or a file", "./lqr")
        self.refuse(["eval", "./lqr"], "safetensors")


class SwingUp(ProgramTest):
    def eval(self, *arguments):
        return json.loads(self.succeed("eval", *arguments, "--json"))

    def test_plans_and_laws_swing_up_and_hold(self):
        for controller, episodes in (("tvlqr", 10), ("mpc", 2), ("pfl", 10)):
            for physics in ("mujoco", "closed-form"):
                result = self.eval(controller, "--episodes", episodes, "--physics", physics)
                self.assertGreaterEqual(result["successes"], 0.9 * episodes, controller)
        energy = self.eval("energy", "--episodes", 20)  # the law exceeds the motor's limit
        self.assertGreater(energy["successes"], 7)
        self.assertLess(energy["successes"], 20)

    def test_plans_know_their_plant(self):
        heavy = ("--made-for", "mass2=1.2", "--made-for", "length1=0.45")
        self.assertEqual(self.eval("tvlqr", *heavy, "--episodes", 10)["successes"], 10)
        self.assertEqual(self.eval("mpc", *heavy, "--episodes", 2)["successes"], 2)
        other = self.eval("tvlqr", "--set", "mass2=3", "--episodes", 10)  # not its design plant
        self.assertLess(other["successes"], 10)

    def test_hybrid_catches_a_networks_swing_up(self):
        alone = self.eval(POLICY, "--episodes", 20)
        caught = self.eval("hybrid", "--swing-up", POLICY, "--episodes", 20)
        self.assertEqual(caught["successes"], 20)
        self.assertLess(caught["steady_tilt_degrees"]["link1"]["mean"], 1e-3)
        self.assertLess(caught["steady_tilt_degrees"]["link1"]["mean"], alone["steady_tilt_degrees"]["link1"]["mean"])
        self.assertIn("and lqr upright, region of attraction x'Px < ",
                      self.succeed("info", "hybrid", "--swing-up", POLICY))
        self.refuse(["eval", "hybrid"], "hybrid: expected a policy that swings up (--swing-up")
        self.refuse(["eval", "hybrid", "--swing-up", "none"], "--swing-up: none: no such file")
        self.refuse(["eval", "mpc", "--swing-up", POLICY], "--swing-up: expected the controller hybrid with it, got mpc")
        self.refuse(["eval", "lqr", "--mpc-seconds", 3], "--mpc-seconds: expected the controller mpc with it, got lqr")
        self.refuse(["eval", POLICY, "--swing-up", POLICY], "--swing-up: expected a controller")

    def test_upright_all_of_them_hold(self):
        # Starts 1 degree off, and with noise. tvlqr once left the regulator to swing up again.
        for controller in ("energy", "lqr", "pfl", "tvlqr"):
            rows = list(csv.DictReader(io.StringIO(self.succeed(
                "simulate", controller, "--start", "3.13,0,0,0", "--seconds", 3, "--sensor-noise", 0.005))))
            self.assertEqual({row["inverted"] for row in rows}, {"1"}, controller)

    def test_strong_motors_and_slow_plants_have_a_region(self):
        for plant in ("torque_limit=200", "damping1=20", "gravity=0.1"):
            text = self.succeed("info", "lqr", "--made-for", plant)
            self.assertGreater(float(text.rsplit("x'Px < ", 1)[1]), 0, plant)
        strong = self.eval("tvlqr", "--made-for", "torque_limit=100", "--episodes", 5)
        self.assertEqual(strong["successes"], 5)

    def test_plans_of_any_length(self):
        for seconds in (3, 5, 10):
            self.assertEqual(self.eval("tvlqr", "--tvlqr-seconds", seconds, "--episodes", 3)["successes"], 3)

    def test_what_cannot_be_planned(self):
        self.refuse(["info", "lqr", "--lqr-q1", "1e9", "--lqr-torque", "1e-9"], "weights so far apart")
        self.succeed("simulate", "energy", "--energy-ke", 0, "--energy-kp", 0, "--seconds", 1)
        self.refuse(["eval", "energy", "--energy-kd", "0"], "--energy-kd")
        self.refuse(["eval", "tvlqr", "--tvlqr-seconds", "1"], "tvlqr: found no swing-up of 1 s with 4 N")
        self.refuse(["eval", "mpc", "--mpc-iterations", "0"], "--mpc-iterations")
        self.refuse(["eval", "mpc", "--mpc-guesses", "0"], "--mpc-guesses")
        self.refuse(["eval", "mpc", "--mpc-angle-range", "3"], "--mpc-angle-range")
        self.refuse(["eval", "mpc", "--mpc-velocity", "-1"], "--mpc-velocity")
        for controller in ("energy", "mpc", "pfl", "tvlqr"):
            self.refuse(["eval", controller, "--made-for", LOST], "lqr: found no gain", "delta")


class OtherSize(ProgramTest):
    """Settings that are given hold for plants of any size; others follow the plant."""

    PLANT = """[plant]
mass1 = 0.01
mass2 = 0.01
length1 = 0.05
length2 = 0.05
damping1 = 6e-5
damping2 = 6e-5
torque_limit = 5e-3
armature = 1e-6
"""

    def evaluate(self, *arguments):
        self.write("small.toml", self.PLANT)
        done = self.run_here("eval", "tvlqr", "--plant", "small.toml", "--episodes", 1, "--physics",
                             "closed-form", "--json", *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout), done.stderr

    def test_a_given_period_is_that_of_the_small_plant(self):
        self.assertRegex(self.evaluate()[1], r"a decision every 0\.006\d* s")
        self.assertIn("a decision every 0.005 s", self.evaluate("--control-period", 0.005)[1])

    def test_a_given_time_is_that_of_the_small_plant(self):
        # The default is 4 s for the built-in plant, so 1.3 s for this one.
        usual, given = (self.evaluate(*more)[0]["energy_used"]
                        for more in ((), ("--tvlqr-seconds", 4)))
        self.assertNotEqual(usual, given)

    def test_flags_and_a_file_are_the_same_plant(self):
        flags = [word for line in self.PLANT.splitlines()[1:] for word in (
            f"--{line.split(' = ')[0].replace('_', '-')}", line.split(" = ")[1])]
        by_flags = self.run_here("eval", "tvlqr", "--episodes", 1, "--physics", "closed-form", "--json",
                                 *flags)
        self.assertEqual(by_flags.returncode, 0, by_flags.stderr)
        self.assertIn("designed for this plant", by_flags.stderr)
        for name in ("return", "successes"):
            self.assertEqual(json.loads(by_flags.stdout)[name], self.evaluate()[0][name])

    def test_a_round_length_becomes_whole_periods(self):
        self.write("small.toml", self.PLANT)
        done = self.run_here("simulate", "tvlqr", "--plant", "small.toml", "--seconds", 1)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertAlmostEqual(float(done.stdout.splitlines()[-1].split(",")[0]), 1, delta=0.004)


if __name__ == "__main__":
    unittest.main()
