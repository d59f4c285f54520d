#!/usr/bin/env python3
"""Tests of upswing.machine: a controller for a loop of the caller's, on fake machines."""

import csv
import math
import os
import subprocess
import sys
import tempfile
import unittest
import warnings
from pathlib import Path

import numpy as np

import upswing
from testing import BadInputTest

ROOT = Path(os.environ["UPSWING_ROOT"])
sys.path.insert(0, str(ROOT / "examples/python"))
from cloudpendulum import FakeControlLoop, drive  # noqa: E402  pylint: disable=wrong-import-position

SMALL = "cloudpendulum"
# mpc plans with the dry friction of the small machine instead of compensating it.
SMALL_MPC = {"twin": SMALL, "max_angle": 50, "mpc_seconds": 0.34,
             "made_for": {"coulomb1": 0.0021, "coulomb2": 0.0025, "torque_limit": 0.08}}


def quiet(*arguments, **settings):
    """A controller, without its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return upswing.machine.Controller(*arguments, **settings)


def steady_twin(folder):
    """A twin like a robot of RealAIGym, whose loop has no late cycles."""
    text = (ROOT / "extras/machine/testdata/twin.toml").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith(("jitter", "late"))]
    path = folder / "steady.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


class Rig:
    """A fake machine in a loop with a controller."""

    def __init__(self, controller, twin=SMALL):
        self.controller, self.machine, self.time = controller, upswing.machine.FakeMachine(twin), 0.0

    def cycle(self, seconds=0.002, changed=lambda q: q):
        self.time += seconds
        self.machine.advance(self.time)
        torques = self.controller(self.time, changed(self.machine.read()))
        self.machine.send(torques)
        return torques

    def run(self, seconds, **more):
        torques = [0.0, 0.0]
        for _ in range(round(seconds / 0.002)):
            torques = self.cycle(**more)
        return torques

    def until(self, state):
        for _ in range(2000):
            if self.controller.state == state:
                return
            self.cycle()
        raise AssertionError(f"{self.controller!r} is not {state}")


class Controllers(BadInputTest):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)

    def test_torques_are_those_of_run_for_the_same_readings(self):
        twin, log = steady_twin(self.folder), self.folder / "log.csv"
        for policy, joint in (("tvlqr", 1), ("sac", 1), ("tvlqr", 2)):
            with self.subTest(policy=policy, joint=joint):
                log.unlink(missing_ok=True)
                robot = {1: "pendubot", 2: "acrobot"}[joint]
                subprocess.run([os.environ["UPSWING"], "run", policy, "--link", twin, "--robot", robot,
                                "--compensation", "0.9", "--seconds", "3", "--log", log],
                               check=False, capture_output=True)
                with log.open(encoding="utf-8") as file:
                    rows = [{name: float(text) for name, text in row.items()}
                            for row in csv.DictReader(file)]
                controller = quiet(policy, twin=twin, actuated_joint=joint, compensation=0.9,
                                   passive_torque=0.5, latency=None)
                largest = 0.0
                for row in rows:
                    if row["state"] == 3:  # run brakes at the end of its time
                        break
                    torques = controller(row["time"], [row["pos_meas1"], row["pos_meas2"]])
                    # Rounding errors of 10^-16 s in the times grow: a swing-up is chaotic.
                    np.testing.assert_allclose(torques, [row["tau_con1"], row["tau_con2"]], rtol=0,
                                               atol=1e-4, err_msg=f"at {row['time']} s")
                    largest = max(largest, abs(torques[joint - 1]))
                self.assertGreater(largest, 1)
                self.assertGreater(controller.driven, 1)

    def test_the_examples_loop_swings_up_and_holds(self):
        """In cycles of 2 ms with single gaps of up to 70 ms, without torque at the other joint."""
        policy = upswing.train("sac-fast", plant=SMALL, progress=False).best
        for seed in range(3):
            with self.subTest(seed=seed):
                controller = quiet(policy, twin=SMALL, max_angle=50, max_velocity=50)
                loop = FakeControlLoop(SMALL, experiment_time=6, seed=seed)
                self.assertEqual(drive(loop, controller), ("", ""))
                self.assertIsNone(controller.stopped, controller)
                self.assertGreater(controller.upright, 2)
                q1, q2, _, _ = loop.machine.state
                self.assertLess(max(math.cos(q1), math.cos(q1 + q2)), -math.cos(math.radians(30)))
                torques = np.array(loop.torques)
                self.assertFalse(np.any(torques[:, 1]))
                self.assertGreater(np.abs(torques[:, 0]).max(), 0.1)
                self.assertLessEqual(np.abs(torques[:, 0]).max(), 0.15)

    def test_the_example_fails_if_the_links_do_not_end_upright(self):
        example = ROOT / "examples/python/cloudpendulum.py"
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, "-B", example, "tvlqr", "--seconds", "0.5"], check=False,
                                  stdout=subprocess.PIPE, encoding="utf-8", cwd=folder)
        self.assertIn("0.00 s upright at the end", done.stdout)
        self.assertEqual(done.returncode, 1)

    def test_the_motor_may_be_at_joint_2(self):
        controller = quiet("mpc", **SMALL_MPC, actuated_joint=2)
        loop = FakeControlLoop(SMALL, experiment_time=3, seed=1)
        driving = []

        def noted(*reading):
            torques = controller(*reading)
            if controller.state == "running":
                driving.append(torques[1])
            return torques

        drive(loop, noted)
        torques = np.array(loop.torques)
        self.assertFalse(np.any(torques[:, 0]))
        # A pulse may need the machine's whole torque to move the links. mpc has its own limit.
        self.assertLessEqual(np.abs(torques[:, 1]).max(), 0.1501)
        self.assertGreater(np.abs(driving).max(), 0.05)
        self.assertLessEqual(np.abs(driving).max(), 0.0801)
        self.assertGreater(controller.driven, 0.01)

    def test_single_gaps_are_bridged_and_long_ones_are_faults(self):
        rig = Rig(quiet("mpc", **SMALL_MPC))
        rig.until("running")
        for _ in range(5):
            rig.cycle(0.07)
            rig.run(0.1)
        self.assertIsNone(rig.controller.stopped)
        self.assertEqual(rig.cycle(0.11), [0, 0])
        self.assertEqual(rig.controller.state, "fault")
        self.assertRegex(rig.controller.stopped, "last reading is 0.11 s old, beyond the limit 0.1 s")
        self.assertEqual(rig.run(0.1), [0, 0])

    def test_the_supervisor_stops_and_says_why(self):
        for what, state, changed in (
                ("joint 2: the angle jumps", "fault", lambda q: [q[0], q[1] + 1]),
                ("joint 2: the angle jumps", "fault", lambda q: [q[0], 0.01]),
                ("angle: .* beyond the limit", "braking", lambda q: q)):
            with self.subTest(what):
                settings = SMALL_MPC | ({"max_angle": 0.5} if state == "braking" else {})
                rig = Rig(quiet("mpc", **settings))
                rig.until("running")
                rig.run(0.3 if state == "fault" else 0)
                self.assertIsNone(rig.controller.stopped)
                for _ in range(1000):
                    torques = rig.cycle(changed=changed)
                    if rig.controller.stopped:
                        break
                self.assertEqual(rig.controller.state, state)
                self.assertRegex(rig.controller.stopped, what)
                self.assertIn(rig.controller.stopped, repr(rig.controller))
                if state == "fault":
                    self.assertEqual(torques, [0, 0])
                rig.run(7)
                self.assertEqual(rig.controller.state, "fault")
                self.assertEqual(rig.run(0.1), [0, 0])

    def test_a_pulse_asks_the_encoders_first(self):
        rig = Rig(quiet("mpc", **SMALL_MPC))
        rig.until("probing")
        rig.run(0.2, changed=lambda q: [0.041, -0.032])  # dead encoders
        self.assertEqual(rig.controller.state, "fault")
        self.assertRegex(rig.controller.stopped, r"joint 2 moves by \S+ rad under the first torques")

    def test_a_stop_brakes_until_the_links_hang(self):
        rig = Rig(quiet("mpc", **SMALL_MPC))
        rig.until("running")
        rig.run(0.3)  # into the swing
        rig.controller.stop()
        rig.cycle()
        self.assertEqual(rig.controller.state, "braking")
        self.assertEqual(rig.controller.stopped, "the caller asked for a stop")
        self.assertEqual(rig.run(6), [0, 0])
        self.assertEqual(rig.controller.state, "idle")
        self.assertLess(max(map(abs, rig.machine.state[2:])), 1)

    def test_wrong_readings_are_refused_and_stop_it(self):
        nan, good = float("nan"), [0.04, -0.03]
        for what, arguments in (
                ("t: expected 0.02 s or later, got 0.01", (0.01, good)),
                ("t: expected a finite time", (nan, good)),
                ("q: expected two finite angles in rad, got nan", (1, [nan, 0])),
                ("q: expected two finite angles in rad", (1, [0, math.inf])),
                ("q: expected two numbers, one of each joint", (1, [0, 0, 0])),
                ("q: expected two numbers, one of each joint", (1, 0.3)),
                ("q: expected two numbers, one of each joint", (1, ["a", "b"])),
                ("w: expected two finite velocities in rad/s", (1, good, [nan, 0])),
                ("w: expected two numbers, one of each joint", (1, good, [0]))):
            with self.subTest(what):
                controller = quiet("mpc", **SMALL_MPC)
                for k in range(1, 11):
                    self.assertEqual(controller(0.002 * k, good, [0, 0]), [0, 0])
                self.refuse(what, controller, *arguments)
                self.assertEqual(controller.state, "fault")
                self.assertIn(what, controller.stopped)
                self.assertEqual(controller(2, good), [0, 0])

    def test_wrong_arguments_are_refused(self):
        for what, policy, settings in (
                ("nothing.toml", "mpc", {"twin": "nothing.toml"}),
                ("no such file", "nothing", {}),
                ("actuated_joint: expected 1 or 2, got 3", "mpc", {"actuated_joint": 3}),
                ("actuated_joint: expected 1, the joint of the motor of sac", "sac", {"actuated_joint": 2}),
                ("max_velocity: expected a number in [0.1, 1000] rad/s, got", "mpc", {"max_velocity": 0}),
                ("compensation: expected a number in [0, 1], got", "mpc", {"compensation": 2}),
                ("latency: expected 0 to 0.1 s or None, got 1", "mpc", {"latency": 1}),
                ("start: expected hanging", "mpc", {"start": "lying"}),
                ("start: expected hanging", "mpc", {"start": [1, 2]}),
                ("control_period: expected 0.001 to 1 s", "mpc", {"control_period": -1}),
                ("control_period: expected 0.001 to 1 s", "mpc", {"control_period": 2}),
                ("mpc_second", "mpc", {"mpc_second": 1}),
                ("expected a controller", "sac", {"mpc_seconds": 1}),
                ("policy: expected a Policy, a path or a controller's name", 3, {}),
                ("twin: expected a path", "mpc", {"twin": 3})):
            with self.subTest(what):
                self.refuse(what, quiet, policy, **{"twin": SMALL} | settings)
        policy = upswing.load_policy("lqr")
        self.refuse("mpc_seconds: expected a controller's name with it", quiet, policy, twin=SMALL,
                    mpc_seconds=1)

    def test_a_policy_for_another_size_is_carried_over_with_a_warning(self):
        with self.assertWarnsRegex(UserWarning, r"sac: carried over to a machine of another size: "
                                                r"times × 0\.3\d+, torques × 0\.01\d+"):
            controller = upswing.machine.Controller("sac", twin=SMALL)
        self.assertLess(controller.control_period, 0.01)
        loaded = quiet(upswing.load_policy("sac"), twin=SMALL)
        self.assertEqual(loaded.control_period, controller.control_period)
        with self.assertWarnsRegex(UserWarning, "made for another plant: inertia"):
            upswing.machine.Controller("sac", twin=steady_twin(self.folder))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            upswing.machine.Controller("lqr", twin=SMALL)

    def test_the_fake_machine_is_the_twin_or_a_draw_of_it(self):
        def fall(**more):
            machine = upswing.machine.FakeMachine(SMALL, start=[2, 0, 0, 0], **more)
            machine.advance(0.3)
            return machine.state

        self.assertEqual(fall(), fall())
        self.assertEqual(fall(draw=1), fall(draw=1))
        self.assertEqual(len({fall(), fall(draw=1), fall(draw=2)}), 3)
        machine = upswing.machine.FakeMachine(SMALL)
        np.testing.assert_allclose(machine.read(), [0.0411, -0.0324], atol=1e-4)  # the encoders' zeros
        machine.advance(1)
        self.refuse("t: expected 1 s or later, got 0.5", machine.advance, 0.5)
        self.refuse("torques: expected finite numbers, got nan", machine.send, [math.nan, 0])
        self.refuse("torques: expected two numbers", machine.send, 1)
        self.refuse("draw: expected 0 or more", upswing.machine.FakeMachine, SMALL, draw=-1)
        self.refuse("draw: expected a twin with [covariance]", upswing.machine.FakeMachine, "realaigym",
                    draw=1)


class Archives(BadInputTest):
    """Logs in archives of NumPy."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        self.t = np.arange(5) / 100
        self.q = np.column_stack([np.sin(self.t), 1 / (3 + self.t)])

    def convert(self, arrays, **settings):
        np.savez_compressed(self.folder / "log.npz", **arrays)
        return upswing.machine.csv_of_npz(self.folder / "log.npz", self.folder / "csv", **settings)

    def test_logs_become_files_with_the_same_numbers(self):
        u = np.linspace(-1, 1, 5)
        files = self.convert({"a_t": self.t, "a_q": self.q, "a_dq": 2 * self.q, "a_u": u, "note": "text", "delta_t": self.t,
                              "b_t": self.t, "b_q": self.q}, torque_joint=2)
        self.assertEqual([file.name for file in files], ["a.csv", "b.csv"])
        with files[0].open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([float(row["pos_meas2"]) for row in rows], list(self.q[:, 1]))
        self.assertEqual([float(row["vel_meas1"]) for row in rows], list(2 * self.q[:, 0]))
        self.assertEqual([float(row["tau_con2"]) for row in rows], list(u))
        self.assertEqual({row["tau_con1"] for row in rows}, {"0"})
        self.refuse("a.csv: expected a new file", self.convert, {"a_t": self.t, "a_q": self.q})

    def test_wrong_archives_are_refused(self):
        good = {"t": self.t, "q": self.q}
        for what, arrays in (
                ("expected arrays t and q, got q", {"q": self.q}),
                ("expected arrays t and q, got t", {"t": self.t}),
                ("q: expected the shape (5, 2), got (2, 5)", good | {"q": self.q.T}),
                ("dq: expected finite numbers", good | {"dq": np.full((5, 2), np.nan)}),
                ("u: expected torque_joint=1 or 2", good | {"u": self.t}),
                ("t: expected finite numbers, got others", good | {"t": np.array(list("abcde"))}),
                ("expected the name of a log, got '../x'", {"../x_t": self.t, "../x_q": self.q})):
            with self.subTest(what):
                self.refuse(what, self.convert, arrays)
        self.refuse("torque_joint: expected 1, 2 or None, got 3", self.convert, good, torque_joint=3)
        (self.folder / "text.npz").write_text("no archive", encoding="utf-8")
        (self.folder / "empty.npz").touch()
        for name in ("text.npz", "empty.npz", "missing.npz"):
            self.refuse("expected an archive of NumPy", upswing.machine.csv_of_npz, self.folder / name,
                        self.folder)
        self.assertFalse((self.folder / "csv").exists())


if __name__ == "__main__":
    unittest.main()
