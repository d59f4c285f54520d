"""Helpers that the tests of `upswing export --c` share: compiling a header and running it."""

import array
import csv
import functools
import random
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "src/cli"))
from testing import ROOT, ProgramTest, probe  # noqa: E402

AGENTS = ROOT / "web/public/agents"
EXAMPLE = ROOT / "examples/c"
COUNT = 2000
STRICT = ["-pedantic", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion", "-Wshadow"]
SANITIZE = ["-fsanitize=undefined,address", "-fno-sanitize-recover=all"]
# The installed compilers: (command, language options).
COMPILERS = [(compiler, standard)
             for compiler, standard in (("gcc", "-std=c99"), ("clang", "-std=c99"),
                                        ("clang-14", "-std=c99"), ("g++", "-std=c++98"),
                                        ("g++", "-std=c++20"))
             if shutil.which(compiler)]

# Reads rows of float: whether an episode begins, the state, the torque that acted after it. Writes
# status, torque and outputs of each.
DRIVER = r"""
#include "policy.h"
#include <stdio.h>

int main(void)
{
  float in[6];
  policy_state state;
  policy_init(&state);
  while (fread(in, sizeof(in), 1, stdin) == 1) {
    float out[2 + POLICY_OUTPUT_SIZE], observation[POLICY_OBSERVATION_SIZE];
    policy_state copy;
    if (in[0] > 0.0f) policy_init(&state);
    copy = state;
    out[0] = (float)policy_control(&state, in[1], in[2], in[3], in[4], &out[1]);
    policy_observe(&copy, in[1], in[2], in[3], in[4], observation);
    policy_outputs(observation, out + 2);
    fwrite(out, sizeof(out), 1, stdout);
    if (in[0] >= 0.0f) state.torque = in[5];
  }
  return policy_selftest() == POLICY_OK ? 0 : 1;
}
"""


def compile_c(folder, source, *options, compiler="gcc", standard="-std=c99"):
    """Compiles a file of the folder. Returns the compiler's messages."""
    language = ["-x", "c++"] if compiler == "g++" else []
    return subprocess.run([compiler, standard, *STRICT, *options, *language, source, "-x", "none",
                           "-o", "program", "-lm"], cwd=folder, check=False,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, encoding="utf-8")


def rows_of(numbers, count):
    """An array split into `count` rows."""
    width = len(numbers) // count
    return [numbers[i * width:(i + 1) * width] for i in range(count)]


@functools.cache
def random_states():
    """Random states, rounded to float: angles of several turns, then velocities."""
    rng = random.Random(0)
    bounds = [3 * 3.14] * 2 + [8] * 2
    return array.array("f", (rng.uniform(-bound, bound) for _ in range(COUNT) for bound in bounds))


HAS_CORTEX_M4 = bool(shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm"))
NO_CORTEX_M4 = "no gcc-arm-none-eabi and qemu-system-arm here"
CORTEX_M4 = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]


def run_on_cortex_m4(folder, source, *qemu, optimize="-O2"):
    """Builds a program with the policy.h of the folder for the Cortex-M4 and runs it there, in QEMU."""
    board = EXAMPLE / "cortex_m4"
    done = subprocess.run(
        ["arm-none-eabi-gcc", "-std=c99", optimize, *STRICT, *CORTEX_M4, "-I.", source,
         board / "startup.c", "--specs=rdimon.specs", "-T", board / "mps2_an386.ld",
         "-Wl,--gc-sections", "-o", "program.elf", "-lm"], cwd=folder, check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8")
    if "rdimon.specs" in done.stdout:
        raise unittest.SkipTest("no libnewlib-arm-none-eabi here")
    assert (done.returncode, done.stdout) == (0, ""), done.stdout
    return subprocess.run(
        ["qemu-system-arm", "-M", "mps2-an386", "-semihosting", "-nographic", *qemu, "-kernel",
         "program.elf"], cwd=folder, check=False, stdin=subprocess.DEVNULL, timeout=300,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8")


def constants_of(plant):
    """J1, J2, b, a, G1, G2, d1, d2 of a plant of two solid capsules (pendulum/equations.h)."""
    def inertia(mass, length):
        radius = 0.04
        share = length / (length + 4 / 3 * radius)  # of the cylinder in the mass
        ends = 2 * radius**2 / 5 + length**2 / 4 + 3 * length * radius / 8
        return mass * (share * (3 * radius**2 + length**2) / 12 + (1 - share) * ends)
    m1, m2, l1, l2 = (plant[name] for name in ("mass1", "mass2", "length1", "length2"))
    j1 = inertia(m1, l1) + m1 * l1**2 / 4 + m2 * l1**2 + 0.01
    return [j1, inertia(m2, l2) + m2 * l2**2 / 4, m2 * l1 * l2 / 2, 0.01,
            (m1 * l1 / 2 + m2 * l1) * plant["gravity"], m2 * l2 / 2 * plant["gravity"],
            plant["damping1"], plant["damping2"]]


class HeaderTest(ProgramTest):
    def build(self, policy, *options):
        """Exports policy.h and compiles the driver with it."""
        self.succeed("export", policy, "--c", "policy.h")
        self.compile_driver(*options)

    def compile_driver(self, *options, **language):
        self.write("driver.c", DRIVER)
        self.compile("driver.c", "-O1", *options, **language)

    def compile(self, *arguments, **more):
        done = compile_c(self.folder, *arguments, **more)
        self.assertEqual((done.returncode, done.stdout), (0, ""))

    def drive(self, states, begins=None, torques=None, code=0):
        """(status, torque, outputs) of each state."""
        count = len(states) // 4
        numbers = array.array("f")
        for i, row in enumerate(rows_of(states, count)):
            numbers.append(1 if begins is None else begins[i])
            numbers.extend(row)
            numbers.append(0 if torques is None else torques[i])
        done = subprocess.run([self.folder / "program"], check=False, input=numbers.tobytes(),
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertEqual((done.returncode, done.stderr), (code, b""))
        return [(row[0], row[1], row[2:])
                for row in rows_of(array.array("f", done.stdout), count)]

    def assert_same(self, got, torques):
        """Asserts equal torques, except where two outputs are practically equal."""
        limit = float(re.search(r"POLICY_TORQUE_LIMIT (\S+)f", self.header())[1])
        scale = max(abs(x) for _, _, outputs in got for x in outputs)
        others = 0
        for (status, torque, outputs), expected in zip(got, torques, strict=True):
            self.assertEqual(status, 0)
            self.assertLessEqual(abs(torque), limit)
            if abs(torque - expected) <= 1e-4 * limit:
                continue
            others += 1
            best = sorted(outputs)[-2:]
            self.assertEqual(len(best), 2, (torque, expected))
            self.assertLessEqual(best[1] - best[0], 1e-4 * scale, (torque, expected))
        self.assertLessEqual(others, len(got) // 1000)
        self.assertGreater(len({torque for _, torque, _ in got}), 1)

    def header(self):
        return (self.folder / "policy.h").read_text(encoding="ascii")

    def check(self, policy, *options):
        """Asserts equal torques in COUNT random states, each the beginning of an episode."""
        self.build(policy, *options)
        states = random_states()
        expected = rows_of(probe(policy, "states", states), COUNT)
        self.assert_same(self.drive(states), [row[0] for row in expected])

    def self_test(self):
        """The exit code of a program that runs the header's self-test."""
        self.write("test.c", '#include "policy.h"\nint main(void) { return (int)policy_selftest(); }')
        self.compile("test.c")
        return subprocess.run([self.folder / "program"], check=False).returncode

    def closed_loops(self, policy, *flags):
        """Successes of the program and of policy.h in the same episodes of `eval`, with its flags."""
        self.succeed("eval", policy, *flags, "--physics", "closed-form", "--episodes-csv", "episodes.csv")
        with open(self.folder / "episodes.csv", encoding="ascii", newline="") as file:
            rows = [{name: float(text) for name, text in row.items() if text}
                    for row in csv.DictReader(file)]
        numbers = array.array("d")
        for row in rows:
            start = [row[name] for name in ("q1", "q2", "w1", "w2")]
            goal = [float(row.get(name, 1) > 0) for name in ("goal1", "goal2")]
            numbers.extend([*constants_of(row), *start, *goal])
        self.compile(Path(__file__).parent / "testdata/closed_loop.c", "-O2", "-I.")
        done = subprocess.run([self.folder / "program"], check=True, input=numbers.tobytes(),
                              stdout=subprocess.PIPE)
        results = rows_of(array.array("d", done.stdout), len(rows))
        self.assertEqual({failed for _, _, failed in results}, {0})
        return [row["success"] for row in rows], [success for success, _, _ in results]
