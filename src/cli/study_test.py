#!/usr/bin/env python3
"""Tests of `upswing study`: variants and seeds from a file, in their folders, stopped and
resumed."""

import json
import re
import shutil
import signal
import subprocess
import tomllib
import unittest

from testing import ROOT, UPSWING, ProgramTest, small, snapshot

HEAD = """title = "Little"
seeds = 2
[settings]
hidden = [8]
head = 8
steps = 400
[settings.train]
agent = "d3qn-small"
eval_every = 200
eval_episodes = 2
log_every = 200
[settings.agent]
learning_starts = 50
"""
STUDY = HEAD + """
[variants.with]

[variants.but]
layer_norm = false
[variants.but.agent]
gamma = 0.9

[variants.plain]
agent = "dqn"
"""
# The same settings as flags.
FLAGS = {"hidden": 8, "head": 8, "steps": 400, "eval_every": 200, "eval_episodes": 2,
         "log_every": 200, "learning_starts": 50, "checkpoint_every": None, "threads": None,
         "envs": None, "updates_per_step": None}
SUMMARY = {"summary.csv", "runs.csv", "evaluations.csv", "curves.svg", "curves.png"}
VARIANTS = {"with": {}, "but": {"layer_norm": False, "gamma": 0.9}, "plain": {"agent": "dqn"}}


class StudyTest(ProgramTest):
    def refuse_study(self, text, *words):
        self.write("bad.toml", text)
        self.refuse(["study", "bad.toml"], "bad.toml", *words)

    def test_a_title_is_text(self):
        self.write("s.toml", HEAD.replace('"Little"', r'"\u001b[2J\nTraining \u202e"')
                   .replace("seeds = 2", "seeds = 1") + "[variants.one]\n")
        output = self.succeed("study", "s.toml")
        shown = 'Training "\\x1b[2J\\nTraining \\u202e" in runs/s\n'
        self.assertTrue(output.startswith(shown), output)
        self.assertTrue(all(line.isprintable() for line in output.splitlines()), repr(output))

    def test_locks_are_checked_by_two_processes(self):
        (self.folder / "shared").mkdir()
        first, second = (subprocess.Popen([UPSWING, "study", "--check-locks", "shared"],
                                          cwd=self.folder, stdout=subprocess.PIPE, encoding="utf-8")
                         for _ in range(2))
        for process, other in ((first, second), (second, first)):
            output, _ = process.communicate(timeout=300)
            self.assertEqual(process.returncode, 0)
            self.assertIn("Locks exclude: of ", output)
            self.assertIn(f" {process.pid} and ", output)
            self.assertIn(f" {other.pid}, neither got a lock", output)
            self.assertIn("Both processes ran on this host.", output)
        self.assertEqual(list((self.folder / "shared").iterdir()), [])

    def test_a_check_of_locks_can_be_stopped_and_refuses_bad_input(self):
        (self.folder / "shared").mkdir()
        process = self.start("study", "--check-locks", "shared", wait=False)
        self.assertIn("waiting at most 300 s", process.stdout.readline())
        self.wait_for(lambda: list((self.folder / "shared").iterdir()))
        self.assertEqual(self.end(process, signal.SIGINT)[0], 130)
        self.assertEqual(list((self.folder / "shared").iterdir()), [])
        self.refuse(["study", "--check-locks", "missing"], "--check-locks: expected a folder, got missing")
        self.refuse(["study", "s.toml", "--check-locks", "shared"], "expected no FILE.toml")
        self.refuse(["study", "--check-locks", "shared", "--status"], "--check-locks: expected no --status")

    def test_each_run_equals_a_single_run(self):
        self.write("little.toml", STUDY)
        output = self.succeed("study", "little.toml")
        self.assertTrue(output.startswith(
            'Training "Little" in runs/little\n  3 variants, seeds 1-2: 6 runs'), output)
        self.assertIn("Written: summary.csv", output)
        self.assertNotIn("Next:", output)  # the study compares its runs itself
        study = self.folder / "runs/little"
        self.assertEqual({path.name for path in study.iterdir()},
                         {"study.toml", "plan.json", *VARIANTS, *SUMMARY})
        self.assertEqual((study / "study.toml").read_text(encoding="utf-8"), STUDY)
        for name, changes in VARIANTS.items():
            for seed in (1, 2):
                alone = f"alone/{name}{seed}"
                self.succeed(*small(**FLAGS | changes | {"seed": seed, "out": alone}))
                self.assert_same_run(f"runs/little/{name}/seed{seed}", alone)

    def test_the_first_seed_of_every_variant_comes_first_in_the_order_of_the_file(self):
        self.write("little.toml", STUDY)
        output = self.succeed("study", "little.toml", "--jobs", 1, "--out", "x")
        self.assertEqual(re.findall(r"^  (\w+/seed\d) ", output, re.M),
                         ["with/seed1", "but/seed1", "plain/seed1",
                          "with/seed2", "but/seed2", "plain/seed2"])

    def test_seeds_in_the_file_and_on_the_command_line(self):
        for text, flags, seeds in (('"2,7-8"', [], {2, 7, 8}), ("[3]", [], {3}), ("[1, 4]", [], {1, 4}),
                                   ("9", ["--seeds", "5,6"], {5, 6})):
            with self.subTest(seeds=text):
                self.write("s.toml", HEAD.replace("seeds = 2", f"seeds = {text}")
                           + "[variants.a]\n")
                out = f"out{min(seeds)}"
                self.succeed("study", "s.toml", "--out", out, *flags)
                self.assertEqual({path.name for path in (self.folder / out / "a").glob("*[0-9]")},
                                 {f"seed{seed}" for seed in seeds})

    def test_finished_runs_stay_and_a_new_variant_is_added(self):
        self.write("little.toml", STUDY)
        self.succeed("study", "little.toml")
        before = snapshot(self.folder / "runs/little")
        self.assertIn("6 already done", self.succeed("study", "little.toml"))
        self.assertEqual(snapshot(self.folder / "runs/little"), before)
        self.write("little.toml", STUDY + "[variants.new]\ngamma = 0.5\n")
        self.succeed("study", "little.toml")
        after = snapshot(self.folder / "runs/little")
        self.assertIn("new/seed2/policy.safetensors", after)
        for name in ("study.toml", "plan.json", *SUMMARY):
            before.pop(name)
        self.assertEqual({name: after[name] for name in before}, before)

    def test_killed_and_gone_on_with_equals_never_stopped(self):
        longer = STUDY.replace("steps = 400", "steps = 6000").replace("= 200\n", "= 1000\n")
        self.write("little.toml", longer)
        process = self.start("study", "little.toml", "--jobs", 1, "--out", "killed")
        self.wait_for(lambda: (self.folder / "killed/with/seed1/metrics.csv").exists())
        self.assertEqual(self.end(process, signal.SIGINT)[0], 130)
        self.assertFalse((self.folder / "killed/plain/seed2").exists())
        self.succeed("study", "little.toml", "--out", "killed")
        self.succeed("study", "little.toml", "--out", "never-stopped")
        for name in VARIANTS:
            for seed in (1, 2):
                self.assert_same_run(f"killed/{name}/seed{seed}", f"never-stopped/{name}/seed{seed}")

    def test_other_settings_are_refused_with_the_difference(self):
        self.write("little.toml", STUDY)
        self.succeed("study", "little.toml")
        self.write("little.toml", STUDY.replace("gamma = 0.9", "gamma = 0.8"))
        # The error names the first run that the folder lists, in any order.
        self.refuse(["study", "little.toml"], "runs/little/but/seed", ": made with agent.gamma = 0.9",
                    "has 0.8", "choose another --out")

    def test_another_study_does_not_take_the_place_of_one(self):
        endless = STUDY.replace("steps = 400", "steps = 10000000")
        process = self.start("study", self.write("little.toml", endless), "--out", "x")
        self.assertEqual(self.end(process, signal.SIGINT)[0], 130)
        for old, new, *words in (
                ('"Little"', '"Large"', 'x/plan.json: made with title "Little"', 'has "Large"'),
                ('title = "Little"', "", 'made with title "Little"', 'has ""'),
                ("[variants.with]", "", 'made with a variant "with"'),
                ("gamma = 0.9", "gamma = 0.8", "x/but", "made with agent.gamma = 0.9", "has 0.8")):
            with self.subTest(new=new):
                self.write("other.toml", endless.replace(old, new))
                self.refuse(["study", "other.toml", "--out", "x"], *words, "choose another --out")

    def test_settings_count_where_no_run_has_begun(self):
        self.write("little.toml", STUDY)
        self.succeed("study", "little.toml", "--seeds", "1-1")
        for seed in (self.folder / "runs/little/but").iterdir():
            if seed.name != "settings.toml":
                shutil.rmtree(seed) if seed.is_dir() else seed.unlink()
        self.write("little.toml", STUDY.replace("gamma = 0.9", "gamma = 0.8"))
        self.refuse(["study", "little.toml"], "little/but/settings.toml: made with agent.gamma = 0.9",
                    "has 0.8", "choose another --out")

    def test_finished_seeds_stay(self):
        self.write("little.toml", STUDY)
        self.succeed("study", "little.toml", "--seeds", 3)
        tables = {name: (self.folder / "runs/little" / name).read_bytes()
                  for name in ("summary.csv", "runs.csv", "evaluations.csv", "plan.json")}
        output = self.succeed("study", "little.toml", "--seeds", 2)
        self.assertIn("Finished seeds stay in the tables, too: 3\n", output)
        for name, text in tables.items():
            self.assertEqual((self.folder / "runs/little" / name).read_bytes(), text, name)
        # A seed that a variant has not finished goes; its files stay.
        (self.folder / "runs/little/but/seed3.done").unlink()
        output = self.succeed("study", "little.toml", "--seeds", 2)
        self.assertNotIn("stay", output)
        self.assertIn('"[1-2]"', (self.folder / "runs/little/plan.json").read_text(encoding="utf-8"))
        self.assertTrue((self.folder / "runs/little/but/seed3/policy.safetensors").exists())

    def test_a_folder_of_something_else_is_refused(self):
        self.write("little.toml", STUDY)
        self.succeed(*small(**FLAGS | {"out": "run"}))
        self.refuse(["study", "little.toml", "--out", "run"], "run: expected a new or empty folder",
                    "no plan.json")

    def test_without_gnuplot_there_are_only_tables(self):
        self.write("little.toml", STUDY)
        done = self.run_here("study", "little.toml", "--seeds", 1, env={"PATH": str(self.folder)})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"^upswing: tables only, no figures: .*gnuplot-nox.*\n$")
        self.assertTrue((self.folder / "runs/little/summary.csv").exists())
        self.assertFalse((self.folder / "runs/little/curves.svg").exists())

    def test_bad_studies(self):
        one = "[variants.a]\n"
        for text, words in (
                ("seed = 3\n" + one, [":1:", '"seed"', "did you mean seeds?"]),
                ("seeds = 2\n", ["[variants.NAME]"]),
                ("seeds = 2\n[variants]\n", ["[variants.NAME]"]),
                (f"[variants.{'a' * 101}]\n", ["a name of at most 100 letters, got 101"]),
                (one, ["seeds = 10"]),
                ('seeds = "0-"\n' + one, [":1: seeds: expected", "3,5,8-12"]),
                ("seeds = [1, 1]\n" + one, [":1: seeds:", "1 is twice"]),
                ("seeds = 0\n" + one, [":1: seeds:", "1 to 10000"]),
                ("seeds = [1.5]\n" + one, [":1: seeds:"]),
                ("title = 3\nseeds = 2\n" + one, [":1: title: expected a text"]),
                ("seeds = 2\n[settings]\ngama = 0.9\n" + one, [":3:", "did you mean gamma?"]),
                ("seeds = 2\n[settings.agnet]\n" + one, [":2:", "did you mean agent?"]),
                ("seeds = 2\n[settings.task]\ngamma = 1\n" + one, [":3: gamma: expected in section [agent]"]),
                ("seeds = 2\n" + one + 'gamma = "0.9"\n', [":3: gamma: expected a number"]),
                ("seeds = 2\n" + one + "gamma = 1.9\n", [":3: gamma: expected a number in [0, 1]"]),
                ("seeds = 2\n" + one + 'agent = "d3qm"\n', [":3: agent:", "did you mean d3qn?"]),
                ("seeds = 2\n" + one + "seed = 7\n", [":3: seed:", "seeds"]),
                ("seeds = 2\nvariants.a = 3\n", [":2: a: expected a table"]),
                ('seeds = 2\n[variants."../x"]\n', [":2:", "letters"]),
                ('seeds = 2\n[variants.""]\n', [":2:", "letters"]),
                ('seeds = 2\n[settings]\nagent = "ppo"\n[variants.a]\nbatch = 77\n',
                 [':4: variant "a": batch: expected a size that divides', "got 77"]),
                ("seeds = \n" + one, [":1:"])):
            with self.subTest(text=text):
                self.refuse_study(text, *words)
        self.refuse(["study", "none.toml"], "none.toml")
        self.write("bad.toml", "seeds = \n" + one)
        self.refuse(["study", "bad.toml", "--status"], "bad.toml:1:")
        self.refuse(["study"], "study: expected FILE.toml")

    def test_the_studies_of_the_project_can_be_run(self):
        """Every study file can be planned, which parses the settings of all variants; no training
        runs."""
        studies = sorted((ROOT / "configs/studies").glob("*.toml"))
        self.assertEqual(len(studies), 8)
        for path in studies:
            with self.subTest(study=path.stem):
                self.succeed("study", path, "--prepare")
                study = self.folder / "runs" / path.stem
                self.assertEqual((study / "study.toml").read_bytes(), path.read_bytes())
                plan = json.loads((study / "plan.json").read_text(encoding="utf-8"))
                variants = tomllib.loads(path.read_text(encoding="utf-8"))["variants"]
                self.assertEqual([each["name"] for each in plan["variants"]], list(variants))
                for name in variants:
                    self.assertTrue((study / name / "settings.toml").exists(), name)


if __name__ == "__main__":
    unittest.main()
