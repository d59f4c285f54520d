#!/usr/bin/env python3
"""Tests of `upswing simulate`: physics against a reference, the reward recomputed, CSV in and
out."""

import csv
import json
import math
import unittest
from pathlib import Path

from testing import ROOT, ProgramTest, read_tensors, small, write_tensors

REFERENCE = ROOT / "src/mujoco/testdata/mujoco_trajectory.csv"
COLUMNS = ["t", "q1", "q2", "w1", "w2", "torque", "energy", "height", "inverted",
           "reward", "energy_reward", "height_reward", "balance_reward", "velocity_penalty",
           "torque_penalty", "torque1", "torque2"]
REWARDS = COLUMNS[9:15]
STATE = COLUMNS[1:5]
CAPSULE_INERTIA = 0.025995421686746994  # kg·m², across a link of 1 kg
ARMATURE = 0.01  # kg·m²
STANDARD = {"mass1": 1.0, "mass2": 1.0, "length1": 0.5, "length2": 0.5, "gravity": 9.81}


def parse(text):
    """The rows of a CSV text, as dictionaries of text."""
    return list(csv.DictReader(text.splitlines()))


def numbers(row):
    return {name: float(text) for name, text in row.items()}


def energy(plant, row):
    """Mechanical energy (J) of two thin rods, with heights measured from the pivot."""
    m1, m2, l1, l2, g = (plant[name] for name in STANDARD)
    q1, q2, w1, w2 = (row[name] for name in STATE)
    potential = (-m1 * g * (l1 / 2) * math.cos(q1)
                 - m2 * g * (l1 * math.cos(q1) + (l2 / 2) * math.cos(q1 + q2)))
    kinetic = (0.5 * (m1 * l1**2 / 12) * w1**2 + 0.5 * (m2 * l2**2 / 12) * (w1 + w2)**2
               + 0.5 * m1 * ((l1 / 2) * w1)**2
               + 0.5 * m2 * (l1**2 * w1**2 + (l2 / 2)**2 * (w1 + w2)**2
                             + l1 * l2 * math.cos(q2) * w1 * (w1 + w2)))
    return potential + kinetic


def height(plant, row):
    return (-plant["length1"] * math.cos(row["q1"])
            - plant["length2"] * math.cos(row["q1"] + row["q2"]))


def tilt(angle):
    """Distance of an absolute angle from straight up, rad."""
    return abs(math.remainder(angle - math.pi, 2 * math.pi))


def expected_terms(plant, row, torque=0):
    """Energy, height, inverted and the five reward terms of a state that a torque led to, from their
    definitions."""
    target = (plant["mass1"] * plant["gravity"] * plant["length1"] / 2
              + plant["mass2"] * plant["gravity"] * (plant["length1"] + plant["length2"] / 2))
    e = energy(plant, row)
    h = height(plant, row)
    limit = math.radians(30)
    inverted = tilt(row["q1"]) <= limit and tilt(row["q1"] + row["q2"]) <= limit
    speeds = row["w1"]**2 + row["w2"]**2
    return {
        "energy": e,
        "height": h,
        "inverted": float(inverted),
        "energy_reward": min(max((e + target) / (2 * target), 0), 1.5),
        "height_reward": (h / (plant["length1"] + plant["length2"]) + 1) / 2,
        "balance_reward": 5.0 if inverted else 0.0,
        "velocity_penalty": -0.01 * speeds if inverted else 0.0,
        "torque_penalty": -(0.05 if inverted else 0.01) * torque**2,
    }


class SimulateTest(ProgramTest):
    def simulate(self, *arguments):
        """The printed rows, as numbers."""
        return [numbers(row) for row in parse(self.succeed("simulate", *arguments))]

    def reference_rollout(self, *more):
        return self.simulate("--torque", REFERENCE, "--start", "0.1,-0.05,0,0", *more)

    def assert_terms(self, plant, rows):
        """The terms of a row are those of the step that begins there: of the next row's state."""
        for row, after in zip(rows, rows[1:]):
            expected = expected_terms(plant, row)
            rewards = expected_terms(plant, after, row["torque"])
            for name, value in (expected | {name: rewards[name] for name in REWARDS[1:]}).items():
                self.assertAlmostEqual(row[name], value, delta=1e-12 * max(1, abs(value)), msg=name)
            self.assertAlmostEqual(row["reward"], sum(row[name] for name in REWARDS[1:]),
                                   delta=1e-12)
        self.assertEqual({rows[-1][name] for name in REWARDS}, {0})

    # ---- Physics and reward.

    def test_reference_trajectory_is_reproduced(self):
        rows = self.reference_rollout("--seconds", 10)
        text = REFERENCE.read_text(encoding="utf-8").replace("qpos0,qpos1,qvel0,qvel1", ",".join(STATE))
        reference = [numbers(row) for row in parse(text)]
        self.assertEqual((len(rows), len(reference)), (501, 501))
        for row, expected in zip(rows, reference):
            self.assertEqual((row["t"], row["torque"]), (expected["t"], expected["torque"]))
            for name in STATE:
                self.assertAlmostEqual(row[name], expected[name], delta=1e-9, msg=row["t"])

    def test_terms_follow_their_definition(self):
        self.assert_terms(STANDARD, self.reference_rollout("--seconds", 10))

    def test_terms_while_it_falls_from_the_top(self):
        rows = self.simulate("--start", "3.0,0.1,0.5,-2", "--seconds", 4)
        self.assertEqual({row["inverted"] for row in rows}, {0, 1})
        self.assert_terms(STANDARD, rows)

    def test_terms_follow_the_plant(self):
        rows = self.simulate("--start", "2.9,-0.1,0,0", "--seconds", 4, "--set", "mass2=1.4",
                             "--set", "length1=0.8", "--set", "gravity=3.7")
        self.assert_terms(STANDARD | {"mass2": 1.4, "length1": 0.8, "gravity": 3.7}, rows)

    def test_energy_at_the_top_and_at_the_bottom(self):
        for start, expected in (("0,0,0,0", -9.81), (f"{math.pi},0,0,0", 9.81)):
            first = self.simulate("--start", start, "--seconds", 0)[0]
            self.assertAlmostEqual(first["energy"], expected, delta=1e-12)

    def test_thirty_degrees_are_the_limit(self):
        for degrees, expected in ((29.99, 1), (30.01, 0), (-29.99, 1), (-30.01, 0)):
            for start in (f"{math.pi + math.radians(degrees)},{-math.radians(degrees)},0,0",
                          f"{math.pi},{math.radians(degrees)},0,0"):
                row = self.simulate("--start", start, "--seconds", 0)[0]
                self.assertEqual(row["inverted"], expected, start)

    def test_at_rest_it_stays(self):
        for row in self.simulate("--seconds", 2):
            self.assertEqual([row[name] for name in STATE], [0, 0, 0, 0])

    def test_energy_of_the_capsules_is_conserved_without_damping(self):
        # The column `energy` is that of thin rods; MuJoCo's links are capsules with armature.
        def capsule_energy(row):
            w1, w2 = row["w1"], row["w2"]
            more = CAPSULE_INERTIA - 1 * 0.5**2 / 12
            return energy(STANDARD, row) + 0.5 * (more * (w1**2 + (w1 + w2)**2)
                                                  + ARMATURE * (w1**2 + w2**2))
        rows = self.simulate("--start", "2,0,0,0", "--seconds", 10, "--set", "damping=0")
        for row in rows:
            # The error of RK4 at 5 ms is 1e-4 J or less.
            self.assertAlmostEqual(capsule_energy(row), capsule_energy(rows[0]), delta=1e-3)

    def test_damping_takes_energy_away(self):
        self.assertAlmostEqual(self.simulate("--start", "2,0,0,0", "--seconds", 30)[-1]["energy"],
                               -9.81, delta=0.01)

    def test_set_changes_the_trajectory(self):
        usual = self.reference_rollout()[-1]
        for change in ("mass1=1.1", "mass2=1.1", "length1=0.6", "length2=0.6", "damping1=0.3",
                       "damping2=0.3", "gravity=9", "torque_limit=4"):
            with self.subTest(change=change):
                changed = self.reference_rollout("--set", change)[-1]
                self.assertGreater(abs(changed["q1"] - usual["q1"]), 1e-6)

    def test_set_of_both_is_set_of_each(self):
        for name in ("mass", "length", "damping"):
            both = self.reference_rollout("--set", f"{name}=0.7")
            each = self.reference_rollout("--set", f"{name}1=0.7", "--set", f"{name}2=0.7")
            self.assertEqual(both, each)

    def test_torque_is_held_to_the_motor_limit(self):
        self.write("strong.csv", "torque\n" + "8\n" * 50)
        rows = self.simulate("--torque", "strong.csv")
        self.assertEqual({row["torque"] for row in rows[:-1]}, {5})
        self.write("five.csv", "torque\n" + "5\n" * 50)
        self.assertEqual(rows, self.simulate("--torque", "five.csv"))

    # ---- CSV in and out.

    def test_columns(self):
        self.assertEqual(self.succeed("simulate", "--seconds", 0).splitlines()[0],
                         ",".join(COLUMNS))

    def test_numbers_are_the_shortest_that_come_back(self):
        for row in parse(self.succeed("simulate", "--start", "0.1,-0.05,0,0", "--seconds", 5)):
            for text in row.values():
                self.assertLessEqual(len(text), len(repr(float(text))), text)
                self.assertTrue(math.isfinite(float(text)), text)

    def test_a_start_may_have_units_and_is_shown(self):
        rows = self.simulate("--start", "180deg,-5°,90deg/s,0.5rad/s", "--seconds", 0)
        expected = (math.pi, math.radians(-5), math.pi / 2, 0.5)
        for name, value in zip(STATE, expected):
            self.assertAlmostEqual(rows[0][name], value, msg=name)
        shown = "q1 3.1416, q2 -0.0873 rad (180°, -5°), w1 1.5708, w2 0.5 rad/s"
        for command in (["simulate", "--csv", "a.csv"], ["plot", "lqr"]):
            text = self.succeed(*command, "--start", "180deg,-5°,90deg/s,0.5rad/s", "--seconds", 1)
            self.assertIn(f"\n  start      {shown}\n", text)
        # Without --start, and of an episode of eval.
        self.assertIn("  start      q1 0, q2 0 rad (0°, 0°), w1 0, w2 0 rad/s\n",
                      self.succeed("simulate", "--csv", "b.csv", "--seconds", 1))
        text = self.succeed("simulate", "lqr", "--csv", "c.csv", "--episode", 3)
        q1 = float(parse((self.folder / "c.csv").read_text(encoding="utf-8"))[0]["q1"])
        self.assertIn(f"  start      q1 {round(q1, 4):g}, ", text)

    def test_any_row_is_a_start_of_the_same_trajectory(self):
        # The comparison is exact only if the CSV has every digit.
        rows = parse(self.succeed("simulate", "--start", "2,-0.05,0,0", "--seconds", 4))
        start = ",".join(rows[100][name] for name in STATE)
        later = parse(self.succeed("simulate", "--start", start, "--seconds", 2))
        for row, expected in zip(later, rows[100:], strict=True):
            self.assertEqual([row[name] for name in COLUMNS[1:]],
                             [expected[name] for name in COLUMNS[1:]])

    def test_output_fed_back_as_schedule_gives_itself(self):
        first = self.succeed("simulate", "--torque", REFERENCE, "--start", "0.1,-0.05,0,0")
        self.write("first.csv", first)
        seconds = len(first.splitlines()) / 50 - 2 / 50
        second = self.succeed("simulate", "--torque", "first.csv", "--start", "0.1,-0.05,0,0",
                              "--seconds", seconds)
        self.assertEqual(second, "".join(first.splitlines(True)[:len(second.splitlines())]))

    def test_file_gets_the_bytes_of_standard_output(self):
        arguments = ["simulate", "--start", "1,0,0,0", "--seconds", 2]
        printed = self.succeed(*arguments)
        self.assertIn("101 rows", self.succeed(*arguments, "--csv", "out.csv"))
        self.assertEqual((self.folder / "out.csv").read_bytes(), printed.encode())
        self.assertEqual([path.name for path in self.folder.iterdir()], ["out.csv"])

    def test_layouts_of_torque_files(self):
        plain = "torque\n1\n-2.5\n3e0\n"
        self.write("plain.csv", plain)
        expected = self.succeed("simulate", "--torque", "plain.csv")
        self.assertEqual(len(expected.splitlines()), 5)
        layouts = {"comments": "# made by hand\n\ntorque\n1\n# half\n-2.5\n3e0\n",
                   "crlf": plain.replace("\n", "\r\n"),
                   "no newline at the end": plain[:-1],
                   "spaces": "torque \n 1\n -2.5\n 3e0\n",
                   "more columns": "t,torque,note\n0,1,a\n0.02,-2.5,b\n0.04,3e0,\n"}
        for name, text in layouts.items():
            with self.subTest(layout=name):
                (self.folder / "layout.csv").write_bytes(text.encode())
                self.assertEqual(self.succeed("simulate", "--torque", "layout.csv"), expected)

    def test_times_of_torque_files(self):
        """Other times than the control steps are refused, because each torque acts for a step."""
        expected = self.succeed("simulate", "--torque", self.write("n.csv", "torque\n1\n2\n3\n"))
        for name in ("t", "time", "Time [s]"):
            for begin in (0, 3, 1.7e9):
                table = f"{name},torque\n{begin},1\n{begin + .02},2\n{begin + .04},3\n"
                self.assertEqual(
                    self.succeed("simulate", "--torque", self.write("n.csv", table)), expected)
        for times, row, wanted in ((("0", "0.01", "0.02"), 2, "0.02"), ((0, 20, 40), 2, "0.02"),
                                   ((0, 0.02, 0.02), 3, "0.04"), ((0, 0.02, 0.05), 3, "0.04"),
                                   ((0.04, 0.02, 0), 2, "0.06"), ((0, 0, 0), 2, "0.02")):
            for name in ("t", "time", "t_ms", "timestamp"):
                table = f"{name},torque\n" + "".join(f"{t},1\n" for t in times)
                self.refuse(["simulate", "--torque", self.write("bad.csv", table)],
                            f"bad.csv: row {row}: {name}: expected {wanted} s", "0.02 s")
        table = "T [degC],Time step,torque\n20,0,1\n21,1,2\n22,2,3\n"
        self.assertEqual(self.succeed("simulate", "--torque", self.write("n.csv", table)), expected)
        self.refuse(["simulate", "--torque", self.write("bad.csv", "t,torque\n1e300,1\n1e300,2\n")],
                    "bad.csv: row 1: t: expected")
        self.refuse(["simulate", "--torque", self.write("bad.csv", "torque,torque\n1,2\n")],
                    'bad.csv:1: expected one column "torque", got 2')

    def test_the_period_of_a_torque_file_is_printed(self):
        self.write("n.csv", "torque\n1\n2\n3\n")
        self.write("small.toml", "[plant]\nmass = 0.01\nlength = 0.05\narmature = 1e-6\n"
                                 "damping = 6e-5\ntorque_limit = 0.005\n")
        run = ["simulate", "--torque", "n.csv", "--csv", "out.csv"]
        usual = self.run_here(*run)
        self.assertIn("n.csv: 3 torques of 0.02 s each, the control period;", usual.stdout)
        self.assertEqual(usual.stderr, "")
        small = self.run_here(*run, "--plant", "small.toml")
        step = float(parse((self.folder / "out.csv").read_text(encoding="utf-8"))[1]["t"])
        self.assertIn(f"n.csv: 3 torques of {step:.6g} s each, the control period; --control-period",
                      small.stderr)
        given = self.run_here(*run, "--plant", "small.toml", "--control-period", 0.005)
        self.assertIn("n.csv: 3 torques of 0.005 s each", given.stdout)
        self.assertEqual(given.stderr, "")

    def test_rewards_add_up_to_the_printed_sums(self):
        for flags in ([], ["--control-period", 0.007], ["--torque-limit", 3]):
            out = self.succeed("simulate", "energy", *flags, "--seconds", 14, "--csv", "out.csv")
            rows = [numbers(row) for row in parse((self.folder / "out.csv").read_text(encoding="utf-8"))]
            period = rows[1]["t"]
            first = sum(row["reward"] for row in rows[:round(10 / period)])
            self.assertIn(f"{sum(row['reward'] for row in rows):.6g} in 14", out)
            self.assertIn(f"{first:.6g} in the first 10 s", out)

    def test_seconds_may_be_shorter_than_the_schedule(self):
        short = self.reference_rollout("--seconds", 1)
        long = self.reference_rollout()
        self.assertEqual(short[:50], long[:50])
        state = COLUMNS[:9]  # the last row has no reward, because no step follows
        self.assertEqual([short[50][name] for name in state], [long[50][name] for name in state])


class PolicyRolloutTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.succeed(*small())

    def test_deterministic_and_among_the_nine_levels(self):
        output = self.succeed("simulate", "run", "--seconds", 5)
        self.assertEqual(output, self.succeed("simulate", "run/policy.safetensors", "--seconds", 5))
        rows = [numbers(row) for row in parse(output)]
        self.assertEqual(len(rows), 251)
        levels = {1.25 * quarter for quarter in range(-4, 5)}
        self.assertLessEqual({row["torque"] for row in rows}, levels)

    def test_its_torques_as_a_schedule_give_the_same_rollout(self):
        output = self.succeed("simulate", "run", "--seconds", 5)
        self.write("torques.csv", output)
        again = self.succeed("simulate", "--torque", "torques.csv", "--seconds", 5)
        self.assertEqual(again, output)

    def test_another_plant_gives_another_rollout(self):
        usual = self.succeed("simulate", "run", "--seconds", 5)
        self.assertNotEqual(self.succeed("simulate", "run", "--seconds", 5, "--set", "mass2=1.3"),
                            usual)

    def test_policy_rolls_out_on_its_own_plant(self):
        self.succeed(*small(mass2=1.3, out="heavy"))
        output = self.succeed("simulate", "heavy", "--seconds", 2)
        self.assertEqual(self.succeed("simulate", "heavy", "--seconds", 2, "--set", "mass2=1.3"),
                         output)
        self.assertNotEqual(self.succeed("simulate", "heavy", "--seconds", 2, "--set", "mass2=1"),
                            output)


    def test_a_policy_with_memory_acts_on_it(self):
        self.succeed(*small(memory=2, out="remembering"))
        rows = parse(self.succeed("simulate", "remembering", "--seconds", "0.1"))
        self.assertEqual(len(rows), 6)
        self.assertIn('"steps":2', read_tensors(self.folder / "remembering/policy.safetensors")[0]
                      ["observation"])
        self.succeed("eval", "remembering", "--episodes", 2)
        self.assertIn(" motion, 3 for each of the last 2 steps\n", self.succeed("info", "remembering"))

    def test_a_policy_that_identifies_the_plant_does_not_observe_it(self):
        self.succeed(*small(memory=1, out="identifying"), "--identify", "--randomize", 0.1)
        metadata, _ = read_tensors(self.folder / "identifying/policy.safetensors")
        self.assertIn("observes    8 numbers for the motion, 13 for the identified plant, 3 for the last step\n", self.succeed("info", "identifying"))
        observation = json.loads(metadata["observation"])
        self.assertEqual(len(observation["identified"]["names"]), 13)
        self.assertEqual(json.loads(metadata["network"])["inputs"], 8 + 13 + 3)
        light = ("--set", "mass2=0.8", "--set", "gravity=8")
        first = [parse(self.succeed("simulate", "identifying", "--seconds", 0.1, *more))[0]
                 for more in ((), light)]
        self.assertEqual(first[0]["torque"], first[1]["torque"])
        for words in (("eval", "--episodes", 2, *light), ("eval", "--episodes", 2, "--unknown-plant"),
                      ("map", "--x", "mass1=-10%:10%:2", "--y", "mass2=-10%:10%:2", "--episodes", 1,
                       "--out", "map"),
                      ("info",)):
            with self.subTest(words[0]):
                self.succeed(words[0], "identifying", *words[1:])
        # A network without the inputs that its metadata claim.
        metadata, tensors = read_tensors(self.folder / "identifying/policy.safetensors")
        metadata["observation"] = json.dumps(observation | {"identified": {
            "names": observation["identified"]["names"], "scale": 2}})
        write_tensors(self.folder / "scaled.safetensors", metadata, tensors)
        self.refuse(["eval", "scaled.safetensors"], "observation")

    def test_a_policy_for_any_pose_observes_its_goal(self):
        self.succeed(*small(memory=1, out="poses"), "--any-pose")
        metadata, tensors = read_tensors(self.folder / "poses/policy.safetensors")
        self.assertEqual(json.loads(metadata["observation"])["goal"],
                         ["goal of link 1", "goal of link 2"])
        self.assertIn(" motion, 2 for the goal, 3 for the last step\n",
                      self.succeed("info", "poses"))
        # The reward of a step at rest in its goal: all of energy, height and balance.
        for start, goal in (("0,0,0,0", "down-down"), (f"{math.pi},{math.pi},0,0", "up-down")):
            row = numbers(parse(self.succeed("simulate", "poses", "--start", start, "--goal", goal,
                                             "--seconds", 0.1))[0])
            self.assertEqual(row["inverted"], 1)
            self.assertAlmostEqual(row["energy_reward"] + row["height_reward"], 2, delta=0.1)
            self.assertEqual(row["balance_reward"], 5)
            self.assertAlmostEqual(row["torque_penalty"], -0.05 * row["torque"]**2, 12)
        # `eval` draws the goals, `--episode` has the same ones.
        report = json.loads(self.succeed("eval", "poses", "--episodes", 40, "--json",
                                         "--episodes-csv", "episodes.csv"))
        rows = parse((self.folder / "episodes.csv").read_text())
        self.assertEqual({(row["goal1"], row["goal2"]) for row in rows},
                         {("1", "1"), ("1", "-1"), ("-1", "1"), ("-1", "-1")})
        self.assertEqual(sum(t["episodes"] for t in report["transitions"].values()), 40)
        for name in report["transitions"]:
            self.assertEqual(len(set(name.split(" to "))), 2, name)
        first = numbers(parse(self.succeed("simulate", "poses", "--episode", 7, "--seconds",
                                           10))[0])
        self.assertEqual([first[name] for name in STATE],
                         [float(rows[7][name]) for name in ("q1", "q2", "w1", "w2")])
        # One goal for all: the episodes start hanging.
        self.assertIn("down-down to up-down   0 of 3",
                      self.succeed("eval", "poses", "--episodes", 3, "--goal", "up-down"))
        self.refuse(["eval", "poses", "--goal", "up"], "--goal", 'expected one of up-up, up-down, down-up, down-down, got "up"')
        for words in (["eval", "run"], ["eval", "mpc"], ["simulate"]):
            self.refuse([*words, "--goal", "up-down"], "--goal up-down: expected a policy for any pose")
        # A network without the inputs that its metadata claim.
        metadata["observation"] = json.dumps(json.loads(metadata["observation"]) | {"goal": ["up"]})
        write_tensors(self.folder / "one.safetensors", metadata, tensors)
        self.refuse(["eval", "one.safetensors"], "observation")


if __name__ == "__main__":
    unittest.main()
