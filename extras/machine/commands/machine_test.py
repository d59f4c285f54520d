#!/usr/bin/env python3
"""Tests of `upswing machine`: check, identify, adapt and validate."""

import functools
import gzip
import json
import math
import os
import sys
import tomllib
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "src/cli"))
from testing import ROOT, ProgramTest  # noqa: E402

REAL = Path(os.environ.get("UPSWING_REAL", ROOT / "../shared/real"))
NAMES = ["time", "pos_meas1", "pos_meas2", "vel_meas1", "vel_meas2", "tau_con1", "tau_con2",
         "tau_meas1", "tau_meas2"]


def acceleration(q1, q2, w1, w2, torque1, torque2):
    """Accelerations of a double pendulum, rad/s². Symbols as in src/pendulum/equations.h."""
    J1, J2, b, G1, G2, d = 0.12, 0.05, 0.04, 3.0, 1.5, 0.02
    c2, s2 = math.cos(q2), math.sin(q2)
    m11, m12, m22 = J1 + J2 + 2 * b * c2, J2 + b * c2, J2
    gravity2 = G2 * math.sin(q1 + q2)
    r1 = torque1 + b * s2 * w2 * (2 * w1 + w2) - G1 * math.sin(q1) - gravity2 - d * w1
    r2 = torque2 - b * s2 * w1 * w1 - gravity2 - d * w2
    det = m11 * m22 - m12 * m12
    return (m22 * r1 - m12 * r2) / det, (m11 * r2 - m12 * r1) / det


@functools.cache
def rows():
    """A log of 4 s at 500 Hz without faults, as rows of numbers: a swing with torques at both joints."""
    def command(t):
        return math.sin(11 * t) + math.sin(2 * t * t), math.cos(13 * t + t * t)

    h, steps = 0.002, 4
    q1, q2, w1, w2 = 1.2, 0.8, 0.0, 0.0
    table = []
    for k in range(2000):
        t = h * k
        before = [0.95 * torque for torque in command(max(0, t - 0.004))]
        noise = 0.01 * (-1) ** k
        table.append([t, q1, q2, w1 + noise, w2 + noise, *command(t), *before])
        for _ in range(steps):  # the symplectic method of Euler
            a1, a2 = acceleration(q1, q2, w1, w2, *before)
            w1, w2 = w1 + h / steps * a1, w2 + h / steps * a2
            q1, q2 = q1 + h / steps * w1, q2 + h / steps * w2
    return table


def log(change=lambda k, row: row, names=NAMES):
    """The text of a log in which `change` made each row from row number k."""
    lines = [",".join(names)]
    lines += [",".join(map(str, change(k, row))) for k, row in enumerate(rows(), 1)]
    return "\n".join(lines) + "\n"


def scaled(**factors):
    """A change that multiplies columns by factors."""
    return lambda k, row: [x * factors.get(name, 1) for name, x in zip(NAMES, row)]


class Machine(ProgramTest):
    def faults(self, text, *more):
        """Checks a log, and returns its faults as {aspect and joint: text}."""
        done = self.run_here("machine", "check", self.write("log.csv", text), "--json", *more)
        self.assertEqual(done.stderr, "")
        found = json.loads(done.stdout)["logs"][0]
        faults = {f"{f['aspect']} {f.get('joint', '')}".strip(): f["text"]
                  for f in found["findings"] if f["severity"] == "fault"}
        self.assertEqual(done.returncode, 1 if faults else 0)
        self.assertEqual(found["faulty"], bool(faults))
        # check_test.cc tests the hypotheses about the motion.
        return {what: text for what, text in faults.items() if "of a pendulum" not in text}

    def unexplained(self, *arguments):
        """Runs a command on logs that no pendulum explains, and returns its output."""
        done = self.run_here(*arguments)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("the model does not explain ", done.stdout)
        return done.stdout

    def test_a_good_log(self):
        self.assertEqual(self.faults(log()), {})
        text = self.succeed("machine", "check", "log.csv")
        self.assertIn("log.csv: 2000 rows, 4.00 s\n", text)
        self.assertIn("  note     clock       500 Hz, cycles of 2 ms", text)
        self.assertIn("  note     torque 1    measured follows commanded after 2 rows and a lag of 0 "
                      "ms, gain 0.95, correlation 1.000\n", text)
        with gzip.open(self.folder / "log.csv.gz", "wb") as file:
            file.write((self.folder / "log.csv").read_bytes())
        self.assertEqual(self.succeed("machine", "check", "log.csv.gz"),
                         text.replace("log.csv:", "log.csv.gz:"))
        both = json.loads(self.succeed("machine", "check", "log.csv", "log.csv.gz", "--json"))
        self.assertEqual([found["name"] for found in both["logs"]], ["log.csv", "log.csv.gz"])
        self.assertEqual(both["logs"][0]["columns"]["angle1"],
                         {"name": "pos_meas1", "unit": "rad", "factor": 1})

    def test_faults(self):
        degrees = 180 / math.pi

        def late(k, row):
            return [row[0] + (1 if k > 500 else 0)] + row[1:]

        def swapped(k, row):
            return row[:3] + [row[4], row[3]] + row[5:]

        def stuck(k, row):
            return row[:2] + [0.8 * math.sin(5 * 1.8)] + row[3:] if 900 <= k < 950 else row

        for change, expected in (
                (late, {"clock": "a gap of 1.002 s"}),
                (swapped, {"velocity 1": "follows the angle of joint 2: suspect swapped columns",
                           "velocity 2": "follows the angle of joint 1: suspect swapped columns"}),
                (stuck, {"angle 2": "the encoder sticks at 0.3297 rad while the joint moves"}),
                (scaled(vel_meas2=degrees),
                 {"velocity 2": "57.3 times the change of the angle: suspect velocities in deg/s (key unit)"}),
                (scaled(vel_meas2=-1),
                 {"velocity 2": "-1 times the change of the angle: opposite sign"}),
                (scaled(tau_meas1=1000),
                 {"torque 1": "measured 950 times commanded: suspect measured torque in mN·m"})):
            self.assertEqual(self.faults(log(change)), expected)
        self.write("log.csv", log(scaled(pos_meas1=degrees, vel_meas1=degrees)))
        done = self.run_here("machine", "check", "log.csv")
        self.assertEqual(done.returncode, 1)
        self.assertIn("  fault    angle 1     suspect degrees (key unit): with it the equations of a pendulum "
                      "leave ", done.stdout)

    def test_one_bad_file_does_not_hide_the_others(self):
        self.write("good.csv", log())
        self.write("bad.csv", "time,pos_meas1,pos_meas2\n0,1,x\n")
        done = self.run_here("machine", "check", "bad.csv", "good.csv", "none.csv")
        self.assertEqual(done.returncode, 2)
        self.assertIn("good.csv: 2000 rows", done.stdout)
        self.assertEqual(len(done.stderr.splitlines()), 2, done.stderr)

    def test_own_columns(self):
        self.write("columns.toml", """
            time = {column = "t", unit = "ms"}
            angle1 = {column = "a", unit = "deg", hanging = 180, wrap = 360}
            angle2 = {column = "b", unit = "deg", hanging = 180}
            absolute = true
            piece = "part"
        """)

        def own(k, row):
            a = 180 + math.degrees(row[1])
            return [k // 1001, 1000 * row[0], a % 360, a + math.degrees(row[2])]

        text = log(own, ["part", "t", "a", "b"])
        driven = {"torque": "the log has no torque, but no free pendulum moves like this: suspect missing "
                            "columns (keys commanded1, commanded2) or a hand"}
        self.write("log.csv", text)
        done = self.run_here("machine", "check", "log.csv", "--columns", "columns.toml", "--json")
        found = json.loads(done.stdout)["logs"][0]["findings"]
        self.assertEqual({f["aspect"]: f["text"] for f in found if f["severity"] == "fault"}, driven)
        shown = self.run_here("machine", "check", "log.csv", "--columns", "columns.toml").stdout
        self.assertIn("log.csv: 2000 rows, 4.00 s in 2 pieces\n  units    t [ms]; a, b [deg]\n", shown)
        # The same file with other columns, and the columns of RealAIGym.
        self.refuse(["machine", "check", "log.csv"], "log.csv", "--columns", "pos_meas1")
        self.write("other.toml", "time = 't'\nangle1 = 'a'\nangle2 = 'c'\n")
        self.refuse(["machine", "check", "log.csv", "--columns", "other.toml"], "log.csv:1", '"c"')
        self.write("wrong.toml", "time = 't'\nangel1 = 'a'\n")
        self.refuse(["machine", "check", "log.csv", "--columns", "wrong.toml"], "wrong.toml:2",
                    "did you mean angle1?")

    def test_a_rollout_is_a_log(self):
        for joint in (1, 2):
            start = ["--start", "1,0.5,0,0", "--seconds", 10, "--actuated-joint", joint]
            torques = [f"{2 * math.sin(0.05 * k) + math.sin(0.002 * k * k):.6g}" for k in range(500)]
            self.write("torques.csv", "torque\n" + "\n".join(torques) + "\n")
            out = self.succeed("simulate", "--torque", "torques.csv", *start, "--csv", "rollout.csv")
            self.assertIn("rollout.csv: 501 rows", out)
            shown = self.succeed("machine", "check", "rollout.csv")
            self.assertIn("  units    t [s]; q1, q2 [rad]; w1, w2 [rad/s]; torque1, torque2 [N·m]\n", shown)
            self.assertNotIn("fault", shown)
        self.write("names.toml", "time = 't'\nangle1 = 'q1'\nangle2 = 'q2'\ncommanded1 = 'i_A'\n")
        self.refuse(["machine", "check", "rollout.csv", "--columns", "names.toml"], "names.toml:4: commanded1",
                    "Nm, N·m, mNm, mN·m", "factor", '"A"')

    def test_figure(self):
        self.write("log.csv", log(scaled(vel_meas2=-1)))
        done = self.run_here("machine", "check", "log.csv", "--figure", "log.svg")
        self.assertEqual((done.returncode, done.stderr), (1, ""))
        self.assertIn("written log.svg\n", done.stdout)
        figure = (self.folder / "log.svg").read_text(encoding="utf-8")
        for text in ("angles", "velocities", "torques", "cycles", "opposite sign"):
            self.assertIn(text, figure)

    def test_bad_input(self):
        def with_cell(number, column, cell):
            return log(lambda k, row: row[:column] + [cell] + row[column + 1:] if k == number else row)

        refuse = self.refuse
        good = self.write("log.csv", log())
        for text, *words in (
                (with_cell(7, 1, "nan"), "bad.csv:8: pos_meas1", "finite number", '"nan"'),
                (with_cell(7, 1, ""), "bad.csv:8: pos_meas1", "finite number", '""'),
                (with_cell(7, 6, "inf"), "bad.csv:8: tau_con2", '"inf"'),
                (with_cell(7, 6, "x"), "bad.csv:8: tau_con2", '"x"'),
                (with_cell(7, 6, "1,2"), "bad.csv:8", "expected 9 columns, got 10"),
                (with_cell(7, 0, "0.001"), "bad.csv: row 7: time", "at least 0.01 s", "0.001 s"),
                (with_cell(7, 2, "1e30"), "bad.csv: row 7: pos_meas2", "1e+30"),
                (log(names=["t", *NAMES[1:]]), "bad.csv", "time"),
                (log(names=[*NAMES[:2], "pos", *NAMES[3:]]), "bad.csv:1", '"pos_meas2"'),
                (",".join(NAMES) + "\n", "bad.csv", "at least 2 rows, got 0"),
                ("", "bad.csv")):
            refuse(["machine", "check", self.write("bad.csv", text)], *words)
        (self.folder / "cut.csv.gz").write_bytes(gzip.compress(log().encode())[:5000])
        refuse(["machine", "check", "cut.csv.gz"], "cut.csv.gz", "only its beginning")
        bomb = gzip.compress(b"time,pos1,pos2\n" + b"0,0,0\n" * 12_000_000)
        (self.folder / "bomb.csv.gz").write_bytes(bomb)
        self.assertLess(len(bomb), 1_000_000)
        refuse(["machine", "check", "bomb.csv.gz"], "bomb.csv.gz", "bytes after decompression")
        refuse(["machine", "check", "none.csv"], "none.csv", "No such file")
        refuse(["machine", "check", "."], "folder")
        refuse(["machine", "check"], "machine check: expected LOG", "got none")
        refuse(["machine", "polish", good], "one of check, identify, learn, adapt, validate", '"polish"')
        refuse(["machine"], "machine: expected a command", "got none")
        refuse(["machine", "check", good, good, "--figure", "log.svg"], "--figure", "got 2")
        refuse(["machine", "check", good, "--figure", "log.txt"], "log.txt")
        refuse(["machine", "check", good, "--figure", "no/log.svg"], "--figure", "no")

    def test_bad_arguments_of_identify_and_validate(self):
        self.write("plant.toml", "[plant]\nmass1 = 0.5\n")
        good = self.write("log.csv", log())
        self.write("old.toml", "[plant]\n")
        identify = ["machine", "identify", good, "--plant", "plant.toml"]
        out = ["--out", "twin.toml"]
        for arguments, *words in (
                (["machine", "check", good, *out], "unknown flag --out", "machine identify has it"),
                (["machine", "check", good, "--against", "plant.toml"], "unknown flag --against",
                 "identify has it"),
                (["machine", "validate", "plant.toml", good, "--seconds", "1"], "flag --seconds"),
                (["machine", "check", good, "--csv", "x.csv"], "machine validate has it"),
                (["machine", "validate", good, "plant.toml"], "the twin's file before the logs"),
                (["machine", "validate", "plant.toml"], "machine validate: expected LOG"),
                (["machine", "validate", "plant.toml", good, "--against", "plant.toml",
                  "--against", "plant.toml"], "--against", "more than once"),
                (identify, "machine identify: expected --out FILE (TOML file of the twin"),
                (["machine", "identify", good, *out], "expected --plant FILE|NAME (plant file with masses", "realaigym-c1"),
                (["machine", "adapt", "plant.toml", good], "machine adapt: expected --out FILE"),
                (["machine", "adapt", "plant.toml", good, *out, "--folds", "2"], "flag --folds"),
                ([*identify, "--out", "no/twin.toml"], "--out no/twin.toml"),
                ([*identify, "--out", "old.toml"], "--out old.toml: expected a new file, got one that exists; "
                 "--overwrite replaces it"),
                (["machine", "adapt", "plant.toml", good, "--out", "old.toml"], "--overwrite replaces it"),
                ([*identify, "--out", "old.toml", "--overwrite"], "--folds: expected two logs or more"),
                ([*identify, *out, "--folds", "1"], "--folds: expected 0, or 2 or more, got 1"),
                ([*identify, *out], "--folds: expected two logs or more", "got 1")):
            self.refuse(arguments, *words)
        for text, *words in (
                ("", "expected a table [plant]"),
                ("[plant]\n[sessions.day]\nzero = 1\n", "twin.toml:3", "did you mean zero1?"),
                ("[plant]\n[covariance]\nlag = 1\n", "twin.toml:3: lag", "list of 1"),
                ("[plant]\n[covariance]\nlag = [-1]\n", "twin.toml", "0 or more")):
            self.refuse(["machine", "validate", self.write("twin.toml", text), good], *words)
        (self.folder / "twin.toml").unlink()
        # Angles that no model follows, and a clock with gaps of days.
        # check finds a fault of the second one: exit code 1.
        for name, row, code in (
                ("huge.csv", lambda k, r: [r[0], 1e11 * (-1) ** k, 9e11, *r[3:]], 2),
                ("slow.csv", lambda k, r: [1e6 * k, *r[1:]], 1)):
            done = self.run_here(*identify[:2], self.write(name, log(row)), *identify[3:], *out,
                                 "--folds", "0")
            self.assertEqual((done.returncode, done.stdout), (code, ""))
            self.assertIn("upswing: expected logs", done.stderr.splitlines()[-1])
        self.assertFalse((self.folder / "twin.toml").exists())

    def test_a_twin_that_is_no_machine_warns(self):
        self.write("plant.toml", "[plant]\nmass1 = 0.5\ncenter1 = 3\nlength1 = 1\n")
        self.write("log.csv", log())
        done = self.run_here("machine", "adapt", "plant.toml", "log.csv", "--out", "today.toml")
        self.assertEqual(done.returncode, 1)
        self.assertIn("\nwritten today.toml\n", done.stdout)
        # The sines of these logs are not the motion of any pendulum.
        self.assertIn("; the model does not explain the logs of the fit: ", done.stdout)
        reason = done.stderr.splitlines()[-1].removeprefix("upswing: today.toml: not to be trusted: ")
        self.assertRegex(reason, "\\Athe model does not explain .*; center1 is .*, beyond its link of 1 m")
        # Every command with this twin repeats the reason.
        warning = f"upswing: warning: today.toml: not to be trusted: {reason}"
        for arguments in (["machine", "validate", "today.toml", "log.csv"],
                          ["machine", "adapt", "today.toml", "log.csv", "--out", "again.toml"],
                          ["eval", "lqr", "--plant", "today.toml", "--episodes", "1"],
                          ["train", "--plant", "today.toml", "--steps", "1", "--out", "run"]):
            self.assertIn(warning, self.run_here(*arguments).stderr.splitlines(), arguments)
        ran = self.run_here("run", "lqr", "--link", "today.toml", "--seconds", "0.1")
        self.assertIn(f"upswing: warning: today: not to be trusted: {reason}", ran.stderr)

    def test_a_log_with_faults_warns(self):
        self.write("plant.toml", "[plant]\nmass1 = 0.5\n")
        self.write("log.csv", log(scaled(vel_meas2=-1)))
        done = self.run_here("machine", "validate", "plant.toml", "log.csv")
        self.assertEqual(done.returncode, 1)
        self.assertIn("median error of the angles", done.stdout)
        self.assertRegex(done.stderr, r"\Aupswing: warning: log.csv: velocity 2: .*opposite sign"
                                      r"; machine check lists all faults\n\Z")
        # A twin of such logs is written, and marked.
        done = self.run_here("machine", "adapt", "plant.toml", "log.csv", "--out", "today.toml")
        self.assertEqual(done.returncode, 1)
        self.assertIn("upswing: today.toml: not to be trusted: its logs have faults; ", done.stderr)

    def test_torques_of_zeros(self):
        self.write("plant.toml", "[plant]\nmass1 = 0.5\n")
        self.assertEqual(self.faults(log(scaled(tau_meas1=0))),
                         {"torque 1": "measured torque never changes: suspect a column without a "
                                      "measurement (leave it out by --columns)"})

        def driven(k, row):  # as no free pendulum moves
            t = row[0]
            return [t, math.sin(3 * t) + 0.8 * math.sin(7 * t),
                    0.8 * math.sin(5 * t) + 0.5 * math.sin(11 * t),
                    3 * math.cos(3 * t) + 5.6 * math.cos(7 * t) + 0.01 * (-1) ** k,
                    4 * math.cos(5 * t) + 5.5 * math.cos(11 * t) + 0.01 * (-1) ** k, 0, 0, 0, 0]

        text = log(driven)
        self.assertIn("all torques of the motors are 0, but no free pendulum moves like this",
                      self.faults(text)["torque"])
        for arguments in (["validate", "plant.toml", "log.csv"],
                          ["adapt", "plant.toml", "log.csv", "--out", "today.toml"],
                          ["identify", "log.csv", "--plant", "plant.toml", "--out", "twin.toml",
                           "--folds", "0"]):
            done = self.run_here("machine", *arguments)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn("all torques of the motors are 0", done.stderr)

    def test_our_own_simulations_give_their_plant(self):
        """Logs of `simulate` at 50 Hz, of an acrobot of 20 cm. The guess is up to 50% off, or has
        masses and lengths only."""
        truth = {"center1": 0.05, "center2": 0.08, "inertia1": 8e-5, "inertia2": 1.2e-4,
                 "damping1": 5e-5, "damping2": 4e-5, "coulomb1": 5e-4, "coulomb2": 3e-4,
                 "armature": 3e-5}
        off = [1.15, 1.2, 0.8, 1.2, 1.5, 0.6, 0.5, 1.5, 0.7]
        known = {"mass1": 0.05, "mass2": 0.06, "length1": 0.08, "length2": 0.12, "torque_limit": 0.2}
        guess = {key: x * factor for (key, x), factor in zip(truth.items(), off)}
        for name, values in (("plant", truth), ("guess", guess), ("bare", {})):
            self.write(f"{name}.toml", "[plant]\nactuated_joint = 2\n" + "".join(
                f"{key} = {x}\n" for key, x in (known | values).items()))
        for run in (1, 2):
            torque = (0.012 * math.sin(0.09 * k + run) + 0.008 * math.sin(0.25 * k) for k in range(300))
            self.write("torque.csv", "torque\n" + "".join(f"{x:.17g}\n" for x in torque))
            self.succeed("simulate", "--torque", "torque.csv", "--control-period", "0.02", "--plant",
                         "plant.toml", "--start", "0.7,-0.4,0,0", "--csv", f"run-{run}.csv")
        for name in ("guess", "bare"):
            with self.subTest(plant=name):
                said = self.succeed("machine", "identify", "run-1.csv", "run-2.csv", "--plant",
                                    f"{name}.toml", "--folds", "0", "--out", "twin.toml", "--overwrite")
                self.assertIn("the model explains the logs of the fit to ", said)
                with open(self.folder / "twin.toml", "rb") as file:
                    found = tomllib.load(file)
                self.assertNotIn("distrust", found)
                for key, value in truth.items():
                    self.assertAlmostEqual(found["plant"][key] / value, 1, delta=0.01, msg=key)
                # All runs are of one session, so the plant is that of the session.
                for key, value in found["sessions"]["run-"].items():
                    self.assertAlmostEqual((found["plant"] | found["sensors"])[key], value, delta=1e-12)

    def test_a_table_of_measured_and_predicted_angles(self):
        self.write("plant.toml", "[plant]\nmass1 = 0.5\n")
        self.write("log.csv", log())
        said = self.unexplained("machine", "validate", "plant.toml", "log.csv", "--against",
                            "realaigym", "--csv", "motion.csv")
        self.assertIn("written motion.csv\n", said)
        self.write("other.csv", log())
        self.refuse(["machine", "validate", "plant.toml", "log.csv", "--csv", "other.csv"],
                    "other.csv: expected a new file or an older table of validate")
        rows = [row.split(",") for row in (self.folder / "motion.csv").read_text().splitlines()]
        self.assertEqual(rows[0][:6], ["log", "time", "measured 1", "measured 2", "plant 1",
                                       "plant 2"])
        numbers = [[float(cell) for cell in row[1:]] for row in rows[1:]]
        self.assertAlmostEqual(numbers[-1][0] - numbers[0][0], 1, delta=0.05)
        # The first row of the log at or after each multiple of 10 ms.
        for k, row in enumerate(numbers):
            self.assertGreaterEqual(row[0] - numbers[0][0], 0.01 * k - 1e-4)
        # All predictions begin in the same state, near the measured one.
        self.assertEqual(numbers[0][3:5], numbers[0][5:7])
        self.assertAlmostEqual(numbers[0][1], numbers[0][3], delta=0.01)
        # An older table is replaced.
        self.unexplained("machine", "validate", "plant.toml", "log.csv", "--csv", "motion.csv")

    def test_clock_and_layout_of_a_log_change_nothing(self):
        self.write("plant.toml", "[plant]\nmass1 = 0.5\n")

        def results(text):
            (self.folder / "log.csv").write_bytes(text.encode())
            return [self.succeed("machine", "check", "log.csv", "--json"),
                    self.unexplained("machine", "validate", "plant.toml", "log.csv", "--json"),
                    self.succeed("realaigym", "hardware", "log.csv", "--json")]

        expected = results(log())
        order = [8, 3, 0, 7, 2, 6, 1, 5, 4]
        for origin in (0, -5, 1.7e9):
            def moved(k, row, origin=origin):
                row = [f"{row[0] + origin:.6f}", *row[1:]]
                return [*(row[i] for i in order), "x"]

            text = log(moved, [*(NAMES[i] for i in order), "note"])
            self.assertEqual(results(text.replace("\n", "\r\n")), expected)

    def test_the_order_of_logs_changes_nothing(self):
        self.write("plant.toml", "[plant]\nmass1 = 0.5\n")

        def turned(angle):
            return log(lambda k, row: [*row[:2], row[2] + angle, *row[3:]])

        files = [self.write(f"{name}.csv", turned(k / 10)) for k, name in enumerate("abc")]
        validate = ["machine", "validate", "plant.toml"]
        self.assertEqual(self.unexplained(*validate, *files, "--json"),
                         self.unexplained(*validate, *reversed(files), "--json"))
        for again in (files[0], "./a.csv"):
            self.refuse([*validate, *files, again], "expected each log once", "a.csv twice")
            self.refuse(["realaigym", "hardware", *files, again], "expected each log once")

    def test_logs_without_commanded_torques(self):
        self.write("plant.toml", "[plant]\nmass1 = 0.5\n")
        no_command = [*NAMES[:5], "x", "y", *NAMES[7:]]
        measured = self.write("measured.csv", log(names=no_command))
        one_command = self.write("some.csv", log(names=[*NAMES[:5], "x", *NAMES[6:]]))
        for file, code in ((measured, 2), (one_command, 1)):  # check finds faults of the second one
            done = self.run_here("machine", "identify", file, "--plant", "plant.toml", "--out",
                                 "twin.toml", "--folds", "0")
            self.assertEqual(done.returncode, code)
            self.assertIn("joint 1: expected commanded torques", done.stderr)
            self.assertIn("got none", done.stderr)
        def errors(file):
            done = self.run_here("machine", "validate", "plant.toml", file, "--json")
            return json.loads(done.stdout)["errors"]

        none = self.write("none.csv", log(names=[*NAMES[:5], "x", "y", "z", "u", *NAMES[9:]]))
        rows = errors(none)
        self.assertEqual({row["torques"] for row in rows}, {"no"})
        rows = errors(measured)
        self.assertEqual({row["torques"] for row in rows}, {"reported"})
        done = self.run_here("realaigym", "hardware", measured)
        self.assertEqual(done.returncode, 2)
        self.assertIn("expected commanded torques", done.stderr)
        # Without the torques that move the machine, there is no prediction.
        only_one = self.write("one.csv", log(scaled(tau_meas2=0)))
        rows = errors(only_one)
        self.assertEqual({row["torques"] for row in rows}, {"commanded"})
        self.assertEqual(self.faults(log(scaled(tau_con1=0))),
                         {"torque 1": "measured torque of 0.9 N·m (rms) without a command"})

    def test_no_output_replaces_an_input_or_another_output(self):
        text = log()
        self.write("a.csv", text)
        (self.folder / "link.csv").symlink_to("a.csv")
        adapt = ["machine", "adapt", "realaigym-twin", "a.csv"]
        for more in (["--out", "a.csv"], ["--out", "./a.csv"], ["--out=link.csv"],
                     ["--out", "twin.toml", "--figure", "a.csv"]):
            self.refuse([*adapt, *more], "expected another file than the argument a.csv")
        self.refuse([*adapt, "--out", "new.svg", "--figure=new.svg"],
                    "--figure: expected another file than --out new.svg")
        self.refuse(["export", "a.csv", "--onnx", "a.csv"], "expected another file")
        self.assertEqual((self.folder / "a.csv").read_text(encoding="utf-8"), text)
        self.assertFalse((self.folder / "new.svg").exists())

    def test_models_with_equal_names(self):
        self.write("log.csv", log())
        for folder in ("a", "b"):
            (self.folder / folder).mkdir()
            self.write(f"{folder}/plant.toml", "[plant]\nmass1 = 0.5\n")
        rows = json.loads(self.unexplained("machine", "validate", "a/plant.toml", "log.csv",
                                           "--against", "b/plant.toml", "--json"))["errors"]
        errors = rows[0]["median_error_rad"]
        self.assertEqual(list(errors), ["plant", "b/plant.toml"])
        self.assertEqual(errors["plant"], errors["b/plant.toml"])

    @unittest.skipUnless((REAL / "C.1").is_dir(), "no measured data in UPSWING_REAL")
    def test_measured_logs(self):
        text = self.succeed("machine", "check", REAL / "C.1/sysid/20230629-143906.csv.gz")
        self.assertIn("exactly the backward difference", text)
        self.assertIn("steps of 0.000381 rad (16471 per turn)", text)
        self.assertIn("  warning  motion 2    does not move although joint 1 does", text)
        runs = sorted((REAL / "C.1/swingup").glob("pendubot-tvlqr-*.csv.gz"))
        table = self.succeed("realaigym", "hardware", *runs)
        self.assertRegex(table, r"  mean +3/5 .* 0\.130\n")
        scores = json.loads(self.succeed("realaigym", "hardware", *runs, "--json"))
        self.assertAlmostEqual(scores["runs"][1]["score"], 0.21401097079397924, delta=1e-9)


if __name__ == "__main__":
    unittest.main()
