#!/usr/bin/env python3
"""Tests of `upswing train`: its output and files, that it learns, and that it is reproducible."""

import json
import os
import re
import tempfile
import unittest
from pathlib import Path

from testing import REWARD_TERMS, ROOT, RUN_FILES, ProgramTest, read_csv, read_tensors, run, small

ENDLESS = small(steps=10**9, stop_when_solved=False)
METRICS = ["step", "episodes", "updates", "epsilon", "learning_rate", "loss", "q", "td_error",
           "gradient_norm", "feature_rank", "dormant_share", "mean_return", "success_rate",
           "seconds"]
EPISODES = ["step", "episode", "return", "length", "terminated", *REWARD_TERMS]
EVALS = ["step", "success_rate", "success_low", "success_high", "mean_return", "swing_up_seconds",
         "work", "rms_torque", "torque_variation", "torque_variation_upright", "value", "discounted_return", "seconds"]


class SmallTrainingTest(ProgramTest):
    """Tests of one small training: its output and its files."""

    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory(prefix="upswing-")
        cls.addClassCleanup(temporary.cleanup)
        cls.place = Path(temporary.name)
        done = run(*small(), cwd=cls.place)
        assert (done.returncode, done.stderr) == (0, ""), done
        cls.output = done.stdout

    def table(self, name, columns):
        """The rows of a table of the run, after asserting its columns."""
        path = self.place / "run" / name
        self.assertEqual(path.read_text(encoding="utf-8").splitlines()[0], ",".join(columns))
        return read_csv(path)

    def test_plain_lines_when_piped(self):
        self.assertNotIn("\x1b", self.output)
        self.assertNotIn("\r", self.output)
        self.assertTrue(self.output.startswith("Training d3qn-small (seed 1) in run\n"), self.output)
        # Rates are known from the first report on, however little time has passed.
        self.assertEqual(len(re.findall(r"^ *[24],000 steps .* [1-9][\d,]* updates/s .*"
                                        r"success +\d/4$", self.output, re.M)), 2)

    def test_diverged_episodes_are_counted(self):
        output = self.succeed("train", "--agent", "ppo", "--steps", 1000, "--eval-every", 1000,
                              "--eval-episodes", 4, "--mass", 0.01, "--length", 0.1, "--armature", 0,
                              "--torque-limit", 1000, "--damping", 0, "--out", "light")
        self.assertRegex(output, r"success   0/4  diverged 4\n")
        self.assertIn(", the simulation diverged in 4\n",
                      (self.folder / "light/log.txt").read_text(encoding="utf-8"))

    def test_run_folder_holds_just_its_files(self):
        self.assertEqual({path.name for path in (self.place / "run").iterdir()}, RUN_FILES)
        self.assertEqual([path.name for path in self.place.iterdir()], ["run"])

    def test_log_has_the_conditions_of_times(self):
        log = (self.place / "run/log.txt").read_text(encoding="utf-8")
        begin = json.loads(re.search(r"Z started at step 0 (\{.*\})\n", log).group(1))
        self.assertEqual(list(begin), ["host", "vectors", "threads", "processor", "version"])
        self.assertEqual(begin["threads"], 1)
        end = json.loads(re.search(r"Z finished at step 4000 (\{.*\})\n$", log).group(1))
        self.assertEqual(list(end), ["seconds", "busy"])
        self.assertGreater(end["busy"], 0)

    def test_metrics(self):
        rows = self.table("metrics.csv", METRICS)
        # With eight parallel environments, a row comes at the first step at or past a multiple.
        self.assertEqual([row["step"] for row in rows],
                         [504, 1000, 1504, 2000, 2504, 3000, 3504, 4000])
        self.assertEqual([row["updates"] for row in rows],
                         [(row["step"] - 200) // 4 for row in rows])
        for before, after in zip(rows, rows[1:]):
            self.assertGreaterEqual(before["epsilon"], after["epsilon"])
            self.assertGreater(before["learning_rate"], after["learning_rate"])
            self.assertLessEqual(before["seconds"], after["seconds"])
        for row in rows:
            self.assertGreater(row["loss"], 0)
            self.assertGreater(row["td_error"], 0)
            self.assertGreater(row["gradient_norm"], 0)
            self.assertAlmostEqual(row["epsilon"], max(0.05, 0.977 ** row["episodes"]), delta=1e-12)

    def test_episodes(self):
        rows = self.table("episodes.csv", EPISODES)
        self.assertEqual([row["episode"] for row in rows], list(range(1, 17)))  # 4000 / 200 - 4
        for row in rows:
            self.assertEqual((row["length"], row["terminated"]), (200, 0))
            self.assertAlmostEqual(sum(row[term] for term in REWARD_TERMS), row["return"],
                                   delta=1e-9)
            self.assertTrue(0 <= row["energy"] <= 300 and 0 <= row["height"] <= 200, row)
            self.assertEqual(row["balance"] % 5, 0)
            self.assertTrue(row["velocity_penalty"] <= 0 and row["torque_penalty"] < 0, row)

    def test_evaluations(self):
        rows = self.table("evals.csv", EVALS)
        self.assertEqual([row["step"] for row in rows], [2000, 4000])
        for row in rows:
            self.assertTrue(0 <= row["success_low"] <= row["success_rate"] <= row["success_high"]
                            <= 1, row)
            self.assertTrue(row["work"] > 0 and 0 < row["rms_torque"] <= 5, row)
            self.assertTrue(0 < row["torque_variation"] <= 500, row)
            self.assertLessEqual(row["torque_variation_upright"], 500 * row["success_rate"] or 0)


class TrainTest(ProgramTest):
    def policy_of(self, name):
        return (self.folder / name / "policy.safetensors").read_bytes()

    # ---- Output.

    def test_a_rate_is_printed_once_it_is_known(self):
        output = self.succeed(*small(log_every=3000))
        self.assertRegex(output, r"(?m)^ *2,000 steps .* - updates/s ")
        self.assertRegex(output, r"(?m)^ *4,000 steps .* [1-9][\d,]* updates/s ")

    def test_summary_says_not_solved_and_names_the_next_commands(self):
        output = self.succeed(*small())
        self.assertIn("not solved yet", output)
        self.assertIn("Best policy: run/policy.safetensors", output)
        watch, *commands = re.findall(r"^  \./upswing (.*)$", output, re.M)
        self.assertEqual(watch, "demo run")  # the launcher's command
        self.assertEqual(len(commands), 3)
        for command in commands:
            self.succeed(*command.split())

    def test_progress_bar_on_a_terminal(self):
        facts = (r"[1-9][\d,]* steps/s", r"[1-9][\d,]* updates/s", r"eps \d\.\d\d",
                 r"loss \d\.\d+", r"return -?\d+", r"success \d+%", r"at most [^\r]+ left")
        bar = r"\r\x1b\[K\[[= ]{16}\] +\d+% [^\r]*"
        shown = self.watch(200, ENDLESS, *(bar + fact for fact in facts))
        self.assertIn("\r\x1b[KStopped at step", shown)  # in place of the bar

    def test_progress_bar_keeps_to_the_width(self):
        bar = r"\r\x1b\[K(\[[= ]{16}\] +\d+% [^\r]*)\r"
        for shown in re.findall(bar, self.watch(60, ENDLESS, bar)):
            self.assertLess(len(shown), 60)

    # ---- Files.

    def test_best_evaluation_is_kept(self):
        self.succeed(*small(steps=20000))
        rows = read_csv(self.folder / "run/evals.csv")
        best = max(rows, key=lambda row: (row["success_rate"], row["mean_return"]))
        about, _ = read_tensors(self.folder / "run/policy.safetensors")
        self.assertEqual(float(about["step"]), best["step"])
        self.assertEqual(float(about["mean_return"]), best["mean_return"])

    def test_folder_without_a_name_is_a_new_one(self):
        self.succeed(*small(out=None))
        self.succeed(*small(out=None))
        names = sorted(path.name for path in (self.folder / "runs").iterdir())
        self.assertEqual(names, ["d3qn-small-seed1", "d3qn-small-seed1-2"])

    def test_an_empty_folder_may_be_filled(self):
        (self.folder / "run").mkdir()
        self.succeed(*small())

    def test_a_neighbour_with_a_similar_name_stays(self):
        for name in ("run.new", "run.tmp"):
            (self.folder / name).mkdir()
            (self.folder / name / "precious").write_text("mine")
        self.succeed(*small())
        for name in ("run.new", "run.tmp"):
            self.assertTrue((self.folder / name / "precious").exists(), name)

    # ---- Reproducibility.

    def test_config_runs_again_to_the_same_bytes(self):
        self.succeed(*small(gamma=0.97, mass2=1.1, epsilon_decay=0.9, double=False))
        self.succeed("train", "--config", "run/config.toml", "--out", "again")
        self.assert_same_run("run", "again")
        config = (self.folder / "run/config.toml").read_text(encoding="utf-8")
        self.assertEqual((self.folder / "again/config.toml").read_text(encoding="utf-8"), config)
        for line in ("gamma = 0.97 ", "mass2 = 1.1 ", "epsilon_decay = 0.9 ", "double = false "):
            self.assertIn("\n" + line, config)

    def test_flags_come_after_the_file_and_the_file_after_the_agent(self):
        self.write("s.toml", '[train]\nagent = "dqn"\nseed = 4\n[agent]\ngamma = 0.9\n'
                             'double = true\n[network]\nhidden = [16, 16]\n')
        self.succeed(*small(agent=None, hidden=None, seed=5), "--config", "s.toml")
        config = (self.folder / "run/config.toml").read_text(encoding="utf-8")
        for line in ('agent = "dqn" ', "seed = 5 ", "gamma = 0.9 ", "double = true ",
                     "dueling = false ", "hidden = [16, 16] "):
            self.assertIn("\n" + line, config)

    def test_same_seed_gives_the_same_bytes_and_another_does_not(self):
        self.succeed(*small(out="a", seed=3))
        self.succeed(*small(out="b", seed=3))
        self.succeed(*small(out="c", seed=4))
        self.assert_same_run("a", "b")
        self.assertNotEqual(self.policy_of("a"), self.policy_of("c"))

    def test_one_and_two_threads_give_the_same_bytes(self):
        self.succeed(*small(out="one", threads=1))
        self.succeed(*small(out="two", threads=2))
        self.assert_same_run("one", "two")

    # ---- Learning.

    def named_agents(self):
        help_text = self.succeed("train", "--help")
        listed = help_text[help_text.index("Named agents:\n"):].split("\n\n")[0]
        return re.findall(r"^  (\S+) +\S", listed, re.M)

    def test_every_named_agent_makes_a_policy(self):
        names = self.named_agents()
        self.assertEqual(set(names), {path.stem for path in (ROOT / "configs").glob("*.toml")})
        for name in names:
            with self.subTest(agent=name):
                changes = {"head": None}
                if 'algorithm = "ppo"' in (ROOT / "configs" / f"{name}.toml").read_text():
                    changes |= {"learning_starts": None, "updates_per_step": None, "batch": 16,
                                "horizon": 16}
                self.succeed(*small(agent=name, hidden=None, steps=400, eval_every=400,
                                    eval_episodes=2, log_every=200, out=name, **changes))
                self.assertIn(f"agent {name},", self.succeed("info", name))

    def test_a_parameter_beats_the_name_for_both_whatever_the_order(self):
        for flags in (["--mass", "3", "--mass2", "1.2"], ["--mass2", "1.2", "--mass", "3"]):
            self.succeed(*small(out=flags[0]), *flags)
            config = (self.folder / flags[0] / "config.toml").read_text()
            self.assertRegex(config, r"(?m)^mass1 = 3 ")
            self.assertRegex(config, r"(?m)^mass2 = 1\.2 ")

    def test_a_slash_behind_the_folder_is_no_other_folder(self):
        self.succeed(*small(out="a/b/"))
        self.assertTrue((self.folder / "a/b/policy.safetensors").exists())
        self.assertEqual([path.name for path in (self.folder / "a").iterdir()], ["b"])

    @unittest.skipIf("UPSWING_SANITIZED" in os.environ, "takes an hour under sanitizers")
    def test_learns_until_solved(self):
        output = self.succeed("train", "--agent", "fast", "--seed", 9)  # a seed of few steps
        self.assertIn("Solved after", output)
        output = self.succeed("eval", "runs/fast-seed9")
        successes = int(re.search(r"success +(\d+) of 100", output)[1])
        self.assertGreaterEqual(successes, 97)


class CommandsToTypeTest(ProgramTest):
    def test_they_are_quoted(self):
        text = self.succeed(*small(steps=8, eval_every=8, eval_episodes=1, out="my run; id"))
        self.assertIn("  ./upswing eval 'my run; id'\n", text)
        self.assertIn("  ./upswing train --resume 'my run; id'", text)

    def test_what_cannot_be_seen_is_in_none(self):
        text = self.succeed(*small(steps=8, eval_every=8, eval_episodes=1, out="a\x1b[2J"))
        self.assertIn("in a\\x1b[2J\n", text)
        self.assertNotIn("./upswing", text)
        self.assertNotIn("\x1b", text)


if __name__ == "__main__":
    unittest.main()
