#!/usr/bin/env python3
"""Tests of `upswing plant`: plants of MJCF and URDF files against numbers from formulas, what it refuses
and leaves out, and files of strangers. The command itself compares each plant with MuJoCo's motions."""

import math
import os
import re
import tomllib
import unittest
from pathlib import Path

from testing import ROOT, ProgramTest

PYTHON = Path(os.environ.get("UPSWING_PYTHON", ROOT / "build/view-venv/bin/python"))
REQUIRED = "UPSWING_REQUIRE_PICTURES" in os.environ  # then no test is skipped
NAMES = {"mass1", "mass2", "length1", "length2", "center1", "center2", "inertia1", "inertia2", "armature",
         "damping1", "damping2", "coulomb1", "coulomb2", "gravity", "torque_limit", "actuated_joint",
         "rotor_inertia", "gear_ratio"}

MOTOR = '<motor name="m" joint="b" ctrllimited="true" ctrlrange="-1 1" gear="3"/>'


def model(*, joint1="", joint2="", body1="", body2="", option="", world="", actuators=MOTOR, more="",
          axis1="0 1 0", axis2="0 1 0", links=("0 0 -0.4", "0 0 -0.5"), touch="0") -> str:
    """A double pendulum of two capsules in MJCF. Shapes do not touch unless `touch` is 1."""
    return f"""<mujoco>
  <option {option}/>
  <default><geom contype="{touch}" conaffinity="{touch}"/></default>
  <worldbody>{world}
    <body name="one"><joint name="a" axis="{axis1}" damping="0.03" {joint1}/>
      <geom name="rod1" type="capsule" size="0.02" fromto="0 0 0 {links[0]}" mass="0.7"/>{body1}
      <body name="two" pos="{links[0]}"><joint name="b" axis="{axis2}" damping="0.02" {joint2}/>
        <geom name="rod2" type="capsule" size="0.03" fromto="0 0 0 {links[1]}" mass="0.9"/>{body2}
      </body>
    </body>
  </worldbody>
  <actuator>{actuators}</actuator>{more}
</mujoco>
"""


def capsule_inertia(m: float, r: float, length: float) -> float:
    """Of a solid capsule, across its axis: a cylinder and two half spheres."""
    cylinder, spheres = math.pi * r * r * length, 4 / 3 * math.pi * r ** 3
    mc, ms = m * cylinder / (cylinder + spheres), m * spheres / (cylinder + spheres)
    return (mc * (length ** 2 / 12 + r * r / 4)
            + ms * (2 / 5 * r * r + length ** 2 / 4 + 3 / 8 * length * r))


def robot(*, joint1="", effort=4, mesh="", drives="J2", extra="") -> str:
    """A double pendulum in URDF: its base hangs on the link `world`, which the file does not declare."""
    def link(name, z, mass, inertia):
        return (f'<link name="{name}"><inertial><origin xyz="0 0 {z}"/><mass value="{mass}"/>'
                f'<inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial>'
                f'<visual><geometry><mesh filename="package://robot/none.obj"/></geometry></visual>{mesh}</link>')
    motors = "".join(f'<transmission name="t{name}"><joint name="{name}"/></transmission>'
                     for name in drives.split())
    return f"""<?xml version="1.0" encoding="utf-8"?>
<robot name="r">
  <joint name="weld" type="fixed"><parent link="world"/><child link="base"/></joint>
  {link("base", 0, 1, 0.01)}{link("L1", -0.2, 0.5, 0.004)}{link("L2", 0.15, 0.4, 0.002)}
  <joint name="J1" type="continuous"><parent link="base"/><child link="L1"/><axis xyz="1 0 0"/>
    <dynamics damping="0.01" friction="0"/>{joint1}</joint>
  <joint name="J2" type="continuous"><origin xyz="0.03 0 -0.3" rpy="3.141592653589793 0 0"/>
    <parent link="L1"/><child link="L2"/><axis xyz="1 0 0"/>
    <limit effort="{effort}" velocity="9"/><dynamics damping="0.02" friction="0"/></joint>
  {motors}{extra}
</robot>
"""


@unittest.skipIf(not REQUIRED and not PYTHON.exists(), f"needs {PYTHON}, which ./upswing plant makes")
class PlantCommandTest(ProgramTest):
    ENVIRONMENT = os.environ | {"UPSWING_PYTHON": str(PYTHON)}

    def read(self, text, *arguments, name="model.xml"):
        """The settings of the plant of a model, and the comments above them."""
        output = self.succeed("plant", self.write(name, text), "--out", "plant.toml", "--overwrite", *arguments,
                              env=self.ENVIRONMENT)
        difference = float(re.search(r"by at most (\S+) rad", output)[1])
        self.assertLess(difference, 1e-6)
        self.toml = (self.folder / "plant.toml").read_text(encoding="utf-8")
        plant = tomllib.loads(self.toml)["plant"]
        self.assertEqual(plant.keys() - {"armature1"}, NAMES)
        return plant, "\n".join(line for line in self.toml.splitlines() if line.startswith("#"))

    def no_plant(self, text, *words, arguments=(), code=2, name="model.xml"):
        """Asserts that a model is refused."""
        file = name if text is None else self.write(name, text)
        self.refuse(["plant", file, "--out", "plant.toml", "--overwrite", *arguments], *words, code=code,
                    env=self.ENVIRONMENT)

    def assert_close(self, plant, **expected):
        for name, value in expected.items():
            self.assertAlmostEqual(plant[name], value, delta=1e-9 * abs(value) + 1e-15, msg=name)


class Numbers(PlantCommandTest):
    def test_capsules(self):
        plant, comments = self.read(model())
        self.assert_close(plant, mass1=0.7, mass2=0.9, length1=0.4, length2=0.5, center1=0.2, center2=0.25,
                          inertia1=capsule_inertia(0.7, 0.02, 0.4), inertia2=capsule_inertia(0.9, 0.03, 0.5),
                          armature=0, damping1=0.03, damping2=0.02, coulomb1=0, gravity=9.81, torque_limit=3,
                          actuated_joint=2, rotor_inertia=0)
        self.assertIn("q1 = a [rad]", comments)
        self.assertIn("q2 = b [rad]", comments)
        self.assertIn("A positive control is a positive torque here.", comments)
        for name in NAMES:
            self.assertRegex(self.toml, rf"(?m)^{name} = \S+  # .+$")
        self.assertIn('inertia1', self.succeed("simulate", "--plant", "plant.toml", "--seconds", "0.1",
                                               "--csv", "s.csv") + self.toml)

    def test_a_small_machine_takes_the_steps_that_it_needs(self):
        self.write("small.xml", """<mujoco><worldbody><body>
            <joint name="a" axis="0 1 0"/>
            <geom type="capsule" fromto="0 0 0 0 0 -0.05" size="0.004" mass="0.01" contype="0"
            conaffinity="0"/><body pos="0 0 -0.05"><joint name="b" axis="0 1 0"/>
            <geom type="capsule" fromto="0 0 0 0 0 -0.05" size="0.004" mass="0.01" contype="0"
            conaffinity="0"/></body>
            </body></worldbody><actuator><motor joint="a" ctrlrange="-1 1" gear="0.001"/></actuator>
            </mujoco>""")
        # One Python reads the model, and learns how many steps the plant needs.
        python = Path(self.write("python.sh", f'#!/bin/sh\necho >>count\nexec {PYTHON} "$@"\n'))
        (self.folder / python).chmod(0o755)
        # Its natural time is about a third of the built-in plant's, so its motions are as much shorter.
        self.assertIn("random motions of 0.31 s differ from MuJoCo's by at most", self.succeed(
            "plant", "small.xml", "--out", "small.toml",
            env=os.environ | {"UPSWING_PYTHON": str(self.folder / python)}))
        self.assertEqual((self.folder / "count").read_text(), "\n")

    def test_zero_poses_and_signs(self):
        """Horizontal, upright, folded, another axis: the comparison with MuJoCo proves the angles."""
        for links, axis1, axis2, q1, q2 in (
                (("0.4 0 0", "0.5 0 0"), "0 1 0", "0 1 0", "-1.57079633 + a", "b"),
                (("0.4 0 0", "0.5 0 0"), "0 -1 0", "0 -1 0", "1.57079633 + a", "b"),
                (("0 0 0.4", "0 0 -0.5"), "0 1 0", "0 1 0", "3.14159265 + a", "3.14159265 + b"),
                (("0 0 -0.4", "0.5 0 0"), "0 1 0", "0 -1 0", "a", "-1.57079633 - b"),
                (("0 0 -0.4", "0 0.3 -0.4"), "2 0 0", "-1 0 0", "a", "0.643501109 - b")):
            with self.subTest(links, axis1=axis1):
                plant, comments = self.read(model(links=links, axis1=axis1, axis2=axis2))
                self.assert_close(plant, length1=0.4, length2=0.5, center1=0.2, center2=0.25)
                self.assertIn(f"q1 = {q1} [rad]", comments.replace("-3.14159265", "3.14159265"))
                self.assertIn(f"q2 = {q2} [rad]", comments.replace("-3.14159265", "3.14159265"))

    def test_joints_with_a_reference_and_axes_apart(self):
        plant, comments = self.read(model(joint1='ref="30"', body2='<site name="tip" pos="0.2 0 -0.6"/>',
                                          links=("0 0.1 -0.4", "0 -0.2 -0.5")))
        self.assert_close(plant, length1=0.4, length2=math.hypot(0.2, 0.6), center1=0.2, center2=0.25)
        self.assertIn("site tip", self.toml)
        self.assertIn("the angle from the file's zero pose", comments)

    def test_welded_bodies(self):
        """Each link is a ball and another welded ball: centres and inertias by the parallel axes."""
        ball = '<geom type="sphere" size="0.02" mass="{m}"/>'
        welded = ('<body name="w{k}" pos="0 0 {z}"><geom type="sphere" size="0.02" mass="{m}"/>'
                  '<body name="v{k}" pos="0 0.3 0"><site name="s{k}"/></body></body>')
        text = model(body1=welded.format(k=1, z=-0.3, m=0.5), body2=welded.format(k=2, z=-0.2, m=0.25))
        text = re.sub(r'<geom name="rod1".*?/>', ball.format(m=0.3), text)
        text = re.sub(r'<geom name="rod2".*?/>', ball.format(m=0.15), text)
        plant, _ = self.read(text)
        own = 2 / 5 * 0.02 ** 2
        self.assert_close(plant, mass1=0.8, center1=0.3 * 0.5 / 0.8, length1=0.4, length2=0.2,
                          inertia1=0.8 * own + 0.3 * 0.5 / 0.8 * 0.3 ** 2,
                          mass2=0.4, center2=0.2 * 0.25 / 0.4,
                          inertia2=0.4 * own + 0.15 * 0.25 / 0.4 * 0.2 ** 2)
        self.assertIn("one, w1, v1", self.toml)

    def test_motors(self):
        for actuator, limit, joint, direction in (
                ('<motor joint="a" gear="-4" ctrlrange="-0.5 0.5"/>', 2, 1, "negative"),
                ('<motor joint="b" gear="4" ctrlrange="-3 3" forcerange="-2 2"/>', 8, 2, "positive"),
                ('<general joint="a" gainprm="5" gear="2" ctrlrange="-1 1"/>', 10, 1, "positive")):
            with self.subTest(actuator):
                plant, comments = self.read(model(actuators=actuator))
                self.assert_close(plant, torque_limit=limit, actuated_joint=joint)
                self.assertIn(f"a {direction} torque", comments)
        two = MOTOR + '<motor name="n" joint="a" ctrlrange="-2 2"/>'
        self.no_plant(model(actuators=two), "two motors", "--motor 1", "--motor 2")
        plant, comments = self.read(model(actuators=two), "--motor", "1")
        self.assert_close(plant, torque_limit=2, actuated_joint=1)
        self.assertIn("motor of b: --motor 1", comments)
        plant, _ = self.read(model(actuators=""), "--motor", "2", "--torque-limit", "1.5")
        self.assert_close(plant, torque_limit=1.5, actuated_joint=2)
        self.assert_close(self.read(model(joint2='actuatorfrcrange="-1 1"'))[0], torque_limit=1)
        self.assert_close(self.read(model(), "--torque-limit", "7")[0], torque_limit=7)

    def test_armatures(self):
        plant, _ = self.read(model(joint1='armature="0.01"', joint2='armature="0.01"'))
        self.assert_close(plant, armature=0.01, inertia1=capsule_inertia(0.7, 0.02, 0.4))
        self.assertNotIn("armature1", plant)
        for of_a, of_b in (0.03, 0.01), (0, 0.1), (0.1, 0):
            joints = {"joint1": f'armature="{of_a}"', "joint2": f'armature="{of_b}"'}
            plant, _ = self.read(model(**joints))
            self.assert_close(plant, armature1=of_a, armature=of_b, inertia1=capsule_inertia(0.7, 0.02, 0.4))

    def test_length_and_standard_output(self):
        self.assert_close(self.read(model(), "--length2", "0.3")[0], length2=0.3, center2=0.25)
        for out in ([], ["--out", "-"]):
            self.assertEqual(tomllib.loads(self.succeed("plant", "model.xml", *out, env=self.ENVIRONMENT))[
                "plant"]["length2"], 0.5)
        inertial = '<inertial pos="0 0 -0.11" mass="0.9" diaginertia="0.01 0.01 0.01"/>'
        text = re.sub(r'<geom name="rod2".*?/>', inertial, model())
        self.assert_close(self.read(text)[0], length2=0.11, center2=0.11, inertia2=0.01)
        remark = "length2 is 0.11 m, the distance to the centre of mass, because the link has neither sites nor shapes"
        self.assertIn(f"# {remark}; --length2 sets it\n", self.toml)
        self.assertNotIn(remark, self.read(text, "--length2", "0.4")[1])

    def test_robot_of_urdf(self):
        plant, comments = self.read(robot(), name="r.urdf")
        self.assert_close(plant, mass1=0.5, mass2=0.4, length1=0.3, center1=0.2, center2=0.15, inertia1=0.004,
                          inertia2=0.002, damping1=0.01, damping2=0.02, torque_limit=4, actuated_joint=2)
        self.assertIn("q1 = J1", comments)
        self.assertIn("length2 is 0.15 m, the distance to the centre of mass", comments)
        self.no_plant(robot(effort=0), "--torque-limit", name="r.urdf")
        self.no_plant(robot(drives="J1 J2"), "two motors", name="r.urdf")
        self.no_plant(robot(drives=""), "--motor", name="r.urdf")
        mesh = '<collision><geometry><mesh filename="none.stl"/></geometry></collision>'
        self.no_plant(robot(mesh=mesh), "mesh: ", "none.stl", "--drop contacts", name="r.urdf")
        self.assert_close(self.read(robot(mesh=mesh), "--drop", "contacts", name="r.urdf")[0], mass1=0.5)


class Unfit(PlantCommandTest):
    DROPPED = (
        ("stiffness", {"joint1": 'stiffness="3"'}, "a 3 N·m/rad"),
        ("limits", {"joint2": 'range="-90 90"'}, "b -1.571 to 1.571 rad"),
        ("frictionloss", {"joint1": 'frictionloss="0.2"'}, "a 0.2 N·m"),
        ("contacts", {"touch": "1",
                      "world": '<geom name="floor" type="plane" size="1 1 1" pos="0 0 -0.7"/>'}, "floor touches rod2"),
        ("equality", {"more": '<equality><joint joint1="a" joint2="b"/></equality>'}, "1 constraints"),
        ("tendons", {"more": '<tendon><fixed stiffness="2"><joint joint="a" coef="1"/></fixed></tendon>'}, "1"),
        ("fluid", {"option": 'viscosity="0.1" wind="1 0 0"'}, "viscosity 0.1 Pa·s, wind 1 0 0 m/s"),
        ("gravcomp", {"body1": '<body gravcomp="1"><geom size="0.01" mass="0.1" pos="0 0 -0.2"/></body>'}, "up to 1"),
        ("tilt", {"option": 'gravity="0 5 -9"'}, "29.05 degrees"),
        ("offset", {"body1": '<geom size="0.02" pos="0.1 0 -0.2" mass="0.1"/>'}, "0.0125 m off the line"))

    def test_is_refused_and_dropped_by_name(self):
        for name, change, value in self.DROPPED:
            with self.subTest(name):
                self.no_plant(model(**change), f"a plant file cannot hold {name} (", value, f"--drop {name}")
                plant, comments = self.read(model(**change), "--drop", name)
                self.assertIn(f"# Left out by --drop: {name}: ", comments)
                self.assertIn(value, comments)
                self.assertEqual(plant["mass2"], 0.9)
                (self.folder / "plant.toml").unlink()

    def test_several_at_once(self):
        text = model(joint1='stiffness="3"', joint2='range="-90 90" frictionloss="0.1"')
        self.no_plant(text, "stiffness (", "limits (", "frictionloss (",
                      "--drop stiffness --drop limits --drop frictionloss")
        self.no_plant(text, "frictionloss (", arguments=["--drop", "stiffness", "--drop", "limits"])

    def test_out_of_reach_or_switched_off(self):
        for change in ({"joint2": 'range="-1000 1000"'},
                       {"joint2": 'range="-90 90" frictionloss="0.1"', "option": '><flag constraint="disable"/></option><option '},
                       {"joint1": 'stiffness="1"', "option": '><flag spring="disable"/></option><option '}):
            self.read(model(**change))
        plant, _ = self.read(model(option='><flag damper="disable"/></option><option '))
        self.assert_close(plant, damping1=0, damping2=0)

    def test_tilted_plane(self):
        plant, _ = self.read(model(option='gravity="0 5 -9"'), "--drop", "tilt")
        self.assert_close(plant, gravity=9)

    def test_friction(self):
        text = model(joint1='frictionloss="0.2"', joint2='frictionloss="0.1"')
        plant, comments = self.read(text, "--convert-friction")
        self.assert_close(plant, coulomb1=0.4 / math.pi, coulomb2=0.2 / math.pi)
        self.assertIn("frictionloss c became c·2/π·atan(100 w)", comments)
        self.assertRegex(comments, r"moves the joints by \S+ rad \(median\)")

    def test_other_mechanisms(self):
        cart = model().replace('<body name="one">', '<body><joint name="rail" type="slide" axis="1 0 0"/>'
                               '<geom size="0.1"/><body name="one">').replace("</worldbody>", "</body></worldbody>")
        third = model(body2='<body pos="0 0 -0.5"><joint name="c"/><geom size="0.05"/></body>')
        for text, *words in (
                (cart, "expected two hinges", "slide joint (a cart) rail"),
                (third, "expected two hinges", "hinge c"),
                (model().replace('<joint name="a"', '<freejoint name="f"/><joint name="x"', 1), "MuJoCo: "),
                (model(world='<body><freejoint name="f"/><geom size="0.1"/></body>'), "free base f"),
                (model(actuators="").replace('<joint name="b" axis="0 1 0" damping="0.02" />', ""), "expected two hinges"),
                (model(axis2="1 0 0"), "expected parallel axes, got 90 degrees"),
                (model(option='gravity="0 0 0"'), "expected gravity, got none"),
                (model(links=("0 0.4 0", "0 0 -0.5")), "expected a distance between the axes"),
                (model(body1='<geom size="0.05" pos="0 0 0.5" mass="2"/>'), "behind joint 1"),
                (model(actuators='<position name="servo" joint="b" kp="9"/>'), "servo", "--drop actuators"),
                (model(actuators='<motor name="slow" joint="b" delay="0.1" nsample="9" ctrlrange="-1 1"/>'), "slow"),
                (model(actuators=""), "expected a motor, got none", "--motor 1 or 2"),
                (model(actuators='<motor joint="b"/>'), "expected a limited torque", "--torque-limit"),
                (model(actuators='<motor joint="b" ctrlrange="-1 2"/>'), "between -1 and 2 N·m"),
                (model(actuators=MOTOR + MOTOR.replace('"m"', '"n"')), "another one: n")):
            with self.subTest(words):
                self.no_plant(text, *words)

    def test_servos_can_be_left_out(self):
        text = model(actuators='<position name="servo" joint="b" kp="9"/>')
        plant, comments = self.read(text, "--drop", "actuators", "--motor", "2", "--torque-limit", "2")
        self.assert_close(plant, torque_limit=2)
        self.assertIn("actuators: servo", comments)

    def test_a_model_that_moves_otherwise(self):
        """Pins so thin that no examined pose lets them touch: the comparison finds them."""
        pins = model(world='<geom name="w" type="sphere" size="0.01" pos="0.28 0 -0.29" contype="1"/>',
                     body1='<geom name="p" type="sphere" size="0.004" pos="0 0 -0.403" mass="0" conaffinity="1"/>')
        self.no_plant(pins, "s differ from MuJoCo's by at most", "expected at most 1e-06", code=1)

    def test_numbers_out_of_range(self):
        self.no_plant(model(links=("0 0 -120", "0 0 -0.5")), "plant of model.xml", "length1", "120")


class Strangers(PlantCommandTest):
    def test_bad_files(self):
        deep = "<mujoco>" + "<worldbody>" * 200 + "</worldbody>" * 200 + "</mujoco>"
        for text, *words in (
                ("", "expected XML"), ("<mujoco>", "expected XML"), ("no XML", "expected XML"),
                ("<html/>", "expected MJCF (<mujoco>) or URDF (<robot>), got <html>"),
                ('<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', "expected no DOCTYPE"),
                (deep, "at most 100 deep"),
                ("<mujoco>" + " " * (1 << 20) + "</mujoco>", "at most 1048576 bytes"),
                ("<mujoco>" + "<a/>" * 6000 + "</mujoco>", "at most 5000 elements"),
                ("<mujoco><nonsense\x85/></mujoco>", "model.xml"),
                ("<mujoco/>", "expected two hinges"),
                ("<robot/>", "expected two hinges"),
                (model(world='<replicate count="1000000"><geom size="1"/></replicate>'), "<replicate>"),
                (model(more='<extension><plugin plugin="a"/></extension>'), "<extension>"),
                (model(more='<asset><hfield name="h" file="h.png"/></asset>'), "<hfield>"),
                (model(world='<geom file="/etc/passwd" size="1"/>'), "expected no file besides"),
                (model(more='<asset><mesh name="m" file="../m.stl"/></asset>'), "mesh: expected a file in", "../m.stl"),
                (model(more='<include file="/etc/passwd"/>'), "include: ", "--drop includes")):
            with self.subTest(words):
                self.no_plant(text, *words)
        (self.folder / "latin.xml").write_bytes(b"<mujoco>\xff</mujoco>")
        self.no_plant(None, "UTF-8", name="latin.xml")
        os.mkfifo(self.folder / "pipe.xml")
        self.no_plant(None, "regular file", name="pipe.xml")
        self.no_plant(None, "No such file", name="none.xml")
        self.no_plant(None, "directory", name=".")

    def test_includes_stay_in_their_folder(self):
        (self.folder / "parts").mkdir()
        self.write("parts/motor.xml", f"<mujoco><actuator>{MOTOR}</actuator></mujoco>")
        text = model(actuators="", more='<include file="parts/motor.xml"/>')
        self.assert_close(self.read(text)[0], torque_limit=3)
        (self.folder / "plant.toml").unlink()
        self.write("loop.xml", '<mujoco><include file="loop.xml"/></mujoco>')
        self.no_plant(None, "at most 20 included files", name="loop.xml")
        (self.folder / "parts/link.xml").symlink_to("/etc/hostname")
        self.no_plant(model(more='<include file="parts/link.xml"/>'), "include: expected a file in")
        plant, comments = self.read(model(more='<include file="a\nb.xml"/>'), "--drop", "includes")
        self.assertEqual(plant["mass1"], 0.7)
        self.assertIn("includes: a", comments)

    def test_no_plant_replaces_a_part_of_its_model(self):
        parts = {"motor.xml": f"<mujoco><actuator>{MOTOR}</actuator></mujoco>"}
        parts["model.xml"] = model(actuators="", more='<include file="motor.xml"/>')
        for name, text in parts.items():
            self.write(name, text)
        for name in ("motor.xml", "./motor.xml", "model.xml"):
            self.refuse(["plant", "model.xml", "--out", name, "--overwrite"], "--out: expected another file than ", "be lost",
                        env=self.ENVIRONMENT)
        for name, text in parts.items():
            self.assertEqual((self.folder / name).read_text(encoding="utf-8"), text)

    def test_a_mesh_in_the_folder(self):
        """A box as OBJ gives the inertia of a box."""
        corners = [(x, y, z) for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in (-0.5, 0)]
        faces = ("1 2 4", "1 4 3", "5 7 8", "5 8 6", "1 5 6", "1 6 2", "3 4 8", "3 8 7", "1 3 7", "1 7 5", "2 6 8", "2 8 4")
        (self.folder / "meshes").mkdir()
        self.write("meshes/box.obj", "".join(f"v {x} {y} {z}\n" for x, y, z in corners)
                   + "".join(f"f {face}\n" for face in faces))
        text = model(more='<compiler meshdir="meshes"/><asset><mesh file="box.obj"/></asset>')
        text = re.sub(r'<geom name="rod2".*?/>', '<geom type="mesh" mesh="box" mass="0.9"/>', text)
        plant, _ = self.read(text)
        self.assertAlmostEqual(plant["inertia2"], 0.9 * (0.5 ** 2 + 0.04 ** 2) / 12, delta=1e-6)
        self.assertAlmostEqual(plant["center2"], 0.25, delta=1e-6)

    def test_names_are_shown_on_one_line(self):
        name = "e&#10;gravity = 3&#133;" + "x" * 200
        plant, comments = self.read(model(actuators=MOTOR.replace('"b"', f'"{name}"')).replace(
            '<joint name="b"', f'<joint name="{name}"'))
        self.assertEqual(plant["gravity"], 9.81)
        self.assertIn("e?gravity = 3?xxx", comments)

    def test_a_link_as_output_is_replaced(self):
        self.write("target", "kept")
        (self.folder / "plant.toml").symlink_to("target")
        self.read(model())
        self.assertEqual((self.folder / "target").read_text(), "kept")
        self.assertFalse((self.folder / "plant.toml").is_symlink())

    def test_arguments(self):
        self.write("model.xml", model())
        for arguments, *words in (
                (["--out", "x.toml"], "expected FILE.xml|FILE.urdf"),
                (["model.xml", "--out", "no/x.toml"], "--out no/x.toml", "No such file"),
                (["model.xml", "--out", "x.toml", "--drop", "spring"], "--drop: expected one of stiffness", '"spring"'),
                (["model.xml", "--out", "x.toml", "--drop", "frictionloss", "--convert-friction"],
                 "--convert-friction: expected no --drop frictionloss with it"),
                (["model.xml", "--out", "x.toml", "--motor", "3"], '--motor: expected 1 or 2, got "3"'),
                (["model.xml", "--out", "x.toml", "--motor", "j1"], '--motor: expected 1 or 2, got "j1"'),
                (["model.xml", "--out", "x.toml", "--length2", "0"], "--length2")):
            with self.subTest(arguments):
                self.refuse(["plant", *arguments], *words, env=self.ENVIRONMENT)
        self.refuse(["plant", "model.xml", "--out", "x.toml"], "No module named", "mujoco-core==4.0.0", code=1,
                    env=os.environ | {"UPSWING_PYTHON": self.without_packages()})
        self.refuse(["plant", "model.xml", "--out", "x.toml"], "Python read nothing", code=1,
                    env=os.environ | {"UPSWING_PYTHON": "true"})

    def without_packages(self):
        """A Python that lacks packages."""
        self.write("python", '#!/bin/sh\nexec python3 -S -E "$@"\n')
        (self.folder / "python").chmod(0o755)
        return str(self.folder / "python")


if __name__ == "__main__":
    unittest.main()
