#!/usr/bin/env python3
"""`upswing plot`: its figures, its summary, and bad input."""

import struct
import unittest
import xml.dom.minidom

from testing import REWARD_TERMS, ProgramTest, train_once

FILES = ("episode.svg", "episode.png", "phase.svg", "phase.png")


class PlotTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.policy = train_once(cls)

    def svg(self, name):
        text = (self.folder / name).read_text(encoding="utf-8")
        return text, xml.dom.minidom.parseString(text)

    def test_figures(self):
        text = self.succeed("plot", self.policy, "--seconds", 2)
        self.assertEqual(sorted(path.name for path in (self.folder / "plot").iterdir()),
                         sorted(FILES))
        for name in FILES:
            self.assertIn(f"plot/{name}", text)
        episode, _ = self.svg("plot/episode.svg")
        for word in ("link 1", "link 2, absolute", "velocity (rad/s)", "energy (J)", "target",
                     "torque (N·m)", "Q-value", "greedy action", "time (s)", "policy.safetensors",
                     *(name.replace("_", " ") for name in REWARD_TERMS)):
            self.assertIn(word, episode)
        phase, _ = self.svg("plot/phase.svg")
        for word in ("q1 (°)", "w1 (rad/s)", "q2 (°)", "w2 (rad/s)", "begin", "end"):
            self.assertIn(word, phase)
        for name, size in (("episode", (1000, 1150)), ("phase", (1100, 500))):
            png = (self.folder / f"plot/{name}.png").read_bytes()
            self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
            self.assertEqual(struct.unpack(">II", png[16:24]), size)

    def test_summary_says_when_it_is_upright(self):
        start = ("--start", "3.14159265,0,0,0", "--seconds", 0.1)
        text = self.succeed("plot", self.policy, *start)
        self.assertIn("from 0.00 s to the end", text)
        text = self.succeed("plot", self.policy, "--seconds", 0.1, "--out", "hanging")
        self.assertIn("not at the end", text)

    def test_same_episode_same_figures(self):
        for out in ("a", "b"):
            self.succeed("plot", self.policy, "--seconds", 1, "--physics", "closed-form", "--out",
                         out)
        for name in FILES:
            self.assertEqual((self.folder / "a" / name).read_bytes(),
                             (self.folder / "b" / name).read_bytes())

    def test_bad_input(self):
        self.refuse(["plot"], "policy")
        self.refuse(["plot", "nowhere"], "no such file")
        self.refuse(["plot", self.policy, "--start", "1,2"], "--start", "four numbers")
        self.refuse(["plot", self.policy, "--seconds", "0"], "--seconds")
        self.refuse(["plot", self.policy, "--set", "gravty=2"], "did you mean gravity?")
        self.refuse(["plot", self.policy, "--physics", "own"], "closed-form")
        self.write("taken", "")
        self.refuse(["plot", self.policy, "--out", "taken"],
                    "taken: expected a new or empty folder, got a file")

    def test_without_gnuplot(self):
        self.refuse(["plot", self.policy, "--seconds", 0.1], "gnuplot-nox", code=1,
                    env={"PATH": str(self.folder)})


if __name__ == "__main__":
    unittest.main()
