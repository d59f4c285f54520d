#!/usr/bin/env python3
"""Tests that the layer check finds each kind of problem, and nothing in a correct tree."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

CHECK = Path(__file__).resolve().parent / "check_layers.py"

GOOD = {
    "src/base/rng.h": "#include <vector>\n",
    "src/base/simd_test.cc": "#include <hwy/highway.h>\n",
    "src/nn/linear.h": '#pragma once\n#include "base/rng.h"\n',
    "src/nn/linear.cc": '#include "nn/linear.h"\n#include <hwy/highway.h>\n',
    "src/nn/adam_test.cc": "#include <Eigen/Core>\n",
    "src/pendulum/task.h": "",
    "src/mujoco/model.h": "#include <mujoco/mujoco.h>\n",
    "src/mujoco/model_test.cc": '#include "mujoco/model.h"\n#include <mujoco/mjbatch.h>\n',
    "src/base/file_test.cc": "#include <filesystem>\n",
    "src/rl/dqn.cc": '#include "nn/linear.h"\n#include <event.pb.h>\n// #include "pendulum/task.h"\n',
    "src/control/lqr.cc": '#include "pendulum/task.h"\n',
    "src/cli/main.cc": '#include "rl/dqn.h"\n#include "pendulum/task.h"\n#include <CLI/CLI.hpp>\n',
    "src/rl/dqn.h": "",
    "src/cli/say.h": "",
    "extras/machine/log.h": '#include "pendulum/task.h"\n',
    "extras/machine/log_command.cc": '#include "cli/say.h"\n#include "extras/machine/log.h"\n',
    "python/upswing/_lanes.py": "from ._spaces import Spaces\nfrom . import _upswing\n",
    "python/upswing/_spaces.py": "import numpy\n",
    "web/src/page/page.ts": "import type { World } from '../world';\n",
    "web/src/world.ts": "import {\n  core,\n} from './core';\n",
    "web/src/core.ts": "// import { World } from './world';\n",
    "tools/fuzz/log_fuzz.cc": '#include "extras/machine/log.h"\n',
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
            {"src/base/file.cc": '#include <vector>\n#include "report/seeds.h"\n',
             "src/report/seeds.h": ""},
            "src/base/file.cc:2", 'src/base/ may not include "report/seeds.h"')

    def test_sideways_include(self):
        self.assert_one_offender({"src/rl/sac.h": '#include "pendulum/task.h"\n'},
                                 "src/rl/sac.h:1", 'src/rl/ may not include "pendulum/task.h"')

    def test_the_product_needs_no_extras(self):
        self.assert_one_offender({"src/rl/sac.h": '#include "extras/machine/log.h"\n'}, "src/rl/sac.h:1",
                                 'src/rl/ may not include "extras/machine/log.h"')
        self.assert_one_offender({"src/cli/say.cc": '#include "extras/machine/log.h"\n'}, "src/cli/say.cc:1",
                                 'src/cli/ may not include "extras/machine/log.h"')

    def test_only_commands_of_extras_include_the_program(self):
        self.assert_one_offender({"extras/machine/log.cc": '#include "cli/say.h"\n'},
                                 "extras/machine/log.cc:1", 'extras/machine/ may not include "cli/say.h"')

    def test_angle_brackets_do_not_hide_an_include(self):
        self.assert_one_offender({"src/rl/sac.h": "#  include <pendulum/task.h>\n"},
                                 "src/rl/sac.h:1", 'src/rl/ may not include "pendulum/task.h"')

    def test_cycle(self):
        status, lines = self.check({"src/base/rng.h": '#include "nn/linear.h"\n'})
        self.assertEqual(status, 1)
        self.assertEqual(len(lines), 2, lines)
        self.assertIn('src/base/ may not include "nn/linear.h"', lines[0])
        self.assertEqual(lines[1], "src/base/rng.h:1: a cycle between folders: src/base -> src/nn -> "
                                   "src/base (and src/nn/linear.h:2)")

    def test_rooms_have_floors(self):
        self.assertEqual(self.check({"src/rl/replay/replay.h": "",
                                     "src/rl/agent.h": '#include "rl/replay/replay.h"\n',
                                     "src/rl/sac/sac.h": '#include "rl/agent.h"\n',
                                     "src/rl/sac/sac_test.cc": '#include "rl/train/trainer.h"\n',
                                     "src/rl/train/trainer.h": '#include "rl/sac/sac.h"\n'}), (0, []))
        self.assert_one_offender({"src/rl/sac/sac.h": '#include "rl/ppo/ppo.h"\n',
                                  "src/rl/ppo/ppo.h": ""}, "src/rl/sac/sac.h:1",
                                 "src/rl/sac may not include the room ppo: src/rl/ppo/ppo.h")
        self.assert_one_offender({"src/rl/agent.h": '#include "rl/sac/sac.h"\n',
                                  "src/rl/sac/sac.h": ""}, "src/rl/agent.h:1",
                                 "src/rl may not include the room sac: src/rl/sac/sac.h")

    def test_an_operating_system_is_for_upper_layers(self):
        self.assert_one_offender({"src/rl/dqn.h": "#include <filesystem>\n"},
                                 "src/rl/dqn.h:1", "src/rl/ must not need an operating system")
        self.assertEqual(self.check({"src/os/file.h": "#include <unistd.h>\n"}), (0, []))

    def test_allowed_includes_have_no_cycle(self):
        sys.path.insert(0, str(CHECK.parent))
        import check_layers
        self.assertEqual(check_layers.cycles(check_layers.LAYERS), [])

    def test_foreign_include(self):
        self.assert_one_offender({"src/cli/view.cc": "#include <mujoco/mujoco.h>\n"},
                                 "src/cli/view.cc:1", "mujoco/mujoco.h is not for this file")
        self.assert_one_offender({"src/nn/adam.cc": "#include <Eigen/Core>\n"},
                                 "src/nn/adam.cc:1", "Eigen/Core is not for this file")
        self.assert_one_offender({"src/nn/linear_test.cc": "#include <hwy/highway.h>\n"},
                                 "src/nn/linear_test.cc:1", "hwy/highway.h is not for this file")

    def test_missing_header(self):
        self.assert_one_offender({"src/rl/ppo.cc": '#include "rl/ppo.h"\n'},
                                 "src/rl/ppo.cc:1", '"rl/ppo.h" does not exist')

    def test_include_without_folder(self):
        self.assert_one_offender({"src/rl/ppo.cc": '#include "dqn.h"\n'},
                                 "src/rl/ppo.cc:1", 'expected "folder/file.h"')
        self.assert_one_offender({"tools/fuzz/ppo.cc": '#include "src/rl/dqn.h"\n'},
                                 "tools/fuzz/ppo.cc:1", 'expected "folder/file.h"')

    def test_cycle_between_python_modules(self):
        for text in ("from ._lanes import Lanes\n", "if TYPE_CHECKING:\n    from . import _lanes\n",
                     "from . import (\n    _lanes,\n)\n"):
            self.assert_one_offender({"python/upswing/_spaces.py": text}, "python/upswing/_lanes.py:1",
                                     "a cycle between modules: python/upswing/_lanes.py -> "
                                     "python/upswing/_spaces.py -> python/upswing/_lanes.py")

    def test_cycle_between_typescript_modules(self):
        for text in ("import type { Page } from './page/page';\n", "import './page/page';\n",
                     "import {\n  Page,\n} from './page/page';\n", "await import('./page/page');\n",
                     "export { Page } from './page/page';\n", "await import(\n  './page/page');\n"):
            with self.subTest(text=text):
                self.assert_one_offender({"web/src/core.ts": text}, "web/src/core.ts:" + str(text.count("\n")),
                                         "a cycle between modules: web/src/core.ts -> web/src/page/page.ts "
                                         "-> web/src/world.ts -> web/src/core.ts")


if __name__ == "__main__":
    unittest.main()
