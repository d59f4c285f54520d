#!/usr/bin/env python3
"""Tests of trainings: the program's bits, callbacks, stopping, Ctrl-C, folders, bad input."""

import _thread
import csv
import hashlib
import os
import subprocess
import sys
import tempfile
import threading
import tomllib
import types
import typing
import unittest
import unittest.mock
import warnings
from pathlib import Path

import numpy as np

import upswing
from testing import BadInputTest, interrupted

# A training of a fraction of a second that evaluates twice.
SMALL = {"hidden": [32], "head": 16, "steps": 4000, "eval_every": 2000, "eval_episodes": 4,
         "log_every": 500, "learning_starts": 200, "threads": 1, "envs": 8,
         "updates_per_step": 0.25, "checkpoint_every": 500}


def sha(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def program(*arguments, **more):
    return subprocess.run([os.environ["UPSWING"], *map(str, arguments)], capture_output=True,
                          encoding="utf-8", check=True, **more)


def flags(settings):
    words = []
    for name, value in settings.items():
        text = ",".join(map(str, value)) if isinstance(value, list) else str(value)
        words += ["--" + name.replace("_", "-"), text]
    return words


class InFolder(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)


class SameBits(InFolder):
    def test_policies_and_tables_are_the_programs(self):
        for agent, settings in (("fast", SMALL), ("sac-fast", {"steps": 2000, "eval_every": 1000,
                                                               "eval_episodes": 2, "threads": 1}),
                                ("ppo", {"steps": 20000, "eval_every": 10000, "eval_episodes": 2,
                                         "threads": 2})):
            with self.subTest(agent):
                theirs, ours = self.path / f"{agent}-a", self.path / f"{agent}-b"
                program("train", "--agent", agent, "--seed", 3, "--out", theirs, *flags(settings))
                training = upswing.train(agent, seed=3, out=ours, **settings)
                in_memory = upswing.train(agent, seed=3, **settings)
                in_memory.best.save(self.path / "memory.safetensors")
                expected = sha(theirs / "policy.safetensors")
                self.assertEqual(sha(ours / "policy.safetensors"), expected)
                self.assertEqual(sha(self.path / "memory.safetensors"), expected)
                for table in ("episodes.csv",):
                    self.assertEqual((ours / table).read_text(), (theirs / table).read_text())
                with open(theirs / "evals.csv", encoding="utf-8") as file:
                    rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
                for result in (training, in_memory):
                    self.assertEqual(self.without_seconds(result.evaluations),
                                     self.without_seconds(rows))
                self.assertEqual(training.path, str(ours))
                self.assertIsNone(in_memory.path)

    def without_seconds(self, rows):
        return [{key: value for key, value in row.items() if key != "seconds"} for row in rows]

    def test_its_config_trains_again(self):
        first = upswing.train("fast", **SMALL)
        (self.path / "my.toml").write_text(first.config)
        again = upswing.train(config=self.path / "my.toml", threads=1)
        for name, training in (("a", first), ("b", again)):
            training.best.save(self.path / name)
        self.assertEqual(sha(self.path / "a"), sha(self.path / "b"))

    def test_a_run_goes_on_where_the_program_stopped(self):
        for name, steps in (("whole", 4000), ("part", 2000)):
            program("train", "--agent", "fast", "--out", self.path / name,
                    *flags(SMALL | {"steps": steps}))
        training = upswing.train(resume=self.path / "part", steps=4000)
        self.assertTrue(training.finished)
        self.assertEqual(training.steps, 4000)
        self.assertEqual(sha(self.path / "part/policy.safetensors"),
                         sha(self.path / "whole/policy.safetensors"))
        # Nothing is left to train; the best policy is from the earlier part.
        again = upswing.train(resume=self.path / "part")
        again.best.save(self.path / "best")
        self.assertEqual(sha(self.path / "best"), sha(self.path / "whole/policy.safetensors"))


class Callbacks(InFolder):
    def test_rows_equal_the_tables(self):
        heard = {"episode": [], "metrics": [], "evaluation": []}
        best = []
        training = upswing.train("fast", out=self.path / "run", **SMALL,
                                 on_best=best.append,
                                 **{f"on_{kind}": rows.append for kind, rows in heard.items()})
        for kind, table in (("episode", "episodes"), ("metrics", "metrics"),
                            ("evaluation", "evals")):
            with open(self.path / f"run/{table}.csv", encoding="utf-8") as file:
                rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
            self.assertEqual(heard[kind], rows)
            self.assertIsInstance(rows[0] and heard[kind][0]["step"], int)
        self.assertEqual(training.evaluations, heard["evaluation"])
        self.assertEqual(training.metrics, heard["metrics"])
        best[-1].save(self.path / "best")
        self.assertEqual(sha(self.path / "best"), sha(self.path / "run/policy.safetensors"))

    def test_false_stops(self):
        for settings in ({}, {"out": self.path / "run"}):
            training = upswing.train("fast", **SMALL, **settings,
                                     on_metrics=lambda row: np.bool_(row["step"] < 1000))
            self.assertFalse(training.finished)
            self.assertEqual(training.steps, 1000)
            self.assertIsNone(training.best_step)
            np.testing.assert_array_equal(training.best.act(np.eye(8)), training.last.act(np.eye(8)))
        # The run folder has a checkpoint of step 4000.
        self.assertEqual(upswing.train(resume=self.path / "run").steps, 4000)

    def test_a_stop_is_at_its_step_with_several_threads(self):
        threads = {**SMALL, "threads": 3}
        for stops in ({"on_metrics": lambda row: row["step"] < 3000},
                      {"on_evaluation": lambda row: False}):
            training = upswing.train("fast", **threads, **stops)
            expected = upswing.train("fast", **SMALL, **stops)
            self.assertEqual((training.steps, training.best_step), (expected.steps, expected.best_step))
            self.assertEqual(len(training.evaluations), 1)
        # Without callbacks, evaluations run in the background, and their rows arrive all the same.
        training = upswing.train("fast", out=self.path / "run", **threads)
        with open(self.path / "run/evals.csv", encoding="utf-8") as file:
            self.assertEqual(len(training.evaluations), len(list(csv.DictReader(file))))

    def test_other_objects_than_functions_are_refused_at_once(self):
        with self.assertRaisesRegex(upswing.InputError, "on_best: expected a function, got 3"):
            upswing.train("fast", **SMALL, out=self.path / "run", on_best=3)
        self.assertFalse((self.path / "run").exists())

    def test_exceptions_come_through(self):
        class Pruned(Exception):
            pass

        def prune(row):
            raise Pruned(row["step"])

        for settings in ({}, {"out": self.path / "run"}):
            with self.assertRaises(Pruned) as caught:
                upswing.train("fast", **SMALL, **settings, on_evaluation=prune)
            self.assertEqual(caught.exception.args, (2000,))
        self.assertEqual(upswing.train(resume=self.path / "run").steps, 4000)

    def test_ctrl_c_stops_in_order(self):
        run = self.path / "run"
        script = ("import sys, upswing\n"
                  "try:\n"
                  f"    upswing.train('fast', out={str(run)!r}, stop_when_solved=False,\n"
                  "                  steps=100000000, threads=1, eval_every=100000000)\n"
                  "except KeyboardInterrupt:\n"
                  "    print('interrupted')\n")
        done = interrupted(script, (run / "metrics.csv").exists, timeout=1200)
        self.assertEqual(done, ("interrupted\n", 0))
        steps = program("info", run).stdout
        self.assertIn("step", steps)
        self.assertTrue(any(run.glob("checkpoint*.safetensors")))

    def test_an_interrupted_training_is_kept(self):
        def train():
            runs = threading.Event()

            def interrupt():
                runs.wait()
                _thread.interrupt_main()

            threading.Thread(target=interrupt).start()
            return upswing.train("fast", stop_when_solved=False, steps=10**9, threads=1,
                                 eval_every=10**9, on_metrics=lambda row: runs.set())

        # A script gets KeyboardInterrupt, so that loops end. A prompt gets the training.
        with self.assertRaisesRegex(KeyboardInterrupt, "interrupted at step") as caught:
            train()
        self.assertFalse(caught.exception.training.finished)
        sys.ps1 = ">>> "
        self.addCleanup(delattr, sys, "ps1")
        with self.assertWarnsRegex(UserWarning, "interrupted at step"):
            training = train()
        self.assertGreater(training.steps, 0)
        self.assertFalse(training.finished)

    def test_a_notebook_has_a_bar(self):
        shown = []

        class Handle:
            def update(self, data, raw):
                shown.append(data)

        def display(data, raw, display_id):
            shown.append(data)
            return Handle()

        python = types.ModuleType("IPython")
        python.get_ipython = lambda: types.SimpleNamespace(kernel=None)
        python.display = types.ModuleType("IPython.display")
        python.display.display = display
        modules = {"IPython": python, "IPython.display": python.display}
        with unittest.mock.patch.dict(sys.modules, modules):
            upswing.train("fast", **SMALL)
        self.assertIn("<progress value=4000 max=4000>", shown[-1]["text/html"])
        self.assertIn("4,000 of 4,000 steps", shown[-1]["text/plain"])
        self.assertIn("at step 4,000", shown[-1]["text/plain"])

    def test_the_interpreter_runs_meanwhile_and_trainings_run_side_by_side(self):
        results = {}

        def work(seed):
            results[seed] = upswing.train("fast", seed=seed, **SMALL)

        threads = [threading.Thread(target=work, args=(seed,)) for seed in (1, 2, 1001)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        alone = upswing.train("fast", seed=2, **SMALL)
        self.assertEqual(results[2].metrics[-1]["mean_return"], alone.metrics[-1]["mean_return"])
        self.assertNotEqual(results[1].metrics[-1]["mean_return"],
                            alone.metrics[-1]["mean_return"])

    def test_progress_is_said_where_it_is_asked_for(self):
        code = "import upswing; upswing.train('fast', progress={}, **{})"
        for progress, shown in (("None", False), ("True", True), ("False", False)):
            done = subprocess.run([sys.executable, "-c", code.format(progress, SMALL)], check=True,
                                  capture_output=True, encoding="utf-8")
            self.assertEqual("2,000 steps" in done.stderr, shown, done.stderr)
            self.assertEqual(done.stdout, "")


    def test_messages_go_to_pythons_logger(self):
        with self.assertLogs("upswing", "INFO") as caught:
            upswing.train("fast", **SMALL)
        self.assertEqual([record.levelname for record in caught.records], ["INFO"] * 3)
        self.assertRegex(caught.output[0], r"step 2,000: return -?\d+ success \d+%")
        self.assertIn("step 4,000: training ended, not solved", caught.output[2])
        # Without a handler they go to standard error, from the level of the training on.
        code = (f"import upswing; upswing.train('fast', logging='debug', **{SMALL});"
                f"print(); upswing.train('fast', logging=20, **{SMALL})")
        done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True,
                              encoding="utf-8")
        lines = done.stderr.splitlines()
        self.assertEqual(lines[-3:], [record.getMessage() for record in caught.records])
        self.assertRegex(lines[0], "^step 504: episodes .*, loss ")


class StartPolicy(InFolder):
    def test_a_training_starts_with_the_weights_of_a_policy(self):
        first = upswing.train("fast", seed=1, **SMALL)
        first.last.save(self.path / "first.safetensors")
        same = upswing.train("fast", seed=2, start_policy=self.path / "first.safetensors",
                             **SMALL | {"updates_per_step": 0})
        obs = np.eye(8, dtype=np.float32)
        np.testing.assert_array_equal(same.last.values(obs), first.last.values(obs))
        with self.assertRaisesRegex(upswing.InputError, "start_policy: expected a policy with the"):
            upswing.train("fast", start_policy="fast", **SMALL)

    def test_a_reward_of_your_own_has_its_terms_in_the_rows(self):
        rows = []
        upswing.train("fast", reward="height: h; effort: -0.01*tau^2", on_episode=rows.append,
                      **SMALL)
        self.assertEqual(list(rows[0])[-2:], ["height", "effort"])


class Paths(InFolder):
    def test_names_that_are_not_utf8(self):
        class Named:
            def __init__(self, path):
                self.path = path

            def __fspath__(self):
                return self.path

        raw = os.fsencode(self.path)
        (self.path / "p\udcff.toml").write_text("[plant]\nmass2 = 1.1\n")
        for k, path in enumerate((raw + b"/r\xff0", os.fsdecode(raw + b"/r\xff1"),
                                  self.path / "r\udcff2", Named(raw + b"/r\xff3"),
                                  Named(f"{self.path}/é4"))):
            training = upswing.train("fast", out=path, plant=raw + b"/p\xff.toml", **SMALL)
            self.assertEqual(training.path, os.fsdecode(path))
            self.assertTrue(os.path.isdir(path))
            policy = upswing.load_policy(path)
            self.assertEqual(policy.info["plant"]["mass2"], 1.1)
            copy = raw + b"/copy\xff%d" % k
            policy.save(copy)
            self.assertEqual(upswing.load_policy(copy).name, os.fsdecode(copy))
            self.assertIn("copy", upswing.evaluate(copy, episodes=1)["policy"])
            self.assertEqual(upswing.train(resume=path, steps=4400).steps, 4400)


class BadInput(InFolder, BadInputTest):
    def refuse_training(self, what, *agent, **settings):
        self.refuse(what, upswing.train, *agent, **settings)

    def test_settings(self):
        self.refuse_training('gamma: expected a number in [0, 1], got "2"', gamma=2)
        self.refuse_training('gama: expected a setting, got "gama" (did you mean gamma?)', gama=1)
        self.refuse_training('got "fsat" (did you mean fast?)', "fsat")
        self.refuse_training('seed: expected an integer in [0, 9000000000000000], got "x"', seed="x")
        self.refuse_training('hidden: expected a list of integers', hidden=[64, "x"])
        self.refuse_training('double: expected', double=3)
        self.refuse_training("batch: expected at most", "fast", replay=10)
        self.refuse_training("epsilon", "sac", epsilon_end=0.1)
        self.refuse_training("nothing.toml", config="nothing.toml")
        self.refuse_training('steps: expected', steps=None)
        for level in ("loud", 1.5, True):
            self.refuse_training("logging: expected a level such as 'INFO'", logging=level)
        self.refuse_training("use start_policy", from_policy="fast")

    def test_names_of_others(self):
        for name, instead in (("task", "use env"), ("total_timesteps", "use steps"),
                              ("n_envs", "use num_envs"), ("net_arch", "use hidden"),
                              ("buffer_size", "use replay"), ("callback", "use on_evaluation")):
            self.refuse_training(f"{name}: expected a setting, got '{name}'; {instead}",
                                 **{name: 3})
        for name in ("PPO", "SAC", "DQN"):
            self.refuse_training(f'got "{name}" (did you mean {name.lower()}?)', name)

    def test_folders(self):
        (self.path / "full").mkdir()
        (self.path / "full/file").write_text("mine")
        self.refuse_training("not empty (choose another out)", out=self.path / "full", **SMALL)
        self.assertEqual(os.listdir(self.path / "full"), ["file"])
        self.refuse_training("resume", resume=self.path / "nothing")
        self.refuse_training("resume: expected neither out nor config", resume="x", out="y")
        self.refuse_training("out: expected a path, got an empty text", out="")
        self.refuse_training("out: expected a path, got 3", out=3)
        self.refuse_training("out: expected a path, got 'a\\x00b'", out="a\0b")
        self.refuse_training("plant: expected a text without null characters", plant="a\0b")
        self.refuse_training('got "\\xff"', plant=b"\xff")
        self.refuse_training('g\\xff: expected a setting', **{"g\udcff": 1})

    def test_useless_settings_give_a_warning(self):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            upswing.train("fast", **SMALL | {"learning_starts": 5000})
            warnings.simplefilter("error")
            with self.assertRaises(UserWarning):  # raised before anything is written
                upswing.train("fast", out=self.path / "run", **SMALL | {"learning_starts": 5000})
        self.assertFalse((self.path / "run").exists())
        self.assertEqual(len(caught), 1)
        self.assertIn("the agent learns nothing", str(caught[0].message))
        self.assertEqual(caught[0].filename, __file__)


class Settings(unittest.TestCase):
    def test_names_defaults_and_ranges_are_the_programs(self):
        toml = tomllib.loads(program("train", "--agent", "sac", "--print-config").stdout)
        settings = upswing.settings("sac")
        for section, values in toml.items():
            for name, value in values.items():
                self.assertEqual((settings[name].section, settings[name].default),
                                 (section, value))
        self.assertEqual((settings["gamma"].low, settings["gamma"].high), (0, 1))
        self.assertTrue(settings["mass2"].environment)
        self.assertFalse(settings["gamma"].environment)
        self.assertEqual(settings["mass"].members, ["mass1", "mass2"])
        self.assertEqual(settings["physics"].choices, ["mujoco", "closed-form"])
        self.assertEqual(settings["agent"].choices, list(upswing.agents()))
        self.assertIsInstance(settings["batch"].high, int)
        self.assertIn("seed", typing.get_type_hints(upswing.train))
        self.assertIs(typing.get_type_hints(upswing.Training)["best"], upswing.Policy)


if __name__ == "__main__":
    unittest.main()
