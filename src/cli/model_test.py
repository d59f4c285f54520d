#!/usr/bin/env python3
"""Tests of models other than the built-in one: the accepted MJCF, that a run keeps its model, and
that results mention it."""

import json
import os
import shutil
import unittest

from testing import (MODEL, PATIENCE, ProgramTest, limits, read_tensors, run, small, train_once,
                     write_tensors)

# Compiling one of these would take a lot of memory or time, or never end.
BOMBS = {
    "hfield": MODEL.replace("<worldbody>", '<asset><hfield name="h" nrow="40000" ncol="40000" '
                            'size="1 1 1 1"/></asset><worldbody>'),
    "mesh": MODEL.replace("<worldbody>", '<asset><mesh file="a.obj"/></asset><worldbody>'),
    "replicate": MODEL.replace("<worldbody>", '<worldbody><replicate count="100000000"><site/>'
                               '</replicate>'),
    "nuserdata": MODEL.replace("<worldbody>", '<size nuserdata="200000000"/><worldbody>'),
    "flexcomp": MODEL.replace("<worldbody>", '<worldbody><flexcomp name="f" type="grid" '
                              'count="1000 1000 1000" spacing="1 1 1"/>'),
    "composite": MODEL.replace("<worldbody>", '<worldbody><composite type="cable" '
                               'count="100000000 1 1"/>'),
    "plugin": MODEL.replace("<worldbody>", '<extension><plugin plugin="x"/></extension>'
                            '<worldbody>'),
    "delay": MODEL.replace("<motor ", '<motor delay="1e6" nsample="200000000" '),
    "timestep": MODEL.replace('"0.005"', '"1e-9"'),
    "iterations": MODEL.replace("<option ", '<option iterations="2000000000" '),
    "include": MODEL.replace("<worldbody>", '<include file="other.xml"/><worldbody>'),
    "include of itself": MODEL.replace("<worldbody>", '<include file="m.xml"/><worldbody>'),
    "include in a body": MODEL.replace("<body>", '<body><include file="/dev/zero"/>', 1),
    "billion laughs": "<!DOCTYPE m [" + "".join(
        f'<!ENTITY e{i + 1} "{f"&e{i};" * 10}">' for i in range(12)) + "]>"
        '<mujoco model="&e12;"/>',
    "nesting": "<mujoco>" + "<default>" * 6000,
    "nested bodies": "<mujoco><worldbody>" + "<body>" * 400 + "</body>" * 400 +
                     "</worldbody></mujoco>",
    "attribute": MODEL.replace("<option ", f'<option gravity="{"0 " * 30000}" '),
    "name": MODEL.replace("<body>", f'<body name="{"a" * 60000}">', 1),
    "elements": MODEL.replace("<worldbody>", "<worldbody>" + "<light/>" * 7000),
    "length": MODEL + " " * 100000,
    "NUL": MODEL.replace("<body>", "<body>\0", 1),
    "not UTF-8": MODEL.replace("<body>", '<body name="\udcff\udcfe">', 1),
    "UTF-16": MODEL.encode("utf-16").decode("utf-8", "surrogateescape"),
}


# These would take memory, too, if the program compiled more than the motion.
EXTRAS = MODEL.replace(
    "<worldbody>", '<size memory="400G" nkey="200000000"/><asset><texture type="2d" builtin="flat" '
    'width="40000" height="40000"/></asset><worldbody><camera resolution="100000 100000"/>')


class BombTest(ProgramTest):
    """Models that would need too much memory or time are refused before compilation."""

    @classmethod
    def setUpClass(cls):
        cls.policy = train_once(cls, steps=400, eval_every=400, eval_episodes=1)

    def refuse_quickly(self, arguments, *words):
        self.refuse(arguments, *words, preexec_fn=limits, timeout=PATIENCE)

    def write_bytes(self, name, text):
        (self.folder / name).write_bytes(text.encode("utf-8", "surrogateescape"))

    def test_as_a_file(self):
        for name, text in BOMBS.items():
            self.write_bytes("m.xml", text)
            commands = [["simulate", "--seconds", "1", "--model", "m.xml"]]
            if name in ("hfield", "flexcomp", "timestep", "include"):
                commands += [[*small(), "--model", "m.xml"],
                             ["eval", self.policy, "--model", "m.xml"],
                             ["plot", self.policy, "--model", "m.xml"]]
            for command in commands:
                with self.subTest(bomb=name, command=command):
                    self.refuse_quickly(command, "m.xml")

    def test_extras_are_left_out(self):
        self.write("m.xml", EXTRAS)
        self.succeed("simulate", "--seconds", "1", "--model", "m.xml", "--csv", "m.csv", preexec_fn=limits,
                     timeout=PATIENCE)

    def test_in_a_policy(self):
        metadata, tensors = read_tensors(self.policy / "policy.safetensors")
        for name in ("hfield", "replicate", "flexcomp", "timestep", "include", "billion laughs"):
            write_tensors(self.folder / "p", metadata | {"model": BOMBS[name]}, tensors)
            for command in (["info", "p"], ["eval", "p"], ["simulate", "p"],
                            ["map", "p", "--physics", "mujoco"], ["plot", "p"],
                            ["export", "p", "--page", "page"]):
                with self.subTest(bomb=name, command=command):
                    self.refuse_quickly(command, 'p: metadata "model":')

    def test_in_a_run_and_in_a_study(self):
        self.write("m.xml", MODEL)
        self.succeed(*small(model="m.xml", steps=400, eval_every=400, eval_episodes=1))
        self.write("s.toml", "seeds = 1\n[variants.a]\nmodel = \"m.xml\"\n")
        for name in ("hfield", "flexcomp", "timestep", "include"):
            self.write_bytes("run/model.xml", BOMBS[name])
            self.write_bytes("m.xml", BOMBS[name])
            for command in (["train", "--resume", "run"], ["info", "run"], ["compare", "run"],
                            ["train", "--config", "run/config.toml", "--out", "new"]):
                with self.subTest(bomb=name, command=command):
                    self.refuse_quickly(command, "run/model.xml")
            self.refuse_quickly(["study", "s.toml", "--out", "new"], "m.xml")

    def test_a_path_that_is_no_file(self):
        os.mkfifo(self.folder / "pipe")
        (self.folder / "folder").mkdir()
        for name, words in (("pipe", "expected a file, got a pipe or a device"),
                            ("/dev/zero", "expected a file, got a pipe or a device"),
                            ("folder", "expected a file, got a folder")):
            for command in (["simulate"], small(), ["eval", self.policy]):
                with self.subTest(name=name, command=command):
                    done = self.run_here(*command, "--model", name, preexec_fn=limits, timeout=PATIENCE)
                    self.assert_one_line(done, 2, name, words)
        with open(self.folder / "large", "wb") as file:
            file.truncate(1 << 40)
        done = self.run_here("simulate", "--model", "large", preexec_fn=limits, timeout=PATIENCE)
        self.assert_one_line(done, 2, "large: expected at most 65536 bytes, got 1099511627776")


class HiddenTest(ProgramTest):
    """Elements that would change the motion without a change of the plant's parameters are
    refused."""

    def test_it_is_refused(self):
        for old, new, *words in (
                ('armature="0.01"', 'armature="-0.01"', "armature", "not negative"),
                ('armature="0.01"', 'armature="inf"', "m.xml:5:", "armature"),
                ('damping="0"', 'damping="0" frictionloss="-1"', "frictionloss"),
                ('damping="0"', 'damping="0" range="-1 2" limited="true"', "same both ways"),
                ("<option ", '<option wind="1 0 0" density="1.2" ', "wind"),
                ("/>\n  <worldbody>", '><flag gravity="disable"/></option>\n<worldbody>',
                 "gravity"),
                ("<motor ", '<motor forcerange="-1 2" ', "forcerange"),
                ('mass="1"', 'mass="1e5"', "mass1: expected a number in [0.01, 100], got"),
                ('timestep="0.005"', 'timestep="0.003"', "a timestep that divides 0.02 s")):
            with self.subTest(change=new):
                self.assertIn(old, MODEL)
                self.write("m.xml", MODEL.replace(old, new, 1))
                self.refuse(["simulate", "--seconds", "1", "--model", "m.xml"], "m.xml", *words)


class RunTest(ProgramTest):
    """A run stores its complete model."""

    OWN = MODEL.replace('armature="0.01"', 'armature="0.02"', 1)

    def test_it_is_resumed_from_anywhere_and_without_the_file(self):
        (self.folder / "a/sub").mkdir(parents=True)
        (self.folder / "b").mkdir()
        self.write("a/own.xml", self.OWN)
        self.succeed(*small(model="own.xml", out="whole", steps=4000), cwd=self.folder / "a")
        self.succeed(*small(model="../own.xml", out="../parts", steps=2000),
                     cwd=self.folder / "a/sub")
        self.write("a/own.xml", MODEL.replace('armature="0.01"', 'armature="0.05"'))
        self.write("b/model.xml", MODEL)  # the other folder must not use this one
        shutil.move(self.folder / "a/parts", self.folder / "moved")
        (self.folder / "a/own.xml").unlink()
        self.succeed("train", "--resume", "../moved", "--steps", 4000, cwd=self.folder / "b")
        self.assert_same_run("a/whole", "moved")
        self.assertEqual((self.folder / "moved/model.xml").read_text("utf-8"), self.OWN)

    def succeed(self, *arguments, cwd=None, **more):
        done = run(*arguments, cwd=cwd or self.folder, **more)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done)
        return done.stdout

    def test_a_copy_that_has_changed_is_refused(self):
        self.write("own.xml", self.OWN)
        self.succeed(*small(model="own.xml", steps=400))
        self.write("run/model.xml", MODEL.replace('armature="0.01"', 'armature="0.05"', 1))
        self.refuse(["train", "--resume", "run"], "expected a checkpoint of the same model")
        (self.folder / "run/model.xml").unlink()
        self.refuse(["train", "--resume", "run"], "run/model.xml", "No such file")

    def test_a_model_outside_of_the_run_is_refused(self):
        self.write("own.xml", self.OWN)
        self.succeed(*small(model="own.xml", steps=400))
        config = self.folder / "run/config.toml"
        text = config.read_text("utf-8")
        self.assertIn('model = "model.xml"', text)
        config.write_text(text.replace('"model.xml"', '"../own.xml"'), encoding="utf-8")
        for command in (["train", "--resume", "run"], ["info", "run"]):
            self.refuse(command, "run/config.toml", "expected model.xml", "../own.xml")

    def test_an_empty_path_is_refused(self):
        self.refuse(small(model=""), "--model: expected a path, got an empty text")

    def test_variants_of_a_study_may_differ_only_in_the_content_of_their_models(self):
        self.write("one.xml", MODEL)
        self.write("two.xml", self.OWN)
        text = 'seeds = 1\n[settings]\nagent = "d3qn-small"\nsteps = 100\neval_every = 100\n' \
               'eval_episodes = 1\nenvs = 4\nhidden = [16]\nhead = 8\n' \
               '[variants.a]\nmodel = "one.xml"\n[variants.b]\nmodel = "two.xml"\n'
        self.write("s.toml", text)
        self.assertIn("armature1 0.02", self.succeed("study", "s.toml", "--out", "x") +
                      self.succeed("info", "x/b/seed1"))
        self.write("s.toml", text.replace("two.xml", "one.xml"))
        self.refuse(["study", "s.toml", "--out", "y"], 'variant "b": expected settings of its own, got those of "a"')


class SaidTest(ProgramTest):
    """Every report of results mentions a model that is not the built-in one."""

    @classmethod
    def setUpClass(cls):
        cls.ours = train_once(cls, steps=2000, eval_episodes=1)
        own = cls.ours.parent / "own.xml"
        own.write_text(RunTest.OWN, encoding="utf-8")
        done = run(*small(out=cls.ours.parent / "own", steps=2000, eval_episodes=1, model=own))
        assert done.returncode == 0, done
        cls.trained, cls.output = cls.ours.parent / "own", done.stdout

    CAPTION = r"not the built-in one \(content [0-9a-f]{16}\)"
    TEXT = CAPTION + r": armature1 0\.02 kg·m²"

    def test_train_and_info(self):
        self.assertRegex(self.output, r"(?m)^  model model\.xml, " + self.TEXT + "$")
        text = self.succeed("info", self.trained)
        self.assertRegex(text, r"(?m)^  model  +\S+/own/model\.xml, " + self.TEXT + "$")
        self.assertRegex(text, r"(?m)^  model  +of the training, " + self.TEXT + "$")
        self.assertNotIn("model", self.succeed("info", self.ours))

    def test_eval(self):
        self.write("m.xml", RunTest.OWN)
        few = ("--episodes", 1)
        for arguments, name in (([self.trained], "of the training"),
                                ([self.ours, "--model", "m.xml"], "m.xml")):
            self.assertRegex(self.succeed("eval", *arguments, *few),
                             rf"(?m)^  model  +{name}, {self.TEXT}$")
        self.assertNotIn("model", self.succeed("eval", self.ours, *few))
        self.assertIn("the plant of each episode without the model's differences; 0 of 1 plants",
                      self.succeed("eval", "lqr", "--known-plant", "--model", "m.xml", *few))
        model = json.loads(self.succeed("eval", self.trained, *few, "--json"))["model"]
        self.assertEqual((model["file"], model["differences"]), (None, ["armature1 0.02 kg·m²"]))
        given = json.loads(self.succeed("eval", self.ours, "--model", "m.xml", *few, "--json"))
        self.assertEqual(given["model"], model | {"file": "m.xml"})
        plain = json.loads(self.succeed("eval", self.ours, *few, "--json"))
        self.assertEqual(plain["model"], "built-in")

    def test_simulate(self):
        self.write("m.xml", MODEL.replace('type="hinge"', 'type="hinge" ref="20"', 1))
        model = rf"model  *m\.xml, {self.CAPTION}: q1 = -0\.349066 rad \+ a"
        arguments = ("simulate", "--seconds", 0.1, "--model", "m.xml")
        self.assertRegex(self.succeed(*arguments, "--csv", "m.csv"), "(?m)^  " + model)
        done = self.run_here(*arguments)
        self.assertEqual(done.returncode, 0)
        self.assertEqual(done.stdout, (self.folder / "m.csv").read_text("utf-8"))
        self.assertRegex(done.stderr, "^upswing: " + model)

    def test_figures(self):
        grid = ("--x", "mass2=0.9:1.1:2", "--y", "gravity=9:10:2", "--episodes", 1, "--physics",
                "mujoco")
        for policy, out in ((self.trained, "own"), (self.ours, "ours")):
            text = self.succeed("plot", policy, "--seconds", 0.1, "--out", out + "-plot")
            text += self.succeed("map", policy, *grid, "--out", out + "-map")
            figures = [(self.folder / name).read_text("utf-8") for name in
                       (out + "-plot/episode.svg", out + "-plot/phase.svg", out + "-map/map.svg")]
            for figure in figures:
                (self.assertRegex if out == "own" else self.assertNotRegex)(figure, self.CAPTION)
            self.assertEqual(text.count("not the built-in one"), 2 if out == "own" else 0)
        again = json.loads(self.succeed("map", self.trained, *grid, "--out", "json", "--json"))
        self.assertEqual(again["model"]["differences"], ["armature1 0.02 kg·m²"])

    def test_compare(self):
        shutil.copytree(self.trained, self.folder / "runs/a")
        output = self.succeed("compare", "runs", "--unfinished")
        self.assertRegex(output, "d3qn-small, other model: uses an MJCF model, " + self.CAPTION)
        shutil.copytree(self.ours, self.folder / "runs/b")
        output = self.succeed("compare", "runs", "--unfinished", "--different-tasks")
        self.assertRegex(output, "d3qn-small, other model: uses an MJCF model, " + self.CAPTION)
        self.assertRegex(output, r"model built-in")


if __name__ == "__main__":
    unittest.main()
