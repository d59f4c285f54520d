#!/usr/bin/env python3
"""Tests that the layer check finds each kind of problem, and nothing in a correct tree."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

CHECK = Path(__file__).resolve().parent / "check_layers.py"

GOOD = {
    "core/rng.h": "#include <vector>\n",
    "core/simd_test.cc": "#include <hwy/highway.h>\n",
    "nn/linear.h": '#pragma once\n#include "core/rng.h"\n',
    "nn/linear.cc": '#include "nn/linear.h"\n#include <hwy/highway.h>\n',
    "bench/linear_bench.cc": '#include "nn/linear.h"\n#include <Eigen/Core>\n',
    "nn/adam_test.cc": "#include <Eigen/Core>\n",
    "sim/task.h": "",
    "mujoco/model.h": "#include <mujoco/mujoco.h>\n",
    "mujoco/model_test.cc": '#include "mujoco/model.h"\n#include <mujoco/mjbatch.h>\n',
    "core/file_test.cc": "#include <filesystem>\n",
    "rl/dqn.cc": '#include "nn/linear.h"\n#include <event.pb.h>\n// #include "sim/task.h"\n',
    "control/lqr.cc": '#include "sim/task.h"\n',
    "apps/main.cc": '#include "rl/dqn.h"\n#include "sim/task.h"\n#include <CLI/CLI.hpp>\n',
    "rl/dqn.h": "",
}


class CheckLayers(unittest.TestCase):
    def check(self, changes):
        """Runs the check on the correct tree with `changes`. Returns exit status and lines."""
        with tempfile.TemporaryDirectory() as root:
            for name, text in (GOOD | changes).items():
                path = Path(root, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            done = subprocess.run([sys.executable, "-B", CHECK, root], check=False,
                                  capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        return done.returncode, done.stdout.splitlines()

    def assert_one_offender(self, changes, where, what):
        status, lines = self.check(changes)
        self.assertEqual(status, 1)
        self.assertEqual(len(lines), 1, lines)
        self.assertTrue(lines[0].startswith(where + ": "), lines[0])
        self.assertIn(what, lines[0])

    def test_good_tree(self):
        self.assertEqual(self.check({}), (0, []))

    def test_upward_include(self):
        self.assert_one_offender(
            {"core/file.cc": '#include <vector>\n#include "report/seeds.h"\n',
             "report/seeds.h": ""},
            "core/file.cc:2", 'core/ may not include "report/seeds.h"')

    def test_sideways_include(self):
        self.assert_one_offender({"rl/sac.h": '#include "sim/task.h"\n'},
                                 "rl/sac.h:1", 'rl/ may not include "sim/task.h"')

    def test_angle_brackets_do_not_hide_an_include(self):
        self.assert_one_offender({"rl/sac.h": "#  include <sim/task.h>\n"},
                                 "rl/sac.h:1", 'rl/ may not include "sim/task.h"')

    def test_cycle(self):
        status, lines = self.check({"core/rng.h": '#include "nn/linear.h"\n'})
        self.assertEqual(status, 1)
        self.assertEqual(len(lines), 2, lines)
        self.assertIn('core/ may not include "nn/linear.h"', lines[0])
        self.assertEqual(lines[1], "core/rng.h:1: a cycle between folders: core -> nn -> core "
                                   "(and nn/linear.h:2)")

    def test_an_operating_system_is_for_upper_layers(self):
        self.assert_one_offender({"rl/dqn.h": "#include <filesystem>\n"},
                                 "rl/dqn.h:1", "rl/ must not need an operating system")
        self.assertEqual(self.check({"io/file.h": "#include <unistd.h>\n"}), (0, []))

    def test_what_is_allowed_has_no_cycle(self):
        sys.path.insert(0, str(CHECK.parent))
        import check_layers
        self.assertEqual(check_layers.cycles(check_layers.LAYERS), [])

    def test_foreign_include(self):
        self.assert_one_offender({"apps/view.cc": "#include <mujoco/mujoco.h>\n"},
                                 "apps/view.cc:1", "mujoco/mujoco.h is not for this file")
        self.assert_one_offender({"nn/adam.cc": "#include <Eigen/Core>\n"},
                                 "nn/adam.cc:1", "Eigen/Core is not for this file")
        self.assert_one_offender({"nn/linear_test.cc": "#include <hwy/highway.h>\n"},
                                 "nn/linear_test.cc:1", "hwy/highway.h is not for this file")

    def test_missing_header(self):
        self.assert_one_offender({"rl/ppo.cc": '#include "rl/ppo.h"\n'},
                                 "rl/ppo.cc:1", '"rl/ppo.h" does not exist')

    def test_include_without_folder(self):
        self.assert_one_offender({"rl/ppo.cc": '#include "dqn.h"\n'},
                                 "rl/ppo.cc:1", 'expected "folder/file.h"')


if __name__ == "__main__":
    unittest.main()
