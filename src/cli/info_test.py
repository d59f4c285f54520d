#!/usr/bin/env python3
"""Tests of `upswing info`: the description of a policy or run, how it was made, and its
self-check."""

import json
import os
import re
import signal
import unittest

from testing import ProgramTest, small


class InfoTest(ProgramTest):
    def assert_says(self, text, *words):
        for word in words:
            self.assertIn(word, text)

    def test_policy(self):
        self.succeed(*small(seed=5, mass2=1.25))
        text = self.succeed("info", "run/policy.safetensors")
        self.assert_says(text, "run/policy.safetensors", "dueling Q-network 8-32-", "16",
                         "1,578 parameters", "layer normalisation",
                         "-5, -3.75, -2.5, -1.25, 0, 1.25, 2.5, 3.75, 5 N·m", "agent d3qn-small",
                         "seed 5", "upswing ", "mass2 1.25", "self-check  passed",
                         "checksum    correct")
        self.assertRegex(text, r"step (2000|4000)")
        self.assertRegex(text, r"success \d+%, mean return -?\d+")

    def test_this_machine(self):
        text = self.succeed("info")
        self.assert_says(text, "MuJoCo ", "threads ")
        used, choice = re.search(r"vectors +(\S+) \(this processor supports: (.*)\)", text).groups()
        self.assertEqual(used, os.environ.get("UPSWING_VECTORS", choice.split(", ")[0]))

    def test_json(self):
        def answer(*words):
            return json.loads(self.succeed("info", *words, "--json"))

        self.assertIn("sac", answer()["policies"])
        policy = answer("sac")
        self.assertEqual((policy["agent"], policy["plant"]["mass2"]), ("sac", 1))
        self.assertLess(policy["self_check"]["error"], policy["self_check"]["tolerance"])
        self.assertEqual(answer("lqr", "--made-for", "mass2=1.2")["plant"]["mass2"], 1.2)
        self.succeed(*small())
        run = answer("run")
        self.assertEqual((run["step"], run["solved"], run["policy"]["agent"]), (4000, False, "d3qn-small"))

    def test_shipped_policy(self):
        self.assert_says(self.succeed("info"), "policies    any-pose, d3qn, ", "sac (shipped)")
        self.assert_says(self.succeed("info", "sac"), "sac\n", "agent sac", "self-check  passed")
        self.refuse(["info", "sax"], "a shipped policy or a controller (any-pose, ", "did you mean sac?")
        self.refuse(["compare", "sac"], "sac: expected a run or a folder of runs, got a policy")
        (self.folder / "sac").mkdir()  # a folder here comes first
        self.refuse(["info", "sac"], "sac: expected a run with a policy.safetensors, got another folder")

    def test_plain_network(self):
        self.succeed(*small(agent="dqn", layer_norm=False))
        text = self.succeed("info", "run/policy.safetensors")
        self.assert_says(text, "plain Q-network 8-32-9", "585 parameters", "agent dqn")
        self.assertNotIn("layer normalisation", text)

    def test_run(self):
        self.succeed(*small())
        text = self.succeed("info", "run")
        self.assert_says(text, "agent d3qn-small, seed 1", "step 4,000 of 4,000, 16 episodes",
                         "not yet", "self-check  passed")
        self.assertIn(self.succeed("info", "run/policy.safetensors"), text)

    def test_run_without_a_policy(self):
        process = self.start(*small(steps=10**9, eval_every=10**9))
        self.end(process, signal.SIGTERM)
        text = self.succeed("info", "run")
        self.assert_says(text, "none yet")
        self.assertTrue(re.search(r"checkpoint  step [\d,]+ of 1,000,000,000", text), text)

    def test_nothing_of_a_stranger_reaches_the_terminal_as_it_is(self):
        self.succeed(*small(eval_episodes=1))
        evil = self.folder / "\x1b[2Jx\n  self-check  passed\u202e"
        shown = "\\x1b[2Jx\\n  self-check  passed\\u202e"
        (self.folder / "run").rename(evil)
        for command in (["info", evil.name], ["eval", evil.name, "--episodes", "1"],
                        ["compare", evil.name, "--json"]):
            with self.subTest(command=command):
                text = self.succeed(*command)
                self.assertTrue(all(line.isprintable() for line in text.splitlines()), repr(text))
                if command[-1] != "--json":
                    self.assertTrue(text.startswith(shown), repr(text))
        self.assertEqual(self.succeed("info", evil.name).count("\n  self-check  passed"), 1)
        # A name may also contain bytes that are not text.
        odd = self.folder / "run"
        evil.rename(odd)
        name = os.fsdecode(b"r\xff")
        odd.rename(self.folder / name)
        self.assertTrue(self.succeed("info", name).startswith("r\\xff\n"))
        self.succeed("eval", name, "--episodes", "1", "--json")

    def test_nothing_is_written(self):
        self.succeed(*small())
        before = (self.folder / "run/log.txt").read_bytes()
        self.succeed("info", "run")
        self.assertEqual((self.folder / "run/log.txt").read_bytes(), before)

    def test_version_and_help(self):
        self.assertRegex(self.succeed("--version"), r"^upswing \d+\.\d+\.\d+\n$")
        for command in ([], ["train"], ["eval"], ["simulate"], ["info"], ["compare"]):
            self.assertIn("Examples:", self.succeed(*command, "--help"))


if __name__ == "__main__":
    unittest.main()
