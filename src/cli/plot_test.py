#!/usr/bin/env python3
"""Tests of `upswing plot`: its figures, its summary, and bad input."""

import csv
import re
import shutil
import struct
import unittest
import xml.dom.minidom

from testing import REWARD_TERMS, ProgramTest, train_once

FILES = ("episode.svg", "episode.png", "terms.svg", "terms.png")


class PlotTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.policy = train_once(cls)

    def svg(self, name):
        text = (self.folder / name).read_text(encoding="utf-8")
        return text, xml.dom.minidom.parseString(text)

    def test_figures(self):
        text = self.succeed("plot", self.policy, "--seconds", 2)
        out = self.policy / "plot"
        self.addCleanup(shutil.rmtree, out)
        self.assertEqual(sorted(path.name for path in out.iterdir()), sorted(FILES))
        for name in FILES:
            self.assertIn(f"{out}/{name}", text)
        episode, _ = self.svg(out / "episode.svg")
        for word in ("link 1", "link 2, absolute", "velocity (rad/s)", "energy (J)", "target",
                     "torque (N·m)", "Q-value (reward)", "greedy action", "time (s)",
                     "policy.safetensors", *(name.replace("_", " ") for name in REWARD_TERMS)):
            self.assertIn(word, episode)
        png = (out / "episode.png").read_bytes()
        self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">II", png[16:24]), (1000, 1190))

    def test_figures_of_an_actor(self):
        actor = train_once(type(self), agent="sac", hidden="16,16", head=None, steps=2000)
        self.succeed("plot", actor, "--seconds", 2, "--out", "out")
        episode, _ = self.svg("out/episode.svg")
        for word in ("torque (N·m)", "central 68%", "value (reward)"):
            self.assertIn(word, episode)
        for word in ("Q-value", "greedy"):
            self.assertNotIn(word, episode)
        # An actor's figure has a torque curve with a band.
        self.assertRegex(self.succeed("simulate", actor, "--seconds", 2, "--csv", "a.csv"),
                         r"  torque     peak [\d.e-]+ N·m, rms [\d.e-]+ N·m, variation")
        png = (self.folder / "out/episode.png").read_bytes()
        self.assertEqual(struct.unpack(">II", png[16:24]), (1000, 7 * 170))

    def test_summary_says_when_it_is_upright(self):
        start = ("--start", "3.14159265,0,0,0", "--seconds", 0.1)
        text = self.succeed("plot", self.policy, *start)
        self.assertIn("from 0.00 s to the end", text)
        text = self.succeed("plot", self.policy, "--seconds", 0.1, "--out", "hanging")
        self.assertIn("not at the end", text)

    def test_a_second_plot_goes_next_to_the_first(self):
        for number in ("", "-2", "-3"):
            self.succeed("plot", self.policy, "--seconds", 0.1)
            self.addCleanup(shutil.rmtree, self.policy / f"plot{number}")
            self.assertTrue((self.policy / f"plot{number}/episode.png").is_file())
        # A policy file outside any run folder.
        shutil.copy(self.policy / "policy.safetensors", self.folder / "mine.safetensors")
        for number in ("", "-2"):
            text = self.succeed("plot", "mine.safetensors", "--seconds", 0.1)
            self.assertIn(f"runs/plot-mine{number}/episode.svg", text)

    def curves(self, name):
        """The curves of a figure: lists of points (pixels), one for each stroke."""
        text = (self.folder / name).read_text(encoding="utf-8")
        return [[tuple(map(float, point.split(","))) for point in
                 re.findall(r"[-\d.]+,[-\d.]+", stroke)]
                for path in re.findall(r"<path stroke='[^']*' +d='M([^']*)'", text)
                for stroke in path.split("M")]

    def test_phase_portraits(self):
        self.succeed("plot", self.policy, "--seconds", 2, "--start", "3,0.5,-9,4", "--phase", "--out",
                     "out")
        text, _ = self.svg("out/phase.svg")
        for words in ("joint 1", "q1 (°)", "w1 (rad/s)", "joint 2", "q2 (°)", "w2 (rad/s)", "start",
                      "goal", "start 3,0.5,-9,4"):
            self.assertIn(words, text)
        self.assertTrue((self.folder / "out/phase.png").is_file())
        # The longest stroke of joint 1 follows the numbers of `simulate`: pixels are linear in them.
        rows = list(csv.DictReader(self.succeed("simulate", self.policy, "--seconds", 2, "--start",
                                                "3,0.5,-9,4").splitlines()))
        velocities = [float(row["w1"]) for row in rows]
        path = next(curve for curve in self.curves("out/phase.svg") if len(curve) > 20)
        low, high = path[1][1] - path[0][1], path[15][1] - path[0][1]
        self.assertAlmostEqual(low / high, (velocities[1] - velocities[0]) /
                               (velocities[15] - velocities[0]), delta=0.05)
        self.succeed("plot", self.policy, "--seconds", 0.1, "--out", "without")
        self.assertFalse((self.folder / "without/phase.svg").exists())

    def test_texts_of_the_figures(self):
        self.succeed("plot", self.policy, "--seconds", 0.2, "--set", "mass2=1.3", "--delay", 0.04,
                     "--start", "3,0,0,0", "--seed", 5, "--out", "out")
        text, _ = self.svg("out/episode.svg")
        for words in ("start 3,0,0,0", "seed 5", "mujoco", "mass2 1.3 kg (training: 1)", "delay 0.04"):
            self.assertIn(words, text)

    def test_held_values_are_drawn_as_steps(self):
        self.succeed("plot", self.policy, "--seconds", 4, "--start", "3.1,0.1,0,0", "--out", "out")
        rows = list(csv.DictReader(self.succeed("simulate", self.policy, "--seconds", 4, "--start",
                                                "3.1,0.1,0,0").splitlines()))
        flips = sum(a["inverted"] != b["inverted"] for a, b in zip(rows, rows[1:]))
        self.assertGreater(flips, 0)
        # The balance reward, between 5 and 0, and the torques: every piece is horizontal or
        # vertical.
        level = [curve for curve in self.curves("out/episode.svg") if len(curve) > 100 and
                 all(a[0] == b[0] or a[1] == b[1] for a, b in zip(curve, curve[1:]))]
        self.assertGreaterEqual(len(level), 4)

    def test_the_greedy_line_has_chosen_torques_only(self):
        # An episode of 20 s has more steps than the heat map has columns.
        self.succeed("plot", self.policy, "--seconds", 20, "--out", "out")
        torques = {row["torque"] for row in csv.DictReader(
            self.succeed("simulate", self.policy, "--seconds", 20).splitlines())}
        torque = [curve for curve in self.curves("out/episode.svg") if len(curve) > 100 and
                  all(a[0] == b[0] or a[1] == b[1] for a, b in zip(curve, curve[1:]))]
        greedy = max(torque, key=lambda curve: max(y for _, y in curve))  # in the lowest panel
        self.assertEqual(len({y for _, y in greedy}), len(torques))

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
        self.refuse(["plot", self.policy, "--start", "1,2"], "--start", "4 numbers")
        self.refuse(["plot", self.policy, "--seconds", "0"], "--seconds")
        self.refuse(["plot", self.policy, "--set", "gravty=2"], "did you mean gravity?")
        self.refuse(["plot", self.policy, "--physics", "own"], "closed-form")
        self.refuse(["plot", self.policy, "--out", "x.svg"], "--out: expected a folder", "x.svg")
        self.write("taken", "")
        self.refuse(["plot", self.policy, "--out", "taken"],
                    "taken: expected a new or empty folder, got a file")

    def test_without_gnuplot(self):
        self.refuse(["plot", self.policy, "--seconds", 0.1], "gnuplot-nox", code=1,
                    env={"PATH": str(self.folder)})


if __name__ == "__main__":
    unittest.main()
