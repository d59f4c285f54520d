#!/usr/bin/env python3
"""Tests of `upswing view`: pictures and films without a window, the window under Xvfb, and bad
input."""

import csv
import functools
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "src/cli"))
from testing import PATIENCE, ROOT, UPSWING, ProgramTest, run  # noqa: E402

AGENTS = ROOT / "web/public/agents"
FAST = AGENTS / "fast.safetensors"
REFERENCES = ROOT / "extras/view/testdata"
REQUIRED = "UPSWING_REQUIRE_PICTURES" in os.environ  # then no program may be missing


def read_png(path):
    """Width, height and rows of (red, green, blue) bytes of a PNG, ours or a reference."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path
    width, height, depth, kind, *rest = struct.unpack(">IIBBBBB", data[16:29])
    assert (depth, kind, rest) == (8, 2, [0, 0, 0]), path
    packed, at = b"", 8
    while at < len(data):
        length, name = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 4:at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0] == zlib.crc32(body)
        packed += body[4:] if name == b"IDAT" else b""
        at += 12 + length
    raw = zlib.decompress(packed)
    size = 3 * width
    assert len(raw) == (size + 1) * height, path
    rows, above = [], bytearray(size)
    for y in range(height):
        kind, row = raw[y * (size + 1)], bytearray(raw[y * (size + 1) + 1:(y + 1) * (size + 1)])
        if kind == 2:
            row = bytearray((x + up) & 255 for x, up in zip(row, above))
        elif kind != 0:
            for i in range(size):
                left = row[i - 3] if i >= 3 else 0
                up = above[i]
                if kind == 1:
                    guess = left
                elif kind == 3:
                    guess = (left + up) // 2
                else:
                    corner = above[i - 3] if i >= 3 else 0
                    p = left + up - corner
                    guess = min((abs(p - left), 0, left), (abs(p - up), 1, up),
                                (abs(p - corner), 2, corner))[2]
                row[i] = (row[i] + guess) & 255
        rows.append(bytes(row))
        above = row
    return width, height, rows


def difference(a, b):
    """Mean difference of two pictures' bytes, and the share of bytes that differ by more than
    48."""
    differences = [abs(x - y) for x, y in zip(b"".join(a[2]), b"".join(b[2]))]
    return (sum(differences) / len(differences),
            sum(each > 48 for each in differences) / len(differences))


def probe(path):
    """A film's properties by ffprobe: codec, width, height, frames, seconds."""
    done = subprocess.run(
        ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-show_format", "-of", "json",
         path], check=True, stdout=subprocess.PIPE)
    seen = json.loads(done.stdout)
    stream = seen["streams"][0]
    return (stream["codec_name"], stream["width"], stream["height"],
            int(stream["nb_read_frames"]), float(seen["format"]["duration"]))


def need(*programs):
    """Skips tests if a program is missing, unless all are required."""
    for program in programs:
        if shutil.which(program) is None:
            assert not REQUIRED, f"{program} is missing"
            raise unittest.SkipTest(f"needs the program {program}")


@functools.cache
def why_nothing_draws():
    """The reason why this machine draws no pictures; empty if it draws."""
    done = run("view", FAST, "--record", "/dev/null/x.png", "--seconds", 0, cwd="/")
    return done.stderr.strip() if "need EGL" in done.stderr and not REQUIRED else ""


class ViewTest(ProgramTest):
    """Base class for tests that draw; skipped if this machine cannot."""

    @classmethod
    def setUpClass(cls):
        if "UPSWING_SANITIZED" in os.environ:
            raise unittest.SkipTest("graphics drivers are not made for sanitizers")
        if why_nothing_draws():
            raise unittest.SkipTest(why_nothing_draws())

    def picture(self, *arguments, name="a.png", size=(160, 120)):
        """The picture that `view` draws for these arguments."""
        self.succeed("view", *arguments, "--record", name, "--width", size[0], "--height", size[1])
        picture = read_png(self.folder / name)
        self.assertEqual(picture[:2], size)
        return picture


class Pictures(ViewTest):
    def test_the_view_shows_the_motion_of_simulate(self):
        shutil.copy(FAST, self.folder / "fast.safetensors")
        for arguments in (["fast.safetensors"], [],
                          ["fast.safetensors", "--set", "mass2=1.2", "--delay", 0.02, "--sensor-noise",
                           0.01, "--seed", 4],
                          ["fast.safetensors", "--randomize", 0.25, "--episode", 3],
                          [AGENTS / "sac.safetensors", "--start", "3,0.1,0,0"],
                          [AGENTS / "d3qn-randomized.safetensors", "--physics", "closed-form"],
                          ["lqr", "--start", "3.1,0,0,0", "--made-for", "mass2=1.1"]):
            with self.subTest(arguments):
                arguments = [*arguments, "--seconds", 1.5]
                expected = self.succeed("simulate", *arguments)
                self.assertEqual(self.succeed("view", "--headless", *arguments, "--csv", "-"), expected)
        # Recording does not change the file.
        self.succeed("view", "fast.safetensors", "--seconds", 1.5, "--record", "a.png", "--width", 64,
                     "--height", 64, "--csv", "a.csv", "--speed", 0.3)
        self.assertEqual((self.folder / "a.csv").read_text(encoding="utf-8"),
                         self.succeed("simulate", "fast.safetensors", "--seconds", 1.5))

    def test_pictures_equal_the_stored_ones(self):
        drawn, stored = {}, {}
        for name, arguments in (("swing", [FAST, "--seconds", 0.9, "--no-text"]),
                                ("upright", [FAST, "--seconds", 5, "--no-text"]),
                                ("side-by-side", [FAST, AGENTS / "sac.safetensors", "lqr",
                                                  "--seconds", 0.5, "--no-text"]),
                                ("text", [FAST, "--seconds", 1])):
            with self.subTest(name):
                size = (320, 240) if name == "text" else (160, 120)
                drawn[name] = self.picture(*arguments, size=size)
                stored[name] = read_png(REFERENCES / f"{name}.png")
                mean, share = difference(drawn[name], stored[name])
                # Other drivers have different rounding and antialiasing.
                self.assertLess(mean, 2.5)
                self.assertLess(share, 0.01)
        # A tenth of a second, or the text, changes more than that.
        for flags in (["--seconds", 1, "--no-text"], ["--seconds", 0.9]):
            self.assertGreater(difference(self.picture(FAST, *flags), stored["swing"])[1], 0.01)
        # Marks are small, and can be switched off.
        plain = self.picture(FAST, "--seconds", 0.9, "--no-text", "--no-marks")
        self.assertGreater(difference(plain, drawn["swing"])[1], 0.002)

    def test_the_camera_can_be_moved(self):
        usual = self.picture(FAST, "--seconds", 0)
        for flags in (["--azimuth", 120], ["--elevation", -40], ["--distance", 6]):
            self.assertGreater(difference(self.picture(FAST, "--seconds", 0, *flags), usual)[0], 2)

    def test_a_folder_of_pictures(self):
        text = self.succeed("view", FAST, "--record", "frames/", "--seconds", 0.2, "--fps", 20,
                            "--width", 64, "--height", 48)
        self.assertIn("5 pictures of 64x48", text)
        names = sorted(path.name for path in (self.folder / "frames").iterdir())
        self.assertEqual(names, [f"frame-{i:05}.png" for i in range(5)])
        frames = [read_png(self.folder / "frames" / name) for name in names]
        self.assertTrue(all(frame[:2] == (64, 48) for frame in frames))
        self.assertEqual(len({b"".join(frame[2]) for frame in frames}), 5)
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ["frames"])

    def test_films(self):
        """Films with names that a shell, ffmpeg or printf would misread, one of them a link. A size
        that video codecs do not accept is padded."""
        need("ffmpeg", "ffprobe")
        self.write("old.mp4", "old")
        (self.folder / "-i x.mp4").symlink_to("old.mp4")
        for name, size, flags, codecs, frames, seconds in (
                ("-i x.mp4", (66, 50), [], ("h264", "mpeg4"), 11, 0.22),
                ("http:%d.mp4", (65, 49), ["--speed", 0.5, "--fps", 30], ("h264", "mpeg4"), 13, 0.433),
                ("a'b;$(touch c).gif", (66, 50), [], ("gif",), 6, 0.24)):
            with self.subTest(name):
                text = self.succeed("view", FAST, f"--record={name}", "--seconds", 0.2, "--width", size[0],
                                    "--height", size[1], *flags)
                self.assertIn(f"{frames} pictures of {size[0]}x{size[1]}", text)
                codec, *seen = probe(self.folder / name)
                self.assertIn(codec, codecs)
                self.assertEqual(seen[:3], [66, 50, frames])
                self.assertAlmostEqual(seen[3], seconds, delta=0.03)
        self.assertTrue((self.folder / "-i x.mp4").is_symlink())
        self.assertEqual(len(list(self.folder.iterdir())), 4)

    def test_a_picture_through_a_link_of_a_policy_with_a_strange_name(self):
        self.write("old.png", "old")
        (self.folder / "link.png").symlink_to("old.png")
        strange = self.folder / "\x1b[31mö%s%n.safetensors"
        shutil.copy(FAST, strange)
        self.picture(strange, "--seconds", 0, name="link.png")
        self.assertTrue((self.folder / "link.png").is_symlink())
        self.assertEqual((self.folder / "old.png").read_bytes()[:4], b"\x89PNG")

    def test_an_interrupted_recording_leaves_nothing(self):
        need("ffmpeg")
        for name in ("a.mp4", "frames/"):  # these begin to write immediately
            arguments = [UPSWING, "view", FAST, "--record", name, "--seconds", "1000", "--width", "64",
                         "--height", "48", "--fps", "1"]
            with subprocess.Popen(arguments, cwd=self.folder, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT) as process:
                self.wait_for(lambda: process.poll() is not None or list(self.folder.iterdir()))
                process.send_signal(signal.SIGTERM)
                said, _ = process.communicate()
            self.assertEqual(process.returncode, 143, said)
            self.assertEqual(list(self.folder.iterdir()), [])


class BadInput(ViewTest):
    def test_arguments(self):
        for arguments, *words in (
                ([FAST, "--record", "x.avi"], "--record", ".mp4", "x.avi"),
                ([FAST, "--record", "x"], "--record", "FOLDER/"),
                ([FAST, "--record", ""], "expected a path"),
                ([FAST, "--record", "no/x.png"], "--record no/x.png", "No such file"),
                ([FAST, "--record", "no/x.mp4"], "--record no/x.mp4", "No such file"),
                ([FAST, "--record", "no/no/"], "cannot write", "No such file"),
                ([FAST, "--headless"], "--headless", "--record FILE"),
                ([FAST, "--record", "a.png", "--csv", "a.png"], "--csv", "another file"),
                ([FAST, FAST, "--headless", "--csv", "a.csv"], "--csv", "expected one policy, got 2"),
                ([FAST, "--record", "x.png", "--width", 0], "--width", "[16, 8192]"),
                ([FAST, "--record", "x.png", "--height", 100000], "--height", "[16, 8192]"),
                ([FAST, "--record", "x.png", "--fps", "nan"], "--fps"),
                ([FAST, "--record", "x.png", "--speed", 0], "--speed"),
                ([FAST, "--record", "x.png", "--seconds", -1], "--seconds"),
                ([FAST, "--record", "x.gif", "--seconds", 1000], "GIF", "mp4"),
                ([FAST, "--record", "x.png", "--start", "1,2"], "--start", "q1,q2,w1,w2"),
                ([FAST, "--record", "x.png", "--made-for", "mass2=1"], "--made-for", "controller"),
                ([FAST, "--record", "x.png", "--set", "mass3=1"], "mass3"),
                (["missing.safetensors", "--record", "x.png"], "missing.safetensors", "no such file"),
                ([FAST] * 17 + ["--record", "x.png"], "at most 16", "got 17")):
            with self.subTest(arguments):
                self.refuse(["view", *arguments], *words)

    def test_a_folder_that_holds_something(self):
        (self.folder / "full").mkdir()
        self.write("full/a", "")
        self.refuse(["view", FAST, "--record", "full/"], "full", "new or empty folder")
        self.refuse(["view", FAST, "--record", "full/../full/a/"], "a file")

    def test_files_that_are_no_policy(self):
        self.write("text.safetensors", "hello")
        self.refuse(["view", "text.safetensors", "--record", "x.png"], "text.safetensors")
        self.refuse(["view", FAST, "text.safetensors", "--record", "x.png"], "text.safetensors")

    def test_something_is_missing(self):
        (self.folder / "lib").mkdir()
        self.write("lib/libEGL.so.1", "no library")
        for environment, *words in (
                ({"LD_LIBRARY_PATH": "lib"}, "libEGL.so.1", "libegl1"),
                ({"__EGL_VENDOR_LIBRARY_FILENAMES": "/none"}, "EGL: expected a device", "found none", "libgl1-mesa-dri")):
            self.refuse(["view", FAST, "--record", "x.png"], *words, code=1,
                        env=os.environ | environment)
        for name in ("x.mp4", "x.gif"):
            self.refuse(["view", FAST, "--record", name, "--seconds", 1, "--width", 64, "--height",
                         64], "ffmpeg", "FOLDER/", code=1, env=os.environ | {"PATH": "/none"})

    def test_ffmpeg_fails(self):
        (self.folder / "bin").mkdir()
        for script, *words in (("echo 'it is \033[1mtired' >&2; exit 3", "ffmpeg failed: it is \\x1b[1m"),
                               ("exit 0", "ffmpeg"),
                               ("kill -9 $$", "signal 9")):
            (self.folder / "bin/ffmpeg").write_text("#!/bin/sh\n" + script + "\n", encoding="utf-8")
            (self.folder / "bin/ffmpeg").chmod(0o755)
            path = f"{self.folder}/bin:{os.environ['PATH']}"
            self.refuse(["view", FAST, "--record", "x.mp4", "--seconds", 1, "--width", 200, "--height",
                         200], *words, code=1, env=os.environ | {"PATH": path})

    def test_no_window_can_be_opened(self):
        environment = {name: text for name, text in os.environ.items()
                       if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
        done = self.run_here("view", FAST, env=environment)
        self.assert_one_line(done, 1, "view: ", "window", "--record FILE")

    def test_libraries_of_the_window_are_missing(self):
        if "built without" in self.run_here("view", FAST, env=os.environ | {"DISPLAY": ":none"}).stderr:
            self.skipTest("this build has no window")
        for missing, *words in ((["libglfw.so.3"], "libglfw.so.3", "package libglfw3"),
                                (["libGL.so.1", "libEGL.so.1"], "libGL.so.1", "package libgl1")):
            folder = self.folder / missing[0]
            folder.mkdir()
            for name in missing:
                (folder / name).write_text("no library", encoding="utf-8")
            hidden = os.environ | {"LD_LIBRARY_PATH": str(folder)}
            self.refuse(["view", FAST], "view: ", "window", *words, "--record FILE", code=1, env=hidden)
            # Nothing else needs them.
            self.succeed("view", FAST, "--headless", "--csv", "-", env=hidden)


class Launcher(unittest.TestCase):
    def test_the_arguments_decide_what_to_install(self):
        script = ('packages=base picture_packages=egl window_packages=glfw viewer= ; . "$0"; '
                  'view_needs "$@"; echo "$packages ${viewer:-no}"')
        for words, expected in (("run", "base egl glfw yes"), ("", "base egl glfw yes"),
                                ("--help", "base no"), ("run -h", "base no"),
                                ("run --headless --csv -", "base egl no"),
                                ("run --record x.png", "base egl no"),
                                ("--record=x.MP4 run", "base egl ffmpeg no"),
                                ("run --record x.gif --seconds 2", "base egl ffmpeg no"),
                                ("x.mp4", "base egl glfw yes")):
            done = subprocess.run(["sh", "-euc", script, ROOT / "tools/view.sh", *words.split()],
                                  check=True, stdout=subprocess.PIPE, encoding="utf-8")
            self.assertEqual(done.stdout.strip(), expected, words)


class Window(ViewTest):
    """Tests of the window under Xvfb, with keys and mouse from xdotool (XTest)."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        need("Xvfb", "xdotool")
        done = run("view", FAST, env={**os.environ, "DISPLAY": ":nobody"})
        if "built without the window" in done.stderr:
            assert not REQUIRED, done.stderr
            raise unittest.SkipTest(done.stderr.strip())
        temporary = tempfile.TemporaryDirectory(prefix="upswing-")
        cls.addClassCleanup(temporary.cleanup)
        cls.shown = Path(temporary.name, "Xvfb_screen0")
        reading, writing = os.pipe()
        server = subprocess.Popen(["Xvfb", "-displayfd", str(writing), "-screen", "0", "480x360x24",
                                   "-fbdir", temporary.name, "-nocursor", "-nolisten", "tcp",
                                   "-noreset"], pass_fds=[writing],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(writing)
        cls.addClassCleanup(server.wait)
        cls.addClassCleanup(server.terminate)
        with os.fdopen(reading, encoding="ascii") as answer:
            number = answer.readline().strip()
        assert number, "Xvfb did not start"
        cls.environment = {**os.environ, "DISPLAY": f":{number}"}

    def xdotool(self, *words):
        done = subprocess.run(["xdotool", *map(str, words)], env=self.environment, check=False,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8")
        return done.stdout.strip()

    def open(self, *arguments):
        """Opens the window in the upper left corner, with focus."""
        self.process = subprocess.Popen(
            [UPSWING, "view", *map(str, arguments), "--width", "320", "--height", "240"],
            cwd=self.folder, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            encoding="utf-8")
        self.addCleanup(self.end, self.process)
        self.until(lambda: self.process.poll() is not None or
                   re.search(r"^\d+$", self.xdotool("search", "--name", "^upswing view -"), re.M))
        if self.process.poll() is not None:
            self.fail(self.process.stdout.read())
        self.id = self.xdotool("search", "--name", "^upswing view -").split()[-1]
        self.xdotool("windowmove", self.id, 0, 0)
        self.xdotool("windowfocus", "--sync", self.id)

    def until(self, condition):
        deadline = time.monotonic() + PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, f"nothing happened; the title is {self.title()}")
            time.sleep(0.05)

    def title(self):
        return self.xdotool("getwindowname", self.id)

    def key(self, *keys):
        self.xdotool("key", "--delay", 40, *keys)

    def says(self, pattern):
        """Waits for a title."""
        self.until(lambda: re.search(pattern, self.title()))

    def seconds(self):
        return float(re.search(r" ([\d.]+) s", self.title())[1])

    def close(self):
        self.key("ctrl+q")
        self.assertEqual(self.process.wait(PATIENCE), 0)
        self.assertEqual(self.process.stdout.read(), "")

    def screenshot(self):
        """The window as a picture, from the file in which the server keeps its screen (XWD)."""
        data = self.shown.read_bytes()
        header = struct.unpack(">25I", data[:100])
        bits, line, colors = header[11], header[12], header[19]
        self.assertEqual(bits, 32)
        begin = header[0] + 12 * colors
        rows = []
        for y in range(240):
            pixels = data[begin + y * line:begin + y * line + 4 * 320]  # blue, green, red, unused
            row = bytearray(3 * 320)
            row[0::3], row[1::3], row[2::3] = pixels[2::4], pixels[1::4], pixels[0::4]
            rows.append(bytes(row))
        return 320, 240, rows

    def still(self):
        """The window as a picture, once it stops changing."""
        seen = self.screenshot()
        while (now := self.screenshot()) != seen:
            seen = now
        return seen

    def rows(self, name="seen.csv"):
        with open(self.folder / name, encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def test_keys(self):
        self.open(FAST, "--csv", "seen.csv")
        self.until(lambda: self.seconds() > 0.3)
        self.key("space")
        self.says("paused$")
        now = self.seconds()
        time.sleep(0.3)
        self.assertEqual(self.seconds(), now)
        self.key("minus", "minus")
        self.says("speed 0.25")
        self.key("equal", "equal")
        self.until(lambda: "speed" not in self.title())
        # Single steps, from the beginning.
        self.key("BackSpace")
        self.says(r"- 0\.00 s")
        self.key("Right", "Right", "Right", "Right", "Right")
        self.says(r"- 0\.10 s")
        self.key("Left", "Left")
        self.says(r"- 0\.06 s")
        self.key("Return")
        self.says("policy off")
        self.key("Right", "Right")
        self.says(r"- 0\.10 s")
        self.key("Return", "space")
        self.until(lambda: self.seconds() > 0.5 and "paused" not in self.title())
        self.close()
        # It moves as in `simulate` until its motor is switched off.
        rows = self.rows()
        usual = list(csv.DictReader(self.succeed("simulate", FAST, "--seconds", 1).splitlines()))
        self.assertEqual(rows[:3], usual[:3])
        self.assertEqual([float(row["torque"]) for row in rows[3:5]], [0, 0])
        self.assertNotEqual(rows[3]["torque"], usual[3]["torque"])
        self.assertNotEqual({float(row["torque"]) for row in rows[5:20]}, {0.0})

    def test_pictures(self):
        expected = self.picture(FAST, "--start", "3.1415926,0,0,0", "--seconds", 0, size=(320, 240))
        self.open(FAST, "--start", "3.1415926,0,0,0")
        self.key("space")
        self.says("paused")
        self.key("BackSpace")
        self.says(r"- 0\.00 s")

        def is_drawn():
            # The processor draws it without antialiasing.
            mean, share = difference(self.screenshot(), expected)
            return mean < 4 and share < 0.03
        self.until(is_drawn)
        for key in ("F1", "F3", "F4"):
            seen = self.still()
            self.key(key)
            self.until(lambda: self.screenshot() != seen)
        self.close()

    def test_mouse(self):
        # Hangs at rest; no motor acts.
        self.open("--csv", "seen.csv")
        self.key("space", "BackSpace")
        self.says(r"- 0\.00 s")
        before = self.screenshot()
        self.xdotool("mousemove", 160, 190, "click", "--repeat", 2, "--delay", 60, 1)
        self.until(lambda: self.screenshot() != before)  # the selection is marked
        self.xdotool("keydown", "ctrl", "mousedown", 3)
        for x in range(164, 230, 4):
            self.xdotool("mousemove", x, 186)
        self.key("Right", "Right", "Right", "Right", "Right")
        self.xdotool("mouseup", 3, "keyup", "ctrl")
        self.says(r"- 0\.10 s")
        # Without ctrl, only the camera moves.
        seen = self.screenshot()
        self.xdotool("mousemove", 100, 100, "mousedown", 1, "mousemove", 160, 110, "mouseup", 1)
        self.until(lambda: self.screenshot() != seen)
        self.close()
        rows = self.rows()
        self.assertEqual(float(rows[0]["qpos0"]), 0)
        # A pull to the right is against the angles' direction.
        self.assertLess(float(rows[-1]["qpos0"]) + float(rows[-1]["qpos1"]), -1e-3)

    def test_several_policies_and_plants(self):
        self.open(FAST, "lqr", "--start", "3.1,0,0,0", "--set", "mass2=1.1")
        self.key("Tab")
        self.says("upswing view - fast - ")
        self.key("Tab")
        self.says("upswing view - lqr - ")
        self.key("1")
        self.says("upswing view - fast - ")
        self.key("Tab")
        self.says(r"upswing view - \d")
        before = self.seconds()
        self.key("p")
        self.until(lambda: self.seconds() < before or self.seconds() < 0.3)
        self.close()

    def test_it_ends_by_itself_and_by_signals(self):
        self.open(FAST, "--seconds", 0.6, "--csv", "seen.csv")
        self.assertEqual(self.process.wait(PATIENCE), 0)
        self.assertEqual(len(self.rows()), 30)
        self.open(FAST)
        self.process.send_signal(signal.SIGTERM)
        self.assertEqual(self.process.wait(PATIENCE), 143)


if __name__ == "__main__":
    unittest.main()
