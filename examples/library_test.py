#!/usr/bin/env python3
"""Tests of the installed library: its package, its headers and the examples, used as your own
project would use them.

UPSWING names the program; its build folder is used (see src/cli/testing.py).
"""

import csv
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parent.parent))
UPSWING = Path(os.environ.get("UPSWING", ROOT / "build/release/bin/upswing"))
BUILD = UPSWING.parent.parent
POLICY = ROOT / "web/public/agents/d3qn.safetensors"
LAYERS, EXTRAS = (re.search(rf"UPSWING_{name} ([^)]*)\)",
                            (ROOT / "cmake/install.cmake").read_text(encoding="utf-8"))[1].split()
                  for name in ("LAYERS", "EXTRAS"))
FOLDERS = [*LAYERS, *(f"extras/{name}" for name in EXTRAS)]  # of headers


def run(*command, **more):
    """Returns a command's output; its errors fail the test."""
    done = subprocess.run([str(part) for part in command], check=False, encoding="utf-8",
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more)
    assert done.returncode == 0, f"{command}: {done.returncode}\n{done.stdout}"
    return done.stdout


PORTABLE = ["base", "nn", "pendulum", "rl", "control"]
EXAMPLES = ["control_loop", "dqn_on_one_page", "own_task", "train_and_judge"]

# A project that finds the library, with one target for each part to build.
PROJECT = f"""cmake_minimum_required(VERSION 3.25)
project(everything LANGUAGES CXX)
foreach(name IN ITEMS {" ".join(EXAMPLES)})
  add_subdirectory({ROOT}/examples/${{name}} ${{name}})
endforeach()
target_compile_options(dqn_on_one_page PRIVATE -O2)
add_subdirectory(portable)
add_subdirectory(headers)
add_subdirectory(wants)
add_subdirectory(mine)
"""
PORTABLE_HEADERS = """find_package(upswing REQUIRED COMPONENTS pendulum rl control)
add_library(portable OBJECT portable.cc)
target_link_libraries(portable PRIVATE upswing::pendulum upswing::rl upswing::control)
"""
HEADERS = """find_package(upswing REQUIRED)
add_library(all_of_them OBJECT all.cc)
target_link_libraries(all_of_them PRIVATE upswing::judge upswing::control)
"""
# Requests for the package, and whether it accepts them: the minor version has to match.
VERSION = re.search(r"project\(upswing VERSION (\d+\.\d+)",
                    (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
WANTED = {VERSION: "1", "0.3": "0", "0.99": "0", "1.0": "0", f"{VERSION} COMPONENTS physics": "0",
          f"{VERSION} COMPONENTS rl": "1"}
WANTS = "foreach(wanted " + " ".join(f'"{wanted}"' for wanted in WANTED) + """)
  separate_arguments(words UNIX_COMMAND "${wanted}")
  find_package(upswing ${words} QUIET)
  message(STATUS "wants ${wanted}: ${upswing_FOUND}")
  if(words MATCHES "physics")
    message(STATUS "refused: ${upswing_NOT_FOUND_MESSAGE}")
  endif()
endforeach()
"""


# The project of the documentation: its CMakeLists.txt and its source.
DOCUMENTED = (ROOT / "docs/howto/cpp-library.md").read_text(encoding="utf-8")
MINE = {kind: re.search(rf"(?s)^```{kind}\n(.*?)^```", DOCUMENTED, re.MULTILINE)[1] for kind in ("cmake", "cpp")}


class Library(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """Installs the library, then configures and builds everything that uses it."""
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = Path(cls.temporary.name)
        run("cmake", "--install", BUILD, "--prefix", cls.folder / "before")
        cls.prefix = (cls.folder / "before").rename(cls.folder / "moved")  # installations can move
        cls.include = cls.prefix / "include/upswing"
        source = cls.folder / "source"
        for path, text in (("CMakeLists.txt", PROJECT), ("portable/CMakeLists.txt", PORTABLE_HEADERS),
                           ("portable/portable.cc", cls.all_headers(PORTABLE)),
                           ("headers/CMakeLists.txt", HEADERS),
                           ("headers/all.cc", cls.all_headers(FOLDERS)),
                           ("mine/CMakeLists.txt", MINE["cmake"]), ("mine/mine.cc", MINE["cpp"]),
                           ("wants/CMakeLists.txt", WANTS)):
            (source / path).parent.mkdir(parents=True, exist_ok=True)
            (source / path).write_text(text, encoding="utf-8")
        cache = (BUILD / "CMakeCache.txt").read_text(encoding="utf-8")
        compiler = re.search(r"^CMAKE_CXX_COMPILER:\w+=(.*)", cache, re.MULTILINE)[1]
        # The slow code is in the library, so most of these programs need no optimisation.
        options = [f"-DCMAKE_CXX_COMPILER={compiler}", f"-DCMAKE_PREFIX_PATH={cls.prefix}",
                   "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS_RELEASE=-O0 -DNDEBUG",
                   "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror"]
        if shutil.which("ccache"):
            options.append("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
        cls.build_folder = cls.folder / "build"
        cls.environment = os.environ | {"CCACHE_BASEDIR": str(cls.folder), "CCACHE_NOHASHDIR": "1"}
        cls.configured = run("cmake", "-S", source, "-B", cls.build_folder, "-G", "Ninja", *options,
                             env=cls.environment)
        # Failures are reported by each part's own test, which builds it again.
        subprocess.run(["cmake", "--build", cls.build_folder, "--", "-k", "0"], check=False,
                       env=cls.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    @classmethod
    def all_headers(cls, layers):
        """A source that includes every header of the layers."""
        headers = [path.relative_to(cls.include) for layer in layers
                   for path in sorted((cls.include / layer).glob("*.h"), reverse=True)]
        assert len(headers) > 5 * len(layers), headers
        return "".join(f'#include "{header}"\n' for header in headers)

    def build(self, *targets):
        """Builds targets unless they are built already. Returns the program of the last one."""
        run("cmake", "--build", self.build_folder, "--target", *targets, env=self.environment)
        return self.build_folder / targets[-1] / targets[-1]

    def test_train_and_judge(self):
        lines = run(self.build("train_and_judge")).splitlines()
        self.assertEqual(lines[-2], "solved")
        judged = re.match(r"judged in MuJoCo: (\d+) of 100 episodes", lines[-1])
        self.assertGreaterEqual(int(judged[1]), 95)

    def test_the_project_of_the_documentation(self):
        self.assertEqual(run(self.build("mine")), "solved\n")

    def test_own_task(self):
        program = self.build("own_task")
        for algorithm in ("sac", "ppo"):
            self.assertRegex(run(program, algorithm), r"\nsolved after \d+ steps\n$")
        self.assertNotIn("mujoco", run("ldd", program))

    def test_dqn_on_one_page(self):
        lines = run(self.build("dqn_on_one_page"), "--seed", 1).splitlines()
        self.assertRegex(lines[-1], r"^balances: 20 of 20 episodes after \d+ steps\.$")
        source = ROOT / "examples/dqn_on_one_page/dqn_on_one_page.cc"
        lengths = [len(line) for line in source.read_text(encoding="utf-8").splitlines()]
        self.assertLessEqual(len(lengths), 250)
        self.assertLessEqual(max(lengths), 100)

    def test_control_loop(self):
        program = self.build("control_loop")
        rows = list(csv.DictReader(run(UPSWING, "simulate", POLICY, "--seconds", 5).splitlines()))
        states = "".join(f"{row['q1']} {row['q2']} {row['w1']} {row['w2']}\n"
                         for row in rows)
        torques = run(program, POLICY, input=states).splitlines()
        self.assertEqual(torques, [row["torque"] for row in rows])
        self.assertGreater(len(set(torques)), 3)
        bad = subprocess.run([program, POLICY], input="0 0 north 0\n", check=False,
                             encoding="utf-8", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertEqual((bad.returncode, bad.stdout), (2, ""))
        self.assertIn("four numbers", bad.stderr)

    def test_every_target_and_example_is_documented(self):
        text = (ROOT / "docs/howto/cpp-library.md").read_text(encoding="utf-8")
        self.assertEqual(re.findall(r"^\| `upswing::(\w+)`", text, re.MULTILINE), LAYERS + EXTRAS)
        for path in (ROOT / "examples").glob("*/CMakeLists.txt"):
            name = path.parent.name
            self.assertIn(f"(../../examples/{name}/{name}.cc)", text)

    def test_every_header_can_be_included(self):
        self.assertEqual({path.name for path in self.include.iterdir()}, {*LAYERS, "extras"})
        self.assertEqual({path.name for path in (self.include / "extras").iterdir()}, set(EXTRAS))
        self.build("portable", "all_of_them")

    def test_package_refuses_what_it_is_not(self):
        answers = dict(re.findall(r"^-- wants (.*?): (\d)$", self.configured, re.MULTILINE))
        self.assertEqual(answers, WANTED)
        self.assertRegex(self.configured, r"-- refused: expected components among base, .*, deploy; got physics\n")

    def test_installed_program(self):
        self.assertIn("MuJoCo 4.0.0",
                      run(self.prefix / "bin/upswing", "info"))


if __name__ == "__main__":
    unittest.main()
