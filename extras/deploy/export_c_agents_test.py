#!/usr/bin/env python3
"""Tests of `upswing export --c` for policies with a goal, and for policies that identify the plant."""

import array
import math
import random
import re
import subprocess
import unittest

from c_testing import (AGENTS, COMPILERS, HAS_CORTEX_M4, NO_CORTEX_M4, SANITIZE, HeaderTest, rows_of,
                       run_on_cortex_m4)
from testing import ROOT, probe, read_csv, small

POSES = {"up-up": (1, 1), "up-down": (1, 0), "down-up": (0, 1), "down-down": (0, 0)}
ANY_POSE, ADAPTIVE = AGENTS / "any-pose.safetensors", AGENTS / "d3qn-adaptive.safetensors"
# Largest error of an identified number by the rounding of float. The numbers are of size 1.
ROUNDING = 1e-3

# Reads rows of float: whether an episode begins, the state, the torque that acted after it, the goal.
# Writes status, torque and observation of each.
DRIVER = r"""
#include "policy.h"
#include <stdio.h>

int main(void)
{
  float in[8];
  static policy_state state;
  while (fread(in, sizeof(in), 1, stdin) == 1) {
    float out[2 + POLICY_OBSERVATION_SIZE];
    policy_state copy;
    if (in[0] > 0.0f) policy_init(&state);
#ifdef POLICY_GOAL_SIZE
    policy_goal(&state, in[6] > 0.0f, in[7] > 0.0f);
#endif
    copy = state;
    policy_observe(&copy, in[1], in[2], in[3], in[4], out + 2);
    out[0] = (float)policy_control(&state, in[1], in[2], in[3], in[4], &out[1]);
    fwrite(out, sizeof(out), 1, stdout);
    state.torque = in[5];
  }
  return policy_selftest() == POLICY_OK ? 0 : 1;
}
"""


class MotionTest(HeaderTest):
    """Base class: runs a header along motions of the program."""

    def build_driver(self, policy, *options, **language):
        self.succeed("export", policy, "--c", "policy.h")
        self.write("driver.c", DRIVER)
        self.compile("driver.c", "-O1", "-Wconversion", *options, **language)

    def motions(self, policy, episodes, masses=(1, 1), goals=("up-up",)):
        """Control steps of episodes on plants whose masses [kg] are near these: rows as DRIVER reads
        them."""
        rng, rows = random.Random(1), []
        for episode in range(episodes):
            goal = goals[episode % len(goals)]
            changes = [f"--set={name}={mass * rng.uniform(0.8, 1.2)}"
                       for name, mass in zip(("mass1", "mass2"), masses, strict=True)]
            start = ",".join(str(rng.uniform(-3, 3)) for _ in range(4))
            more = ["--goal", goal] if len(goals) > 1 else []
            self.succeed("simulate", policy, "--start", start, "--physics", "closed-form", *more,
                         *changes, "--csv", "rollout.csv")
            for i, row in enumerate(read_csv(self.folder / "rollout.csv")):
                state = [row[name] for name in ("q1", "q2", "w1", "w2")]
                rows.append([float(i == 0), *state, row["torque"], *POSES[goal]])
        # The numbers that C gets, which the program then gets, too.
        return array.array("f", (number for row in rows for number in row))

    def compare(self, policy, numbers, most_unequal=0.001):
        """Asserts the program's observations and torques along motions. Returns the largest error of an
        observation."""
        count = len(numbers) // 8
        done = subprocess.run([self.folder / "program"], check=False, input=numbers.tobytes(),
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        got = rows_of(array.array("f", done.stdout), count)
        expected = rows_of(probe(policy, "motion", numbers), count)
        worst, unequal = 0, 0
        for (status, torque, *observed), (right, *seen) in zip(got, expected, strict=True):
            self.assertEqual(status, 0)
            worst = max(worst, *(abs(x - y) for x, y in zip(observed, seen, strict=True)))
            unequal += abs(torque - right) > 0.01
        self.assertLessEqual(unequal, most_unequal * count)
        self.assertGreater(len({row[1] for row in got}), 5)
        return worst

    def wrong_arithmetic(self, policy, changes):
        """Asserts that the self-test finds each change of the header."""
        self.succeed("export", policy, "--c", "policy.h")
        self.assertEqual(self.self_test(), 0)
        whole = self.header()
        for right, wrong in changes:
            self.assertEqual(whole.count(right), 1, right)
            self.write("policy.h", whole.replace(right, wrong))
            self.assertEqual(self.self_test(), 3, right)


class GoalTest(MotionTest):
    def test_all_goals(self):
        self.build_driver(ANY_POSE, *SANITIZE)
        numbers = self.motions(ANY_POSE, 8, goals=list(POSES))
        self.assertLess(self.compare(ANY_POSE, numbers), 1e-5)
        for compiler, standard in COMPILERS[1:]:
            with self.subTest(f"{compiler} {standard}"):
                self.build_driver(ANY_POSE, compiler=compiler, standard=standard)

    def test_the_goal_changes_at_any_time(self):
        """The goal changes between control steps, and stays after a number that is not finite."""
        self.succeed("export", ANY_POSE, "--c", "policy.h")
        self.write("goal.c", r"""#include "policy.h"
            static float torque(policy_state *state) {
              float u = 9.0f;
              return policy_control(state, 0.1f, 0.2f, 0.3f, 0.4f, &u) == POLICY_OK ? u : 9.0f;
            }
            int main(void) {
              policy_state state;
              static policy_state zeros; /* has the goal upright */
              float up, down, u;
              policy_init(&state);
              up = torque(&state);
              policy_goal(&state, 0, 0);
              down = torque(&state);
              policy_goal(0, 1, 1);
              if (up == down || torque(&zeros) != up || torque(&state) != down) return 1;
              if (policy_control(&state, (float)NAN, 0, 0, 0, &u) != POLICY_NOT_FINITE) return 2;
              if (torque(&state) != down) return 3;
              policy_goal(&state, 1, 1);
              if (torque(&state) != up) return 4;
              policy_goal(&state, 0, 1);
              policy_init(&state);
              return torque(&state) == up ? 0 : 5;
            }""")
        self.compile("goal.c", "-O1", *SANITIZE)
        self.assertEqual(subprocess.run([self.folder / "program"], check=False).returncode, 0)

    def test_closed_loops(self):
        """From each pose to every other, as in the program."""
        self.succeed("export", ANY_POSE, "--c", "policy.h")
        ours, in_c = self.closed_loops(ANY_POSE, "--episodes", 48)
        self.assertEqual(in_c, ours)
        self.assertEqual(sum(ours), 48)

    def test_self_test_finds_wrong_arithmetic(self):
        self.wrong_arithmetic(ANY_POSE, (("state->down1 ? -1.0f", "state->down1 ? 0.5f"),
                                         ("state->down2 = !up2", "state->down2 = up2")))

    def test_goal_identification_and_memory_together(self):
        """The order of the observation, on a plant of 5 cm with dry friction and a motor at joint 2."""
        self.succeed(*small(any_pose=True, identify=True, memory=2, physics="closed-form",
                            plant="cloudpendulum", actuated_joint=2))
        policy = self.folder / "run"
        self.build_driver(policy, *SANITIZE)
        self.assertIn("#define POLICY_FRICTION_SLOPE 100.0f", self.header())
        self.assertIn("21: goal of link 1", self.header())
        numbers = self.motions(policy, 6, masses=(0.131, 0.064), goals=list(POSES))
        self.assertLess(self.compare(policy, numbers), ROUNDING)


class IdentificationTest(MotionTest):
    def test_the_numbers_along_motions(self):
        self.build_driver(ADAPTIVE, *SANITIZE)
        numbers = self.motions(ADAPTIVE, 10)
        self.assertLess(self.compare(ADAPTIVE, numbers), ROUNDING)
        for compiler, standard in COMPILERS[1:]:
            with self.subTest(f"{compiler} {standard}"):
                self.build_driver(ADAPTIVE, compiler=compiler, standard=standard)
                self.assertLess(self.compare(ADAPTIVE, numbers[:8 * 1000]), ROUNDING)

    def test_closed_loops(self):
        """Swing-ups on plants within 25% succeed where those of the program do."""
        self.succeed("export", ADAPTIVE, "--c", "policy.h")
        ours, in_c = self.closed_loops(ADAPTIVE, "--randomize", 0.25, "--episodes", 120)
        self.assertEqual(in_c, ours)
        self.assertGreater(sum(ours), 0.93 * len(ours))

    def test_numbers_beyond_float(self):
        """The filter begins again where float overflows, and is right from then on."""
        self.build_driver(ADAPTIVE, *SANITIZE)
        numbers = self.motions(ADAPTIVE, 1)[:8 * 400]
        for big in (1e9, 1e15, 3e18, math.nan, math.inf, -3.4e38):
            with self.subTest(big):
                wild = [0, 0.1, 0.2, big, 1, 0, 1, 1]
                rows = array.array("f", [*numbers[:8 * 50], *wild, *numbers])
                done = subprocess.run([self.folder / "program"], check=True, input=rows.tobytes(),
                                      stdout=subprocess.PIPE)
                got = rows_of(array.array("f", done.stdout), len(rows) // 8)
                self.assertEqual(got[50][0], float(not abs(big) < 1e19), big)
                self.assertEqual([row[0] for row in got[51:]], [0] * 400)
                again = array.array("f", numbers.tobytes())
                alone = subprocess.run([self.folder / "program"], check=True, input=again.tobytes(),
                                       stdout=subprocess.PIPE).stdout
                self.assertEqual(array.array("f", done.stdout)[-len(alone) // 4:],
                                 array.array("f", alone))

    def test_self_test_finds_wrong_arithmetic(self):
        self.wrong_arithmetic(ADAPTIVE, (
            ("e.h2 = p[POLICY_D2]", "e.h2 = -p[POLICY_D2]"), ("h / 6.0f", "h / 5.0f"),
            ("c2 * a1 + s2 * w1 * w1", "c2 * a1 - s2 * w1 * w1"),
            ("0.3f * surprise", "0.4f * surprise"), ("-= ph[i] * (ph[j] / spread)", "-= ph[i] * ph[j]"),
            ("k1 = -d1 * g2 - d2 * g", "k1 = -d1 * g2 + d2 * g"),
            ("d2 - pole * n12", "d2 - 1.01f * pole * n12"), ("tanhf(0.1f / delta)", "tanhf(0.11f / delta)"),
            ("surprise -= h2[i]", "surprise += h2[i]"), ("zeta[0] - zeta[1]", "zeta[0] + zeta[1]"),
            ("+= 1e-6f;", "+= 1e-4f;")))

    def test_constants_agree_with_the_filter(self):
        """The state that the header names is that of its struct, and the samples are 16 in a row."""
        printed = self.succeed("export", ADAPTIVE, "--c", "policy.h")
        self.assertIn(f"{4 * (1 + 1 + 7 + 28 + 4)} bytes of state", printed)
        count = re.search(r"policy_sample_identified\[(\d+)\]", self.header())[1]
        self.assertEqual(int(count), 16 * 13)
        self.write("size.c", '#include "policy.h"\nint main(void) { return (int)sizeof(policy_state); }')
        self.compile("size.c")
        self.assertEqual(subprocess.run([self.folder / "program"], check=False).returncode, 164)

    @unittest.skipUnless(HAS_CORTEX_M4, NO_CORTEX_M4)
    def test_on_a_cortex_m4(self):
        """The self-test holds with newlib's math, and identification adds little work to the network."""
        for policy in (ADAPTIVE, ANY_POSE):
            self.succeed("export", policy, "--c", "policy.h")
            done = run_on_cortex_m4(self.folder, ROOT / "examples/c/cortex_m4/count.c", "-icount", "shift=8")
            self.assertEqual(done.returncode, 0, done)
            work = int(re.search(r"POLICY_MULTIPLY_ADDS (\d+)L", self.header())[1])
            counts = [int(x) for x in re.findall(r"status 0, torque \S+, (\d+) instructions", done.stdout)]
            self.assertEqual(len(counts), 4, done.stdout)
            self.assertLess(max(counts), 6 * work + 40_000)


if __name__ == "__main__":
    unittest.main()
