#!/usr/bin/env python3
"""Tests of tools/fetch_wheel: bad arguments are refused before any download; existing files are
kept."""

import subprocess
import tempfile
import unittest
from pathlib import Path

FETCH = Path(__file__).resolve().parent / "fetch_wheel"


class FetchWheel(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="upswing-")
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name) / "mujoco"

    def fetch(self, *arguments):
        return subprocess.run([FETCH, *map(str, arguments)], check=False, capture_output=True,
                              text=True)

    def assert_refused(self, arguments, *words):
        done = self.fetch(*arguments)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        for word in words:
            self.assertIn(word, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertFalse(self.folder.exists())

    def test_arguments(self):
        self.assert_refused([], "got 0 arguments")
        self.assert_refused(["mujoco", self.folder, "aarch64", "more"], "got 4 arguments")
        self.assert_refused(["eigen", self.folder], "expected mujoco, node, zig, highway, muparser, highway-source or protobuf, got 'eigen'")
        # Its versions are pinned, too, but it is not a wheel to unpack.
        self.assert_refused(["python", self.folder], "expected mujoco, node, zig, highway, muparser, highway-source or protobuf, got 'python'")

    def test_machine_without_a_wheel(self):
        self.assert_refused(["mujoco", self.folder, "riscv64"],
                            "expected Linux on x86_64 or aarch64", "riscv64")

    def test_existing_files_are_kept(self):
        (self.folder / "lib").mkdir(parents=True)
        library = self.folder / "lib/libmujoco.so.4.0.0"
        library.write_text("here", encoding="utf-8")
        done = self.fetch("mujoco", self.folder, "aarch64")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(library.read_text(encoding="utf-8"), "here")


if __name__ == "__main__":
    unittest.main()
