#!/usr/bin/env python3
"""Tests of `upswing run` and `upswing fake`: a control loop on a twin, over UDP and a terminal."""

import itertools
import math
import re
import resource
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import unittest
import zlib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "src/cli"))
from testing import PATIENCE, ROOT, UPSWING, ProgramTest, read_csv, without_locks  # noqa: E402

TWIN = ROOT / "extras/machine/testdata/twin.toml"
# Tests run on busy machines: readings may be late, which a real run would not accept. Torques are
# small, so that the twin predicts an angle after a long gap, too.
PATIENT = ["--twin", TWIN, "--max-age", 1, "--max-torque", 0.5]


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


class Firmware(threading.Thread):
    """A machine in Python that follows docs/reference/machine-link.md, with the readings of a test.

    Joint 1 swings on a spring, and joint 2 against it. `reading(i)` gives the angles [rad] that are
    added in the answer to the i-th command of the controller, after the pulses that the encoders
    have to answer. `pack(frame, i)` gives the datagram. `commands` has (flags, torques) as they
    came.
    """

    INERTIA, SPRING = 0.03, 1.0  # kg·m², N·m/rad

    def __init__(self, test, reading=lambda i: (0, 0), pack=lambda frame, i: frame):
        super().__init__(daemon=True)
        self.reading, self.pack, self.commands = reading, pack, []
        self.known = []  # number of the newest reading that each command knew
        self.times = []  # when each command came, s
        self.number = 0  # of this reading
        self.driven = threading.Event()  # the controller drove for 50 commands
        self.silent = threading.Event()  # no command for a while, once it did
        self.angle = self.velocity = 0  # of joint 1, rad and rad/s
        self.phases = [0]  # whether torques came: 0, pulses, 0, the controller's
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.link = f"udp:127.0.0.1:{self.socket.getsockname()[1]}"
        test.addCleanup(self.socket.close)
        self.socket.settimeout(0.3)
        self.start()

    def wait_for_silence(self):
        """Returns once no command has come for a while: all that were sent are in `commands`."""
        self.silent.clear()
        assert self.silent.wait(PATIENCE)

    def move(self, torque):
        """Lets the spring swing since the command before."""
        self.times.append(time.monotonic())
        passed = self.times[-1] - self.times[max(len(self.times) - 2, 0)]
        for _ in range(4):
            step = min(passed, 0.02) / 4
            self.velocity += (torque - self.SPRING * self.angle) / self.INERTIA * step
            self.angle += self.velocity * step

    def run(self):
        on = 0
        for number in itertools.count(1):
            self.number = number
            try:
                command, sender = self.socket.recvfrom(1000)
            except TimeoutError:
                if self.driven.is_set():
                    self.silent.set()
                continue
            except OSError:
                return
            flags, sequence, known = struct.unpack_from("<HII", command, 6)
            torques = struct.unpack_from("<2f", command, 24)
            self.known.append(known)
            self.commands.append((flags & 1, torques))
            self.move(torques[0])
            if (torques[0] != 0) != self.phases[-1]:
                self.phases.append(not self.phases[-1])
            on += len(self.phases) > 3
            added = self.reading(on) if on > 0 else (0, 0)
            angles = self.angle + added[0], -1.5 * self.angle + added[1]
            if on == 50:
                self.driven.set()
            body = b"UPSW" + struct.pack("<BBHIIQ4f", 1, 2, 0, number, sequence, 0, 0, 0, *angles)
            self.socket.sendto(self.pack(body + struct.pack("<I", zlib.crc32(body)), on), sender)


class Protection(ProgramTest):
    """What docs/howto/protection.md promises."""

    def drive(self, firmware, *arguments, **options):
        """Starts a run that drives the machine with full torque until something ends it."""
        run = subprocess.Popen([UPSWING, "run", "lqr", "--link", firmware.link, "--max-age", "0.5",
                                "--max-torque", "0.1", "--seconds", "60", *map(str, arguments)],
                               cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               encoding="utf-8", **options)
        self.addCleanup(run.communicate)
        self.addCleanup(run.kill)
        return run

    def assert_off(self, firmware):
        firmware.wait_for_silence()
        self.assertEqual(firmware.commands[-1], (0, (0, 0)))
        for on, torques in firmware.commands:
            self.assertTrue(all(abs(torque) <= on * 0.1 for torque in torques), (on, torques))
        self.assertIn(1, [on for on, _ in firmware.commands])

    def test_every_signal_switches_the_motors_off(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP,
                       signal.SIGALRM, signal.SIGXCPU, signal.SIGABRT, signal.SIGSEGV):
            with self.subTest(signal=number.name):
                firmware = Firmware(self)
                run = self.drive(firmware)
                self.assertTrue(firmware.driven.wait(PATIENCE))
                run.send_signal(number)
                if number is signal.SIGHUP:  # a terminal that closes sends it twice
                    run.send_signal(number)
                run.communicate(timeout=PATIENCE)
                crash = number in (signal.SIGABRT, signal.SIGSEGV)
                self.assertEqual(run.returncode, -number if crash else 128 + number)
                self.assert_off(firmware)

    def test_a_second_interrupt_switches_the_motors_off_at_once(self):
        # The links do not hang, so braking would take seconds.
        firmware = Firmware(self, lambda i: (min(0.001 * i, 1.5), 0))
        run = self.drive(firmware, "--brake-seconds", 60)
        self.assertTrue(firmware.driven.wait(PATIENCE))
        while len(firmware.commands) < 2500:  # the angle has reached 1.5 rad
            time.sleep(0.01)
        run.send_signal(signal.SIGINT)
        count = len(firmware.commands)
        while len(firmware.commands) < count + 100:
            time.sleep(0.01)
        self.assertIsNone(run.poll())
        run.send_signal(signal.SIGINT)
        run.communicate(timeout=PATIENCE)
        self.assertEqual(run.returncode, -signal.SIGINT)
        self.assert_off(firmware)

    def test_a_program_that_was_stopped_sends_no_old_torque(self):
        firmware = Firmware(self)
        run = self.drive(firmware)
        self.assertTrue(firmware.driven.wait(PATIENCE))
        run.send_signal(signal.SIGSTOP)
        self.assertTrue(firmware.silent.wait(PATIENCE))
        time.sleep(0.5)  # longer than --max-age
        count = len(firmware.commands)
        run.send_signal(signal.SIGCONT)
        _, err = run.communicate(timeout=PATIENCE)
        self.assertEqual(run.returncode, 1)
        self.assertRegex(err, r"the last reading is \S+ s old")
        firmware.wait_for_silence()
        self.assertEqual({on for on, _ in firmware.commands[count:]}, {0})

    def test_the_watchdog_acts_where_the_program_is_killed(self):
        fake = Fake(self, "udp:0")
        run = subprocess.Popen([UPSWING, "run", "lqr", "--link", fake.link, "--log", "log.csv",
                                *map(str, PATIENT)], cwd=self.folder, stdout=subprocess.PIPE)
        self.addCleanup(run.communicate)
        while not (self.folder / "log.csv").is_file() or not any(
                row["state"] == 2 for row in read_csv(self.folder / "log.csv")):
            time.sleep(0.05)
        run.kill()
        while " 1 watchdog" not in fake.process.stdout.readline():
            pass

    def test_readings_that_no_motion_explains(self):
        for name, change in (("a turn", 2 * math.pi), ("two turns", 14), ("a slip", -1)):
            for once in (False, True):
                with self.subTest(fault=name, once=once):
                    # A pause of the computer explains a slip: links may have moved meanwhile.
                    while not self.expect_jump(change, once):
                        pass

    def expect_jump(self, change, once):
        """Expects that a jump switches the motors off. Returns whether no pause could explain it."""
        wrong = []

        def reading(i):
            if i < 60 or (once and i > 100):
                return 0, 0
            wrong.append(firmware.number)
            return 0, change

        firmware = Firmware(self, reading)
        run = self.drive(firmware)
        _, err = run.communicate(timeout=PATIENCE)
        firmware.wait_for_silence()
        times = firmware.times[wrong[0] - 10:wrong[0] + 10]
        if max(later - earlier for earlier, later in zip(times, times[1:])) > 0.02:
            return False
        self.assertEqual(run.returncode, 1)
        self.assertRegex(err, "joint 2: the (angle jumps by|encoder saturates)")
        self.assert_off(firmware)
        # The first command after the wrong reading is off.
        after = [on for (on, _), known in zip(firmware.commands, firmware.known)
                 if known >= wrong[0]]
        self.assertEqual(after, [0] * 3)
        return True

    def test_encoders_that_do_not_answer(self):
        # A driver that repeats its first angles.
        firmware = Firmware(self)
        firmware.INERTIA = math.inf
        run = self.drive(firmware)
        self.assertRegex(run.communicate(timeout=PATIENCE)[1], "joint 1 does not answer its motor")
        self.assertEqual(run.returncode, 1)
        self.assertLess(sum(torques[0] != 0 for _, torques in firmware.commands), 200)

    def test_a_datagram_is_one_frame(self):
        for pack in (lambda frame, i: frame + frame, lambda frame, i: frame[:22],
                     lambda frame, i: frame + b"x"):
            firmware = Firmware(self, pack=pack)
            run = self.drive(firmware, "--patience", 0.5)
            self.assertEqual(run.communicate(timeout=PATIENCE)[1],
                             "upswing: no readings within 0.5 s\n")

    def test_a_link_that_is_none(self):
        for command in (["run", "lqr"], ["machine", "learn", "--encoder-counts", 8192, "--out", "learnt"]):
            self.refuse([*command, "--link", "foo"], '--link: expected udp:HOST:PORT, serial:DEVICE, a plant file '
                        '(TOML) or one of cloudpendulum, ', 'got "foo"')

    def test_a_log_is_never_lost(self):
        run = ["run", "lqr", "--link", TWIN, "--start", "upright", "--seconds", 0.2, "--log"]
        self.succeed(*run, "log.csv")
        log = (self.folder / "log.csv").read_bytes()
        for link in (TWIN, "serial:none", "udp:127.0.0.1:9"):
            self.refuse(["run", "lqr", "--link", link, "--patience", 0.2, "--log", "log.csv"],
                        "none" if link == "serial:none" else "--log: expected a new file")
            self.assertEqual((self.folder / "log.csv").read_bytes(), log)
        # Two runs at once.
        firmware = Firmware(self)
        first = self.drive(firmware, "--log", "other.csv")
        self.assertTrue(firmware.driven.wait(PATIENCE))
        self.assert_one_line(self.run_here(*run, "other.csv"), 2, "--log: expected a new file")
        first.send_signal(signal.SIGINT)
        first.communicate(timeout=PATIENCE)
        self.assertGreater(len(read_csv(self.folder / "other.csv")), 50)
        # Without a machine the file stays free.
        for _ in range(2):
            done = self.run_here("run", "lqr", "--link", "udp:127.0.0.1:9", "--patience", 0.2,
                                 "--log", "free.csv")
            self.assert_one_line(done, 1, "no readings")

    def test_without_locks_the_cause_is_said_and_no_log_is_left(self):
        run = ["run", "lqr", "--link", TWIN, "--seconds", 0.2, "--log", "log.csv"]
        self.refuse(run, "cannot lock log.csv: No locks available", preexec_fn=without_locks)
        self.write("log.csv", "")
        self.refuse(run, "cannot lock log.csv: No locks available", preexec_fn=without_locks)
        done = self.run_here("machine", "learn", "--link", TWIN, "--encoder-counts", 16470,
                             "--out", "new/learned", preexec_fn=without_locks)
        self.assertEqual(done.returncode, 2)
        self.assertIn("upswing: cannot lock new/learned/log-01.csv: No locks", done.stderr)
        self.assertEqual([path.name for path in self.folder.iterdir()], ["log.csv"])

    def test_a_full_disk_leaves_a_whole_log(self):
        limit = 100_000  # bytes
        done = subprocess.run([UPSWING, "run", "lqr", "--link", TWIN, "--seconds", "5", "--log",
                               "log.csv"], cwd=self.folder, capture_output=True, encoding="utf-8",
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE,
                                                                    (limit, limit)))
        self.assert_one_line(done, 1, "cannot write log.csv: File too large")
        text = (self.folder / "log.csv").read_text()
        self.assertGreater(len(text), 10_000)
        self.assertTrue(text.endswith("\n"))
        # `check` reads it, whatever it finds in so short a run.
        self.assertRegex(self.run_here("machine", "check", "log.csv").stdout,
                         rf"^log.csv: {text.count(chr(10)) - 1} rows")


class Run(ProgramTest):
    def swing(self, *arguments):
        """Runs a controller that does not reach upright; returns what it printed."""
        done = self.run_here("run", *arguments)
        self.assert_one_line(done, 1, "the links were not upright at the end of the run")
        return done.stdout

    def test_a_rehearsal_on_the_twin(self):
        arguments = ["run", "mpc", "--link", TWIN, "--compensation", 0.8, "--seconds", 5]
        out = self.succeed(*arguments, "--log", "a.csv")
        self.assertRegex(out, r"^mpc on \S+twin.toml, 500 Hz, pendubot\n  ran      5.00 s, "
                              r"the last [1-4]\.\d\d s upright\n")
        self.succeed(*arguments, "--log", "b.csv")
        self.succeed(*arguments, "--log", "c.csv", "--seed", 2)
        self.run_here(*arguments, "--log", "d.csv", "--draw")
        logs = [(self.folder / f"{name}.csv").read_bytes() for name in "abcd"]
        self.assertEqual(logs[0], logs[1])
        self.assertEqual(len(set(logs)), 3)
        checked = self.succeed("machine", "check", "a.csv")
        self.assertRegex(checked, r"torque 1 +measured follows commanded after [1-4] rows")
        # Torque 0 before the controller drives and after braking.
        rows = read_csv(self.folder / "a.csv")
        self.assertEqual({row["tau_con1"] for row in rows if row["state"] < 2}, {0})
        self.assertLessEqual(max(abs(row["tau_con1"]) for row in rows), 5)

    def test_a_policy_for_another_plant_needs_consent_on_a_machine(self):
        other = "sac was made for another plant: inertia "
        done = self.run_here("run", "sac", "--link", TWIN, "--seconds", 1)
        self.assertEqual(done.returncode, 1, done)
        warning, end = done.stderr.splitlines()
        self.assertTrue(warning.startswith(f"warning: {other}"), warning)
        self.assertRegex(warning, r"decisions in the natural time [\d.]+ \(twin [\d.]+\)")
        self.assertIn("not upright", end)
        fake = Fake(self, "udp:0")
        run = ["run", "sac", "--link", fake.link, "--seconds", 0.2, *PATIENT]
        self.refuse(run, other, f"train one with --plant {TWIN}", "give --force")
        # Without torques nothing moves.
        done = self.run_here(*run, "--max-torque", 0)
        self.assertEqual(done.returncode, 0, done)
        done = self.run_here(*run, "--force")
        self.assertIn(f"warning: {other}", done.stderr)
        self.assertIn("ran      0.20 s", done.stdout)
        # A policy of this plant, and a controller, which is designed for it, need none.
        self.swing("lqr", "--link", fake.link, "--seconds", 0.2, *PATIENT)

    def test_compensation_of_dry_friction(self):
        # The joint without the controller's motor shows it.
        def passive(compensation):
            log = f"run-{len(list(self.folder.iterdir()))}.csv"
            self.swing("energy", "--link", "realaigym-twin", "--seconds", 2,
                         "--compensation", compensation, "--log", log)
            return max(abs(row["tau_con2"]) for row in read_csv(self.folder / log)
                       if row["state"] == 2)

        self.assertEqual(passive(0), 0)
        self.assertGreater(passive(0.8), 0.05)
        self.assertLessEqual(passive(0.8), 0.5)

    def test_limits_follow_the_size_of_the_machine(self):
        run = ["run", "energy", "--seconds", 0.1, "--max-torque"]
        usual = self.run_here(*run, 0, "--link", TWIN)
        self.assertNotIn("another size", usual.stdout)
        small = self.run_here(*run, 0.1, "--link", "cloudpendulum")
        self.assertRegex(small.stdout, r"another size .* times × 0\.41\d, torques × 0\.03\d+; "
                         r"limits 60\.\d rad/s, 0\.1 N·m, other joint 0 N·m; braking 0\.0025\d ")
        own = self.run_here(*run, 0.1, "--link", "cloudpendulum", "--max-velocity", 40, "--brake-damping", 0.01,
                            "--passive-torque", 0.02)
        self.assertIn("limits 40 rad/s, 0.1 N·m, other joint 0.02 N·m; braking 0.01 ", own.stdout)
        for flag, wrong in (("--max-velocity", 0), ("--brake-damping", -1), ("--velocity-share", "x")):
            self.refuse([*run, 0, "--link", TWIN, flag, wrong], f"{flag}: expected a number", f'"{wrong}"')

    def test_control_periods_need_no_whole_cycles(self):
        run = ["run", "energy", "--seconds", 0.1, "--max-torque", 0, "--link", TWIN]
        usual = self.run_here(*run)
        self.assertNotIn("decides every", usual.stdout)
        short = self.run_here(*run, "--control-period", 0.0067)
        self.assertEqual(short.returncode, 0, short.stderr)
        self.assertIn("decides every 0.0067 s, which is 3.35 cycles", short.stdout)
        self.refuse([*run, "--control-period", 0.0012], "--hz: expected 834 or more", "got 500")
        self.refuse(["run", "sac", *run[2:], "--control-period", 0.01],
                    "--control-period: expected 0.02 s", "got 0.01")
        self.refuse(["run", "sac", "--link", "cloudpendulum", "--control-period", 0.02],
                    "--control-period: expected 0.00", "the control period of sac on this machine, got 0.02")

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
            out = self.swing("lqr", "--link", fake.link, "--seconds", 0.5, "--hz", hz,
                               "--log", f"{hz}.csv", *PATIENT)
            self.assertIn("ran      0.50 s", out)
            self.assertIn(" 0 lost, 0 doubled, 0 too old, 0 broken bytes", out)
            self.assertGreater(len(read_csv(self.folder / f"{hz}.csv")), 0.3 * hz)
        code, out = fake.end()
        self.assertEqual(code, 0)
        # The second run is refused until the watchdog of the first one.
        self.assertRegex(out, r"(?m)^\d+ commands, \d+ refused, [1-9] watchdog\n\Z")

    def test_over_a_terminal(self):
        fake = Fake(self, "pty", "--quiet")
        out = self.swing("lqr", "--link", fake.link, "--seconds", 0.5, *PATIENT)
        self.assertIn("ran      0.50 s", out)
        # Bytes that belong to no frame come before those of a second run.
        with open(fake.link.split(":")[1], "wb", buffering=0) as line:
            line.write(b"UPSW noise " * 20)
        out = self.swing("lqr", "--link", fake.link, "--seconds", 0.2, *PATIENT)
        self.assertIn("ran      0.20 s", out)
        self.assertEqual(fake.end(signal.SIGTERM)[0], 0)

    def test_a_bad_line(self):
        fake = Fake(self, "udp:0", "--loss", 0.05, "--duplicate", 0.05, "--reorder", 0.05,
                    "--delay", 0.001, "--jitter", 0.001)
        out = self.swing("lqr", "--link", fake.link, "--seconds", 1, *PATIENT)
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
        while not (self.folder / "log.csv").is_file() or not any(
                row["state"] == 2 for row in read_csv(self.folder / "log.csv")):
            time.sleep(0.05)
        run.send_signal(signal.SIGINT)
        out, err = run.communicate(timeout=PATIENCE)
        self.assertEqual((run.returncode, err), (128 + signal.SIGINT, ""))
        states = [row["state"] for row in read_csv(self.folder / "log.csv") if row["state"] != 5]
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
                (["run"], ["run: expected POLICY|RUN (policy.safetensors"]),
                (["run", "lqr"], ["run: expected --link LINK (machine: udp:HOST:PORT, serial:DEVICE", "realaigym-twin"]),
                (["run", "lqr", "--link", "udp:4000"], ["udp:HOST:PORT"]),
                (["run", "lqr", "--link", "udp:127.0.0.1:70000"], ["1 to 65535"]),
                (["run", "lqr", "--link", "serial:none"], ["serial:none", "No such file"]),
                (["run", "lqr", "--link", "serial:x:12"], ["921600"]),
                (["run", "lqr", "--link", "serial:x:115200"], ["220000 bit/s", "115200"]),
                (["run", "lqr", "--link", "none.toml"], ["none.toml"]),
                (["run", "lqr", "--link", "twin.toml", "--hz", "333.5"], ["--hz", "an integer in [100, 1000]"]),
                (["run", "lqr", "--link", "twin.toml", "--twin", "twin.toml"], ["--twin"]),
                (["run", "lqr", "--link", "twin.toml", "--start", "here"], ["--start", "here"]),
                (["run", "lqr", "--link", "twin.toml", "--robot", "arm"], ["pendubot", "arm"]),
                (["run", "lqr", "--link", "udp:127.0.0.1:9", "--compensation", "1"], ["--twin"]),
                (["run", "lqr", "--link", TWIN, "--compensation", "1", "--differences"],
                 ["--compensation", "--differences"]),
                (["fake"], ["fake: expected TWIN (twin to play", "realaigym-twin"]),
                (["fake", "twin.toml"], ["fake: expected --link LINK (udp:PORT"]),
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
