#!/usr/bin/env python3
"""Tests of --from: a training that starts with the weights of a policy."""

import shutil
import unittest

from testing import SmallRunTest, read_tensors, small

SAC = {"agent": "sac-fast", "head": None, "hidden": 16, "steps": 400, "eval_every": 200,
       "learning_starts": 100, "updates_per_step": 1, "batch": 16}


class FromTest(SmallRunTest):
    def parameters(self, path):
        return {name: tensor for name, tensor in read_tensors(self.folder / path)[1].items()
                if not name.startswith("sample.")}

    def test_without_updates_the_policy_stays(self):
        self.succeed(*small(updates_per_step=0, steps=200, eval_every=100, **{"from": "run"}, out="same"))
        self.assertEqual(self.parameters("same/policy.safetensors"),
                         self.parameters("run/policy.safetensors"))
        self.succeed(*small(**SAC | {"out": "sac"}))
        self.succeed(*small(**SAC | {"updates_per_step": 0, "out": "copy", "from": "sac"}))
        actors = [{name: tensor for name, tensor in self.parameters(f"{run}/policy.safetensors").items()
                   if not name.startswith("critic.")} for run in ("copy", "sac")]
        self.assertEqual(*actors)

    def test_a_run_needs_the_file_only_at_its_start(self):
        changes = {"from": "run", "seed": 5}
        self.succeed(*small(**changes, out="whole"))
        self.succeed(*small(**changes, steps=2000, out="part"))
        config = (self.folder / "part/config.toml").read_text(encoding="utf-8")
        self.assertRegex(config, r'start_policy = "run#[0-9a-f]{16}"')
        self.write("mine.toml", config)
        shutil.move(self.folder / "run", self.folder / "moved")
        self.succeed("train", "--resume", "part", "--steps", "4000")
        self.assert_same_run("part", "whole")
        self.refuse(["train", "--config", "mine.toml", "--out", "again"], "run: no such file")
        # Another policy at the same place is noticed.
        shutil.copytree(self.folder / "part", self.folder / "run")
        self.refuse(["train", "--config", "mine.toml", "--out", "again"],
                    "start_policy: expected run#", ", got run#", "the policy has changed")

    def test_another_network_is_refused(self):
        for changes, words in (({"hidden": 16}, "8-16-(16→1, 16→9), got levels 8-32-("),
                               ({"levels": 5}, "16→5), got levels"),
                               ({"memory": 2}, "expected a policy with the network of the agent"),
                               ({"agent": "ppo", "hidden": None, "head": None, "learning_starts": None,
                                 "updates_per_step": None, "envs": None}, "expected an agent of dqn or sac")):
            with self.subTest(changes=changes):
                self.refuse(small(**changes, **{"from": "run"}, out="other"), words)
        self.refuse(small(**{"from": "lqr"}, out="other"), "--from: lqr: expected a policy.safetensors")
        self.refuse(small(start_policy="sac", out="other"), "upswing: --start-policy sac: expected a policy with")
        self.refuse(small(start_policy="nosuch", out="other"),
                    "upswing: --start-policy: nosuch: no such file; expected a policy.safetensors, a run folder "
                    "or a shipped policy (any-pose, ", " sac)\n")
        self.assertFalse((self.folder / "other").exists())


if __name__ == "__main__":
    unittest.main()
