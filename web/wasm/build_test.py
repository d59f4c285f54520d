#!/usr/bin/env python3
"""The page's module, build/wasm/core.wasm, follows its sources.

With UPSWING_COMPILE_WASM=1 a copy of the sources in another folder is compiled, too, which takes
minutes, and has to give the same bytes.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import build

COMPILES = os.environ.get("UPSWING_COMPILE_WASM") == "1"
HAS_COMPILER = all(folder.exists() for folder in (build.ZIG, build.HIGHWAY, build.MUPARSER))


class Key(unittest.TestCase):
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


    def test_unchanged_sources_are_not_compiled_again(self):
        with tempfile.TemporaryDirectory(prefix="upswing-") as name:
            folder = Path(name)
            module, key = folder / "core.wasm", folder / "core.key"
            with mock.patch.multiple(build, WORK=folder, MODULE=module, KEY=key, ZIG=folder,
                                     HIGHWAY=folder, MUPARSER=folder, compile_module=mock.DEFAULT) as fakes:
                compiled = fakes["compile_module"]
                module.touch()
                key.write_text(build.key(), encoding="utf-8")
                build.make()
                compiled.assert_not_called()
                for change in (lambda: key.write_text("another", encoding="utf-8"), key.unlink, module.unlink):
                    module.touch()
                    key.write_text(build.key(), encoding="utf-8")
                    compiled.reset_mock()
                    change()
                    build.make()
                    compiled.assert_called_once()

    def test_a_changed_source_or_version_changes_the_key(self):
        before = build.key()
        with mock.patch.object(build, "versions", lambda: "others"):
            self.assertNotEqual(build.key(), before)
        with tempfile.TemporaryDirectory(prefix="upswing-") as name:
            copy = copy_of_sources(Path(name))
            self.assertEqual(key_in(copy), before)
            header = copy / "src/nn/linear.h"
            header.write_text(header.read_text(encoding="utf-8") + "// a word\n", encoding="utf-8")
            self.assertNotEqual(key_in(copy), before)


class Module(unittest.TestCase):
    @unittest.skipUnless(COMPILES, "takes minutes")
    def test_another_folder_gives_the_same_bytes(self):
        build.make()
        with tempfile.TemporaryDirectory(prefix="upswing-") as name:
            copy = copy_of_sources(Path(name) / "a folder")
            for tools in (build.ZIG, build.HIGHWAY, build.MUPARSER):
                shutil.copytree(tools, copy / tools.relative_to(build.ROOT))
            subprocess.run([sys.executable, "-B", copy / "web/wasm/build.py"], check=True)
            again = (copy / "build/wasm/core.wasm").read_bytes()
        self.assertTrue(again == build.MODULE.read_bytes())


def copy_of_sources(folder):
    """Copies what the module is made of, and returns the folder."""
    for name in ("src", "configs", "web/wasm"):
        shutil.copytree(build.ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "tools").mkdir()
    for path in [build.ROOT / "CMakeLists.txt", *(build.ROOT / "tools").glob("*-requirements.txt")]:
        shutil.copy(path, folder / path.relative_to(build.ROOT))
    return folder


def key_in(folder):
    done = subprocess.run([sys.executable, "-B", folder / "web/wasm/build.py", "--key"], check=True,
                          stdout=subprocess.PIPE, encoding="utf-8")
    return done.stdout.strip()


if __name__ == "__main__":
    if COMPILES and not HAS_COMPILER:
        sys.exit("skipped: the compiler is missing; ./upswing test installs it")
    unittest.main()
