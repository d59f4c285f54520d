#!/usr/bin/env python3
"""Tests of --reward: a training by a reward of your own."""

import re
import unittest

from testing import ROOT, ProgramTest, read_csv, read_tensors, small

REWARD = "energy: E; height: h - 0.5; term3: -0.01*tau^2 - 0.001*abs(dtau) + upright"


class RewardTest(ProgramTest):
    def test_terms_are_columns_and_evaluations_keep_the_posts_reward(self):
        same = {"updates_per_step": 0, "steps": 2000, "eval_every": 1000, "episode_seconds": 1}
        self.succeed(*small(**same, reward=REWARD))
        rows = read_csv(self.folder / "run/episodes.csv")
        terms = ["energy", "height", "term3"]
        self.assertEqual(list(rows[0])[5:], terms)
        self.succeed("plot", "run", "--seconds", 0.1, "--out", "plot")
        figure = (self.folder / "plot/terms.svg").read_text(encoding="utf-8")
        for term in terms:
            self.assertIn(term, figure)
        for row in rows:
            self.assertAlmostEqual(row["return"], sum(row[term] for term in terms), delta=1e-9)
        # Without updates, the policy is the same.
        self.succeed(*small(**same, out="usual"))
        evaluations = [[{**row, "seconds": 0, "expected": 0} for row in read_csv(self.folder / run / "evals.csv")]
                       for run in ("run", "usual")]
        self.assertEqual(*evaluations)

    def test_a_resumed_run_equals_one_that_was_never_stopped(self):
        self.succeed(*small(steps=2000, reward=REWARD, episode_seconds=1.5))
        self.refuse(["train", "--resume", "run", "--reward", "E", "--steps", "4000"],
                    "reward", "E; height")
        self.succeed("train", "--resume", "run", "--steps", "4000")
        self.succeed(*small(steps=4000, reward=REWARD, episode_seconds=1.5, out="never-stopped"))
        self.assert_same_run("run", "never-stopped")

    def test_weights_of_the_built_in_terms_have_no_effect(self):
        words = "Warning: energy_weight has no effect, because reward replaces the built-in terms\n"
        self.assertIn(words, self.succeed(*small(steps=400, reward="E", energy_weight=2)))
        self.assertNotIn(words, self.succeed(*small(steps=400, energy_weight=2, out="built-in")))
        self.assertNotIn("has no effect", self.succeed(*small(steps=400, reward="E", out="own")))

    def test_the_built_in_reward_can_be_pasted_with_its_line_breaks(self):
        page = (ROOT / "docs/howto/reward.md").read_text(encoding="utf-8")
        texts = [re.findall(r'--reward "(energy: E; height[^"]*)"', text)[-1]
                 for text in (page, self.succeed("train", "--help"))]
        texts.append(texts[0].replace("\n", "\r\n") + "\n")
        same = {"steps": 2000, "physics": "mujoco", "episode_seconds": 1}
        self.succeed(*small(**same, out="usual"))
        expected = [row["return"] for row in read_csv(self.folder / "usual/episodes.csv")]
        for i, text in enumerate(texts):
            self.assertIn("\n", text)
            self.succeed(*small(**same, reward=text, out=f"run{i}"))
            rows = read_csv(self.folder / f"run{i}/episodes.csv")
            self.assertEqual([row["return"] for row in rows], expected)
            self.assertEqual(list(rows[0])[5:], ["energy", "height", "balance", "velocity", "torque"])
        # The same from a file with a text of several lines, as TOML writes them.
        self.write("my.toml", f'[reward]\nreward = """\n{texts[0]}"""\n')
        self.succeed(*small(**same, out="file"), "--config", "my.toml")
        self.assertEqual([row["return"] for row in read_csv(self.folder / "file/episodes.csv")], expected)
        self.refuse(small(start_policy="a\nb"), "start-policy")

    def mirrors(self, run):
        """Whether the settings of a run mirror its minibatches."""
        found = re.search(r"(?m)^mirror = (\w+)", (self.folder / run / "config.toml").read_text("utf-8"))
        return found[1] == "true"

    def test_a_reward_without_symmetry_is_not_mirrored(self):
        self.assertIn("Warning: mirror is off, because mirrored states have another reward: ",
                      self.succeed(*small(steps=2000, reward="0.2*w1")))
        self.assertFalse(self.mirrors("run"))
        # The same as without the setting, and after a stop.
        self.succeed(*small(steps=4000, reward="0.2*w1", mirror=False, out="never-stopped"))
        self.succeed("train", "--resume", "run", "--steps", "4000")
        self.assert_same_run("run", "never-stopped")
        self.assertNotIn("mirror", self.succeed(*small(steps=2000, reward="a: w1 + E; b: -w1", out="symmetric")))
        self.assertTrue(self.mirrors("symmetric"))
        # A plant that only some episodes have.
        self.succeed(*small(steps=1000, reward="mass2 > 1.2 ? w2 : E", out="nominal"))
        self.succeed(*small(steps=1000, reward="mass2 > 1.2 ? w2 : E", out="random"), "--randomize", 0.3)
        self.assertEqual([self.mirrors(run) for run in ("nominal", "random")], [True, False])

    def test_mirror_that_is_asked_for_is_refused_without_symmetry(self):
        self.refuse(small(reward="tau", mirror=True), "--mirror: expected false with this reward, which is ",
                    " at the mirror image, got true")
        self.write("mine.toml", 'mirror = true'.join(("[agent]\n", "\n")))
        self.refuse(["train", "--config", "mine.toml", "--reward", "tau"], "mine.toml:2: mirror: expected false")

    def test_a_study_does_the_same(self):
        self.write("study.toml", """seeds = 1

[settings]
agent = "fast"
steps = 1000
eval_every = 1000
eval_episodes = 2

[variants.plain]
reward = "E"

[variants.lean]
reward = "E + 0.1*w1"
""")
        output = self.succeed("study", "study.toml", "--out", "study")
        self.assertIn("Warning: lean: mirror is off", output)
        self.assertEqual([self.mirrors(f"study/{name}/seed1") for name in ("plain", "lean")], [True, False])

    def test_files_keep_the_reward(self):
        self.succeed(*small(steps=2000, reward=REWARD))
        metadata, _ = read_tensors(self.folder / "run/policy.safetensors")
        self.assertIn(f'reward = "{REWARD}"\n', metadata["config"])
        self.succeed(*small(steps=2000, out="usual"))
        self.assertIn("reward", self.succeed("compare", "run", "usual"))
        # A file of settings has it, too.
        settings = (self.folder / "run/config.toml").read_text(encoding="utf-8")
        self.write("mine.toml", settings)
        self.succeed("train", "--config", "mine.toml", "--out", "again")
        self.assert_same_run("run", "again")

    def test_a_reward_that_is_not_finite_stops_the_training_with_its_state(self):
        done = self.run_here(*small(reward="ok: E; bad: sqrt(0.5 - h)"))
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (1, 1))
        for words in ("training stopped at step",
                      "reward: bad: expected a number within ±1e9, got nan at q1 = ", ", w2 = ",
                      "; the checkpoint of step 0 is kept in run"):
            self.assertIn(words, done.stderr)
        self.refuse(small(reward="E + w3", out="other"), "reward: term1: ", "(did you mean w1?)")
        self.assertFalse((self.folder / "other").exists())


if __name__ == "__main__":
    unittest.main()
