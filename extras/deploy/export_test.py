#!/usr/bin/env python3
"""Tests of `upswing export --page`: policies in the page's folder."""

import array
import json
import math
import shlex
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "src/cli"))
from testing import (ROOT, ProgramTest, read_csv, read_tensors, small, with_number,  # noqa: E402
                     write_tensors)


class PageTest(ProgramTest):
    SETTINGS = {"hidden": "16,16", "head": 8, "gamma": 0.97, "double": False, "mass2": 1.25}

    def index(self, folder="page"):
        return json.loads((self.folder / folder / "agents.json").read_text())["agents"]

    def test_a_run(self):
        self.succeed(*small(seed=7, out="My run_7", **self.SETTINGS))
        printed = self.succeed("export", "My run_7", "--page", "page")
        self.assertEqual(printed, "page/my-run-7.safetensors\n")
        policy = self.folder / "My run_7/policy.safetensors"
        self.assertEqual((self.folder / "page/my-run-7.safetensors").read_bytes(),
                         policy.read_bytes())
        (entry,) = self.index()
        about, tensors = read_tensors(policy)
        rows = read_csv(self.folder / "My run_7/evals.csv")
        self.assertEqual(len(rows), 2)
        numbers = sum(math.prod(shape) for name, (_, shape, _) in tensors.items()
                      if name.endswith((".weight", ".bias")))
        self.assertEqual(
            {key: entry[key] for key in entry if key != "command"},
            {"id": "my-run-7", "file": "my-run-7.safetensors", "agent": "d3qn-small", "seed": 7,
             "parameters": numbers, "success_rate": float(about["success_rate"]),
             "mean_return": float(about["mean_return"]), "step": int(about["step"]),
             "upswing_version": about["upswing_version"],
             "curve": {name: [row[name] for row in rows]
                       for name in ("step", "success_rate", "mean_return")}})

    def test_its_command_makes_the_same_policy(self):
        self.succeed(*small(seed=7, **self.SETTINGS))
        self.succeed("export", "run", "--page", "page")
        program, *command = shlex.split(self.index()[0]["command"])
        self.assertEqual(program, "./upswing")
        self.assertEqual(command[:5], ["train", "--agent", "d3qn-small", "--seed", "7"])
        for word in ("--hidden 16,16", "--no-double", "--gamma 0.97", "--mass2 1.25"):
            self.assertIn(word, self.index()[0]["command"])
        self.assertNotIn("--learning-rate", command)  # the named agent has this value
        self.succeed(*command, "--out", "again", "--threads", 1, "--steps", 4000)
        self.assertEqual((self.folder / "again/policy.safetensors").read_bytes(),
                         (self.folder / "page/run.safetensors").read_bytes())

    def test_the_way_to_a_policy(self):
        self.succeed(*small(seed=7, steps=8000, eval_every=2000, **self.SETTINGS))
        about, tensors = read_tensors(self.folder / "run/policy.safetensors")
        end = int(about["step"])
        steps = [0, *(int(row["step"]) for row in read_csv(self.folder / "run/evals.csv")
                      if row["step"] <= end)]
        count = str(len(steps))
        printed = self.succeed("export", "run", "--page", "page", "--checkpoints", count)
        checkpoints = self.index()[0]["checkpoints"]
        self.assertEqual([one["step"] for one in checkpoints], steps)
        *files, last = [one["file"] for one in checkpoints]
        self.assertEqual(last, "run.safetensors")
        self.assertEqual(printed, "".join(f"page/{name}\n" for name in ("run.safetensors", *files)))
        bytes_of = {name: (self.folder / "page" / name).read_bytes() for name in files}
        self.assertEqual(len(set(bytes_of.values())), len(steps) - 1)

        # Compare with a training of this length, with parameters rounded to bfloat16.
        self.succeed(*small(seed=7, steps=steps[1], eval_every=2000, out="short", **self.SETTINGS))
        _, exact = read_tensors(self.folder / "short/policy.safetensors")
        rounded_about, rounded = read_tensors(self.folder / "page" / files[1])
        self.assertEqual(rounded_about["step"], str(steps[1]))
        self.assertEqual(set(rounded), set(tensors))
        for name, (kind, shape, data) in rounded.items():
            if not name.endswith((".weight", ".bias")):
                self.assertNotEqual(kind, "BF16", name)
                continue
            self.assertEqual((kind, shape), ("BF16", exact[name][1]), name)
            wide = b"".join(bytes(2) + data[i:i + 2] for i in range(0, len(data), 2))
            for got, expected in zip(array.array("f", wide), array.array("f", exact[name][2]),
                                     strict=True):
                self.assertLessEqual(abs(got - expected), 2**-8 * abs(expected))
        self.succeed("eval", "page/" + files[1], "--episodes", "2")

        # Repeating it, and exporting only the policy, gives the same bytes.
        self.succeed("export", "run/policy.safetensors", "--id", "run", "--page", "page",
                     "--checkpoints", count)
        self.assertEqual({name: (self.folder / "page" / name).read_bytes() for name in files},
                         bytes_of)
        before = (self.folder / "page/agents.json").read_text()
        self.refuse(["export", "run", "--page", "page", "--checkpoints", len(steps) + 1],
                    "--checkpoints", f"at most {count}")
        _, untrained = read_tensors(self.folder / "page" / files[0])
        write_tensors(self.folder / "other.safetensors", about, untrained)
        self.refuse(["export", "other.safetensors", "--page", "page", "--checkpoints", "2"],
                    "expected the same policy from training it again")
        self.assertEqual((self.folder / "page/agents.json").read_text(), before)

    def test_the_way_is_that_of_a_q_network_in_the_page(self):
        self.succeed("train", "--agent", "sac-fast", "--steps", 2000, "--eval-every", 1000,
                     "--eval-episodes", 1, "--threads", 1, "--out", "run")
        self.refuse(["export", "run", "--page", "page", "--checkpoints", "2"], "Q-network")
        self.refuse(["export", "run", "--c", "a.h", "--checkpoints", "2"], "--page")
        self.refuse(["export", "run", "--page", "page", "--checkpoints", "1"], "--checkpoints")

    def test_a_named_agent_as_it_is_needs_no_more_words(self):
        self.succeed("train", "--agent", "fast", "--seed", 3, "--steps", 10000, "--threads", 1,
                     "--out", "run")
        self.succeed("export", "run", "--page", "page")
        self.assertEqual(self.index()[0]["command"], "./upswing train --agent fast --seed 3")

    def test_several_and_again(self):
        self.succeed(*small(seed=1, out="one"))
        self.succeed(*small(seed=2, out="two", agent="dqn"))
        shutil.copy(self.folder / "two/policy.safetensors", self.folder / "lonely.safetensors")
        self.succeed("export", "one", "two/policy.safetensors", "--page", "page")
        self.assertEqual([entry["id"] for entry in self.index()], ["one", "two"])
        self.assertIn("curve", self.index()[1])  # the file is in a run folder
        self.succeed("export", "lonely.safetensors", "--page", "page")
        self.assertEqual([entry["id"] for entry in self.index()], ["one", "two", "dqn"])
        self.assertNotIn("curve", self.index()[2])
        # An entry with the same ID is replaced in place; the other entries keep their text.
        text = (self.folder / "page/agents.json").read_text()
        index = json.loads(text)
        index["agents"][1]["note"] = "by hand"
        self.write("page/agents.json", json.dumps(index))
        self.succeed("export", "two", "--id", "one", "--page", "page")
        self.assertEqual([entry["id"] for entry in self.index()], ["one", "two", "dqn"])
        self.assertEqual([entry["seed"] for entry in self.index()], [2, 2, 2])
        self.assertEqual(self.index()[1]["note"], "by hand")
        self.assertEqual((self.folder / "page/one.safetensors").read_bytes(),
                         (self.folder / "two/policy.safetensors").read_bytes())
        self.assertEqual({path.name for path in (self.folder / "page").iterdir()},
                         {"agents.json", "one.safetensors", "two.safetensors", "dqn.safetensors"})

    def test_the_page_has_its_motor_at_joint_1(self):
        self.succeed(*small(actuated_joint=2, out="acrobot"))
        self.assertIn("actuated_joint 2", self.succeed("info", "acrobot"))
        self.assertEqual(json.loads(self.succeed("eval", "acrobot", "--episodes", 2, "--json"))
                         ["plant"]["actuated_joint"], 2)
        self.refuse(["export", "acrobot", "--page", "page"], "a motor at joint 1", "joint 2")

    def test_bad_input_changes_nothing(self):
        self.succeed(*small())
        for folder in ("a", "b"):
            shutil.copytree(self.folder / "run", self.folder / folder / "run")
        metadata, tensors = read_tensors(self.folder / "run/policy.safetensors")
        wrong = tensors | {"value.bias": with_number(tensors["value.bias"], 0, math.nan)}
        write_tensors(self.folder / "wrong.safetensors", metadata, wrong)
        write_tensors(self.folder / "nameless.safetensors",
                      {key: text for key, text in metadata.items() if key != "agent"}, tensors)
        write_tensors(self.folder / "lost.safetensors", metadata | {"step": "many"}, tensors)
        write_tensors(self.folder / "own-model.safetensors", metadata | {"model": "<mujoco/>"},
                      tensors)
        self.succeed("export", "run", "--page", "page")
        (self.folder / "broken").mkdir()
        self.write("broken/agents.json", '{"agents": [{"name": 3}]}')
        self.write("file", "")
        page = ["--page", "page"]
        for arguments, *words in (
                (["run", "wrong.safetensors", *page], "wrong.safetensors", "nan"),
                (["nameless.safetensors", *page], "nameless.safetensors", "agent"),
                (["lost.safetensors", *page], "lost.safetensors", "step", "many"),
                (["own-model.safetensors", *page], "own-model.safetensors", 'metadata "model"'),
                (["nothing", *page], "nothing"),
                (["a/run", "b/run", *page], "a/run", "b/run", "--id"),
                (["a/run", "b/run", "--id", "x", *page], "--id", "single"),
                (["run", "--id", "../x", *page], "--id", "../x"),
                (["run", "--id", "X", *page], "--id"),
                (page, "none"),
                (["run", "--page", "broken"], "broken/agents.json"),
                (["run", "--page", "file"], "file", "folder")):
            with self.subTest(arguments=arguments):
                self.refuse(["export", *arguments], *words)

    def test_text_of_the_file_is_no_shell_code_in_the_command(self):
        self.succeed(*small(out="run"))
        metadata, tensors = read_tensors(self.folder / "run/policy.safetensors")
        evil = "x; touch y; $(id)`id`'"

        def command_of(start):
            config = metadata["config"].replace('\nstart_policy = ""\n',
                                                f"\nstart_policy = {start}\n")
            self.assertNotEqual(config, metadata["config"])
            write_tensors(self.folder / "evil.safetensors", metadata | {"config": config}, tensors)
            self.succeed("export", "evil.safetensors", "--id", "evil", "--page", "page")
            return self.index()[0].get("command")

        words = shlex.split(command_of(f'"{evil}"'))
        self.assertEqual(words[words.index("--start-policy") + 1], evil)
        # A shell also reads each word as one.
        printed = command_of(f'"{evil}"').replace("./upswing", "printf '%s\\n'")
        shown = subprocess.run(["sh", "-c", printed], cwd=self.folder, check=True,
                               stdout=subprocess.PIPE, encoding="utf-8").stdout
        self.assertEqual(shown.splitlines(), words[1:])
        self.assertFalse((self.folder / "y").exists())
        # A command with invisible characters is left out.
        for text in ('"a\\u001b[2Jb"', '"a\\u202eb"'):
            self.assertIsNone(command_of(text), text)

    def test_numbers_about_the_policy_are_numbers(self):
        self.succeed(*small(out="run"))
        metadata, tensors = read_tensors(self.folder / "run/policy.safetensors")
        for key, text in (("seed", "1e19"), ("step", "nan"), ("success_rate", "nan"),
                          ("mean_return", "1e61"), ("agent", "a\nb"), ("agent", ""),
                          ("seed", None), ("upswing_version", None)):
            with self.subTest(key=key, text=text):
                about = {name: value for name, value in (metadata | {key: text}).items()
                         if value is not None}
                write_tensors(self.folder / "p.safetensors", about, tensors)
                self.refuse(["export", "p.safetensors", "--page", "page"], "p.safetensors", key)

    def test_a_list_that_is_none(self):
        self.succeed(*small(out="run"))
        for name, text in (("a", '{"agents": {"x": {"id": "y"}}}'), ("b", '{"agents": 3}'),
                           ("c", "[]"), ("d", '{"agents": ["x"]}'), ("e", "{"), ("f", "")):
            (self.folder / name).mkdir()
            self.write(f"{name}/agents.json", text)
            with self.subTest(text=text):
                self.refuse(["export", "run", "--page", name], f"{name}/agents.json",
                            "expected a list of agents")

    def test_only_a_policy_of_this_version_has_a_command(self):
        """Settings that its file lacks have their defaults; unknown ones are left out."""
        self.succeed(*small(out="run"))
        metadata, tensors = read_tensors(self.folder / "run/policy.safetensors")
        config = metadata["config"]
        self.assertIn("\ngamma = 0.99\n", config)
        for name, other in (("lacks", config.replace("\ngamma = 0.99\n", "\n")),
                            ("setting", config.replace("[plant]\n", '[plant]\nmodel = ""\n')),
                            ("section", config + "\n[gone]\nbins = 51\n"),
                            ("top", "title = 1\n" + config)):
            self.assertNotEqual(other, config)
            write_tensors(self.folder / f"{name}.safetensors", metadata | {"config": other}, tensors)
        for name in ("lacks", "setting", "section", "top"):
            self.succeed("export", f"{name}.safetensors", "--page", "page", "--id", name)
        self.succeed("export", "run", "--page", "page")
        entries = json.loads((self.folder / "page/agents.json").read_text())["agents"]
        commands = {entry["command"] for entry in entries}
        self.assertEqual((len(entries), len(commands)), (5, 1), commands)
        write_tensors(self.folder / "old.safetensors", metadata | {"upswing_version": "0.4.0"}, tensors)
        self.succeed("export", "old.safetensors", "--page", "old", "--id", "old")
        entry, = json.loads((self.folder / "old/agents.json").read_text())["agents"]
        self.assertNotIn("command", entry)


class ShippedTest(ProgramTest):
    def test_the_pages_own_agents_match_their_list(self):
        folder = ROOT / "web/public/agents"
        entries = json.loads((folder / "agents.json").read_text())["agents"]
        self.assertEqual({path.name for path in folder.iterdir()},
                         {one["file"] for entry in entries
                          for one in (entry, *entry.get("checkpoints", []))} | {"agents.json"})
        for entry in entries:
            with self.subTest(agent=entry["id"]):
                # An agent trained on a box of plants need not succeed on every plant.
                least = {"d3qn-adaptive": 0.95, "d3qn-randomized": 0.85}.get(entry["agent"], 1)
                self.assertGreaterEqual(entry["success_rate"], least)
                self.assertEqual(max(entry["curve"]["success_rate"]), entry["success_rate"])
                self.succeed("export", folder / entry["file"], "--id", entry["id"],
                             "--page", entry["id"])
                text = (self.folder / entry["id"] / "agents.json").read_text()
                del entry["curve"]  # needs the run, which is not here
                entry.pop("checkpoints", None)
                self.assertEqual(json.loads(text)["agents"], [entry])

    def test_the_pages_own_agents_attain_their_expected_values(self):
        for path in sorted((ROOT / "web/public/agents").glob("*.safetensors")):
            if "-at-" in path.name:
                continue  # a checkpoint
            with self.subTest(agent=path.stem):
                result = json.loads(self.succeed("eval", path, "--episodes", 50, "--json",
                                                 "--physics", "closed-form"))
                self.assertAlmostEqual(result["value"] / result["discounted_return"], 1, delta=0.1)


if __name__ == "__main__":
    unittest.main()
