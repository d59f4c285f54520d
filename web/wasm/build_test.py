#!/usr/bin/env python3
"""The page's module, web/wasm/core.wasm, is up to date.

Its record, core.txt, holds hashes of the sources and of the module. If both match, nothing is
compiled. Otherwise, and with UPSWING_COMPILE_WASM=1, the sources are compiled again and must give
the same bytes.

The compilation is skipped if the compiler is missing (./upswing test installs it), or if the
versions differ from core.txt.
"""

import os
import sys
import tempfile
import unittest
from pathlib import Path

import build

MODULE = build.HERE / "core.wasm"
COMPILES = os.environ.get("UPSWING_COMPILE_WASM") == "1" or not build.is_recorded(MODULE)


class Module(unittest.TestCase):
    @unittest.skipUnless(COMPILES, "core.txt records these sources and this module")
    def test_is_that_of_the_sources(self):
        with tempfile.TemporaryDirectory(prefix="upswing-") as folder:
            again = Path(folder) / "core.wasm"
            build.make(again)
            self.assertTrue(again.read_bytes() == MODULE.read_bytes(),
                            "web/wasm/core.wasm is out of date: run web/wasm/build.py, "
                            "and put the new module under version control")
            self.assertEqual(build.recorded(again), build.recorded(MODULE),
                             "web/wasm/core.txt is out of date: run web/wasm/build.py")

    def test_every_source_and_header_counts(self):
        names = {str(path.relative_to(build.ROOT)) for path in build.included(build.own_sources())}
        self.assertLessEqual({"web/wasm/api.cc", "src/nn/linear.cc", "src/nn/linear.h", "src/rl/agent.h"}, names)
        with tempfile.TemporaryDirectory(prefix="upswing-") as name:
            folder = Path(name)
            (folder / "a.cc").write_text('#include "b.h"\n', encoding="utf-8")
            (folder / "b.h").write_text('#include <vector>\n  #  include "c.h"\n', encoding="utf-8")
            (folder / "c.h").write_text('#include "b.h"\n', encoding="utf-8")
            self.assertEqual([path.name for path in build.included([folder / "a.cc"])],
                             ["a.cc", "b.h", "c.h"])


if __name__ == "__main__":
    if COMPILES and not (build.ZIG.exists() and build.HIGHWAY.exists()):
        sys.exit("skipped: the compiler is missing; ./upswing test installs it")
    if COMPILES and build.versions() != build.recorded(MODULE)[0]:
        print(f"skipped: core.wasm needs {build.recorded(MODULE)[0]}, found {build.versions()}")
        sys.exit()
    unittest.main()
