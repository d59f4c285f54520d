#!/usr/bin/env python3
"""The installed library: its package, its headers and the examples, as a project of one's own would
use them.

The build folder is that of the program in UPSWING (see apps/testing.py).
"""

import csv
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parent.parent))
UPSWING = Path(os.environ.get("UPSWING", ROOT / "build/release/apps/upswing"))
BUILD = UPSWING.parent.parent
POLICY = ROOT / "web/public/agents/d3qn.safetensors"
LAYERS = re.search(r"UPSWING_LAYERS ([^)]*)\)",
                   (ROOT / "cmake/install.cmake").read_text(encoding="utf-8"))[1].split()


def run(*command, **more):
    """What a command prints; its errors fail the test."""
    done = subprocess.run([str(part) for part in command], check=False, encoding="utf-8",
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more)
    assert done.returncode == 0, f"{command}: {done.returncode}\n{done.stdout}"
    return done.stdout


class Library(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = Path(cls.temporary.name)
        run("cmake", "--install", BUILD, "--prefix", cls.folder / "before")
        cls.prefix = (cls.folder / "before").rename(cls.folder / "moved")  # it need not stay
        cache = (BUILD / "CMakeCache.txt").read_text(encoding="utf-8")
        cls.compiler = re.search(r"^CMAKE_CXX_COMPILER:\w+=(.*)", cache, re.MULTILINE)[1]

    def build(self, source, build_type="Release"):
        """Configures and builds a project against the library; returns the build folder."""
        folder = self.folder / f"build-{source.name}"
        run("cmake", "-S", source, "-B", folder, "-G", "Ninja", f"-DCMAKE_BUILD_TYPE={build_type}",
            f"-DCMAKE_CXX_COMPILER={self.compiler}", f"-DCMAKE_PREFIX_PATH={self.prefix}",
            "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror")
        run("cmake", "--build", folder)
        return folder

    def build_example(self, name):
        """Builds an example; returns its program."""
        return self.build(ROOT / "examples" / name) / name

    def build_text(self, name, cmake, build_type="Release", **sources):
        """Builds a project of these files."""
        folder = self.folder / name
        folder.mkdir()
        (folder / "CMakeLists.txt").write_text(
            f"cmake_minimum_required(VERSION 3.25)\nproject({name} LANGUAGES CXX)\n{cmake}",
            encoding="utf-8")
        for source, text in sources.items():
            (folder / f"{source}.cc").write_text(text, encoding="utf-8")
        return self.build(folder, build_type)

    def test_train_and_judge(self):
        lines = run(self.build_example("train_and_judge")).splitlines()
        self.assertEqual(lines[-2], "solved")
        judged = re.match(r"judged in MuJoCo: (\d+) of 200 episodes", lines[-1])
        self.assertGreaterEqual(int(judged[1]), 190)

    def test_own_task(self):
        program = self.build_example("own_task")
        self.assertRegex(run(program), r"\nsolved after \d+ steps\n$")
        self.assertNotIn("mujoco", run("ldd", program))

    def test_control_loop(self):
        program = self.build_example("control_loop")
        rows = list(csv.DictReader(run(UPSWING, "simulate", POLICY, "--seconds", 5).splitlines()))
        states = "".join(f"{row['qpos0']} {row['qpos1']} {row['qvel0']} {row['qvel1']}\n"
                         for row in rows)
        torques = run(program, POLICY, input=states).splitlines()
        self.assertEqual(torques, [row["torque"] for row in rows])
        self.assertGreater(len(set(torques)), 3)
        bad = subprocess.run([program, POLICY], input="0 0 north 0\n", check=False,
                             encoding="utf-8", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertEqual((bad.returncode, bad.stdout), (2, ""))
        self.assertIn("four numbers", bad.stderr)

    def test_blocks_of_the_documentation_are_one_program(self):
        text = (ROOT / "docs/library.md").read_text(encoding="utf-8")
        blocks = re.findall(r"^```cpp\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
        self.assertEqual(len(blocks), 4)
        program = self.build_text(
            "docs", "find_package(upswing REQUIRED COMPONENTS sim rl)\n"
            "add_executable(docs docs.cc)\n"
            "target_link_libraries(docs PRIVATE upswing::sim upswing::rl)\n",
            docs="\n".join(blocks)) / "docs"
        lines = run(program).splitlines()
        self.assertRegex(lines[-1], r"20000 steps, a checkpoint of \d{6,} bytes")
        for begin in ("reward of random torques: ", "return of a brake: ", "loss "):
            self.assertEqual(sum(line.startswith(begin) for line in lines), 1, begin)

    def test_every_target_and_example_is_documented(self):
        text = (ROOT / "docs/library.md").read_text(encoding="utf-8")
        self.assertEqual(re.findall(r"^\| `upswing::(\w+)`", text, re.MULTILINE), LAYERS)
        for path in (ROOT / "examples").glob("*/CMakeLists.txt"):
            name = path.parent.name
            self.assertIn(f"(../examples/{name}/{name}.cc)", text)

    def test_every_header_can_be_included(self):
        include = self.prefix / "include/upswing"
        self.assertEqual({path.name for path in include.iterdir()}, set(LAYERS))
        sources = {"portable": ["core", "nn", "sim", "rl", "control"], "all": LAYERS}
        cmake = ("find_package(upswing REQUIRED)\n"
                 "add_library(portable OBJECT portable.cc)\nadd_library(all_of_them OBJECT all.cc)\n"
                 "target_link_libraries(portable PRIVATE upswing::control upswing::rl)\n"
                 "target_link_libraries(all_of_them PRIVATE upswing::judge upswing::control)\n")
        for name, layers in sources.items():
            headers = [path.relative_to(include) for layer in layers
                       for path in sorted((include / layer).glob("*.h"), reverse=True)]
            self.assertGreater(len(headers), 5 * len(layers))
            sources[name] = "".join(f'#include "{header}"\n' for header in headers)
        self.build_text("headers", cmake, "Debug", **sources)

    def test_package_refuses_what_it_is_not(self):
        for wanted in ("0.3", "0.99", "1.0", "0.4 COMPONENTS physics"):
            with self.assertRaises(AssertionError) as error:
                self.build_text(re.sub(r"\W", "_", f"wants_{wanted}"),
                                f"find_package(upswing {wanted} REQUIRED)\n")
            self.assertIn("Could not find" if "COMP" not in wanted else "physics",
                          str(error.exception))

    def test_installed_program(self):
        self.assertIn("MuJoCo 4.0.0",
                      run(self.prefix / "bin/upswing", "info"))


if __name__ == "__main__":
    unittest.main()
