#!/usr/bin/env python3
"""Tests of `upswing export`: test vectors against a second derivation, and policies in the page's
folder."""

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
from testing import (MODEL, ROOT, ProgramTest, read_csv, read_tensors, small, with_number,  # noqa: E402
                     write_tensors)

PLANT = ["mass1", "mass2", "length1", "length2", "damping1", "damping2", "gravity", "torque_limit"]


def mean_over_rod(value):
    """Mean of a function that is at most quadratic along a rod (Simpson's rule, exact for it)."""
    return (value(0) + 4 * value(0.5) + value(1)) / 6


def energy(plant, state):
    """Mechanical energy as an integral over the points of two thin rods."""
    q1, q2, w1, w2 = state
    l1, l2 = plant["length1"], plant["length2"]

    def per_mass(x, z, vx, vz):
        return plant["gravity"] * z + (vx * vx + vz * vz) / 2

    def first(s):
        return (-s * l1 * math.sin(q1), -s * l1 * math.cos(q1),
                -s * l1 * w1 * math.cos(q1), s * l1 * w1 * math.sin(q1))

    def second(s):
        q, w = q1 + q2, w1 + w2
        own = (-s * l2 * math.sin(q), -s * l2 * math.cos(q),
               -s * l2 * w * math.cos(q), s * l2 * w * math.sin(q))
        return tuple(a + b for a, b in zip(first(1), own))

    return (plant["mass1"] * mean_over_rod(lambda s: per_mass(*first(s))) +
            plant["mass2"] * mean_over_rod(lambda s: per_mass(*second(s))))


def capsule(mass, radius, length, slices=4000):
    """Moments of inertia (across, along) of a solid capsule, cut into thin discs."""
    total = across = along = 0.0
    step = (length + 2 * radius) / slices
    for i in range(slices):
        z = (i + 0.5) * step - length / 2 - radius
        beyond = max(0.0, abs(z) - length / 2)  # in one of the half spheres
        area = radius * radius - beyond * beyond  # over pi; r² of the disc
        total += area
        across += area * (area / 4 + z * z)
        along += area * area / 2
    return mass * across / total, mass * along / total


class TestVectorsTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.vectors = None

    def setUp(self):
        super().setUp()
        if self.vectors is None:
            type(self).vectors = json.loads(self.succeed("export", "--test-vectors", "-"))

    def assert_near(self, got, expected, error, what=None):
        self.assertLessEqual(abs(got - expected), error, (what, got, expected))

    def test_every_case_by_a_second_derivation(self):
        largest_w1, largest_w2 = self.vectors["constants"]["max_velocity"]
        for case in self.vectors["cases"]:
            plant, state = case["plant"], case["state"]
            q1, q2, w1, w2 = state
            target = energy(plant, (math.pi, 0, 0, 0))
            height = -plant["length1"] * math.cos(q1) - plant["length2"] * math.cos(q1 + q2)
            relative = (energy(plant, state) + target) / (2 * target)
            lean = [abs(math.remainder(q - math.pi, 2 * math.pi)) for q in (q1, q1 + q2)]
            inverted = max(lean) <= math.radians(30)
            high = height / (plant["length1"] + plant["length2"])
            self.assert_near(case["energy"], energy(plant, state), 1e-9)
            self.assert_near(case["energy_target"], target, 1e-12)
            self.assert_near(case["normalized_energy"], relative, 1e-10)
            self.assert_near(case["tip_height"], height, 1e-12)
            self.assertEqual(case["inverted"], inverted)
            self.assertLessEqual(abs(case["torque"]), plant["torque_limit"])
            observation = [math.cos(q1), math.sin(q1), w1 / largest_w1, math.cos(q2), math.sin(q2),
                           w2 / largest_w2, relative, high]
            terms = [min(max(relative, 0), 1.5), (high + 1) / 2, 5 * inverted,
                     -0.01 * (w1 * w1 + w2 * w2) * inverted,
                     -(0.05 if inverted else 0.01) * case["torque"] ** 2]
            for got, expected in zip(case["observation"], observation, strict=True):
                self.assert_near(got, expected, 1e-6 * max(1, abs(expected)))
            for got, expected in zip(case["reward_terms"], terms, strict=True):
                self.assert_near(got, expected, 1e-9)

    def test_cases_cover_what_differs(self):
        cases = self.vectors["cases"]
        self.assertEqual(len(cases), 64)
        self.assertGreater(sum(case["inverted"] for case in cases), 16)
        self.assertGreater(sum(case["normalized_energy"] > 1.5 for case in cases), 4)
        self.assertGreater(sum(abs(case["state"][0]) > math.pi for case in cases), 8)
        self.assertEqual(sum(case["plant"]["mass1"] == 1 for case in cases), 16)
        for name in PLANT:
            self.assertGreater(len({case["plant"][name] for case in cases}), 40)
        # States half a degree on both sides of the 30° limit, with either link.
        for link in (0, 1):
            for inside in (True, False):
                edge = math.radians(29.5 if inside else 30.5)
                leans = [(abs(abs(c["state"][0] - math.pi) - edge) if link == 0 else
                          abs(abs(c["state"][0] + c["state"][1] - math.pi) - edge), c)
                         for c in cases]
                self.assertIn(inside, [c["inverted"] for lean, c in leans if lean < 1e-9])

    def test_capsules_by_discs(self):
        for case in self.vectors["capsules"]:
            across, along = capsule(case["mass"], case["radius"], case["length"])
            self.assert_near(case["across"], across, 1e-5 * across)
            self.assert_near(case["along"], along, 1e-5 * along)

    def test_models_have_the_plant_in_them(self):
        nominal, other = self.vectors["models"]
        self.assertIn('gravity="0 0 -9.81"', nominal["mjcf"])
        self.assertNotEqual(nominal["plant"], other["plant"])
        for model in (nominal, other):
            self.write("model.xml", model["mjcf"])
            rows = self.succeed("simulate", "--model", "model.xml", "--start", "1,0,0,0",
                                "--seconds", "0.2")
            changes = [word for name in PLANT
                       for word in ("--set", f"{name}={model['plant'][name]!r}")]
            self.assertEqual(rows, self.succeed("simulate", *changes, "--start", "1,0,0,0",
                                                "--seconds", "0.2"))

    def test_memory_by_its_definition_over_a_rollout(self):
        case = self.vectors["observation_memory"]
        constants = self.vectors["constants"]
        torques, plain = case["torques"], case["observations"]
        self.assertGreater(len(set(torques)), 3)
        self.write("torques.csv", "torque\n" + "".join(f"{torque}\n" for torque in torques))
        self.succeed("simulate", "--torque", "torques.csv", "--csv", "rollout.csv",
                     "--start", ",".join(map(str, case["start"])))
        states = [[row[name] for name in ("qpos0", "qpos1", "qvel0", "qvel1")]
                  for row in read_csv(self.folder / "rollout.csv")]
        for observation, (q1, _, w1, w2) in zip(plain, states, strict=True):
            for got, expected in zip((observation[i] for i in (0, 2, 5)),
                                     (math.cos(q1), w1 / 10, w2 / 20), strict=True):
                self.assert_near(got, expected, 1e-6)
        steps = [[after[2] - before[2], after[3] - before[3], torque]
                 for before, after, torque in zip(states, states[1:], torques)]
        scale = [constants["memory_velocity"]] * 2 + [constants["memory_torque"]]
        self.assertEqual([each["memory"] for each in case["with_memory"]], [2, 4])
        for each in case["with_memory"]:
            for i, observation in enumerate(each["observations"]):
                self.assertEqual(observation[:8], plain[i])
                past = [steps[i - 1 - k] if k < i else [0, 0, 0] for k in range(each["memory"])]
                expected = [x / s for step in past for x, s in zip(step, scale)]
                for got, wanted in zip(observation[8:], expected, strict=True):
                    self.assert_near(got, wanted, 3e-6)

    def test_delays_by_their_definition(self):
        self.assertEqual([case["steps"] for case in self.vectors["delays"]], [0, 1, 3, 5])
        for case in self.vectors["delays"]:
            chosen, steps = case["chosen"], case["steps"]
            self.assertEqual(case["applied"], ([0] * steps + chosen)[:len(chosen)])
            self.assertGreater(len(set(chosen)), 4)

    def test_file_is_the_same_every_time(self):
        self.assertEqual(self.succeed("export", "--test-vectors", "vectors.json"), "")
        text = (self.folder / "vectors.json").read_text()
        self.assertEqual(json.loads(text), self.vectors)
        self.assertEqual(text, self.succeed("export", "--test-vectors", "-"))
        self.assertLess(len(text), 400_000)
        self.assertNotIn("-0.0,", text)

    def test_bad_usage(self):
        self.refuse(["export"], "--page", "--onnx", "--c", "--test-vectors", "none")
        self.refuse(["export", "--test-vectors", "a", "--page", "b"], "--page and --test-vectors")
        self.refuse(["export", "x", "--test-vectors", "a"], "no policy")
        self.refuse(["export", "--test-vectors", "nowhere/a"], "nowhere")


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
        self.write("model.xml", MODEL)
        self.succeed(*small(model="model.xml", out="own-model"))
        self.succeed("export", "run", "--page", "page")
        (self.folder / "broken").mkdir()
        self.write("broken/agents.json", '{"agents": [{"name": 3}]}')
        self.write("file", "")
        page = ["--page", "page"]
        for arguments, *words in (
                (["run", "wrong.safetensors", *page], "wrong.safetensors", "nan"),
                (["nameless.safetensors", *page], "nameless.safetensors", "agent"),
                (["lost.safetensors", *page], "lost.safetensors", "step", "many"),
                (["own-model", *page], "own-model", "built-in"),
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

        def command_of(model):
            config = metadata["config"].replace('\nmodel = ""\n', f"\nmodel = {model}\n")
            self.assertNotEqual(config, metadata["config"])
            write_tensors(self.folder / "evil.safetensors", metadata | {"config": config}, tensors)
            self.succeed("export", "evil.safetensors", "--id", "evil", "--page", "page")
            return self.index()[0].get("command")

        words = shlex.split(command_of(f'"{evil}"'))
        self.assertEqual(words[words.index("--model") + 1], evil)
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
                          ("mean_return", "1e19"), ("agent", "a\nb"), ("agent", ""),
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

    def test_a_policy_that_does_not_tell_every_setting_has_no_command(self):
        self.succeed(*small(out="run"))
        metadata, tensors = read_tensors(self.folder / "run/policy.safetensors")
        self.assertIn("\ngamma = 0.99\n", metadata["config"])
        older = metadata["config"].replace("\ngamma = 0.99\n", "\n")
        write_tensors(self.folder / "older.safetensors", metadata | {"config": older}, tensors)
        self.succeed("export", "run", "older.safetensors", "--page", "page")
        entries = json.loads((self.folder / "page/agents.json").read_text())["agents"]
        self.assertEqual(["command" in entry for entry in entries], [True, False])


class ShippedTest(ProgramTest):
    def test_the_pages_own_agents_are_what_their_list_says(self):
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

    def test_the_pages_own_agents_attain_what_they_expect(self):
        for path in sorted((ROOT / "web/public/agents").glob("*.safetensors")):
            if "-at-" in path.name:
                continue  # a checkpoint
            with self.subTest(agent=path.stem):
                result = json.loads(self.succeed("eval", path, "--episodes", 50, "--json",
                                                 "--physics", "closed-form"))
                self.assertAlmostEqual(result["value"] / result["discounted_return"], 1, delta=0.1)


if __name__ == "__main__":
    unittest.main()
