#!/usr/bin/env python3
"""Tests of `upswing machine learn`."""

import signal
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "src/cli"))
from run_test import TWIN, Firmware  # noqa: E402
from testing import PATIENCE, UPSWING, ProgramTest, read_csv  # noqa: E402

LEARN = ["machine", "learn", "--encoder-counts", 16470, "--out", "today"]


class Learn(ProgramTest):
    def test_bad_input_is_one_line(self):
        for arguments, *words in [
                (["machine", "learn"], "machine learn: expected --link LINK (machine: udp:HOST:PORT"),
                ([*LEARN, "--link", TWIN, "--length", 0.1], "--length: expected --max-torque with it, got none"),
                ([*LEARN, "--link", TWIN, "--length", 0], "--length: expected a number in [0.02, 200]", '"0"'),
                ([*LEARN, "--link", TWIN, "--max-torque", "strong"], "--max-torque", '"strong"'),
                (["machine", "learn", "--link", TWIN], "expected --out FOLDER (new folder", "got none"),
                (["machine", "learn", "--link", TWIN, "--out", "today"],
                 "expected --encoder-counts NUMBER (steps of the encoders", "got none"),
                ([*LEARN, "--link", TWIN, "--max-energy", 0.9],
                 "--max-energy: expected 1.1 or more for a swing-up, got 0.9"),
                ([*LEARN, "--link", TWIN, "--robot", "cartpole"],
                 "--robot: expected pendubot or acrobot", "cartpole"),
                ([*LEARN, "--link", "realaigym-c1", "--draw"],
                 "--draw: expected a twin with [covariance] as --link, got none"),
                ([*LEARN, "--link", "none.toml"], "none.toml")]:
            with self.subTest(arguments=arguments):
                self.refuse(arguments, *words)

    def test_a_machine_in_simulated_time(self):
        done = self.run_here(*LEARN, "--link", TWIN, "--hold", 2)
        self.assertEqual(done.returncode, 0, done.stderr)
        first, command, written = done.stdout.splitlines()
        self.assertRegex(first, r"^balanced for 2\.0 s: .+ s of motion, .+ s of computing, 1 attempt$")
        self.assertEqual(written, "written today")
        self.assertIn("try 1: tvlqr", done.stderr)
        report = (self.folder / "today/report.txt").read_text(encoding="utf-8")
        self.assertTrue(report.endswith(f"{command}\n"), report)
        # The command of the report runs the controller without learning.
        self.assertRegex(self.succeed(*command.split()[1:], "--seconds", 8),
                         r"the last \d\.\d\d s upright")
        self.refuse([*LEARN, "--link", TWIN], "today", code=2)

    def test_an_interrupt_stops_the_machine_and_keeps_the_log(self):
        firmware = Firmware(self)
        process = subprocess.Popen([UPSWING, *map(str, LEARN), "--link", firmware.link, "--max-age", "0.5"],
                                   cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   encoding="utf-8")
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        self.assertTrue(firmware.driven.wait(PATIENCE))
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 128 + signal.SIGINT)
        self.assertEqual(firmware.commands[-1], (0, (0, 0)))
        self.assertGreater(len(read_csv(self.folder / "today/log-01.csv")), 50)


if __name__ == "__main__":
    unittest.main()
