#!/usr/bin/env python3
"""Tests of `upswing view`: its states, recordings, the window under Xvfb, and bad input."""

import csv
import os
import select
import shutil
import signal
import socket
import subprocess
import time
import unittest
from pathlib import Path

from testing import PATIENCE, ROOT, UPSWING, ProgramTest, run

AGENTS = ROOT / "web/public/agents"
FAST = AGENTS / "fast.safetensors"
PYTHON = Path(os.environ.get("UPSWING_PYTHON", ROOT / "build/view-venv/bin/python"))
REQUIRED = "UPSWING_REQUIRE_PICTURES" in os.environ  # then no test is skipped

# Plays the program that draws: asks for times, with torques of the mouse, and keeps the answers.
ASKS = """#!/usr/bin/env python3
import sys
with open("answers.txt", "w", encoding="utf-8") as file:
    for request in open("requests.txt", encoding="utf-8"):
        print(request, end="", flush=True)
        file.write(sys.stdin.readline())
"""


def why_nothing_is_drawn():
    """Why this machine makes no pictures; empty if it makes them."""
    if "UPSWING_SANITIZED" in os.environ:
        return "graphics drivers are not made for sanitizers"
    if REQUIRED:
        return ""
    return "" if PYTHON.exists() else f"needs {PYTHON}, which ./upswing view makes"


class ViewTest(ProgramTest):
    def script(self, text, name="python"):
        """An executable file that the program runs as Python."""
        self.write(name, text)
        (self.folder / name).chmod(0o755)
        return os.environ | {"UPSWING_PYTHON": str(self.folder / name)}


class States(ViewTest):
    def answers(self, requests, *arguments):
        """The numbers with which `view` answers these requests."""
        self.write("requests.txt", "".join(request + "\n" for request in requests))
        self.succeed("view", *arguments, env=self.script(ASKS))
        return [line.split() for line in
                (self.folder / "answers.txt").read_text(encoding="utf-8").splitlines()]

    def test_are_those_of_simulate(self):
        times = [str(k) for k in range(76)]
        for arguments in ([FAST], [],
                          [FAST, "--set", "mass2=1.2", "--delay", 0.02, "--sensor-noise", 0.01,
                           "--seed", 4],
                          [FAST, "--randomize", 0.25, "--episode", 3],
                          [AGENTS / "sac.safetensors", "--start", "3,0.1,0,0"],
                          [AGENTS / "d3qn-randomized.safetensors", "--physics", "closed-form"],
                          ["lqr", "--start", "3.1,0,0,0", "--made-for", "mass2=1.1"]):
            with self.subTest(arguments):
                rows = csv.DictReader(self.succeed("simulate", *arguments, "--seconds", 1.5).splitlines())
                expected = [[row[name] for name in ("q1", "q2", "w1", "w2", "torque")]
                            for row in rows]
                seen = self.answers(times, *arguments)
                self.assertEqual([row[0] for row in seen], times)
                self.assertEqual([row[1:] for row in seen], expected)

    def test_several_policies_and_times_between_steps(self):
        (start, later, again) = self.answers(["0", "10.5", "0"], FAST, "lqr")
        self.assertEqual(start, again)
        self.assertEqual(len(later), 11)
        self.assertNotEqual(later[1:6], later[6:])
        before, after = self.answers(["10", "11"], FAST)
        low, high = sorted((float(before[1]), float(after[1])))
        self.assertTrue(low < float(later[1]) < high)

    def test_the_mouse_pushes(self):
        """A pull at the first pendulum moves it, and not the second one."""
        pulled = self.answers(["0", "10 1 0 0 0"], FAST, "lqr")[1]
        free = self.answers(["0", "10"], FAST, "lqr")[1]
        self.assertGreater(float(pulled[1]) - float(free[1]), 0.01)
        self.assertEqual(pulled[6:], free[6:])
        unmoved = self.answers(["0", "10 1 0"], "--physics", "closed-form")[1]
        self.assertEqual([float(number) for number in unmoved[1:5]], [0.0] * 4)

    def test_a_motion_that_diverges_starts_again(self):
        self.write("requests.txt", "0\n5 1e300 1e300\n")
        done = run("view", cwd=self.folder, env=self.script(ASKS))
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stderr, "^upswing: the simulation diverged after .*\n$")
        self.assertEqual((self.folder / "answers.txt").read_text().splitlines()[1], "0 0 0 0 0 0")


@unittest.skipIf(why_nothing_is_drawn(), why_nothing_is_drawn())
class Recordings(ViewTest):
    def record(self, *arguments):
        return self.succeed("view", *arguments, env=os.environ | {"UPSWING_PYTHON": str(PYTHON)})

    def seen(self, code):
        """What a program in the Python that draws prints."""
        return subprocess.run([PYTHON, "-c", code], cwd=self.folder, check=True, encoding="utf-8",
                              stdout=subprocess.PIPE).stdout.split()

    def test_pictures(self):
        """The pendulum hangs in one picture and stands in the other."""
        (self.folder / "old.png").touch()
        (self.folder / "link.png").symlink_to("old.png")
        self.record("--record", "link.png", "--size", "64x48", "--seconds", 0)
        self.assertTrue((self.folder / "link.png").is_symlink())
        self.record("--record", "b.PNG", "--size", "64x48", "--seconds", 0, "--start", "3.14159,0,0,0")
        lower, upper, width, height = self.seen(
            "from PIL import Image; import numpy as np\n"
            "a, b = (Image.open(name) for name in ('old.png', 'b.PNG'))\n"
            "blue = np.asarray(a, int)[:, :, 2] - np.asarray(b, int)[:, :, 2]\n"
            "print((abs(blue[28:]) > 20).sum(), (abs(blue[:20]) > 20).sum(), *a.size)")
        self.assertEqual([width, height], ["64", "48"])
        self.assertGreater(int(lower), 8)
        self.assertGreater(int(upper), 8)

    def test_a_folder_of_pictures(self):
        text = self.record(FAST, "--record", "frames/", "--seconds", 0.2, "--fps", 20, "--size", "32x24")
        self.assertEqual(text, "frames/: 5 pictures of 32x24\n")
        names = [path.name for path in sorted((self.folder / "frames").iterdir())]
        self.assertEqual(names, [f"frame-{i:05}.png" for i in range(5)])
        self.assertEqual([path.name for path in self.folder.iterdir()], ["frames"])

    def test_films(self):
        self.record(FAST, "lqr", "--record=-i %d.mp4", "--seconds", 0.2, "--size", "65x49", "--speed", 0.5,
                    "--fps", 30)
        self.assertEqual(self.seen(
            "import av; file = av.open('-i %d.mp4'); film = file.streams.video[0]\n"
            "print(film.codec.name, film.width, film.height, len(list(file.decode(film))),"
            " film.average_rate)"), ["h264", "64", "48", "13", "30"])
        for _ in range(2):  # the second film replaces the first
            for name in ("a.gif", "a.mp4"):
                self.record(FAST, "--record", name, "--seconds", 0.2, "--size", "64x48")
        self.assertEqual(self.seen("from PIL import Image; film = Image.open('a.gif')\n"
                                   "print(*film.size, film.n_frames, film.info['duration'])"),
                         ["64", "48", "6", "40"])

    def test_an_interruption_leaves_nothing(self):
        arguments = [UPSWING, "view", "--record", "a.mp4", "--seconds", "1000", "--size", "32x24"]
        with subprocess.Popen(arguments, cwd=self.folder, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT,
                              env=os.environ | {"UPSWING_PYTHON": str(PYTHON)}) as process:
            self.wait_for(lambda: process.poll() is not None or
                          any(path.stat().st_size for path in self.folder.iterdir()))
            process.send_signal(signal.SIGTERM)
            said, _ = process.communicate()
        self.assertEqual(process.returncode, 143)
        self.assertRegex(said, rb"^(upswing: 0%.* left\n)*$")  # a slow machine shows progress
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_the_drawing_program_ends_silently_after_the_program(self):
        """However the connection ends: before a request, before its answer, or with the request unread."""
        run("view", "--record", "a.png", "--size", "32x24", cwd=self.folder,
            env=self.script('#!/bin/sh\nprintf %s "$3" >job\n'))
        job = (self.folder / "job").read_text(encoding="utf-8")
        for reads, waits in ((0, False), (4096, True), (0, True)):
            with self.subTest(reads=reads, waits=waits):
                ours, its = socket.socketpair()
                if not waits:
                    ours.close()
                drawer = subprocess.Popen([PYTHON, ROOT / "python/upswing/_view.py", job], cwd=self.folder,
                                          stdin=its, stdout=its, stderr=subprocess.PIPE)
                its.close()
                if waits:
                    select.select([ours], [], [], PATIENCE)
                    ours.recv(reads)
                    ours.close()
                self.assertEqual((drawer.communicate()[1], drawer.returncode), (b"", 0))

    def test_something_is_missing(self):
        environment = {name: text for name, text in os.environ.items()
                       if name not in ("DISPLAY", "WAYLAND_DISPLAY")} | {"UPSWING_PYTHON": str(PYTHON)}
        for arguments, more, *words in (
                ([], {}, "cannot open a window: DISPLAY"),
                ([], {"DISPLAY": ":987"}, "cannot open a window", "libgl1"),
                (["--record", "x.png"], {"__EGL_VENDOR_LIBRARY_FILENAMES": "/none"},
                 "cannot draw without a display", "libegl1"),
                (["--record", "x.png"], {"MUJOCO_GL": "glfw"}, "cannot draw without a display"),
                (["--record", "x.png"], {"MUJOCO_GL": "other"}, "MUJOCO_GL=other"),
                (["--record", "x.png"], {"UPSWING_PYTHON": "true"}, "Python drew nothing")):
            self.refuse(["view", *arguments], *words, code=1, env=environment | more)


class BadInput(ViewTest):
    def test_arguments(self):
        for arguments, *words in (
                ([FAST, "--record", "x.avi"], "--record", ".mp4", "x.avi"),
                ([FAST, "--record", "x"], "--record", "FOLDER/"),
                ([FAST, "--record", ""], "expected a path"),
                ([FAST, "--record", "no/x.png"], "--record no/x.png", "No such file"),
                ([FAST, "--record", "no/no/"], "cannot write", "No such file"),
                ([FAST, "--record", "/dev/null/../null.png"], "/dev/null/../null.png"),
                ([FAST, "--size", "0x100"], "--size", "16 to 8192 pixels", '"0x100"'),
                ([FAST, "--size", "100"], "--size", '"100"'),
                ([FAST, "--fps", "nan"], "--fps"),
                ([FAST, "--speed", 0], "--speed"),
                ([FAST, "--seconds", -1], "--seconds"),
                ([FAST, "--start", "1,2"], "--start", "q1,q2,w1,w2"),
                ([FAST, "--made-for", "mass2=1"], "--made-for", "controller"),
                ([FAST, "--set", "mass3=1"], "mass3"),
                (["missing.safetensors"], "missing.safetensors", "no such file"),
                ([FAST] * 9, "at most 8", "got 9")):
            with self.subTest(arguments):
                self.refuse(["view", *arguments], *words)
        (self.folder / "full").mkdir()
        self.write("full/a", "")
        self.refuse(["view", FAST, "--record", "full/"], "full", "new or empty folder")
        for name in ("notes.png", "notes.gif", "notes.mp4"):
            self.write(name, "notes")
            self.refuse(["view", FAST, "--record", name], name, f"an older {name[-3:]} file")
            self.assertEqual((self.folder / name).read_text(), "notes")

    def test_python_is_missing_or_lacks_packages(self):
        self.refuse(["view"], "cannot run /none", "UPSWING_PYTHON", code=1,
                    env=os.environ | {"UPSWING_PYTHON": "/none"})
        self.refuse(["view"], "No module named", "mujoco-core[rendering]==4.0.0", code=1,
                    env=self.script("#!/bin/sh\nexec python3 -S -E \"$@\"\n"))
        self.refuse(["view"], "signal 9", code=1, env=self.script("#!/bin/sh\nkill -9 $$\n"))


@unittest.skipIf(why_nothing_is_drawn(), why_nothing_is_drawn())
class WindowTest(ViewTest):
    """The window under Xvfb. A stand-in for Python writes down its input."""

    def setUp(self):
        super().setUp()
        for program in ("Xvfb", "xdotool"):
            if shutil.which(program) is None:
                assert not REQUIRED, f"{program} is missing"
                self.skipTest(f"needs the program {program}")
        reading, writing = os.pipe()
        server = subprocess.Popen(["Xvfb", "-displayfd", str(writing), "-screen", "0", "480x360x24",
                                   "-nolisten", "tcp", "-noreset"], pass_fds=[writing],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(writing)
        self.addCleanup(server.wait)
        self.addCleanup(server.terminate)
        with os.fdopen(reading, encoding="ascii") as answer:
            self.environment = self.script(
                f'#!/bin/sh\ntee answers 2>/dev/null | "{PYTHON}" "$@" | tee requests\n')
            self.environment["DISPLAY"] = f":{answer.readline().strip()}"

    def xdotool(self, *words):
        return subprocess.run(["xdotool", *map(str, words)], env=self.environment, check=False,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              encoding="utf-8").stdout.split()

    def until(self, condition):
        self.wait_for(lambda: self.process.poll() is not None or condition())
        self.assertIsNone(self.process.poll(), "the program has ended")

    def last(self, name):
        """Numbers of the last whole line of a file."""
        path = self.folder / name
        lines = path.read_text(encoding="utf-8").split("\n")[:-1] if path.exists() else []
        return [float(word) for word in lines[-1].split()] if lines else [0.0]

    def steps(self):
        return self.last("requests")[0]

    def stands_still(self):
        before = self.steps()
        time.sleep(0.5)
        return self.steps() == before

    def test_keys_and_mouse(self):
        self.process = subprocess.Popen([UPSWING, "view"], cwd=self.folder, env=self.environment,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.addCleanup(self.process.stdout.close)
        self.addCleanup(self.process.kill)
        self.until(lambda: self.steps() > 1)
        self.until(lambda: self.xdotool("search", "--onlyvisible", "--name", "MuJoCo", "windowmove", 0, 0,
                                        "windowfocus") == [])
        # Paused, it asks for nothing; a step is the next whole one; then it starts again.
        self.xdotool("key", "space")
        self.until(self.stands_still)
        paused = self.steps()
        self.xdotool("key", "Right")
        self.until(lambda: self.steps() == paused // 1 + 1)
        self.assertTrue(self.stands_still())
        self.xdotool("key", "BackSpace")
        self.until(lambda: self.steps() == 0)
        # Ctrl and the right button pull the hanging link that was selected.
        self.xdotool("key", "space")
        x, y = 160, 144  # a link: the window has two thirds of the screen's size
        pause = 0.2  # s, for the window to see what happened

        def pulls():
            nonlocal pause
            pause *= 1.5
            self.xdotool("key", "BackSpace", "mousemove", x, y, "click", "--repeat", 2, "--delay", 20, 1)
            time.sleep(pause)
            self.xdotool("keydown", "ctrl", "mousedown", 3, "mousemove", x + 20, y)
            time.sleep(pause)
            self.xdotool("mousemove", x + 60, y)
            time.sleep(pause)
            pulling = any(self.last("requests")[1:]) and abs(self.last("answers")[1]) > 1e-3
            self.xdotool("mouseup", 3, "keyup", "ctrl")
            return pulling
        self.until(pulls)
        self.process.send_signal(signal.SIGINT)
        self.assertEqual((self.process.wait(PATIENCE), self.process.stdout.read()), (130, b""))


if __name__ == "__main__":
    unittest.main()
