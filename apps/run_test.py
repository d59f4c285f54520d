#!/usr/bin/env python3
"""Tests of `upswing run` and `upswing fake`: a control loop on a twin, over UDP and a terminal."""

import re
import signal
import socket
import struct
import subprocess
import time
import unittest
import zlib

from testing import PATIENCE, ROOT, UPSWING, ProgramTest, read_csv

TWIN = ROOT / "apps/testdata/twin.toml"
# Tests run on busy machines: readings may be late, which a real run would not accept.
PATIENT = ["--twin", TWIN, "--max-age", 1]


class Fake:
    """The fake machine as a process; `link` is the address for `run`."""

    def __init__(self, test, link, *arguments):
        self.process = subprocess.Popen([UPSWING, "fake", TWIN, "--link", link, "--watchdog", "1",
                                         *map(str, arguments)],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                        encoding="utf-8")
        test.addCleanup(self.kill)
        first = self.process.stdout.readline()
        place = first.removeprefix("listening on ").strip()
        self.link = place if place.startswith("udp:") else f"serial:{place}:4000000"

    def kill(self):
        self.process.kill()
        self.process.communicate()

    def end(self, number=signal.SIGINT):
        """Stops it as Ctrl-C does; returns exit code and the text since the first line."""
        self.process.send_signal(number)
        out, _ = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, out


class Run(ProgramTest):
    def test_a_rehearsal_on_the_twin(self):
        arguments = ["run", "mpc", "--link", TWIN, "--compensation", 0.8, "--seconds", 5]
        out = self.succeed(*arguments, "--log", "a.csv")
        self.assertRegex(out, r"^mpc on \S+twin.toml, 500 Hz, pendubot\n  ran      5.00 s, "
                              r"the last [1-4]\.\d\d s upright\n")
        self.succeed(*arguments, "--log", "b.csv")
        self.succeed(*arguments, "--log", "c.csv", "--seed", 2)
        self.succeed(*arguments, "--log", "d.csv", "--draw")
        logs = [(self.folder / f"{name}.csv").read_bytes() for name in "abcd"]
        self.assertEqual(logs[0], logs[1])
        self.assertEqual(len(set(logs)), 3)
        checked = self.succeed("machine", "check", "a.csv")
        self.assertRegex(checked, r"torque 1 +measured follows commanded after [1-4] rows")
        # Torque 0 before the controller drives and after braking.
        rows = read_csv(self.folder / "a.csv")
        self.assertEqual({row["tau_con1"] for row in rows if row["state"] < 2}, {0})
        self.assertLessEqual(max(abs(row["tau_con1"]) for row in rows), 5)

    def test_compensation_of_dry_friction(self):
        # The policy was searched for a machine that compensates most of its dry friction.
        def upright(compensation):
            policy = ROOT / "docs/figures/realaigym-pendubot-twin.safetensors"
            return "s upright\n" in self.succeed("run", policy, "--link", "realaigym-twin",
                                                 "--compensation", compensation)

        self.assertTrue(upright(0.8))
        self.assertFalse(upright(0))

    def test_limits(self):
        done = self.run_here("run", "mpc", "--link", TWIN, "--max-velocity", 2)
        self.assert_one_line(done, 1, "velocity", "beyond the limit 2 rad/s")
        done = self.run_here("run", "mpc", "--link", TWIN, "--start", "upright", "--max-angle", 3,
                             "--log", "log.csv")
        self.assert_one_line(done, 1, "angle")
        self.assertEqual(read_csv(self.folder / "log.csv")[-1]["tau_con1"], 0)

    def test_over_udp(self):
        fake = Fake(self, "udp:0")
        # Two runs after another: the machine accepts a new program.
        for hz in (500, 250):
            out = self.succeed("run", "lqr", "--link", fake.link, "--seconds", 0.5, "--hz", hz,
                               "--log", "log.csv", *PATIENT)
            self.assertIn("ran      0.50 s", out)
            self.assertIn(" 0 lost, 0 doubled, 0 too old, 0 broken bytes", out)
            self.assertGreater(len(read_csv(self.folder / "log.csv")), 0.3 * hz)
        code, out = fake.end()
        self.assertEqual(code, 0)
        # The second run is refused until the watchdog of the first one.
        self.assertRegex(out, r"(?m)^\d+ commands, \d+ refused, [1-9] watchdog\n\Z")

    def test_over_a_terminal(self):
        fake = Fake(self, "pty", "--quiet")
        out = self.succeed("run", "lqr", "--link", fake.link, "--seconds", 0.5, *PATIENT)
        self.assertIn("ran      0.50 s", out)
        # Bytes that belong to no frame come before those of a second run.
        with open(fake.link.split(":")[1], "wb", buffering=0) as line:
            line.write(b"UPSW noise " * 20)
        out = self.succeed("run", "lqr", "--link", fake.link, "--seconds", 0.2, *PATIENT)
        self.assertIn("ran      0.20 s", out)
        self.assertEqual(fake.end(signal.SIGTERM)[0], 0)

    def test_a_bad_line(self):
        fake = Fake(self, "udp:0", "--loss", 0.05, "--duplicate", 0.05, "--reorder", 0.05,
                    "--delay", 0.001, "--jitter", 0.001)
        out = self.succeed("run", "lqr", "--link", fake.link, "--seconds", 1, *PATIENT)
        counts = re.search(r"(\d+) cycles without one, (\d+) lost, (\d+) doubled, (\d+) too old", out)
        for number in counts.groups():
            self.assertGreater(int(number), 0, out)
        self.assertRegex(fake.end()[1], r"(?m)^\d+ commands, [1-9]\d* refused, \d watchdog\n\Z")

    def test_faults_of_the_machine(self):
        for fault, words in (("--nan-after", "expected a finite reading"),
                             ("--silent-after", "s old, beyond the limit 1 s")):
            with self.subTest(fault=fault):
                fake = Fake(self, "udp:0", fault, 0.2)
                done = self.run_here("run", "lqr", "--link", fake.link, "--seconds", 5, *PATIENT)
                self.assert_one_line(done, 1, words)
                fake.end()

    def test_a_signal_brakes(self):
        fake = Fake(self, "udp:0")
        run = subprocess.Popen([UPSWING, "run", "lqr", "--link", fake.link, "--log", "log.csv",
                                *map(str, PATIENT)], cwd=self.folder, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, encoding="utf-8")
        while not (self.folder / "log.csv").is_file() or len(
                (self.folder / "log.csv").read_text().splitlines()) < 100:
            time.sleep(0.05)
        run.send_signal(signal.SIGINT)
        out, err = run.communicate(timeout=PATIENCE)
        self.assertEqual((run.returncode, err), (128 + signal.SIGINT, ""))
        states = [row["state"] for row in read_csv(self.folder / "log.csv")]
        self.assertEqual(states, sorted(states[:-1]) + states[-1:])
        self.assertIn(3, states)
        self.assertIn("written log.csv", out)

    def test_the_documented_frames(self):
        """A client in Python that follows docs/reference/machine-link.md."""
        def command(sequence, flags, torque):
            body = b"UPSW" + struct.pack("<BBHIIQ4f", 1, 1, flags, sequence, 0, 0, torque, 0, 0, 0)
            return body + struct.pack("<I", zlib.crc32(body))

        fake = Fake(self, "udp:0")
        _, host, port = fake.link.split(":")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.connect((host, int(port)))
            client.settimeout(PATIENCE)
            for sequence, flags in ((1, 1), (2, 0), (3, 1)):
                client.send(command(sequence, flags, 0.5))
                reading = client.recv(1000)
                self.assertEqual(len(reading), 44)
                self.assertEqual(struct.unpack_from("<I", reading, 40)[0], zlib.crc32(reading[:40]))
                magic, version, kind, locked, number, answers = struct.unpack_from("<4sBBHII", reading)
                self.assertEqual((magic, version, kind, locked, number, answers),
                                 (b"UPSW", 1, 2, sequence == 1, sequence, sequence))
                self.assertAlmostEqual(struct.unpack_from("<f", reading, 32)[0], 0.0164, delta=0.001)

    def test_bad_arguments(self):
        self.write("twin.toml", TWIN.read_text(encoding="utf-8"))
        for arguments, words in (
                (["run"], ["expected a policy"]),
                (["run", "lqr"], ["--link"]),
                (["run", "lqr", "--link", "udp:4000"], ["udp:HOST:PORT"]),
                (["run", "lqr", "--link", "udp:127.0.0.1:70000"], ["1 to 65535"]),
                (["run", "lqr", "--link", "serial:none"], ["serial:none", "No such file"]),
                (["run", "lqr", "--link", "serial:x:12345"], ["921600"]),
                (["run", "lqr", "--link", "serial:x:115200"], ["220000 bit/s", "115200"]),
                (["run", "lqr", "--link", "none.toml"], ["none.toml"]),
                (["run", "lqr", "--link", "twin.toml", "--hz", "333"], ["multiple of 50"]),
                (["run", "lqr", "--link", "twin.toml", "--twin", "twin.toml"], ["--twin"]),
                (["run", "lqr", "--link", "twin.toml", "--start", "here"], ["--start", "here"]),
                (["run", "lqr", "--link", "twin.toml", "--robot", "arm"], ["pendubot", "arm"]),
                (["run", "baseline-lqr", "--link", "twin.toml", "--hz", "400"], ["500 or 1000"]),
                (["run", "lqr", "--link", "udp:127.0.0.1:9", "--compensation", "1"], ["--twin"]),
                (["run", "lqr", "--link", TWIN, "--compensation", "1", "--differences"],
                 ["--compensation", "--differences"]),
                (["fake"], ["a twin"]),
                (["fake", "twin.toml"], ["--link"]),
                (["fake", "twin.toml", "--link", "serial:x"], ["udp:PORT"]),
                (["fake", "twin.toml", "--link", "udp:0", "--stuck", "3@1"], ["JOINT@SECONDS"]),
                (["fake", "twin.toml", "--link", "udp:0", "--loss", "2"], ["--loss", "[0, 1]"])):
            with self.subTest(arguments=arguments):
                self.refuse(arguments, *words)

    def test_no_machine(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as silent:
            silent.bind(("127.0.0.1", 0))
            port = silent.getsockname()[1]
            done = self.run_here("run", "lqr", "--link", f"udp:127.0.0.1:{port}", "--patience", 0.3)
        self.assert_one_line(done, 1, "no readings within 0.3 s")


if __name__ == "__main__":
    unittest.main()
