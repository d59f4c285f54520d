#!/usr/bin/env python3
"""Tests of plant files (--plant): the commands that take them, their layer below the other flags, and
machines whose links are not solid capsules."""

import csv
import io
import json
import re
import sys
import unittest

from testing import ROOT, ProgramTest, read_tensors, small

sys.path.insert(0, str(ROOT / "tools/results"))
from sizes import image  # noqa: E402

MACHINE = """[plant]
mass1 = 0.8
length2 = 0.4
center1 = 0.3
center2 = 0.15
inertia1 = 0.02
inertia2 = 0.015
armature = 0.002
rotor_inertia = 1e-4
coulomb2 = 0.01

[disturbance]
delay = 0.02

[actuator]
ignored = true
"""
VALUES = {"mass1": 0.8, "length2": 0.4, "center1": 0.3, "center2": 0.15, "inertia1": 0.02,
          "inertia2": 0.015, "armature": 0.002, "rotor_inertia": 1e-4, "coulomb2": 0.01}
SETS = [argument for name, value in VALUES.items() for argument in ("--set", f"{name}={value}")]
START = ("--start", "0.5,0.2,-1,2", "--seconds", "1")


class PlantTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("m.toml", MACHINE)

    def table(self, *arguments):
        """The rows of `simulate` as lists of numbers."""
        text = self.succeed("simulate", *START, *arguments)
        return [[float(x) for x in row] for row in list(csv.reader(io.StringIO(text)))[1:]]

    def test_every_command_refuses_a_plant_that_the_steps_cannot_follow(self):
        stiff = {"mass2": 0.05, "length2": 0.2, "damping2": 50, "armature": 1e-4}
        self.write("stiff.toml", "[plant]\n" + "".join(f"{k} = {v}\n" for k, v in stiff.items()))
        made_for = [word for k, v in stiff.items() for word in ("--made-for", f"{k}={v}")]
        words = ("plant: expected friction that stops the joints at a rate of at most 51200/s, because "
                 "time steps of 1.95313e-05 s are too long beyond it, got 63321.7/s: damping2 = 50 N·m·s/rad "
                 "and coulomb2 = 0 N·m act on 0.000789622 kg·m²")
        for command in (["simulate"], ["eval", "fast"], ["eval", "tvlqr"], ["plot", "mpc"],
                        ["view", "lqr", "--record", "x.png"],
                        ["map", "fast", "--x", "mass1=1:2:2", "--y", "gravity=9:10:2"],
                        ["train", "--agent", "fast"]):
            for physics in ("mujoco", "closed-form"):
                with self.subTest(command[0], physics=physics):
                    self.refuse([*command, "--plant", "stiff.toml", "--physics", physics], words)
        for controller in ("lqr", "tvlqr", "mpc", "energy", "pfl"):
            self.refuse(["eval", controller, *made_for], f"design {words}")
        # Only one end of a range, dry friction, and a box around a plant that is stable itself.
        for command in (["map", "fast", "--x", "damping2=1:1e5:2", "--y", "gravity=9:10:2"],
                        ["simulate", "--set", "coulomb2=5000"],
                        ["train", "--damping2", "1e5", "--random-start-share", "1"],
                        ["train", "--damping2", "1200", "--randomize", "0.9"],
                        ["eval", "fast", "--set", "damping2=1200", "--randomize", "0.9"]):
            self.refuse(command, "plant: expected friction", "51200/s")
        for command in (["simulate", "--set", "damping2=120", "--seconds", "1"],
                        ["eval", "fast", "--episodes", "1", "--randomize", "0.9"],
                        *(["eval", "lqr", "--plant", plant, "--episodes", "1", "--randomize", "0.25"]
                          for plant in ("realaigym", "realaigym-c1", "realaigym-twin"))):
            self.succeed(*command)

    def write_size(self, length, mass):
        """Writes size.toml, a plant of the nominal shape, and returns its natural time [s]."""
        self.write("size.toml", image(length, mass))
        return length ** 0.5

    def test_policies_and_controllers_act_on_every_size(self):
        for length, mass in ((0.1, 0.01), (10, 1000), (0.1, 1)):
            time = self.write_size(length, mass)
            for policy in ("sac", "d3qn", "any-pose", "tvlqr"):
                with self.subTest(policy, length=length, mass=mass):
                    done = self.run_here("eval", policy, "--plant", "size.toml", "--goal", "up-up",
                                         "--physics", "closed-form", "--episodes", 20, "--json")
                    self.assertEqual(done.returncode, 0, done)
                    self.assertEqual(json.loads(done.stdout)["successes"], 20)
                    period = float(re.search(r"a decision every (\S+) s", done.stderr)[1])
                    self.assertAlmostEqual(period / (0.02 * time), 1, delta=0.02)

    def test_a_training_on_a_small_plant_is_that_on_the_nominal_one(self):
        self.write_size(0.1, 0.01)
        config = self.succeed("train", "--agent", "fast", "--plant", "size.toml", "--print-config")
        for name, value in (("control_period", 0.00632), ("episode_seconds", 1.265),
                            ("random_start_velocity", 15.8), ("torque_scale", 1e-3)):
            got = float(re.search(rf"(?m)^{name} = (\S+)", config)[1])
            self.assertAlmostEqual(got / value, 1, delta=0.02, msg=name)
        # What the user gives stays, and gamma looks as far ahead.
        config = self.succeed("train", "--agent", "fast", "--plant", "size.toml", "--print-config",
                              "--control-period", 0.005, "--random-start-velocity", 3)
        self.assertRegex(config, r"(?m)^control_period = 0.005 ")
        self.assertRegex(config, r"(?m)^random_start_velocity = 3 ")
        self.assertRegex(config, r"(?m)^gamma = 0.992")

    def test_the_steps_of_sacs_returns_follow_the_control_period(self):
        for agent, period, given, n_step in (("sac-fast", 0.005, (), 12), ("sac", 0.05, (), 1), ("fast", 0.005, (), 4),
                                             ("sac", 0.02, (), 3), ("sac", 0.001, (), 60),
                                             ("sac", 0.005, ("--n-step", 7), 7)):
            config = self.succeed("train", "--agent", agent, "--control-period", period, "--print-config", *given)
            self.assertRegex(config, rf"(?m)^n_step = {n_step} ")

    def test_links_of_50_m_have_a_decision_every_200_ms(self):
        self.write_size(100, 1)
        done = self.run_here("eval", "sac", "--plant", "size.toml", "--episodes", 5, "--physics",
                             "closed-form", "--json")
        report = json.loads(done.stdout)
        self.assertAlmostEqual(report["control_period"], 0.2, delta=0.001)
        self.assertEqual(report["successes"], 5)
        usual = json.loads(self.succeed("eval", "sac", "--episodes", 5, "--physics", "closed-form", "--json"))
        self.assertAlmostEqual(report["return"]["mean"] / usual["return"]["mean"], 1, delta=0.01)

    def test_the_armature_of_joint_1(self):
        for value in (-0.5, -2):
            self.refuse(["eval", "sac", "--armature1", value],
                        f'--armature1: expected a number in [0, 1000000] kg·m² or -1, got "{value}"')
        ends = [self.table("--seconds", 1, *more)[-1][1:5] for more in
                ((), ("--armature1", -1), ("--armature1", 0.01), ("--armature1", 0.05))]
        self.assertEqual(ends[0], ends[1])
        self.assertEqual(ends[0], ends[2])
        self.assertNotEqual(ends[0], ends[3])

    def test_the_control_period(self):
        rows = self.table("--control-period", 0.005, "--seconds", 0.02)
        self.assertEqual([row[0] for row in rows], [0, 0.005, 0.01, 0.015, 0.02])
        self.refuse(["eval", "sac", "--control-period", 0.01],
                    "--control-period: expected 0.02 s, the control period of sac on its own plant, got 0.01")
        self.refuse(["simulate", "--control-period", 2], "--control-period", "[0.001, 1]")
        # Returns do not depend on how often a controller decides.
        returns = [json.loads(self.succeed(
            "eval", "tvlqr", "--control-period", period, "--episodes", 5, "--physics", "closed-form",
            "--json"))["return"]["mean"] for period in (0.02, 0.01, 0.005)]
        for other in returns[1:]:
            self.assertAlmostEqual(other / returns[0], 1, delta=0.03)
        for period in (0.005, 0.01):
            self.assertIn("20 of 20", self.succeed(
                "eval", "tvlqr", "--control-period", period, "--episodes", 20, "--physics",
                "closed-form"))
        self.assertIn("\n  a decision every 0.01 s\n", self.succeed(
            "train", "--agent", "sac-fast", "--control-period", 0.01, "--physics", "closed-form",
            "--out", "run", "--steps", 20000))
        self.assertIn("every 0.01 s", self.succeed("info", "run"))
        self.assertIn("decisions      every 0.01 s", self.succeed("eval", "run", "--episodes", 2))

    def test_a_file_is_the_settings_that_it_has(self):
        for physics in ("mujoco", "closed-form"):
            self.assertEqual(self.table("--plant", "m.toml", "--physics", physics),
                             self.table(*SETS, "--delay", "0.02", "--physics", physics))
        self.assertNotEqual(self.table("--plant", "m.toml"), self.table())

    def test_both_engines_move_it_alike(self):
        for plant in (["m.toml"], ["realaigym"], ["m.toml", "--set", "actuated_joint=2"]):
            one, two = (self.table("--plant", *plant, "--physics", physics)
                        for physics in ("mujoco", "closed-form"))
            for a, b in zip(one, two, strict=True):
                for x, y in zip(a, b, strict=True):
                    self.assertAlmostEqual(x, y, delta=1e-6 * max(1, abs(x)))

    def test_flags_override_it(self):
        more = ("--set", "mass1=1.1", "--delay", "0")
        sets = [text for text in SETS if text != "mass1=0.8"]
        sets.remove("--set")
        self.assertEqual(self.table("--plant", "m.toml", *more), self.table(*sets, *more))

    def test_evaluations_say_it(self):
        done = json.loads(self.succeed("eval", "lqr", "--plant", "m.toml", "--episodes", 1, "--json"))
        self.assertLessEqual(VALUES.items(), done["plant"].items())
        self.assertEqual(done["disturbance"]["delay"], 0.02)
        known = ("--episodes", 1, "--episodes-csv", "-")
        self.assertEqual(
            self.succeed("eval", "energy", "--plant", "m.toml", "--set", "coulomb2=0", "--made-for",
                         "m.toml", "--made-for", "coulomb2=0", *known),
            self.succeed("eval", "energy", "--plant", "m.toml", "--set", "coulomb2=0",
                         "--known-plant", *known))
        self.assertEqual(
            self.succeed("eval", "lqr", "--made-for", "realaigym", "--made-for", "mass1=0.6", *known),
            self.succeed("eval", "lqr", "--made-for", "mass1=0.6", "--made-for", "realaigym", *known))

    def test_maps(self):
        grid = ("--x", "center2=0.1:0.2:2", "--y", "inertia1=0.01:0.03:2", "--episodes", 1)
        mapped = json.loads(self.succeed("map", "lqr", "--plant", "m.toml", *grid, "--out", "map",
                                         "--json", "--set", "mass2=1.2"))
        self.assertLessEqual({"armature": 0.002, "mass1": 0.8, "mass2": 1.2}.items(),
                             mapped["plant"].items())
        self.assertIn("delay 0.02", mapped["changes"])

    def test_a_run_holds_the_values(self):
        self.write("c.toml", "[plant]\nmass1 = 2\nmass2 = 2\n")
        self.succeed(*small(config="c.toml", plant="m.toml", length2=0.45, coulomb2=0,
                            rotor_inertia=0, steps=400, eval_every=400,
                            eval_episodes=1, physics="mujoco"))
        config = (self.folder / "run/config.toml").read_text()
        for line in ("mass1 = 0.8 ", "mass2 = 1 ", "length2 = 0.45 ", "center1 = 0.3 ",
                     "inertia2 = 0.015 ", "armature = 0.002 ", "delay = 0.02 "):
            self.assertIn("\n" + line, config)
        plant = json.loads(read_tensors(self.folder / "run/policy.safetensors")[0]["plant"])
        here = {name: VALUES[name] for name in VALUES if name not in ("rotor_inertia", "coulomb2")}
        self.assertLessEqual((here | {"length2": 0.45}).items(), plant.items())
        self.refuse(["export", "run", "--page", "page"], "solid capsules")
        self.succeed("export", "run", "--c", "p.h")
        self.succeed("train", "--resume", "run", "--steps", 500)
        self.refuse(["train", "--resume", "run", "--plant", "m.toml"], "--resume: expected no --plant")

    def test_a_plant_without_own_links_is_in_no_policy_file(self):
        self.succeed(*small(steps=400, eval_every=400, eval_episodes=1))
        plant = json.loads(read_tensors(self.folder / "run/policy.safetensors")[0]["plant"])
        self.assertEqual(set(plant), {"mass1", "mass2", "length1", "length2", "damping1", "damping2",
                                      "gravity", "torque_limit"})

    def test_a_controller_for_the_board(self):
        score = ("realaigym", "score", "tvlqr", "--runs", 1, "--made-for")
        board = json.loads(self.succeed(*score, "realaigym", "--score-version", 2, "--json"))
        self.assertEqual(board["policy"], "tvlqr (for realaigym)")
        self.assertTrue(board["performance"]["swung_up"])
        self.assertGreater(board["performance"]["score"], 0.45)
        self.assertNotIn("designed for", self.succeed(*score, "realaigym"))
        changed = self.succeed(*score, "realaigym", "--made-for", "mass1=0.6")
        self.assertIn("tvlqr (for realaigym and mass1 0.6)", changed)
        self.assertIn("designed for mass1 0.6", changed)

    def test_mistakes(self):
        self.write("bad.toml", "[plant]\nmas1 = 1\n")
        self.write("other.toml", "[sensor]\n")
        for command in (["simulate"], ["eval", "lqr"], ["plot", "lqr"], ["map", "lqr"], ["view"], small()):
            self.refuse([*command, "--plant", "bad.toml"], "bad.toml:2: [plant]", "did you mean mass1?")
            self.refuse([*command, "--plant", "none"], "--plant: expected a plant file", "realaigym",
                        'got "none"')
        for name in ("mine.toml", "my/plant"):
            self.refuse(["simulate", "--plant", name], f'got "{name}" (no such file)')
        self.refuse(["simulate", "--plant", "other.toml"], "other.toml:1", "did you mean sensors?")
        self.refuse(["eval", "lqr", "--made-for", "bad.toml"], "bad.toml:2: [plant]")
        self.refuse(["eval", "lqr", "--made-for", "m.toml", "--made-for", "realaigym"],
                    "--made-for: expected at most one plant file")


if __name__ == "__main__":
    unittest.main()
