#!/usr/bin/env python3
"""Tests of address.py, on copies of the files that it changes, and of the address in the metadata."""

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parents[2]))
PROGRAM = ROOT / "tools/package/address.py"
FILES = ("README.md", "docs/start/install.md", "docs/answers.md", "CITATION.cff", "pyproject.toml")


class Address(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="upswing-")
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        for name in FILES:
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.folder / name)

    def write(self, *arguments):
        return subprocess.run([sys.executable, PROGRAM, *arguments], check=False, capture_output=True, encoding="utf-8",
                              env=os.environ | {"UPSWING_ROOT": str(self.folder)})

    def texts(self):
        return {name: (self.folder / name).read_text(encoding="utf-8") for name in FILES}

    def test_every_file_has_the_address_once(self):
        # The second address takes the place of the first one.
        for url in ("https://example.org/a-team/swing", "https://github.com/some-one/upswing/"):
            done = self.write(url)
            self.assertEqual((done.returncode, done.stderr), (0, ""), done)
            url = url.rstrip("/")
            texts = self.texts()
            for name in FILES:
                self.assertEqual(texts[name].count("some-one/upswing" if "some-one" in url else "a-team/swing"), 1, name)
            self.assertIn(f"git clone {url} upswing", texts["README.md"])
            self.assertIn(f"\n  url     = {{{url}}}\n}}\n", texts["docs/answers.md"])
            self.assertIn(f"\nrepository-code: {url}\n", texts["CITATION.cff"])
            self.assertEqual(tomllib.loads(texts["pyproject.toml"])["project"]["urls"]["Source"], url)
        self.assertNotIn("a-team", "".join(texts.values()))

    def test_another_text_is_no_address(self):
        before = self.texts()
        for arguments in ([], ["upswing"], ["http://example.org/a"], ["https://example.org"], ["https://a/b c"],
                          ['https://a/b"'], ["https://a/b", "https://a/c"], ["https://a/b?c"]):
            with self.subTest(arguments=arguments):
                done = self.write(*arguments)
                self.assertEqual(done.returncode, 1)
                self.assertRegex(done.stderr, r"\Aaddress.py: expected .*\n\Z")
                self.assertEqual(self.texts(), before)


class Metadata(unittest.TestCase):
    def test_versions_of_python_authors_and_addresses(self):
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        # package.py builds for CPython 3.11, and for 3.12 and later.
        self.assertEqual(project["requires-python"], ">=3.11")
        self.assertTrue(project["authors"])
        self.assertTrue(project["urls"])


if __name__ == "__main__":
    unittest.main()
