#!/usr/bin/env python3
"""Tests of `upswing export --c`, for every kind of policy. The header compiles without a warning as
C99 and C++, and gives the program's torques. It detects damage to itself, and input that is not
finite.
"""

import array
import math
import random
import re
import shutil
import subprocess
import sys
import unittest

from c_testing import (AGENTS, COMPILERS, COUNT, EXAMPLE, HAS_CORTEX_M4, NO_CORTEX_M4, SANITIZE, HeaderTest,
                       compile_c, random_states, rows_of, run_on_cortex_m4)
from testing import ROOT, UPSWING, ProgramTest, probe, read_csv, read_tensors, small, write_tensors

sys.path.insert(0, str(ROOT / "tools/results"))
from sizes import image  # noqa: E402

ACTORS = sorted((ROOT / "web/tests/actors").glob("*.safetensors"))

# Reads states of one episode and writes the torques of a controller.
CONTROLLER_DRIVER = r"""
#include "policy.h"
#include <stdio.h>

int main(void)
{
  float in[5];
  policy_state state;
  policy_init(&state);
  in[0] = 0.0f;
  while (fread(in + 1, 4 * sizeof(float), 1, stdin) == 1) {
    float torque;
    if (policy_control(&state, CALL, &torque) != POLICY_OK) return 2;
    fwrite(&torque, sizeof(torque), 1, stdout);
  }
  return policy_selftest() == POLICY_OK ? 0 : 1;
}
"""


class HeadersTest(HeaderTest):
    def test_agents_of_the_page(self):
        self.assertEqual(COMPILERS[0], ("gcc", "-std=c99"))
        self.assertIn(("g++", "-std=c++20"), COMPILERS)
        for name in ("fast", "dqn", "d3qn", "sac", "ppo", "d3qn-randomized"):
            with self.subTest(name):
                self.check(AGENTS / f"{name}.safetensors", "-Wconversion")
            if name in ("dqn", "d3qn"):  # larger, but of the same kind as fast
                continue
            for compiler, standard in COMPILERS[1:]:
                with self.subTest(f"{compiler} {standard} {name}"):
                    self.compile_driver("-Wconversion", compiler=compiler, standard=standard)
                    self.drive(random_states()[:40])

    def test_q_network_without_layer_normalisation(self):
        self.succeed(*small(agent="dqn", layer_norm=False, hidden="24,33"))
        self.check(self.folder / "run")
        self.check_outputs_of_the_plain_network()

    def check_outputs_of_the_plain_network(self):
        """A plain network's outputs are its Q-values."""
        states = random_states()
        expected = rows_of(probe(self.folder / "run", "states", states), COUNT)
        scale = max(abs(q) for row in expected for q in row[1:])
        for (_, _, outputs), row in zip(self.drive(states), expected, strict=True):
            for got, q in zip(outputs, row[1:], strict=True):
                self.assertLessEqual(abs(got - q), 1e-4 * scale)

    def test_actors_of_other_kinds(self):
        for path in ACTORS:
            with self.subTest(path.name):
                self.check(path)

    def test_another_plant(self):
        self.succeed(*small(mass1=1.5, length2=0.4, gravity=3, damping2=0.1))
        self.check(self.folder / "run")

    def test_memory_over_rollouts(self):
        policy = AGENTS / "d3qn-randomized.safetensors"
        self.build(policy)
        rng = random.Random(1)
        states, begins, torques = array.array("f"), [], []
        while len(begins) < COUNT:
            start = ",".join(str(rng.uniform(-3, 3)) for _ in range(4))
            self.succeed("simulate", policy, "--start", start, "--physics", "closed-form",
                         "--set", f"mass2={rng.uniform(0.8, 1.2)}", "--unknown-plant",
                         "--csv", "rollout.csv")
            rows = read_csv(self.folder / "rollout.csv")
            for i, row in enumerate(rows):
                states.extend(row[name] for name in ("q1", "q2", "w1", "w2"))
                begins.append(i == 0)
                torques.append(row["torque"])
        self.assert_same(self.drive(states, begins, torques), torques)

    def test_sanitizers(self):
        for name in ("fast", "sac", "d3qn-randomized"):
            with self.subTest(name):
                self.build(AGENTS / f"{name}.safetensors", *SANITIZE)
                far = [x * 10.0 ** random.Random(i).uniform(0, 37)
                       for i, x in enumerate(random_states()[:400])]
                got = self.drive(array.array("f", far) + random_states()[:2000],
                                 begins=[0] * 600)
                self.assertEqual({status for status, _, _ in got}, {0, 1})

    def test_bad_numbers_set_the_status(self):
        bad = [math.nan, -math.nan, math.inf, -math.inf, 3.4e38, -3.4e38]
        for options in ([], ["-O3", "-ffast-math"]):
            for name in ("fast", "ppo", "d3qn-randomized"):
                with self.subTest(f"{name} {options}"):
                    self.build(AGENTS / f"{name}.safetensors", *options)
                    good = [0.1, 0.2, 0.3, 0.4]
                    states, wrong = array.array("f"), []
                    for place in range(4):
                        for x in bad:
                            # Angles may have any size.
                            wrong.append(place > 1 or not abs(x) < math.inf)
                            states.extend([*good[:place], x, *good[place + 1:]])
                            states.extend(good)
                    got = self.drive(states, begins=[-1] * (len(states) // 4))
                    for i, is_wrong in enumerate(wrong):
                        status, torque, _ = got[2 * i]
                        self.assertEqual(status, is_wrong, (i, got[2 * i]))
                        self.assertTrue(not is_wrong or torque == 0)
                        self.assertEqual(got[2 * i + 1][0], 0)
                    # After wrong input the memory is empty: the next call is like the first of an
                    # episode.
                    first = self.drive(array.array("f", good))[0]
                    for i, is_wrong in enumerate(wrong):
                        if is_wrong:
                            self.assertEqual(got[2 * i + 1][1], first[1])

    def test_controllers(self):
        """In closed loops, controllers give the program's torques, except where rounding
        decides."""
        call = ", ".join(f"in[{i + 1}]" for i in range(4))
        driver = CONTROLLER_DRIVER.replace("CALL", call)
        for name, options, begins in (("lqr", ["--lqr-torque", 2], ["3.12,0,0,0"]),
                                      ("energy", [], ["0,0,0,0"]), ("pfl", [], ["0.5,0.3,0,1"]),
                                      ("tvlqr", [], ["0,0,0,0", "-1,2,0,0"]),
                                      ("tvlqr", ["--made-for", "actuated_joint=2"], ["0,0,0,0"]),
                                      ("tvlqr", ["--made-for", "coulomb1=2e-4", "--made-for",
                                                 "coulomb2=2e-4"], ["0,0,0,0"])):
            self.succeed("export", name, *options, "--c", "policy.h")
            self.write("driver.c", driver)
            self.compile("driver.c", "-O1", "-Wconversion", *SANITIZE)
            for begin in begins:
                with self.subTest(f"{name} {options} {begin}"):
                    self.check_controller(name, options, begin)

    def check_controller(self, name, options, begin):
        """Compares a closed loop of the program with the torques of the compiled controller."""
        self.succeed("simulate", name, *options, "--start", begin, "--physics", "closed-form", "--csv",
                     "rollout.csv")
        rows = read_csv(self.folder / "rollout.csv")[:-1]
        numbers = array.array("f", (row[key] for row in rows
                                    for key in ("q1", "q2", "w1", "w2")))
        done = subprocess.run([self.folder / "program"], check=False, input=numbers.tobytes(),
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        errors = [abs(u - row["torque"])
                  for u, row in zip(array.array("f", done.stdout), rows, strict=True)]
        self.assertLessEqual(sum(error > 0.01 for error in errors), 5, sorted(errors)[-9:])

    def test_controllers_of_other_plants_pass_their_self_test(self):
        names = ("mass1", "mass2", "length1", "length2", "damping1", "damping2", "gravity",
                 "torque_limit")
        # The first two starts were hard for choosing a place on the plan, the others for the step.
        for name, values in (
                ("tvlqr", (1.062, 1.135, .513, .498, .188, .226, 9.494, 5.877)),
                ("tvlqr", (1.192, .915, .537, .556, .231, .173, 9.315, 5.92)),
                ("pfl", (2.183, 4.849, .135, 2.33, .265, .076, 6.121, 26.493)),
                ("lqr", (1, 1, .5, .5, .2, .2, 9.81, .5))):
            with self.subTest(f"{name} {values}"):
                plant = [f"--made-for={key}={value}" for key, value in zip(names, values)]
                self.succeed("export", name, *plant, "--c", "policy.h")
                self.assertEqual(self.self_test(), 0)
                inner = re.search(r"sample_torques.*?{(.*?)}", self.header(), re.S).group(1)
                torques = [abs(float(x.strip("f\n "))) for x in inner.split("*/")[-1].split(",")]
                self.assertLess(max(torques[::2]), values[-1])  # near upright

    def test_a_controller_swings_up_in_c_and_knows_when_it_is_damaged(self):
        self.succeed("export", "tvlqr", "--c", "policy.h")
        self.compile(EXAMPLE / "swing_up.c", "-O2", "-I.")
        done = subprocess.run([self.folder / "program"], check=False, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, encoding="utf-8")
        self.assertRegex(done.stderr, "upright from 2.8[0-9] s to the end")
        self.assertEqual((done.returncode, self.self_test()), (0, 0))
        whole = self.header()
        for right, wrong in (("sinf(q2)", "cosf(q2)"), ("e.h2 = p[POLICY_D2]", "e.h2 = -p[POLICY_D2]"),
                             ("h / 6.0f", "h / 5.0f"), ("off[i] = d[i] - sign", "off[i] = d[i] + sign")):
            self.assertEqual(whole.count(right), 1, right)
            self.write("policy.h", whole.replace(right, wrong))
            self.assertEqual(self.self_test(), 3, right)

    def test_a_policy_for_a_plant_of_another_size(self):
        self.write("size.toml", image(0.1, 0.01))
        for flag, file in (("--c", "policy.h"), ("--onnx", "policy.onnx")):
            done = self.run_here("export", "sac", "--plant", "size.toml", flag, file)
            self.assertIn("carried over to a plant of another size", done.stderr)
            self.assertEqual(done.returncode, 0)
        header = self.header()
        for name, value in (("PERIOD", 0.00632), ("TORQUE_LIMIT", 5e-3)):
            got = float(re.search(rf"#define POLICY_{name} (\S+)f", header)[1])
            self.assertAlmostEqual(got / value, 1, delta=0.01)
        self.assertEqual(self.self_test(), 0)
        self.refuse(["export", "mpc", "--plant", "size.toml", "--c", "x.h"],
                    "--plant: expected a learned policy, got mpc; --made-for designs")
        self.refuse(["export", "sac", "--page", "page", "--plant", "size.toml"],
                    "--plant: expected --c or --onnx with it, got --page")

    def test_the_control_period_of_a_controller(self):
        self.succeed("export", "lqr", "--c", "policy.h", "--control-period", 0.01)
        self.assertIn("#define POLICY_PERIOD 0.01f", self.header())
        self.assertEqual(self.self_test(), 0)
        self.refuse(["export", "fast", "--page", "page", "--control-period", 0.02],
                    "--control-period: expected --c or --onnx with it, got --page")

    def test_controllers_that_have_no_header(self):
        for flags in (["--c", "x.h"], ["--onnx", "x.onnx"],
                      ["--c", "x.h", "--swing-up", AGENTS / "fast.safetensors"]):
            self.refuse(["export", "hybrid", *flags],
                        "hybrid: expected a single policy or controller", "each by itself")
        self.refuse(["export", "lqr", "--onnx", "x.onnx"], "lqr: expected a learned policy", "--c")

    def test_null_pointers(self):
        self.succeed("export", AGENTS / "fast.safetensors", "--c", "policy.h")
        self.write("null.c", """#include "policy.h"
            int main(void) {
              policy_state state; float torque = 1.0f;
              policy_init(&state); policy_init(0);
              return policy_control(0, 0, 0, 0, 0, &torque) == POLICY_NULL_POINTER
                && torque == 0.0f
                && policy_control(&state, 0, 0, 0, 0, 0) == POLICY_NULL_POINTER
                && policy_control_observation(0, &torque) == POLICY_NULL_POINTER
                && policy_control_observation(&torque, 0) == POLICY_NULL_POINTER ? 0 : 1;
            }""")
        self.compile("null.c", "-O1")
        self.assertEqual(subprocess.run([self.folder / "program"], check=False).returncode, 0)

    def test_self_test_finds_any_changed_number(self):
        self.succeed(*small(hidden="8,8", head=4, mirror=False, reward_centering=0, tau=0.02))
        self.succeed("export", "run", "--c", "policy.h")
        tables = re.findall(r"static const float (policy_\w+)\[(\d+)\] = ", self.header())
        self.assertGreater(sum(int(count) for _, count in tables), 300)
        # Changes each number in turn, and the last bit of each number that is not a sample. Works
        # in memory, because `const` is removed.
        self.write("change.c", r"""
            #include <math.h>
            #include <stdint.h>
            #include <stdio.h>
            #define const
            #include "policy.h"
            static struct { float *numbers; int count, sample; const char *name; } tables[] = {
              TABLES};
            int main(void) {
              int t, i;
              for (t = 0; t < (int)(sizeof(tables) / sizeof(*tables)); t++) {
                for (i = 0; i < tables[t].count; i++) {
                  float *x = tables[t].numbers + i;
                  const float right = *x;
                  *x = right + (tables[t].sample ? 0.1f : 0.01f) * fmaxf(1.0f, fabsf(right));
                  if (policy_selftest() != POLICY_DAMAGED) printf("%s[%d]\n", tables[t].name, i);
                  *x = nextafterf(right, 9.0f);
                  if (!tables[t].sample && policy_selftest() != POLICY_DAMAGED)
                    printf("last bit of %s[%d]\n", tables[t].name, i);
                  *x = right;
                }
              }
              return policy_selftest() == POLICY_OK ? 0 : 1;
            }""".replace("TABLES", ", ".join(
                f'{{{name}, {count}, {int("sample" in name)}, "{name}"}}' for name, count in tables)))
        self.compile("change.c", "-O1")
        done = subprocess.run([self.folder / "program"], check=False, stdout=subprocess.PIPE,
                              encoding="utf-8")
        self.assertEqual((done.returncode, done.stdout), (0, ""))

    def test_self_test_finds_wrong_arithmetic(self):
        self.succeed("export", AGENTS / "sac.safetensors", "--c", "policy.h")
        whole = self.header()
        for right, wrong in (("sinf(q1)", "cosf(q1)"), ("c12 = c1 * c2 - s1", "c12 = c1 * c2 + s1"),
                             ("w1 / POLICY_MAX_VELOCITY1", "w1 / 11.0f"), ("tanhf(outputs", "sinf(outputs"),
                             ("mean /= (float)size", "mean /= 2.0f * (float)size"),
                             ("POLICY_TORQUE_LIMIT 5.0f", "POLICY_TORQUE_LIMIT 4.9f")):
            self.assertEqual(whole.count(right), 1, right)
            self.write("policy.h", whole.replace(right, wrong))
            self.assertEqual(self.self_test(), 3, right)

    def test_two_policies_in_one_program(self):
        for name in ("fast", "sac"):
            self.succeed("export", AGENTS / f"{name}.safetensors", "--c", f"{name}.h")
        self.write("two.c", """#include "fast.h"
            #include "sac.h"
            int main(void) {
              static fast_state one; static sac_state two; float a, b;
              return fast_control(&one, 1, 0, 0, 0, &a) == FAST_OK
                && sac_control(&two, 1, 0, 0, 0, &b) == SAC_OK && fast_selftest() == FAST_OK
                && sac_selftest() == SAC_OK ? 0 : 1;
            }""")
        self.compile("two.c", "-O1")
        self.assertEqual(subprocess.run([self.folder / "program"], check=False).returncode, 0)

    def test_names_follow_the_file_or_the_flag(self):
        policy = AGENTS / "fast.safetensors"
        for arguments, prefix in ((["--c", "My Policy-2.h"], "my_policy_2"),
                                  (["--c", "3x.h"], "policy_3x"), (["--c", "..h"], "fast"),
                                  (["--c", "x.h", "--prefix", "left_arm"], "left_arm"),
                                  (["--c", "y" * 99 + ".h"], "y" * 32)):
            printed = self.succeed("export", policy, *arguments)
            self.assertIn(f"names begin with {prefix}_\n", printed)
            text = (self.folder / arguments[1]).read_text(encoding="ascii")
            self.assertIn(f"{prefix}_control(", text)
            self.assertEqual(set(re.findall(r"static (?:inline|const) \w+ (?!float\b)(\w+?)_control\(",
                                            text)), {prefix})
            self.assertNotRegex(text, "NAME_|CAPS_")
        piped = self.succeed("export", policy, "--c", "-")
        self.assertIn("fast_control(", piped)
        for prefix in ("Fast", "3x", "a b", "a/*", "é", "_a", "a" * 33):
            self.refuse(["export", policy, "--c", "x.h", "--prefix", prefix], "prefix", "expected")

    def test_hostile_texts_stay_in_their_comment(self):
        metadata, tensors = read_tensors(AGENTS / "fast.safetensors")
        agent = '*/ int x = 1; /* ??/ \\ " %s // é #define q1 2'
        for key in ("agent", "upswing_version"):
            write_tensors(self.folder / "hostile.safetensors", metadata | {key: agent}, tensors)
            self.build("hostile.safetensors", "-Wtrigraphs")
            self.assertEqual(self.header().count("*/ int x"), 0)
            self.drive(random_states()[:40])
            self.succeed("export", "hostile.safetensors", "--onnx", "policy.onnx")
            self.assertIn(agent.encode(), (self.folder / "policy.onnx").read_bytes())
        self.succeed("export", "hostile.safetensors", "--c", "-")

    def test_it_describes_itself(self):
        printed = self.succeed("export", AGENTS / "fast.safetensors", "--c", "policy.h")
        # Layers 8-48-32, the advantage stream 32-32-9 only, and layer normalisation.
        weights = 8 * 48 + 48 * 32 + 32 * 32 + 32 * 9
        constants = 4 * (weights + 3 * (48 + 32) + 32 + 9 + 9 + 7)
        self.assertIn(f"{weights:,} multiply-adds", printed)
        self.assertIn(f"{constants:,} bytes of constants", printed)
        header = self.header()
        for words in (f"Flash: {constants} bytes", f"{weights} multiply-adds",
                      f"POLICY_MULTIPLY_ADDS {weights}L",
                      "#define POLICY_PERIOD 0.02f", "#define POLICY_TORQUE_LIMIT 5.0f",
                      "agent fast, seed 3", "mass2 1, length1 0.5", "rad/s  velocity of q2"):
            self.assertTrue(words in header.replace("\n * ", " "), words)
        self.assertEqual([line for line in header.splitlines() if len(line) > 100], [])
        sizes = [int(size) for name, size in re.findall(r"static const float (\w+)\[(\d+)\]", header)
                 if "sample" not in name]
        self.assertEqual(4 * sum(sizes), constants)
        self.write("size.c", '#include "policy.h"\n#include <stdio.h>\nint main(void) '
                             '{ printf("%d", (int)sizeof(policy_state)); return 0; }')
        for name, state in (("fast", 4), ("d3qn-randomized", 4 + 8 + 4 + 48), ("any-pose", 12)):
            printed = self.succeed("export", AGENTS / f"{name}.safetensors", "--c", "policy.h")
            self.compile("size.c")
            size = subprocess.run([self.folder / "program"], check=True, stdout=subprocess.PIPE)
            self.assertEqual(int(size.stdout), state)
            self.assertIn(f"{state} bytes of state", printed)

    def test_every_policy_that_is_accepted(self):
        for path in sorted((ROOT / "tools/fuzz/corpus/policy/accepted").iterdir()):
            with self.subTest(path.name):
                self.succeed("export", path, "--c", "policy.h")
                self.assertEqual(self.self_test(), 0)

    def test_torques_that_are_no_floats(self):
        metadata, tensors = read_tensors(AGENTS / "fast.safetensors")
        for name in ("torques", "sample.torque"):
            kind, shape, data = tensors[name]
            numbers = [1e300 if x == 5 else x for x in array.array("d", data)]
            tensors[name] = kind, shape, array.array("d", numbers).tobytes()
        write_tensors(self.folder / "far.safetensors", metadata, tensors)
        for flag in ("--c", "--onnx"):
            self.refuse(["export", "far.safetensors", flag, "x"], "far.safetensors", "float", "1e+300")

    def test_only_an_export_is_replaced(self):
        policy = AGENTS / "fast.safetensors"
        for flag in ("--c", "--onnx"):
            for other in (b"int main(void) { return 0; }\n", b"", b"import upswing  # Written by Upswing\n",
                          (AGENTS / "d3qn.safetensors").read_bytes()):
                with self.subTest(flag=flag, other=other[:40]):
                    (self.folder / "mine").write_bytes(other)
                    self.refuse(["export", policy, flag, "mine"],
                                f"{flag} mine: expected a new file, got one that exists; --overwrite replaces it")
                    out = self.succeed("export", policy, flag, "mine", "--overwrite")
                    self.assertIn(", in place of the file that was there\n", out)
            # An export may be made again.
            self.assertIn("in place of", self.succeed("export", AGENTS / "sac.safetensors", flag, "mine"))
            self.assertNotIn("in place of", self.succeed("export", policy, flag, f"new{flag}"))
        # A header is no ONNX file, nor the other way round.
        self.refuse(["export", policy, "--c", "mine"], "--overwrite")

    def test_bad_usage(self):
        policy = AGENTS / "fast.safetensors"
        self.refuse(["export"], "expected --onnx FILE, --c FILE.h or --page FOLDER", "none")
        self.refuse(["export", "--c", "x.h"], "--c", "none")
        self.refuse(["export", policy, policy, "--onnx", "x.onnx"], "--onnx", "got 2")
        self.refuse(["export", policy, "--onnx", "a", "--c", "b"], "--onnx: expected no --c")
        self.refuse(["export", policy, "--onnx", "a", "--prefix", "b"], "--prefix", "--c")
        self.refuse(["export", policy, "--c", "a", "--id", "b"], "--id: expected no --c")
        for flags in ([policy, "--page", "p"], [policy, "--onnx", "a"]):
            self.refuse(["export", *flags, "--made-for", "mass2=2"], "controller", "--c")
        self.refuse(["export", policy, "--c", "nowhere/x.h"], "nowhere")
        self.refuse(["export", "nothing", "--c", "x.h"], "nothing: no such file")
        self.write("wrong.safetensors", "no policy")
        self.refuse(["export", "wrong.safetensors", "--c", "x.h"], "wrong.safetensors")
        self.refuse(["export", "wrong.safetensors", "--onnx", "x.onnx"], "wrong.safetensors")


def block_of_documentation(section):
    """The lines that a section of docs/howto/export.md asks you to type."""
    text = (ROOT / "docs/howto/export.md").read_text(encoding="utf-8").split(f"### {section}\n")[1]
    blocks = re.findall(r"^```sh\n(.*?)^```", re.split(r"\n###? ", text)[0], re.MULTILINE | re.DOTALL)
    return "".join(blocks)


class DocumentedTest(ProgramTest):
    """Tests that the commands in docs/howto/export.md work."""

    def type(self, lines):
        """Runs lines in a folder with the examples; returns their output."""
        if not (self.folder / "examples").exists():
            (self.folder / "examples").symlink_to(ROOT / "examples")
        done = subprocess.run(["sh", "-euc", lines.replace("./upswing ", f"'{UPSWING}' ")],
                              cwd=self.folder, check=False, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8")
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    def test_export_compile_swing_up(self):
        """Uses the page's agent of that name instead of the training, which
        examples/library_test.py runs to its end."""
        train, rest = block_of_documentation("A closed loop in plain C").split("\n", maxsplit=1)
        self.assertEqual(train, "./upswing train --agent fast --out runs/fast")
        (self.folder / "runs/fast").mkdir(parents=True)
        shutil.copy(AGENTS / "fast.safetensors", self.folder / "runs/fast/policy.safetensors")
        said = self.type(rest)
        self.assertRegex(said, r"upright from \d\.\d\d s to the end\n$")

    @unittest.skipUnless(HAS_CORTEX_M4, NO_CORTEX_M4)
    def test_on_a_cortex_m4(self):
        self.succeed("export", AGENTS / "fast.safetensors", "--c", "policy.h")
        said = self.type(block_of_documentation("On a Cortex-M4"))
        self.assertRegex(said, r"upright from 2\.\d\d s to the end\n")
        self.assertEqual(said.count("instructions"), 4 + 1)

    def test_the_loop_of_the_controller(self):
        text = (ROOT / "docs/howto/export.md").read_text(encoding="utf-8")
        (code,) = re.findall(r"^```c\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
        self.succeed("export", AGENTS / "fast.safetensors", "--c", "policy.h")
        include, loop = code.split("\n", maxsplit=1)
        self.write("loop.c", f"""{include}
            static void stop_motor(void); static void set_motor(float);
            static float q1, q2, w1, w2, motor;
            void begin(void); void every_20_ms(void);
            {loop}
            static void stop_motor(void) {{ motor = 9.0f; }}
            static void set_motor(float torque) {{ motor = torque; }}
            int main(void) {{
              begin(); every_20_ms();
              return motor == 5.0f || motor == -5.0f ? 0 : 1;
            }}""")
        done = compile_c(self.folder, "loop.c")
        self.assertEqual((done.returncode, done.stdout), (0, ""))
        self.assertEqual(subprocess.run([self.folder / "program"], check=False).returncode, 0)

    def test_every_name_is_explained(self):
        text = (ROOT / "docs/howto/export.md").read_text(encoding="utf-8")
        agents = [[AGENTS / f"{name}.safetensors"]
                  for name in ("fast", "d3qn-randomized", "any-pose", "d3qn-adaptive")]
        for policy in [*agents, ["mpc", "--mpc-angle-range", 4, "--mpc-velocity", 9]]:
            self.succeed("export", *policy, "--c", "policy.h")
            header = (self.folder / "policy.h").read_text(encoding="ascii")
            for name in re.findall(r"^#define (POLICY_\w+) ", header, re.MULTILINE):
                self.assertIn(f"`{name}`", text)


class SwingUpTest(ProgramTest):
    """Tests of the closed loop in plain C of examples/c."""

    def build(self, agent, source="swing_up.c"):
        self.succeed("export", AGENTS / f"{agent}.safetensors", "--c", "policy.h")
        done = compile_c(self.folder, EXAMPLE / source, "-O2", "-I.")
        self.assertEqual((done.returncode, done.stdout), (0, ""))

    def run_example(self, *start):
        done = subprocess.run([self.folder / "program", *map(str, start)], check=False,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8")
        return done.returncode, done.stdout, done.stderr

    def test_policies_swing_up(self):
        for agent in ("fast", "sac", "ppo", "d3qn-randomized"):
            with self.subTest(agent):
                self.build(agent)
                code, rows, said = self.run_example()
                self.assertEqual(code, 0, said)
                since = re.fullmatch(r"upright from (\S+) s to the end\n", said)
                self.assertLess(float(since[1]), 6)
                self.assertEqual(len(rows.splitlines()), 1001)

    def test_the_motion_is_that_of_the_program(self):
        self.build("fast")
        start = [0.3, -0.2, 0.5, 1]
        _, text, _ = self.run_example(*start)
        self.write("in_c.csv", text)
        self.succeed("simulate", AGENTS / "fast.safetensors", "--start", ",".join(map(str, start)),
                     "--physics", "closed-form", "--csv", "ours.csv")
        for got, ours in zip(read_csv(self.folder / "in_c.csv")[:100],
                             read_csv(self.folder / "ours.csv")):
            for name in ("q1", "q2", "w1", "w2", "torque"):
                self.assertAlmostEqual(got[name], ours[name], delta=1e-9)

    def test_the_time_of_a_call_is_measured(self):
        self.build("fast", "time.c")
        code, text, said = self.run_example()
        self.assertEqual((code, said), (0, ""))
        self.assertRegex(text, r"^[1-9]\d* ns a call \(sum of torques \S+\)\n$")

    def test_a_failure_sets_the_status(self):
        self.build("fast")
        header = (self.folder / "policy.h").read_text(encoding="ascii")
        lazy = header.replace("*torque = policy_choose(outputs);", "*torque = 0.0f;")
        self.assertNotEqual(lazy, header)
        self.write("policy.h", lazy)
        self.assertEqual(compile_c(self.folder, EXAMPLE / "swing_up.c", "-I.").returncode, 0)
        self.assertEqual(self.run_example()[::2], (1, "not upright for the last 10 s\n"))
        self.assertEqual(self.run_example("nan", 0, 0, 0)[::2],
                         (1, "swing_up: the state is no longer finite\n"))
        self.assertEqual(self.run_example(1)[0], 2)


@unittest.skipUnless(HAS_CORTEX_M4, NO_CORTEX_M4)
class CortexM4Test(ProgramTest):
    """Tests of examples/c on a Cortex-M4 in QEMU, with its own arithmetic and newlib's math."""

    def test_self_test_and_work(self):
        # (agent, most instructions per multiply-add): load, multiply, add, and loops
        for agent, most in (("fast", 6), ("d3qn-randomized", 6), ("sac", 6)):
            for optimize in ("-O2", "-Os"):
                with self.subTest(f"{agent} {optimize}"):
                    self.succeed("export", AGENTS / f"{agent}.safetensors", "--c", "policy.h")
                    done = run_on_cortex_m4(self.folder, EXAMPLE / "cortex_m4/count.c", "-icount", "shift=8",
                                          optimize=optimize)
                    self.assertEqual(done.returncode, 0, done)
                    header = (self.folder / "policy.h").read_text(encoding="ascii")
                    work = int(re.search(r"POLICY_MULTIPLY_ADDS (\d+)L", header)[1])
                    lines = re.findall(r"status 0, torque (\S+), (\d+) instructions", done.stdout)
                    self.assertEqual(len(lines), 4, done.stdout)
                    for _, instructions in lines:
                        self.assertLess(2 * work, int(instructions))
                        self.assertLess(int(instructions), most * work + 4000)

    def test_it_swings_up(self):
        self.succeed("export", AGENTS / "fast.safetensors", "--c", "policy.h")
        done = run_on_cortex_m4(self.folder, EXAMPLE / "swing_up.c")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("upright from", done.stderr)

    def test_a_damaged_one_sets_the_status(self):
        self.succeed("export", AGENTS / "fast.safetensors", "--c", "policy.h")
        header = (self.folder / "policy.h").read_text(encoding="ascii")
        begin = header.index("{", header.index("policy_feature_1_weight["))
        number = re.search(r"-?\d+\.\d+", header[begin:])
        begin += number.start()
        self.write("policy.h", header[:begin] + "0.5" + header[begin + len(number[0]):])
        done = run_on_cortex_m4(self.folder, EXAMPLE / "cortex_m4/count.c", "-icount", "shift=8")
        self.assertEqual((done.returncode, done.stdout), (1, "damaged\n"))


if __name__ == "__main__":
    unittest.main()
