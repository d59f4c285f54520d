#!/usr/bin/env python3
"""Tests of `upswing compare`: groups, figures over seeds, refused input, and written files."""

import csv
import json
import re
import statistics
import unittest
import xml.etree.ElementTree as ET

from testing import ProgramTest, read_csv, small, train_once

OUTPUTS = ["curves.png", "curves.svg", "runs.csv", "summary.csv"]


def iqm(values):
    """Mean without the floor(n/4) smallest and largest values."""
    cut = len(values) // 4
    return statistics.fmean(sorted(values)[cut:len(values) - cut])


class CompareTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        # The settings of a run, as `train` writes them.
        cls.settings = {}
        for agent in ("d3qn", "dqn"):
            path = train_once(cls, agent=agent, hidden=None, head=None, steps=8, eval_every=None,
                              eval_episodes=None, checkpoint_every=None, log_every=None,
                              learning_starts=None, threads=None, envs=None, updates_per_step=None)
            cls.settings[agent] = (path / "config.toml").read_text(encoding="utf-8")

    def make_run(self, path, seed, rows, *, agent="d3qn", steps=4000, stop=True, more=""):
        """Makes a run folder as `train` writes it, with an evaluation (success rate, return) every
        1,000 steps of 2.5 s each. `more` are lines of other settings."""
        folder = self.folder / path
        folder.mkdir(parents=True)
        settings = self.settings[agent]
        lines = (f"seed = {seed}\nsteps = {steps}\neval_every = 1000\n"
                 f"stop_when_solved = {str(stop).lower()}\n{more}").splitlines()
        for line in lines:
            settings, count = re.subn(rf"(?m)^{line.split()[0]} = .*", lambda _: line, settings)
            self.assertEqual(count, 1, line)
        (folder / "config.toml").write_text(settings, encoding="utf-8")
        (folder / "evals.csv").write_text(
            "step,success_rate,success_low,mean_return,rms_torque,torque_variation,"
            "torque_variation_upright,value,discounted_return,seconds\n"
            + "".join(f"{1000 * k},{rate},0,{value},{value / 1000},{value / 100},"
                      f"{value / 500 * rate},{300 * rate},200,{2.5 * k}\n"
                      for k, (rate, value) in enumerate(rows, 1)))
        return path

    def make_group(self, path, solved_at, **more):
        """Makes a run for each entry: the index of the evaluation that solves it, or None."""
        for seed, k in enumerate(solved_at, 1):
            rows = ([(0.5, 1000 + seed)] * (k - 1) + [(1, 2600 + seed), (1, 2500 + seed)] if k
                    else [(0.5, 900 + seed)] * 4)
            self.make_run(f"{path}/seed{seed}", seed, rows, **more)

    def compare(self, *arguments):
        return json.loads(self.succeed("compare", *arguments, "--json"))

    def test_names_of_folders_forge_neither_lines_nor_cells(self):
        variant = 'x\x1b[2J\n"a",1\u202e'
        self.make_group(f"study/{variant}", [1, 2])
        self.make_group("study/plain", [1, 2], more="gamma = 0.9\n")
        text = self.succeed("compare", "study", "--out", "figures")
        self.assertIn('x\\x1b[2J\\n"a",1\\u202e', text)
        self.assertTrue(all(line.isprintable() for line in text.splitlines()), repr(text))
        with open(self.folder / "figures/summary.csv", encoding="utf-8", newline="") as file:
            self.assertEqual({row["group"] for row in csv.DictReader(file)},
                             {'x\\x1b[2J\\n"a",1\\u202e', "plain"})
        with open(self.folder / "figures/runs.csv", encoding="utf-8", newline="") as file:
            self.assertEqual(len(list(csv.DictReader(file))), 4)
        ET.parse(self.folder / "figures/curves.svg")
        shown = self.succeed("compare", "study", "--json")
        self.assertTrue(all(line.isprintable() for line in shown.splitlines()), repr(shown))
        self.assertIn(variant, [group["group"] for group in json.loads(shown)["groups"]])

    def test_figures_of_a_group(self):
        self.make_group("runs", [1, 2, 3, 1, None])
        (group,) = self.compare("runs")["groups"]
        self.assertEqual(group["group"], "d3qn")
        self.assertEqual([run["seed"] for run in group["runs"]], [1, 2, 3, 4, 5])
        self.assertEqual(group["solved"], 4)
        self.assertEqual(group["solve_seconds"]["values"], [2.5, 5, 7.5, 2.5, None])
        self.assertEqual(group["solve_seconds"]["median"], 5)
        self.assertEqual(group["solve_steps"]["iqm"]["value"], iqm([1000, 2000, 3000, 1000, 9e9]))
        self.assertIsNone(group["solve_seconds"]["iqm"]["interval_95"][1])
        final = [2501, 2502, 2503, 2504, 905]
        self.assertEqual(group["final_return"]["values"], final)
        self.assertAlmostEqual(group["final_return"]["iqm"]["value"], iqm(final), delta=1e-9)
        low, high = group["final_return"]["iqm"]["interval_95"]
        self.assertLess(low, iqm(final))
        self.assertGreater(high, iqm(final))
        self.assertEqual(group["best_return"]["values"], [2601, 2602, 2603, 2604, 905])
        self.assertEqual(group["once_solved"]["evaluations"], 0)
        text = self.succeed("compare", "runs")
        for words in ("4 of 5", "not solved", "seeds           5 (1-5)", "no later"):
            self.assertIn(words, text)

    def test_torques(self):
        self.make_group("runs", [1, 2, 3, 1, None])
        (group,) = self.compare("runs")["groups"]
        best = [2601, 2602, 2603, 2604, 905]
        self.assertEqual(group["best_rms_torque"]["values"], [value / 1000 for value in best])
        self.assertEqual(group["best_torque_variation"]["values"],
                         [value / 100 for value in best])
        upright = group["best_torque_variation_upright"]["values"]
        self.assertEqual(upright[:4], [value / 500 for value in best[:4]])
        self.assertEqual(upright[4], 905 / 1000)
        text = self.succeed("compare", "runs", "--out", "out")
        self.assertRegex(text, r"  rms torque +median 2\.6, .* range 0\.905 to 2\.6 N·m\n")
        self.assertRegex(text, r"  torque change +median 26, .* N·m/s\n")
        self.assertRegex(text, r"    once upright +median 5\.2, .* N·m/s\n")
        with open(self.folder / "out/runs.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([float(row["best_torque_variation"]) for row in rows],
                         [value / 100 for value in best])

    def test_the_median_of_runs_half_of_which_never_solve_is_not_reached(self):
        self.make_group("runs", [1, 2, None, None])
        (group,) = self.compare("runs")["groups"]
        self.assertIsNone(group["solve_seconds"]["median"])
        self.assertRegex(self.succeed("compare", "runs"), "time to solve +median not solved")

    def test_two_groups(self):
        self.make_group("a", [1, 1, 2])
        self.make_group("b", [3, 3, None], agent="dqn")
        answer = self.compare("a", "b")
        self.assertEqual([g["group"] for g in answer["groups"]], ["d3qn", "dqn"])
        self.assertEqual([g["settings"] for g in answer["groups"]],
                         ["double true, dueling true", "double false, dueling false"])
        (pair,) = answer["pairs"]
        self.assertEqual((pair["group"], pair["against"]), ("dqn", "d3qn"))
        self.assertEqual(pair["solves_sooner"]["value"], 0)
        self.assertEqual(pair["solves_in_fewer_steps"], pair["solves_sooner"])
        self.assertIsNone(pair["solve_seconds_difference"])
        self.assertIsNone(pair["solve_steps_difference"])
        self.assertEqual(pair["return_difference"]["value"],
                         (2501 + 2502 + 903) / 3 - (2501 + 2502 + 2503) / 3)
        # Zero of nine pairs does not mean that it never happens.
        low, high = pair["solves_sooner"]["interval_95"]
        self.assertEqual(low, 0)
        self.assertAlmostEqual(high, 0.499, delta=0.001)
        self.assertIn("solves sooner   with probability 0.00 (95% 0.00 to 0.50), in no pair of "
                      "runs\n  in fewer steps  with probability 0.00 ",
                      self.succeed("compare", "a", "b"))
        # One order, whatever that of the arguments.
        other = self.compare("b", "a")
        self.assertEqual((other["groups"], other["pairs"]), (answer["groups"], answer["pairs"]))

    def test_stability(self):
        late = [(1, 2), (1, 2), (0.98, 2), (1, 2)]
        self.make_run("runs/seed1", 1, late, stop=False)
        self.make_run("runs/seed2", 2, [(1, 2)] * 4, stop=False)
        once = self.compare("runs")["groups"][0]["once_solved"]
        self.assertEqual(once, {"seeds": 2, "steady_seeds": 1, "evaluations": 4,
                                "steady_evaluations": 3, "lowest_success": 0.98})

    def test_labels(self):
        self.make_group("study/fast", [1, 1], more="gamma = 0.9\n")
        self.make_group("study/slow", [2, 2])
        self.assertEqual([g["group"] for g in self.compare("study")["groups"]], ["fast", "slow"])
        self.assertEqual([g["group"] for g in self.compare("study/fast", "study/slow")["groups"]],
                         ["d3qn (gamma 0.9)", "d3qn (gamma 0.99)"])

    def test_groups_that_differ_in_much_are_named_by_folder(self):
        much = "gamma = 0.9\nhidden = [32, 32, 32, 32]\nhead = 48\nbatch = 64\nlearning_rate = 0.01\n"
        self.make_group("runs/old", [1, 2], more=much)
        self.make_run("runs/new", 1, [(1, 2)] * 4)
        labels = [g["group"] for g in self.compare("runs/old", "runs/new")["groups"]]
        self.assertEqual(sorted(labels), ["d3qn in runs/new", "d3qn in runs/old"])
        # Runs of one folder have numbers.
        self.make_run("mixed/a/seed1", 1, [(1, 2)] * 4, more=much)
        self.make_run("mixed/a/seed2", 2, [(1, 2)] * 4, more=much)
        self.make_run("mixed/a/seed3", 3, [(1, 2)] * 4)
        self.make_run("mixed/a/seed4", 4, [(1, 2)] * 4)
        labels = [g["group"] for g in self.compare("mixed/a")["groups"]]
        self.assertEqual(labels, ["d3qn #1", "d3qn #2"])

    def test_settings_outside_the_training_do_not_split_a_group(self):
        self.make_run("r/1", 1, [(1, 1), (1, 1)], steps=9000)
        self.make_run("r/2", 2, [(0, 1)] * 4, stop=False, more="threads = 2\n")
        answer = self.compare("r")
        self.assertEqual(len(answer["groups"]), 1)
        self.assertTrue(any("budgets, 4,000 to 9,000 steps" in n for n in answer["notes"]), answer)
        self.assertTrue(any("some do not" in n for n in answer["notes"]), answer)

    def test_a_posterior_that_nothing_is_drawn_from_does_not_split_a_group(self):
        covariance = 'posterior = "mass1 0.01"\n'
        self.make_group("with", [2], more=covariance)
        self.make_run("without", 2, [(0.5, 1000)] * 4)
        self.make_run("other", 3, [(0.5, 1000)] * 4, agent="dqn", more=covariance)
        found = json.loads(self.succeed("compare", "with", "without", "other", "--json"))
        self.assertEqual([group["group"] for group in found["groups"]], ["d3qn", "dqn"])
        self.assertFalse(any("different tasks" in note for note in found["notes"]), found)
        self.assertNotIn("posterior", json.dumps(found))
        self.make_run("drawn", 1, [(0.5, 1000)] * 4, more=covariance + "randomize_posterior = true\n")
        self.assertIn("posterior", self.succeed("compare", "with", "drawn"))

    def test_one_seed_has_no_interval(self):
        self.make_run("run", 1, [(1, 2600), (1, 2610)])
        answer = self.compare("run")
        self.assertIsNone(answer["groups"][0]["final_return"]["iqm"]["interval_95"])
        self.assertIn("no intervals, because there is only one seed", answer["notes"][0])
        # "In every run" needs several runs.
        self.assertIn("final return    2,610\n", self.succeed("compare", "run"))
        self.make_run("two/1", 1, [(1, 2600), (1, 2610)])
        self.make_run("two/2", 2, [(1, 2600), (1, 2610)])
        self.assertIn("final return    2,610 in every run\n", self.succeed("compare", "two"))
        (group,) = self.compare("two")["groups"]
        self.assertIsNone(group["final_success"]["iqm"]["interval_95"])

    def test_order_of_the_arguments_changes_no_figure(self):
        self.make_group("r", [1, 2, 3])
        forth = self.compare("r/seed1", "r/seed2", "r/seed3")
        self.assertEqual(self.compare("r/seed3", "r/seed1", "r/seed2"), forth)

    def test_refuses(self):
        self.make_group("r", [1, 2])
        self.make_run("begun", 3, [(0, 1), (1, 1)])
        self.make_run("bare", 4, [])
        self.make_run("odd", 5, [(1, 1)])
        with open(self.folder / "odd/config.toml", "a", encoding="utf-8") as file:
            file.write("no_such_key = 1\n")
        (self.folder / "empty").mkdir()
        self.write("file", "")
        refuse = lambda arguments, *words: self.refuse(["compare", *arguments], *words)
        refuse([], "compare: expected RUN|FOLDER")
        refuse(["none"], "none: no such file or folder")
        refuse(["r", "none"], "none: no such file or folder")
        refuse(["file"], "file: expected a run folder, got another file")
        refuse(["empty"], "empty", "config.toml", "got neither")
        refuse(["r", "r/seed2"], "r/seed2", "got it twice")
        refuse(["begun"], "begun", "unfinished", "2,000 of 4,000", "--unfinished")
        refuse(["bare"], "bare: has no evaluation yet")
        refuse(["bare", "--unfinished"], "bare: has no evaluation yet")
        refuse(["odd"], "odd/config.toml:", "no_such_key")
        refuse(["odd", "bare", "empty"], "odd/config.toml:", "no run is left", "2 more")

    def test_one_bad_folder_does_not_stop_the_rest(self):
        self.make_group("r", [1, 2])
        expected = self.compare("r")["groups"]
        self.make_run("r/begun", 3, [(0, 1), (1, 1)])
        self.make_run("r/bare", 4, [])
        self.make_run("r/odd", 5, [(1, 1), (1, 1)])
        with open(self.folder / "r/odd/config.toml", "a", encoding="utf-8") as file:
            file.write("no_such_key = 1\n")
        self.make_run("r/table", 6, [(1, 1), (1, 1)])
        self.write("r/table/evals.csv", "step,seconds\n1,x\n")
        self.make_run("r/twin", 1, [(1, 1), (1, 1)])
        (self.folder / "empty").mkdir()
        self.write("file", "")
        for arguments in (["r"], ["r", "empty", "file"]):
            answer = self.compare(*arguments)
            self.assertEqual(answer["groups"], expected)
            left_out = [note for note in answer["notes"] if note.endswith(": left out")]
            self.assertEqual(len(left_out), 3 + len(arguments) + 1, left_out)
            for words in ("r/begun: is unfinished, evaluated up to step 2,000 of 4,000",
                          "r/bare: has no evaluation yet", "r/odd/config.toml:", "r/table/evals.csv:",
                          "r/twin: the same training as r/seed1 (all settings and seed 1)"):
                self.assertEqual(sum(note.startswith(words) for note in left_out), 1, words)
        self.assertIn("Note: file: expected a run folder", self.succeed("compare", "r", "file"))

    def test_of_the_same_training_the_one_that_went_furthest_is_kept(self):
        self.make_run("r/begun", 1, [(0, 1)], steps=1000)
        self.make_run("r/long", 1, [(0, 1), (1, 1), (1, 1)])
        self.make_run("r/short", 1, [(0, 1), (1, 1)], steps=2000)
        answer = self.compare("r")
        self.assertEqual([note for note in answer["notes"] if "left out" in note],
                         [f"r/{name}: the same training as r/long (all settings and seed 1): "
                          "left out" for name in ("begun", "short")])
        self.assertEqual(answer["groups"][0]["solved"], 1)

    def test_an_evaluation_interval_is_no_task(self):
        self.make_group("a", [1, 1, 2])
        self.make_group("b", [3, 3, 2], more="gamma = 0.9\neval_physics = \"mujoco\"\n")
        for seed in (1, 2, 3):
            config = self.folder / f"b/seed{seed}/config.toml"
            text = config.read_text(encoding="utf-8")
            text = text.replace("eval_every = 1000\n", "eval_every = 500\n")
            text = text.replace("log_every = 2000 ", "log_every = 7 ")
            config.write_text(text, encoding="utf-8")
        answer = self.compare("a", "b")
        self.assertEqual([group["task"] for group in answer["groups"]], [1, 1])
        self.assertEqual(len(answer["pairs"]), 1)
        self.assertIn("evaluated every 500 to 1,000 steps", " ".join(answer["notes"]))

    def test_tasks_stand_apart(self):
        self.make_group("a", [1, 1])
        self.make_group("b", [1, 2], agent="dqn")
        self.make_group("heavy", [1, 1], more="mass2 = 1.2\n")
        self.make_group("heavy-too", [1, 2], agent="dqn", more="mass2 = 1.2\n")
        self.make_group("seldom", [1, 1], more="eval_episodes = 7\n")
        self.make_group("noisy", [1, 1], more="sensor_noise = 0.1\n")
        self.make_group("poses", [1, 1], more="any_pose = true\n")
        folders = ["a", "b", "heavy", "heavy-too", "seldom", "noisy", "poses"]
        answer = self.compare(*folders)
        self.assertEqual([group["task"] for group in answer["groups"]], [1, 1, 2, 2, 3, 4, 5])
        self.assertEqual(len(answer["pairs"]), 2)
        self.assertIn("the groups are evaluated on 5 different tasks", " ".join(answer["notes"]))
        text = self.succeed("compare", *folders, "--out", "out")
        self.assertRegex(text, r"(?m)^  task +1 \(eval_episodes 100, any_pose false, mass2 1, sensor_noise 0\)$")
        self.assertRegex(text, r"(?m)^  task +2 \(eval_episodes 100, any_pose false, mass2 1.2, sensor_noise 0\)$")
        self.assertEqual(sorted(p.name for p in (self.folder / "out").glob("*.svg")),
                         ["curves-2.svg", "curves-3.svg", "curves-4.svg", "curves-5.svg", "curves.svg"])
        self.assertEqual(len(self.compare(*folders, "--different-tasks")["pairs"]), 21)

    def test_times_of_other_machines_are_noted(self):
        def log(run, *lines):
            text = "".join(f"2026-01-01 00:00:00Z {line}\n" for line in lines)
            self.write(run + "/log.txt", text)

        self.make_group("r", [1, 2, 3])
        def begin(threads, processor, vectors="AVX2"):
            facts = {"threads": threads, "processor": processor, "vectors": vectors}
            return f"started at step 0 {json.dumps(facts)}"

        def end(busy, seconds):
            return f'finished at step 4000 {json.dumps({"busy": busy, "seconds": seconds})}'

        for seed in (1, 2, 3):
            log(f"r/seed{seed}", begin(2, "A"), end(0.9, 10.5))
        self.assertNotIn("times", " ".join(self.compare("r")["notes"]))
        log("r/seed3", begin(1, "B\x1b[2J", "AVX-512"), end(0.9, 10))
        notes = " ".join(self.compare("r")["notes"])
        self.assertIn("different numbers of threads: 1; 2", notes)
        self.assertIn("different processors: A; B\\x1b[2J", notes)
        self.assertIn("different vector instructions: AVX-512; AVX2", notes)
        self.assertNotIn("loads", notes)
        log("r/seed3", begin(2, "A"), end(0.4, 22))
        notes = " ".join(self.compare("r")["notes"])
        self.assertIn("different machine loads", notes)
        self.assertIn("40% of the time, another 90%", notes)
        log("r/seed3", begin(2, "A"), end(0.4, 0.3))  # too short to tell
        self.assertNotIn("loads", " ".join(self.compare("r")["notes"]))
        log("r/seed3", "\0\xff", "started {", '{"threads": "2", "busy": null, "seconds": []}',
            "started at step 0, host a, vector instructions AVX2, threads 2, processor A")
        self.compare("r")

    def test_a_run_that_lacks_settings_is_not_filled_up_with_todays_defaults(self):
        self.make_run("old", 1, [(1, 1), (1, 1)])
        config = self.folder / "old/config.toml"
        whole = config.read_text(encoding="utf-8")
        config.write_text(re.sub(r"(?m)^memory = .*\n", "", whole), encoding="utf-8")
        self.refuse(["compare", "old"], "old/config.toml: expected every setting",
                    "got none of task.memory; another version wrote the file")
        config.write_text(re.sub(r"(?m)^(hidden|head) = .*\n", "", whole), encoding="utf-8")
        self.refuse(["compare", "old"], "got none of network.hidden, network.head")
        config.write_text('[train]\nagent = "d3qn"\n', encoding="utf-8")
        self.assertRegex(self.run_here("compare", "old").stderr,
                         r"got none of (\w+\.\w+, ){5}\w+\.\w+ and \d+ more; another version")

    def test_unfinished_runs_on_demand(self):
        self.make_group("r", [1, 2])
        self.make_run("begun", 3, [(0, 1), (1, 1)])
        self.make_run("bare", 4, [])
        with open(self.folder / "begun/evals.csv", "a", encoding="utf-8") as file:
            file.write("3000,1,0,2")  # left by a full disk
        self.refuse(["compare", "begun"], "begun/evals.csv", "half-written", "--resume")
        answer = self.compare("r", "begun", "bare", "--unfinished")
        self.assertEqual([run["steps"] for run in answer["groups"][0]["runs"]], [2000, 3000, 2000])
        self.assertIn("begun: is unfinished, evaluated up to step 2,000 of 4,000", answer["notes"])
        self.assertIn("bare: has no evaluation yet: left out", answer["notes"])

    def test_files(self):
        self.make_group("a", [1, 1, None])
        self.make_group("b", [3, 3, 2], more="n_step = 1\nhidden = [9, 9]\n")
        text = self.succeed("compare", "a", "b", "--out", "out")
        self.assertIn("Written", text)
        self.assertEqual(sorted(p.name for p in (self.folder / "out").iterdir()), OUTPUTS)
        with open(self.folder / "out/summary.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([row["group"] for row in rows],
                         ["d3qn (hidden [256, 256], n_step 5)", "d3qn (hidden [9, 9], n_step 1)"])
        self.assertEqual(rows[0]["solve_seconds_iqm"], "inf")
        self.assertAlmostEqual(float(rows[1]["solve_seconds_iqm"]), 20 / 3, delta=1e-12)
        with open(self.folder / "out/runs.csv", encoding="utf-8", newline="") as file:
            runs = list(csv.DictReader(file))
        self.assertEqual([row["run"] for row in runs],
                         [f"{g}/seed{s}" for g in "ab" for s in (1, 2, 3)])
        self.assertEqual([row["solve_seconds"] for row in runs],
                         ["2.5", "2.5", "inf", "7.5", "7.5", "5"])
        self.assertTrue((self.folder / "out/curves.png").read_bytes().startswith(b"\x89PNG"))
        svg = (self.folder / "out/curves.svg").read_text(encoding="utf-8")
        ET.fromstring(svg)
        for words in ("n_step 1", "keeps its last value", "training time"):
            self.assertIn(words, re.sub(r"(<[^>]*>|&#160;|\s)+", " ", svg))
        self.refuse(["compare", "a", "--out", "out"], "out: expected a new or empty folder")

    def test_without_gnuplot_there_are_figures_in_numbers_only(self):
        self.make_group("a", [1, 1])
        path = {"PATH": str(self.folder)}
        self.assertIn("2 of 2", self.succeed("compare", "a", env=path))
        done = self.run_here("compare", "a", "--out", "out", env=path)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"^upswing: tables only, no figures: .*gnuplot-nox.*\n$")
        self.assertIn("Written: summary.csv, runs.csv in out\n", done.stdout)
        self.assertEqual({path.name for path in (self.folder / "out").iterdir()},
                         {"summary.csv", "runs.csv"})

    def test_a_run_as_train_makes_it(self):
        self.succeed(*small())
        rows = read_csv(self.folder / "run/evals.csv")
        self.assertEqual(len(rows), 2)
        (group,) = self.compare("run")["groups"]
        self.assertEqual(group["group"], "d3qn-small")
        self.assertEqual(group["final_return"]["values"], [rows[1]["mean_return"]])
        self.assertEqual(group["runs"][0]["steps"], 4000)
        self.assertEqual(group["runs"][0]["seconds"], rows[1]["seconds"])

    def test_refuses_policies_and_controllers(self):
        self.make_group("r", [1, 2])
        self.write("r/seed1/policy.safetensors", "")
        refuse = lambda arguments, *words: self.refuse(["compare", *arguments], *words)
        for name in ("lqr", "sac", "r/seed1/policy.safetensors"):
            refuse(["r", name], f"{name}: expected a run or a folder of runs, got a policy or controller",
                   f"`upswing eval {name}` judges")
        refuse(["r", "none.safetensors"], "none.safetensors: no such file")


if __name__ == "__main__":
    unittest.main()
