#!/usr/bin/env python3
"""Tests of the programs for Windows, in Wine: trainings have the bits of Linux, locks and processes work, and
missing parts say so. `./upswing test --windows` builds them and runs this program, which exits with 77
if there is no Wine or no build/windows.

UPSWING names the program of this system, to compare with (see src/cli/testing.py).
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(ROOT / "src/cli"))
import fingerprint_test  # noqa: E402  pylint: disable=wrong-import-position
import grade_test  # noqa: E402  pylint: disable=wrong-import-position
from testing import UPSWING, without_seconds  # noqa: E402  pylint: disable=wrong-import-position

WINE = ROOT / "tools/windows/wine"
PROGRAM = ROOT / "build/windows/bin/upswing.exe"
PAGE = ROOT / "build/web"
AGENTS = ROOT / "web/public/agents"
PATIENCE = 1200  # s, after which a program counts as hanging
STUDY = """title = "Little"
seeds = [1, 2]
[settings]
agent = "fast"
steps = 10000
stop_when_solved = false
[variants.with]
[variants.but]
gamma = 0.98
"""


def why_not():
    """Why the tests cannot run; None if they can."""
    if shutil.which("wine") is None:
        return "expected Wine, found none"
    if not PROGRAM.exists():
        return f"expected {PROGRAM.relative_to(ROOT)}, found none"
    return None


class WindowsTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="upswing-")
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)

    def start(self, *arguments):
        return subprocess.Popen([WINE, PROGRAM, *map(str, arguments)], cwd=self.folder, stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                env=os.environ | {"UPSWING_PAGE": str(PAGE)})

    def finish(self, process):
        """The exit code, output and errors."""
        with process:
            out, errors = process.communicate(timeout=PATIENCE)
        return process.returncode, out.decode(), errors.decode()

    def succeed(self, *arguments):
        code, out, errors = self.finish(self.start(*arguments))
        errors = "".join(line for line in errors.splitlines(True) if "gnuplot-nox" not in line)  # no figures
        self.assertEqual((code, errors), (0, ""), out)
        self.assertNotIn("\r\n", out)
        return out

    def refuse(self, arguments, *words):
        """Expects bad input: an error in one line with these words."""
        code, out, errors = self.finish(self.start(*arguments))
        self.assertEqual((code, out, len(errors.splitlines())), (2, "", 1), errors)
        for word in words:
            self.assertIn(word, errors)

    def train(self, out, *more):
        return self.succeed("train", "--agent", "fast", "--out", out, *more)

    def test_a_training_has_the_bits_of_linux_with_any_number_of_threads(self):
        expected = fingerprint_test.PINNED["fast"][0]
        for threads in (1, 3):
            self.train(f"run{threads}", *fingerprint_test.CASES["fast"], "--threads", threads,
                       "--no-stop-when-solved")
            found = fingerprint_test.policy_digest(self.folder / f"run{threads}/policy.safetensors")
            self.assertEqual(found, expected)
        self.assertEqual(*(without_seconds(self.folder / f"run{threads}/evals.csv") for threads in (1, 3)))

    def test_a_training_solves_the_task_and_its_policy_succeeds(self):
        self.assertIn("Solved after", self.train("run"))
        report = json.loads(self.succeed("eval", "run", "--json"))
        self.assertGreaterEqual(report["success_rate"], 0.99, report)

    def test_a_class_gets_the_table_of_linux(self):
        folder = self.folder / "class"
        folder.mkdir()
        for agent in grade_test.ONE_OF_EACH:
            shutil.copy(AGENTS / f"{agent}.safetensors", folder)
        self.succeed("grade", "class", *grade_test.QUICK, "--out", "out")
        subprocess.run([UPSWING, "grade", "class", *map(str, grade_test.QUICK), "--out", "here"],
                       cwd=self.folder, check=True, stdout=subprocess.DEVNULL)
        self.assertEqual(*((self.folder / out / "table.csv").read_bytes() for out in ("out", "here")))

    @unittest.skipUnless((PAGE / "single.html").exists(), "needs the built page, build/web")
    def test_the_page_is_one_file_with_the_bytes_of_linux(self):
        shutil.copy(AGENTS / "fast.safetensors", self.folder / "mine.safetensors")
        self.succeed("demo", "mine.safetensors", "--file", "page.html")
        subprocess.run([UPSWING, "demo", "mine.safetensors", "--file", "here.html"], cwd=self.folder,
                       check=True, stdout=subprocess.DEVNULL, env=os.environ | {"UPSWING_PAGE": str(PAGE)})
        self.assertEqual(*(sorted((self.folder / name).read_text(encoding="utf-8").splitlines())
                           for name in ("page.html", "here.html")))

    def test_names_may_have_any_letters(self):
        for out in ("Läufe mit Ü", "бег", "😀"):
            self.assertIn(out, self.train(f"{out}/1", "--steps", 2000))
            self.assertTrue((self.folder / out / "1/policy.safetensors").exists())
            self.assertIn("greedy policy", self.succeed("info", f"{out}/1"))

    def test_a_run_is_trained_by_one_process_and_resumed(self):
        first = self.start("train", "--agent", "fast", "--out", "run", "--steps", "100000000",
                           "--checkpoint-every", 10000, "--no-stop-when-solved")
        try:
            for _ in range(PATIENCE):
                if (self.folder / "run/policy.safetensors").exists():
                    break
                time.sleep(1)
            self.refuse(["train", "--resume", "run"], "another process is at work here")
        finally:
            first.kill()  # Wine runs the program in this process
            self.finish(first)
        # The lock ends with its process, also if that was killed.
        self.assertIn("step", self.succeed("train", "--resume", "run", "--steps", 2000000))

    def test_a_study_runs_in_several_processes(self):
        (self.folder / "little.toml").write_text(STUDY, encoding="utf-8")
        self.succeed("study", "little.toml", "--out", "study", "--jobs", 2)
        again = self.succeed("study", "little.toml", "--out", "study")
        self.assertIn("4 already done", again)
        self.assertEqual(list((self.folder / "study").rglob("*.claim")), [])

    def test_missing_parts_say_so(self):
        self.refuse(["run", "fast", "--link", "udp:127.0.0.1:4000"], "UDP and serial links exist on Linux only")


if __name__ == "__main__":
    problem = why_not()
    if problem:
        print(f"skipped: {problem}; ./upswing test --windows installs and builds it")
        sys.exit(77)
    unittest.main()
