#!/usr/bin/env python3
"""Tests of the requirement files: every version is pinned by hash, and the Pythons of Debian 12 (3.11.2)
and Debian 13 (3.13) can install all lists. The latter asks the package index: without a network it is
skipped, and this program exits with 77."""

import concurrent.futures
import os
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "src/cli"), str(ROOT / "tools")]
import requirements  # noqa: E402  pylint: disable=wrong-import-position

READY = requirements.UV.exists() or "UPSWING_REQUIRE_PACKAGE" in os.environ
FILES = sorted((ROOT / "tools").glob("**/*requirements*.txt"))


class Requirements(unittest.TestCase):
    def test_every_version_is_pinned_by_hash(self):
        self.assertLessEqual({ROOT / "tools" / name for name in requirements.LISTS}, set(FILES))
        for path in FILES:
            lines = path.read_text(encoding="utf-8").replace("\\\n", "").splitlines()
            for line in lines:
                if line and not line.startswith("#"):
                    self.assertRegex(line, r"^\S+(==| @ https://)\S+( +--hash=sha256:[0-9a-f]{64})+$", path)

    @unittest.skipUnless(READY, "needs build/uv-venv, which ./upswing test makes")
    def test_the_pythons_of_debian_12_and_13_install_every_list(self):
        """A list has all that its packages depend on, in wheels for these Pythons with the listed hashes."""
        places = [(name, *place) for name, places in requirements.LISTS.items() for place in places
                  if place[0] in ("3.11.2", "3.13")]
        with tempfile.TemporaryDirectory(prefix="upswing-") as cache:
            try:
                with concurrent.futures.ThreadPoolExecutor(8) as pool:
                    found = list(pool.map(lambda place: requirements.wheels(
                        ROOT / "tools" / place[0], *place[1:], cache), places))
            except requirements.CannotInstall as error:
                if "error sending request" in str(error):
                    self.skipTest(f"the package index cannot be reached: {error}")
                raise
        for (name, *place), wheels in zip(places, found, strict=True):
            listed = requirements.pins((ROOT / "tools" / name).read_text(encoding="utf-8"))
            for pin, digest in wheels.items():
                self.assertIn(digest, listed.get(pin, ()), (name, place, pin))


if __name__ == "__main__":
    result = unittest.main(exit=False).result
    sys.exit(77 if result.skipped and result.wasSuccessful() else not result.wasSuccessful())
