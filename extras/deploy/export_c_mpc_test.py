#!/usr/bin/env python3
"""Tests of `upswing export mpc --c`: the same plans and torques as the program's, in float."""

import array
import re
import subprocess
import unittest

from c_testing import (COMPILERS, EXAMPLE, HAS_CORTEX_M4, NO_CORTEX_M4, SANITIZE, HeaderTest,
                       run_on_cortex_m4)
from testing import read_csv

# Reads states of one episode and writes the torques.
DRIVER = r"""
#include "policy.h"
#include <stdio.h>

int main(void)
{
  static policy_state state;
  float in[4];
  policy_init(&state);
  while (fread(in, sizeof(in), 1, stdin) == 1) {
    float torque;
    if (policy_control(&state, in[0], in[1], in[2], in[3], &torque) != POLICY_OK) return 2;
    fwrite(&torque, sizeof(torque), 1, stdout);
  }
  return 0;
}
"""
SIZE = """#include "policy.h"
#include <stdio.h>
int main(void) { printf("%d", (int)sizeof(policy_state)); return 0; }
"""


class MpcTest(HeaderTest):
    def errors(self, start, seconds, options):
        """Errors of the torques in the states of the program's own episode [N·m]."""
        self.succeed("simulate", "mpc", *options, "--start", start, "--seconds", seconds, "--physics",
                     "closed-form", "--csv", "rollout.csv")
        rows = read_csv(self.folder / "rollout.csv")[:-1]
        numbers = array.array("f", (row[name] for row in rows for name in ("q1", "q2", "w1", "w2")))
        done = subprocess.run([self.folder / "program"], check=True, input=numbers.tobytes(),
                              stdout=subprocess.PIPE)
        torques = array.array("f", done.stdout)
        return [abs(torque - row["torque"]) for torque, row in zip(torques, rows, strict=True)]

    def test_torques(self):
        """In 9 of 10 calls of an episode the torque is that of the program, within 1% of the limit. The cost
        is flat along some changes of a plan; there rounding moves a few torques."""
        self.write("driver.c", DRIVER)
        for options, start in (
                ((), "0,0,0,0"), ((), "0.7,1.5,1.8,2.7"),
                (("--mpc-guesses", 3, "--mpc-seconds", 1.5, "--mpc-iterations", 1), "0.1,0.1,0,0"),
                (("--mpc-angle-range", 4, "--mpc-velocity", 8), "2,-1,3,0"),
                (("--made-for", "coulomb1=0.05", "--made-for", "coulomb2=0.02"), "0.1,0.2,0,0"),
                (("--made-for", "cloudpendulum"), "0.1,0.2,0,0")):
            with self.subTest(f"{options} {start}"):
                self.succeed("export", "mpc", *options, "--c", "policy.h")
                self.compile("driver.c", "-O1", "-Wconversion", *SANITIZE)
                limit = float(re.search(r"POLICY_TORQUE_LIMIT (\S+)f", self.header())[1])
                period = float(re.search(r"POLICY_PERIOD (\S+)f", self.header())[1])
                errors = sorted(self.errors(start, round(60 * period, 3), options))
                self.assertEqual(len(errors), 60)
                self.assertLess(errors[53], 0.01 * limit, errors[50:])
                self.assertEqual(self.self_test(), 0)

    def test_closed_loops(self):
        """Swing-ups succeed as those of the program do."""
        self.succeed("export", "mpc", "--c", "policy.h")
        ours, in_c = self.closed_loops("mpc", "--episodes", 3, "--randomize", 0.05)
        self.assertEqual(in_c, ours)

    def test_compilers_and_sizes(self):
        self.succeed("export", "mpc", "--c", "policy.h")
        self.write("driver.c", DRIVER)
        for compiler, standard in COMPILERS:
            with self.subTest(f"{compiler} {standard}"):
                self.compile("driver.c", "-O1", "-Wconversion", compiler=compiler, standard=standard)
        self.write("size.c", SIZE)
        for options, floats in (((), 3 + 4 * 126 + 6 * 125), (("--mpc-seconds", 1), 3 + 4 * 51 + 6 * 50),
                                (("--mpc-guesses", 2), 3 + 4 * 126 + 7 * 125)):
            printed = self.succeed("export", "mpc", *options, "--c", "policy.h")
            self.compile("size.c")
            size = subprocess.run([self.folder / "program"], check=True, stdout=subprocess.PIPE)
            self.assertEqual(int(size.stdout), 4 * floats)
            self.assertIn(f"{4 * floats:,} bytes of state", printed)
        self.assertEqual([line for line in self.header().splitlines() if len(line) > 100], [])

    def test_self_test_finds_damage(self):
        self.succeed("export", "mpc", "--c", "policy.h")
        self.assertEqual(self.self_test(), 0)
        whole = self.header()
        for right, wrong in (
                ("e.h2 = p[POLICY_D2]", "e.h2 = -p[POLICY_D2]"), ("h / 6.0f * sums", "h / 5.0f * sums"),
                ("side1[3] = 2.0f * bs * (w1 + w2)", "side1[3] = 2.0f * bs * (w1 - w2)"),
                ("side2[1] = g2 - bc", "side2[1] = g2 + bc"), ("s->u[t] + share", "s->u[t] - share"),
                ("-= towards[k] * ab[k][i]", "+= towards[k] * ab[k][i]"),
                ("sum += ab[n][i] * vf[n][k]", "sum += ab[n][i] * vf[k][n]"),
                ("before[i] += ab[k][i] * v[k]", "before[i] += ab[i][k] * v[k]"),
                ("s->u[t] = s->u[t + 1]", "s->u[t] = -s->u[t + 1]"),
                ("return policy_limited(policy_regulator(d))", "return policy_limited(-policy_regulator(d))"),
                ("* d[i] * d[k]", "* d[i] * d[i]")):
            with self.subTest(right):
                self.assertEqual(whole.count(right), 1, right)
                self.write("policy.h", whole.replace(right, wrong))
                self.assertEqual(self.self_test(), 3)

    def test_self_test_on_other_plants(self):
        for plant in ("mass1=8 mass2=11 length1=0.8 length2=1.1 gravity=3.1 torque_limit=29 actuated_joint=2",
                      "mass1=0.1 mass2=0.19 length1=1 length2=2.7 gravity=8 damping=0.01 torque_limit=1.6",
                      "mass1=5.9 mass2=2.1 length1=0.17 length2=0.09 damping=0.003 torque_limit=4.2"):
            with self.subTest(plant):
                flags = [f"--made-for={change}" for change in plant.split()]
                self.succeed("export", "mpc", *flags, "--c", "policy.h")
                self.assertEqual(self.self_test(), 0)

    def test_numbers_that_are_not_finite(self):
        """The plan is then forgotten, and the next call is like the first."""
        self.succeed("export", "mpc", "--mpc-seconds", 0.5, "--c", "policy.h")
        self.write("bad.c", r"""#include "policy.h"
            int main(void) {
              static policy_state state, other;
              float first, again, u;
              policy_init(&state);
              if (policy_control(&state, 0.1f, 0.2f, 0.3f, 0.4f, &first) != POLICY_OK) return 1;
              if (policy_control(&state, 0.1f, 0.2f, 0.4f, 0.4f, &u) != POLICY_OK) return 2;
              if (policy_control(&state, 0.1f, (float)NAN, 0, 0, &u) != POLICY_NOT_FINITE) return 3;
              if (u < 0.0f || u > 0.0f) return 4;
              if (policy_control(&state, 0.1f, 0.2f, 0.3f, 0.4f, &again) != POLICY_OK) return 5;
              if (first < again || first > again) return 6;
              /* A state whose cost overflows leaves no plan behind. */
              policy_init(&other);
              (void)policy_control(&other, 0.1f, 0.2f, 1e25f, -1e30f, &u);
              if (!(u >= -POLICY_TORQUE_LIMIT && u <= POLICY_TORQUE_LIMIT)) return 7;
              if (policy_control(&other, 0.1f, 0.2f, 0.3f, 0.4f, &again) != POLICY_OK) return 8;
              return first < again || first > again ? 9 : 0;
            }""")
        for options in (["-O1", *SANITIZE], ["-O3", "-ffast-math"]):
            self.compile("bad.c", *options)
            self.assertEqual(subprocess.run([self.folder / "program"], check=False).returncode, 0)

    @unittest.skipUnless(HAS_CORTEX_M4, NO_CORTEX_M4)
    def test_on_a_cortex_m4(self):
        """It is right with newlib's math, and its work follows the horizon."""
        most = {}
        for seconds in (0.2, 0.4):
            self.succeed("export", "mpc", "--mpc-seconds", seconds, "--c", "policy.h")
            done = run_on_cortex_m4(self.folder, EXAMPLE / "cortex_m4/swing_ups.c", "-icount", "shift=2")
            self.assertEqual((done.returncode, done.stderr), (0, ""), done)
            most[seconds] = int(re.search(r"mean, (\d+) at most,", done.stdout)[1])
        # A derivative takes some hundred instructions; a call has 4 * 10 * (2 + 2 * (17 + 4)) of them.
        self.assertGreater(most[0.2], 200_000)
        self.assertLess(most[0.2], 6_000_000)
        self.assertAlmostEqual(most[0.4] / most[0.2], 2, delta=0.5)


if __name__ == "__main__":
    unittest.main()
