#!/usr/bin/env python3
"""The page's module, web/wasm/core.wasm, is that of the sources: compiled again it has the same bytes.

Skipped where the compiler is missing (./upswing test installs it), and where another version of a
library is installed than those in core.txt, which makes other bytes.
"""

import sys
import tempfile
import unittest
from pathlib import Path

import build


class Module(unittest.TestCase):
    def test_is_that_of_the_sources(self):
        module = build.HERE / "core.wasm"
        made_with = module.with_suffix(".txt").read_text(encoding="utf-8").strip()
        with tempfile.TemporaryDirectory(prefix="upswing-") as folder:
            again = Path(folder) / "core.wasm"
            build.make(again)
            self.assertEqual(again.with_suffix(".txt").read_text(encoding="utf-8").strip(), made_with)
            self.assertTrue(again.read_bytes() == module.read_bytes(),
                            "web/wasm/core.wasm is not that of the sources: run web/wasm/build.py, "
                            "and put the new module under version control")


if __name__ == "__main__":
    if not build.ZIG.exists() or not build.HIGHWAY.exists():
        sys.exit("skipped: the compiler is missing; ./upswing test installs it")
    there = (build.HERE / "core.txt").read_text(encoding="utf-8").strip()
    if build.versions() != there:
        print(f"skipped: core.wasm is of {there}, here are {build.versions()}")
        sys.exit()
    unittest.main()
