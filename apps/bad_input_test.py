#!/usr/bin/env python3
"""Bad input: one clear line, exit code 2 (usage or input) or 1 (failed), and nothing is lost."""

import json
import math
import os
import resource
import shutil
import struct
import subprocess
import tempfile
import unittest
from pathlib import Path

from testing import (MODEL, UPSWING, ProgramTest, read_tensors, run, small, snapshot, with_number,
                     write_tensors)

# Should it be accepted against expectation, it does not take long.
TRAIN = ["train", "--steps", "8", "--eval-episodes", "1", "--out", "run"]


class CommandLineTest(ProgramTest):
    def test_value_for_a_flag_that_takes_none(self):
        for flag in ("--double=maybe", "--no-double=maybe", "--json=3"):
            with self.subTest(flag=flag):
                command = "eval" if flag.startswith("--json") else "train"
                self.refuse([command, "x", flag] if command == "eval" else [command, flag],
                            flag.split("=")[0].replace("--no-", ""))

    def test_empty_path(self):
        for command in (["train", "--resume", ""], ["train", "--out", ""], ["train", "--config", ""],
                        ["eval", ""], ["info", ""], ["compare", ""], ["simulate", "--torque", ""],
                        ["simulate", "--csv", ""], ["simulate", "--model", ""]):
            with self.subTest(command=command):
                self.refuse(command, "empty")

    def test_unknown_flag(self):
        self.refuse(["train", "--gama", "0.9"], "--gama", "did you mean --gamma?")
        self.refuse(["train", "--gama=0.9"], "--gama", "did you mean --gamma?")
        self.refuse(["eval", "x", "--episode", "3"], "--episode", "did you mean --episodes?")
        self.refuse(["simulate", "--secs", "3"], "--secs")

    def test_unknown_subcommand(self):
        self.refuse(["trian"], "trian", "did you mean train?")
        self.refuse([], "expected a command", "train")

    def test_too_much_or_too_little(self):
        self.refuse(["eval"], "policy")
        self.refuse(["eval", "a", "b"], "b")
        self.refuse(["train", "--gamma"], "--gamma")
        self.refuse(["train", "something"], "something")

    def test_unknown_agent(self):
        self.refuse([*TRAIN, "--agent", "d3qm"], "d3qm", "did you mean d3qn?", "double-dqn")

    def test_value_of_the_wrong_type(self):
        for flag, value, expected in (("--gamma", "high", "a number"),
                                      ("--precision", "half", "one of float32, bfloat16"),
                                      ("--batch", "1.5", "an integer"),
                                      ("--seed", "", "an integer"),
                                      ("--eval-every", "1O0", "an integer"),
                                      ("--hidden", "64,x", "a list of integers"),
                                      ("--hidden", "64,,64", "a list of integers"),
                                      ("--learning-rate", "nan", "a number"),
                                      ("--tau", "inf", "a number"), ("--mass", "1kg", "a number")):
            with self.subTest(flag=flag, value=value):
                self.refuse([*TRAIN, flag, value], flag, "expected " + expected, f'got "{value}"')

    def test_value_out_of_range(self):
        for flag, value, allowed in (("--gamma", "1.01", "[0, 1]"), ("--mass2", "0", "[0.01, 100]"),
                                     ("--mass", "-1", "[0.01, 100]"), ("--envs", "0", "[1, 4096]"),
                                     ("--hidden", "5000", "[1, 4096]"),
                                     ("--threads", "-1", "[0, 256]"),
                                     ("--seed", "99999999999999999999", "an integer"),
                                     ("--length1", "1e3", "[0.1, 10]"),
                                     ("--randomize-mass1", "1", "[0, 0.99]"),
                                     ("--randomize-gravity", "-0.1", "[0, 0.99]"),
                                     ("--sensor-noise", "-1", "[0, 10]"),
                                     ("--delay", "1.02", "[0, 1]")):
            with self.subTest(flag=flag, value=value):
                self.refuse([*TRAIN, flag, value], f" {flag}: expected", allowed,
                            f'got "{value}"')

    def test_boxes_and_disturbances_of_an_evaluation(self):
        for flag, value in (("--randomize", "1"), ("--randomize-mass", "-0.25"),
                            ("--randomize-delay", "2"), ("--sensor-noise", "nan"),
                            ("--delay", "20ms")):
            with self.subTest(flag=flag, value=value):
                self.refuse(["eval", self.write("policy", ""), flag, value], f" {flag}: expected",
                            f'got "{value}"')

    def test_delay_that_is_no_whole_number_of_control_periods(self):
        for flag in ("--delay", "--randomize-delay"):
            for value, nearest in (("0.001", "0 and 0.02"), ("0.99", "0.98 and 1"),
                                   ("0.70001", "0.7 and 0.72")):
                with self.subTest(flag=flag, value=value):
                    words = [f" {flag}: expected a multiple of 0.02 in [0, 1]", f'got "{value}"',
                             f"the nearest are {nearest}"]
                    self.refuse([*TRAIN, flag, value], *words)
                    self.refuse(["eval", self.write("policy", ""), flag, value], *words)

    def test_physics(self):
        for engine in ("mujco", "", "MuJoCo"):
            with self.subTest(engine=engine):
                words = ["--physics", "expected one of mujoco, closed-form", f'got "{engine}"']
                self.refuse([*TRAIN, "--physics", engine], *words)
                self.refuse(["eval", "run", "--physics", engine], *words)
        self.write("m.xml", MODEL)
        self.refuse([*TRAIN, "--physics", "closed-form", "--model", "m.xml"],
                    "physics closed-form: expected the built-in model")

    def test_no_layers(self):
        self.refuse([*TRAIN, "--hidden", "[]"], "expected", "--hidden")

    def test_eval_values(self):
        for flag, value in (("--episodes", "0"), ("--episodes", "many"), ("--episodes", "1.5"),
                            ("--seed", "-1"), ("--threads", "257")):
            with self.subTest(flag=flag, value=value):
                self.refuse(["eval", "run", flag, value], flag, value)

    def test_set(self):
        for change, words in (("mss2=1", ["mss2", "did you mean mass2?"]),
                              ("gravty=1", ["gravty", "did you mean gravity?"]),
                              ("gamma=1", ["gamma"]), ("mass2", ["NAME=VALUE", "mass2"]),
                              ("mass2=", ["mass2", "expected a number"]),
                              ("mass2=heavy", ["mass2", "expected a number", "heavy"]),
                              ("damping=-1", ["damping", "[0, 100]"])):
            with self.subTest(change=change):
                self.refuse(["simulate", "--set", change], "--set", *words)

    def test_start(self):
        for start in ("0,0,0", "0,0,0,0,0", "a,b,c,d", "nan,0,0,0", "0,0,0,inf", "", "0;0;0;0"):
            with self.subTest(start=start):
                self.refuse(["simulate", "--start", start], "--start", "q1,q2,w1,w2", f'"{start}"')

    def test_seconds(self):
        for seconds in ("-1", "1e9", "nan", "long"):
            with self.subTest(seconds=seconds):
                self.refuse(["simulate", "--seconds", seconds], "--seconds")

    def test_resume_beside_out_or_config(self):
        self.refuse(["train", "--resume", "a", "--out", "b"], "--resume", "--out")
        self.refuse(["train", "--resume", "a", "--config", "b"], "--resume", "--config")


class TomlTest(ProgramTest):
    def refuse_toml(self, text, *words):
        self.write("s.toml", text)
        self.refuse([*TRAIN, "--config", "s.toml"], *words)

    def test_unknown_key(self):
        self.refuse_toml("[agent]\ngamma = 0.9\ngama = 0.9\n", "s.toml:3:", "gama",
                         "did you mean gamma?")

    def test_key_in_another_section(self):
        self.refuse_toml("[train]\n\ngamma = 0.9\n", "s.toml:3:", "gamma", "[agent]", "[train]")

    def test_unknown_section(self):
        self.refuse_toml("[train]\nseed = 1\n[agnet]\ngamma = 0.9\n", "s.toml:3:", "agnet",
                         "did you mean agent?")
        self.refuse_toml("gamma = 0.9\n", "s.toml:1:", "gamma")

    def test_unknown_agent(self):
        self.refuse_toml('[train]\nseed = 3\nagent = "d3qm"\n', "s.toml:3:", "d3qm",
                         "did you mean d3qn?")

    def test_wrong_type(self):
        for line, expected in (('gamma = "0.9"', "a number"), ("gamma = true", "a number"),
                               ("double = 1", "true or false"),
                               ("double = \"yes\"", "true or false"),
                               ("n_step = 2.5", "an integer"), ("gamma = [1]", "a number"),
                               ("gamma = nan", "a number"), ("gamma = 1979-05-27", "a number"),
                               ("gamma = {}", "a number")):
            with self.subTest(line=line):
                self.refuse_toml(f"# settings\n[agent]\n{line}\n", "s.toml:3:", line.split()[0],
                                 "expected " + expected)
        for line in ("hidden = \"64\"", "hidden = [64, \"a\"]", "hidden = [[64]]"):
            with self.subTest(line=line):
                self.refuse_toml(f"[network]\n{line}\n", "s.toml:2:", "hidden",
                                 "expected a list of integers")
        self.refuse_toml("[train]\nagent = 3\n", "s.toml:2:", "agent", "expected a text")

    def test_out_of_range(self):
        self.refuse_toml("[agent]\ngamma = 0.9\ntau = 2\n", "s.toml:3:", "tau", "[0, 1]", "2")
        self.refuse_toml("[plant]\nmass = -1\n", "s.toml:2:", "mass", "[0.01, 100]", "-1")
        self.refuse_toml("[network]\nhidden = [64, 0]\n", "s.toml:2:", "hidden", "[1, 4096]")

    def test_physics(self):
        self.refuse_toml('[task]\n\nphysics = "bullet"\n', "s.toml:3:", "physics",
                         "expected one of mujoco, closed-form", 'got "bullet"')

    def test_syntax_error(self):
        for text in ("[agent]\ngamma = = 3\n", "[agent]\ngamma\n", "[agent]\ngamma = 0.9 tau = 1\n",
                     "[agent]\ngamma = \"0.9\n", "[train]\nseed = 1\n[train]\n" ):
            with self.subTest(text=text):
                self.refuse_toml(text, f"s.toml:{2 if 'agent' in text else 3}:")

    def test_missing_file_or_folder_in_its_place(self):
        self.refuse(["train", "--config", "none.toml"], "none.toml", "No such file")
        (self.folder / "d").mkdir()
        self.refuse(["train", "--config", "d"], "d", "expected a file")

    def test_binary_file(self):
        (self.folder / "s.toml").write_bytes(bytes(range(256)))
        self.refuse(["train", "--config", "s.toml"], "s.toml:1:")


class FileTest(ProgramTest):
    """A folder with a small finished run, made once and copied for each test."""

    @classmethod
    def setUpClass(cls):
        cls.made = tempfile.TemporaryDirectory(prefix="upswing-")
        cls.addClassCleanup(cls.made.cleanup)
        done = run(*small(), cwd=cls.made.name)
        assert done.returncode == 0, done

    def setUp(self):
        super().setUp()
        shutil.copytree(Path(self.made.name, "run"), self.folder / "run")
        self.policy = self.folder / "run/policy.safetensors"
        self.made_policy = Path(self.made.name, "run/policy.safetensors")
        self.checkpoint = self.folder / "run/checkpoint.safetensors"

    def flip(self, path, position):
        """Turns over one bit."""
        data = bytearray(path.read_bytes())
        data[position] ^= 0x10
        path.write_bytes(data)

    def places(self, path):
        """Bytes all over a safetensors file: in its length, header, checksum and tensors."""
        data = path.read_bytes()
        header = int.from_bytes(data[:8], "little")
        checksum = data.index(b'"checksum":"') + 12
        return [0, 1, 7, 8, 8 + header // 4, checksum, checksum + 15, 8 + header // 2, 8 + header,
                8 + header + 5, (8 + header + len(data)) // 2, len(data) - 1]


class PolicyFileTest(FileTest):
    def refuse_policy(self, *words):
        for command in (["eval"], ["simulate"], ["info"]):
            self.refuse([*command, "run/policy.safetensors"], "run/policy.safetensors", *words)

    def refuse_info(self, *words):
        self.refuse(["info", "run/policy.safetensors"], "run/policy.safetensors", *words)

    def change(self, metadata=(), tensors=(), drop=()):
        """Rewrites the policy file with another content, whole in itself."""
        old_metadata, old_tensors = read_tensors(self.policy)
        kept = {name: tensor for name, tensor in (old_tensors | dict(tensors)).items()
                if name not in drop}
        about = {key: text for key, text in (old_metadata | dict(metadata)).items()
                 if key not in drop}
        write_tensors(self.policy, about, kept)

    def test_rewritten_unchanged_it_is_good(self):
        expected = self.succeed("info", "run/policy.safetensors")
        self.change()
        self.assertEqual(self.succeed("info", "run/policy.safetensors"), expected)

    def test_missing(self):
        self.policy.unlink()
        self.refuse_policy("no such file")
        self.refuse(["eval", "nothing"], "nothing", "no such file")
        self.refuse(["eval", "run"], "run", "this run has no policy")

    def test_truncated(self):
        whole = self.policy.read_bytes()
        for size in (0, 7, 8, 100, len(whole) // 2, len(whole) - 1):
            with self.subTest(size=size):
                self.policy.write_bytes(whole[:size])
                self.refuse(["eval", "run"], "policy.safetensors", "not a whole safetensors file")

    def test_too_long(self):
        self.policy.write_bytes(self.policy.read_bytes() + b"\0" * 8)
        self.refuse_policy("not a whole safetensors file", "8 bytes too many")

    def test_corrupted(self):
        whole = self.policy.read_bytes()
        for position in self.places(self.policy):
            with self.subTest(position=position):
                self.flip(self.policy, position)
                self.refuse(["eval", "run"], "policy.safetensors")
                self.policy.write_bytes(whole)

    def test_something_else(self):
        self.policy.write_text("t,torque\n0,1\n" * 20)
        self.refuse_policy("not a whole safetensors file")
        self.refuse(["info", "run/config.toml"], "run/config.toml", "not a whole safetensors file")

    def test_tensor_of_another_shape_or_type(self):
        _, tensors = read_tensors(self.policy)
        _, shape, data = tensors["feature.0.weight"]
        self.assertEqual(shape, [32, 8])
        for wrong in (("F32", [8, 32], data), ("F32", [31, 8], data[:31 * 8 * 4]),
                      ("F64", [16, 8], data)):
            with self.subTest(type=wrong[0], shape=wrong[1]):
                self.change(tensors={"feature.0.weight": wrong})
                self.refuse_policy('"feature.0.weight"', "expected F32", str(wrong[1]))

    def test_missing_tensor(self):
        for name in ("advantage.bias", "torques", "sample.obs", "sample.q", "sample.torque"):
            with self.subTest(name=name):
                self.change(drop=[name])
                self.refuse_policy(f'"{name}"')
                shutil.copy(Path(self.made.name, "run/policy.safetensors"), self.policy)

    def test_not_finite(self):
        _, tensors = read_tensors(self.policy)
        for name, number in (("feature.0.weight", math.nan), ("value.bias", math.inf),
                             ("torques", math.nan), ("torques", -math.inf),
                             ("sample.q", math.inf), ("sample.q", math.nan),
                             ("sample.obs", math.inf), ("sample.torque", math.nan)):
            with self.subTest(tensor=name, number=number):
                self.change(tensors={name: with_number(tensors[name], 0, number)})
                self.refuse_policy(f'"{name}"', "expected finite numbers", str(number))
                shutil.copy(Path(self.made.name, "run/policy.safetensors"), self.policy)

    def test_samples_that_the_network_does_not_give(self):
        _, tensors = read_tensors(self.policy)
        for name, number in (("sample.q", 3.0), ("sample.q", -1e38), ("sample.obs", 5.0),
                             ("value.bias", 9.0), ("value.bias", 3e38), ("feature.0.weight", 9.0),
                             ("sample.torque", 4.9)):
            with self.subTest(tensor=name, number=number):
                self.change(tensors={name: with_number(tensors[name], 0, number)})
                self.refuse_policy("self-check")
                shutil.copy(Path(self.made.name, "run/policy.safetensors"), self.policy)

    def test_a_little_more_than_rounding(self):
        # The bias of the value moves every Q-value by what it is moved by itself.
        _, tensors = read_tensors(self.policy)
        largest = max(map(abs, struct.unpack("<144f", tensors["sample.q"][2])))
        (bias,) = struct.unpack("<f", tensors["value.bias"][2])
        for share, accepted in ((3e-5, False), (-3e-5, False), (3e-6, True)):
            with self.subTest(share=share):
                changed = with_number(tensors["value.bias"], 0, bias + share * largest)
                self.change(tensors={"value.bias": changed})
                if accepted:
                    self.succeed("info", "run/policy.safetensors")
                else:
                    self.refuse_policy("self-check: expected Q-value")

    def test_our_own_file_needs_its_checksum(self):
        whole = self.policy.read_bytes()
        at = whole.index(b'"checksum":"')
        for begin, text in ((at + 1, b"chequsum"), (at + 10, b" "), (at, b'"checksum" "'),
                            (at + 12, b"0" * 16), (at + 12, b"1234567890123456")):
            with self.subTest(text=text):
                broken = bytearray(whole)
                broken[begin:begin + len(text)] = text
                self.policy.write_bytes(broken)
                self.refuse_policy("not a whole safetensors file")

    def test_a_file_of_another_writer_needs_none(self):
        self.change(drop=["upswing_version"])
        self.assertNotIn(b"checksum", self.policy.read_bytes())
        text = self.succeed("info", "run/policy.safetensors")
        self.assertIn("checksum    none: the self-check cannot notice", text)
        self.assertIn("upswing unknown", text)

    def test_metadata(self):
        metadata, _ = read_tensors(self.policy)
        network = json.loads(metadata["network"])
        for change in ({"format": "other"}, {"format_version": "2"}, {"output": "gaussian"},
                       {"network": "{}"}, {"network": "nonsense"}, {"plant": "nonsense"},
                       {"plant": "{}"}, {"plant": metadata["plant"].replace("9.81", "-9.81")},
                       {"network": json.dumps(network | {"hidden": [64]})},
                       {"network": json.dumps(network | {"hidden": []})},
                       {"network": json.dumps(network | {"hidden": [-1]})},
                       {"network": json.dumps(network | {"actions": 10})},
                       {"network": json.dumps(network | {"inputs": 2**31})},
                       {"network": json.dumps(network | {"dueling": False})},
                       {"network": json.dumps(network | {"layer_norm": "yes"})}):
            with self.subTest(change=change):
                self.change(metadata=change)
                self.refuse(["eval", "run"], "policy.safetensors")
                shutil.copy(Path(self.made.name, "run/policy.safetensors"), self.policy)
        for key in ("format", "format_version", "output", "network", "plant"):
            with self.subTest(missing=key):
                self.change(drop=[key])
                self.refuse(["eval", "run"], f'"{key}"')
                shutil.copy(Path(self.made.name, "run/policy.safetensors"), self.policy)

    def test_metadata_that_the_program_uses(self):
        metadata, _ = read_tensors(self.policy)
        observation = json.loads(metadata["observation"])
        changes = [(key, text) for key, texts in {
            "control_period": ("0.05", "0", "banana", "nan", "-0.02", ""),
            "seed": ("nan", "1e19", "-1", "7.5", "99999999999999999999"),
            "step": ("nan", "1e19", "-1", "many"),
            "success_rate": ("nan", "1e19", "-0.5", "2"),
            "mean_return": ("nan", "1e19", "-inf"),
            "gamma": ("nan", "2"), "reward_scale": ("0", "inf"),
            "agent": ("a\nself-check  passed", "\x1b[2J", "a" * 65),
            "upswing_version": ("0.3.0\n", "\u202e"),
            "observation": ("{}", "nonsense", json.dumps(observation | {"max_velocity": [10, 10]}),
                            json.dumps(observation | {"memory": {"steps": 2, "names": [],
                                                                 "velocity": 1, "torque": 5}})),
        }.items() for text in texts]
        for key, text in changes:
            with self.subTest(key=key, text=text):
                self.change({key: text})
                self.refuse_info(f'metadata "{key}"')
                self.restore()
        for key in ("control_period", "observation"):
            with self.subTest(missing=key):
                shutil.copy(Path(self.made.name, "run/policy.safetensors"), self.policy)
                self.change(drop=[key])
                self.refuse_info(f'"{key}"')

    def test_numbers_of_the_network_are_neither_rounded_nor_wrapped(self):
        metadata, _ = read_tensors(self.policy)
        network = json.loads(metadata["network"])
        for change in ({"inputs": 8.9}, {"inputs": 2**32 + 8}, {"inputs": True}, {"inputs": -8},
                       {"inputs": 2**64 + 8}, {"actions": 9.5}, {"actions": 2**32 + 9},
                       {"head": 2**32 + 16}, {"head": 16.5}, {"hidden": [32.5]},
                       {"hidden": [2**32 + 32]}, {"hidden": [True]}, {"hidden": 32},
                       {"dueling": 1}, {"layer_norm": 1}):
            with self.subTest(change=change):
                self.change({"network": json.dumps(network | change)})
                self.refuse_info("network")

    def refuse_in_little_memory(self, *words):
        """A gigabyte of addresses, most of which the program and its libraries take anyway."""
        limit = None
        if "UPSWING_SANITIZED" not in os.environ:  # a sanitizer needs far more of them
            limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30))
        self.refuse(["info", "claims.safetensors"], "claims.safetensors", *words,
                    preexec_fn=limit)

    def claim(self, network, tensors):
        """Writes a policy whose metadata say that it has this network."""
        metadata, _ = read_tensors(self.policy)
        write_tensors(self.folder / "claims.safetensors",
                      metadata | {"network": json.dumps(network)}, tensors)

    def test_sizes_that_are_claimed_ask_for_no_memory(self):
        big = {"inputs": 8, "actions": 9, "hidden": [4096] * 16, "head": 0, "dueling": False,
               "layer_norm": False}
        self.claim(big, {"torques": ("F64", [9], bytes(72))})
        self.refuse_in_little_memory('no tensor "feature.0.weight"')
        self.claim(big | {"hidden": [1] * 100000}, {"torques": ("F64", [9], bytes(72))})
        self.refuse_in_little_memory('"hidden": expected a list of at most 16')

        # Each sample has 4096 Q-values, of which the file holds those of 16.
        wide = {"inputs": 8, "actions": 4096, "hidden": [1], "head": 0, "dueling": False,
                "layer_norm": False}
        samples = 400000
        shapes = {"feature.0.weight": [1, 8], "feature.0.bias": [1], "output.weight": [4096, 1],
                  "output.bias": [4096], "sample.obs": [16, 8], "sample.q": [16, 4096]}
        tensors = {name: ("F32", shape, bytes(4 * math.prod(shape)))
                   for name, shape in shapes.items()}
        tensors["torques"] = ("F64", [4096], bytes(8 * 4096))
        tensors["sample.torque"] = ("F64", [samples], bytes(8 * samples))
        self.claim(wide, tensors)
        self.refuse_in_little_memory("expected 1 to 64 samples to check, got 400000")

    def test_text_from_the_file_forges_no_line(self):
        forged = "x\n  self-check  passed\x1b[2J\u202e"
        shown = "x\\n  self-check  passed\\x1b[2J\\u202e"
        self.change(tensors={forged: ("F32", [1], bytes(8))})
        self.refuse_policy(shown)
        self.restore()
        self.change(tensors={forged: (forged, [1], bytes(8))})
        self.refuse_policy(f"type {shown} is not ours")
        self.restore()
        self.change({"format": forged})
        self.refuse_policy(f'got "{shown}"')
        self.restore()
        self.change({"network": json.dumps({"inputs": forged})})
        self.refuse_policy("network")
        self.restore()
        self.change(tensors={"y" * 100000: ("F32", [1], bytes(8))})
        done = self.run_here("info", "run/policy.safetensors")
        self.assert_one_line(done, 2, "expected the bytes of F32 [1], got 8")
        self.assertLess(len(done.stderr), 2500)

    def restore(self):
        shutil.copy(self.made_policy, self.policy)

    def test_policy_for_other_observations(self):
        self.change_inputs(4)
        self.refuse_policy("expected", "8", "4")

    def change_inputs(self, inputs):
        """Makes it a policy of zeros for observations of another size."""
        metadata, tensors = read_tensors(self.policy)
        network = json.loads(metadata["network"]) | {"inputs": inputs}
        zeros = {name: (dtype, shape, bytes(len(data)))
                 for name, (dtype, shape, data) in tensors.items() if dtype == "F32"}
        zeros["feature.0.weight"] = ("F32", [32, inputs], bytes(32 * inputs * 4))
        zeros["sample.obs"] = ("F32", [16, inputs], bytes(16 * inputs * 4))
        self.change({"network": json.dumps(network)}, zeros)


class CheckpointTest(FileTest):
    RESUME = ["train", "--resume", "run", "--steps", "8000"]

    def refuse_checkpoint(self, *words):
        self.refuse(self.RESUME, "run/checkpoint.safetensors", *words)

    def change(self, metadata=(), tensors=(), drop=()):
        old_metadata, old_tensors = read_tensors(self.checkpoint)
        kept = {name: tensor for name, tensor in (old_tensors | dict(tensors)).items()
                if name not in drop}
        write_tensors(self.checkpoint, old_metadata | dict(metadata), kept)

    def restore(self):
        shutil.copy(Path(self.made.name, "run/checkpoint.safetensors"), self.checkpoint)

    def test_rewritten_unchanged_it_is_good(self):
        self.change()
        self.succeed(*self.RESUME)

    def test_no_run(self):
        self.refuse(["train", "--resume", "nothing"], "nothing", "expected a run folder")
        (self.folder / "empty").mkdir()
        self.refuse(["train", "--resume", "empty"], "empty", "expected a run folder")

    def test_missing(self):
        self.checkpoint.unlink()
        self.refuse_checkpoint("No such file")

    def test_truncated(self):
        whole = self.checkpoint.read_bytes()
        for size in (0, 7, 1000, len(whole) // 2, len(whole) - 1):
            with self.subTest(size=size):
                self.checkpoint.write_bytes(whole[:size])
                self.refuse_checkpoint("not a whole safetensors file")

    def test_corrupted(self):
        for position in self.places(self.checkpoint):
            with self.subTest(position=position):
                self.flip(self.checkpoint, position)
                self.refuse_checkpoint()
                self.restore()

    def test_tensor_of_another_shape_or_type_or_none(self):
        _, tensors = read_tensors(self.checkpoint)
        for name in ("agent/theta", "agent/adam/m", "agent/n_step/reward", "env/state.0",
                     "env/step_counts", "train/episode_return", "train/steps", "run/size/metrics"):
            dtype, shape, data = tensors[name]
            with self.subTest(name=name):
                longer = shape[:-1] + [shape[-1] + 1] if shape else [2]
                self.change(tensors={name: (dtype, longer, data + data[-8:] if dtype[1:] == "64"
                                            else data + data[-4:])})
                self.refuse_checkpoint(f'"{name}"', "expected", "got")
                self.restore()
                self.change(drop=[name])
                self.refuse_checkpoint(f'"{name}"')
                self.restore()
                self.change(tensors={name: ("U8", [len(data)], data)})
                self.refuse_checkpoint(f'"{name}"', "expected " + dtype)
                self.restore()

    def test_not_finite(self):
        _, tensors = read_tensors(self.checkpoint)
        for name in ("agent/theta", "agent/theta_target", "agent/adam/m", "agent/adam/v",
                     "agent/replay/rows", "env/state.0", "env/obs", "train/episode_return"):
            with self.subTest(name=name):
                self.change(tensors={name: with_number(tensors[name], 2, math.nan)})
                self.refuse_checkpoint(f'"{name}"', "finite", "nan")
                self.restore()

    def test_another_version(self):
        self.change(metadata={"upswing_version": "0.0.1"})
        self.refuse_checkpoint("upswing_version", "0.0.1")
        self.change(metadata={"format": "upswing-checkpoint-99"})
        self.refuse_checkpoint("format", "upswing-checkpoint-99")

    def test_another_configuration(self):
        config = self.folder / "run/config.toml"
        original = config.read_text(encoding="utf-8")
        for before, after, words in (
                ("gamma = 0.99 ", "gamma = 0.98 ", ["agent.gamma", "0.99", "0.98"]),
                ("hidden = [32]", "hidden = [64]", ["network.hidden", "[32]", "[64]"]),
                ("mass2 = 1 ", "mass2 = 1.5 ", ["plant.mass2", "1.5"]),
                ("seed = 1 ", "seed = 2 ", ["train.seed", "1", "2"]),
                ("dueling = true", "dueling = false", ["agent.dueling", "true", "false"])):
            with self.subTest(change=after):
                self.assertIn(before, original)
                config.write_text(original.replace(before, after), encoding="utf-8")
                self.refuse_checkpoint(*words)
        config.write_text(original, encoding="utf-8")
        self.refuse([*self.RESUME, "--gamma", "0.98"], "agent.gamma", "0.99", "0.98")
        self.succeed(*self.RESUME)

    def test_configuration_of_another_version(self):
        config = self.folder / "run/config.toml"
        lines = config.read_text(encoding="utf-8").splitlines(keepends=True)
        config.write_text("".join(line for line in lines if not line.startswith("gamma = ")),
                          encoding="utf-8")
        for command in (self.RESUME, ["info", "run"], ["compare", "run"]):
            with self.subTest(command=command):
                self.refuse(command, "run/config.toml: expected every setting",
                            "got none of agent.gamma: another version wrote it")
        # As a user's own file it need not be whole.
        self.succeed(*small(steps=400, out="again"), "--config", "run/config.toml")

    def test_broken_configuration(self):
        config = self.folder / "run/config.toml"
        text = config.read_text(encoding="utf-8")
        config.write_text(text.replace("gamma = ", "gamma = = "), encoding="utf-8")
        line = text[:text.index("gamma = ")].count("\n") + 1
        self.refuse(self.RESUME, f"run/config.toml:{line}:")

    def test_table_shorter_than_the_checkpoint_knows(self):
        table = self.folder / "run/metrics.csv"
        table.write_bytes(table.read_bytes()[:100])
        self.refuse(self.RESUME, "run/metrics.csv", "expected", "got 100")


class RunFolderTest(FileTest):
    def test_existing_run_is_never_overwritten(self):
        self.refuse(small(), "run: expected a new or empty folder", "--resume run",
                    "--out")
        self.refuse(["train", "--config", "run/config.toml", "--out", "run"],
                    "run: expected a new or empty folder")

    def test_file_in_the_place_of_the_folder(self):
        self.write("taken", "mine")
        self.refuse(small(out="taken"), "taken: expected a new or empty folder, got a file")

    def test_unwritable_place(self):
        self.write("file", "mine")
        for out in ("file/run", "/proc/run", "/proc/1/deep/run"):
            with self.subTest(out=out):
                self.refuse(small(out=out), out)

    def test_unwritable_csv(self):
        self.write("file", "mine")
        for csv in ("file/out.csv", "/proc/out.csv", "none/out.csv", "run"):
            with self.subTest(csv=csv):
                self.refuse(["simulate", "--seconds", "1", "--csv", csv], csv)

    def test_output_that_cannot_be_written(self):
        for command in (["simulate"], ["simulate", "--seconds", "1"], ["eval", "run", "--json"],
                        ["eval", "run"], ["info", "run"]):
            with self.subTest(command=command), open("/dev/full", "w", encoding="utf-8") as full:
                done = subprocess.run([UPSWING, *command], cwd=self.folder, stdout=full,
                                      stderr=subprocess.PIPE, encoding="utf-8", check=False)
                self.assert_one_line(done, 1, "No space left on device")

    def test_training_does_not_need_its_output(self):
        with open("/dev/full", "w", encoding="utf-8") as full:
            subprocess.run([UPSWING, *small(out="new")], cwd=self.folder, stdout=full,
                           stderr=subprocess.DEVNULL, check=False)
        self.succeed(*small(out="other"))
        self.assert_same_run("new", "other")


class DiskFullTest(ProgramTest):
    """The replay memory grows, and with it each checkpoint."""

    SMALL_FILES = 60  # kilobytes that the other files of a small run take on a disk

    def assert_stopped_and_whole(self, done, kept_step, run_name="run"):
        """It stopped with one line that names step and checkpoint, and what is there is whole."""
        self.assert_one_line(done, 1, "training stopped at step", f"checkpoint of step {kept_step}",
                             "is kept in " + run_name)
        self.assertNotIn("Done", done.stdout)
        self.assertEqual([str(path) for path in self.folder.rglob("*.tmp")], [])
        self.assertEqual([str(path) for path in self.folder.rglob("*.new")], [])

    def step_of(self, name="run"):
        _, tensors = read_tensors(self.folder / name / "checkpoint.safetensors")
        return int.from_bytes(tensors["train/steps"][2], "little")

    def assert_resumes_to_the_same_bytes(self):
        self.succeed("train", "--resume", "run")
        self.succeed(*small(out="never-stopped"))
        self.assert_same_run("run", "never-stopped")

    def test_in_the_middle_of_a_checkpoint(self):
        self.succeed(*small(steps=2000, out="measured"))
        limit = (self.folder / "measured/checkpoint.safetensors").stat().st_size + 1000
        done = self.run_here(*small(), preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_FSIZE, (limit, limit)))
        self.assert_stopped_and_whole(done, 2000)
        self.assertIn("checkpoint.safetensors: File too large", done.stderr)
        self.assertEqual(self.step_of(), 2000)
        self.assertEqual(self.succeed("info", "run").count("self-check  passed"), 1)
        self.assert_resumes_to_the_same_bytes()

    def test_when_the_first_checkpoint_does_not_fit(self):
        before = snapshot(self.folder)
        done = self.run_here(*small(), preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_FSIZE, (10000, 10000)))
        self.assert_one_line(done, 1, "cannot make the run folder run", "File too large")
        self.assertEqual(snapshot(self.folder), before)

    def test_in_the_middle_of_a_csv(self):
        self.write("out.csv", "mine")
        self.refuse(["simulate", "--csv", "out.csv"], "out.csv", "File too large", code=1,
                    preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000)))

    def on_small_disk(self, kilobytes, arguments):
        """Runs the program in a tmpfs of its own, of which the run is copied here afterwards."""
        script = (f'mount -t tmpfs -o size={kilobytes}k tmpfs "$PWD/disk" || exit 99\n'
                  'cd disk; "$@"; code=$?; cp -a run .. || exit 98; exit $code')
        (self.folder / "disk").mkdir()
        # A mount namespace of its own: the disk goes with the shell, whatever happens.
        done = subprocess.run(["unshare", "--mount", "--map-root-user", "sh", "-c", script, "sh",
                               UPSWING, *arguments], cwd=self.folder, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, encoding="utf-8", check=False)
        if done.returncode == 99 or "unshare:" in done.stderr:
            self.skipTest("mounting is not permitted here: " + done.stderr.strip())
        return done

    def test_on_a_full_disk(self):
        # While a checkpoint replaces another there are two. Room for two of step 2000.
        self.succeed(*small(steps=2000, out="measured"))
        checkpoint = (self.folder / "measured/checkpoint.safetensors").stat().st_size
        done = self.on_small_disk(2 * checkpoint // 1024 + self.SMALL_FILES, small())
        kept = self.step_of()
        self.assertTrue(0 < kept < 4000, kept)
        self.assert_stopped_and_whole(done, kept)
        self.assertIn("No space left on device", done.stderr)
        self.assert_resumes_to_the_same_bytes()

    def test_on_a_disk_that_a_table_fills(self):
        # No checkpoint but the first; a row of metrics.csv for each step fills the rest.
        settings = {"log_every": 8, "checkpoint_every": 10**9, "steps": 8000, "eval_every": 10**6}
        self.succeed(*small(**settings | {"steps": 8, "eval_episodes": 1, "out": "measured"}))
        checkpoint = (self.folder / "measured/checkpoint.safetensors").stat().st_size
        done = self.on_small_disk(checkpoint // 1024 + self.SMALL_FILES, small(**settings))
        self.assert_stopped_and_whole(done, 0)
        self.assertIn("No space left on device", done.stderr)
        self.succeed("train", "--resume", "run")
        self.succeed(*small(**settings, out="never-stopped"))
        self.assert_same_run("run", "never-stopped")


class ModelTest(ProgramTest):
    def refuse_model(self, text, *words):
        self.write("m.xml", text)
        for command in (["simulate", "--seconds", "1"], small()):
            self.refuse([*command, "--model", "m.xml"], "m.xml", *words)

    def test_good_model(self):
        self.write("m.xml", MODEL)
        self.succeed("simulate", "--seconds", "1", "--model", "m.xml")

    def test_missing(self):
        self.refuse(["simulate", "--model", "none.xml"], "none.xml", "No such file")

    def test_what_is_no_mjcf_or_does_not_compile(self):
        self.refuse_model("<mujoco><worldbody>", "XML")
        self.refuse_model("", "XML")
        self.refuse_model("no XML at all", "XML")
        self.refuse_model(MODEL.replace('mass="1"', 'mas="1"', 1),
                          "m.xml:6: <geom> takes no", "mas", "did you mean mass?")
        self.refuse_model(MODEL.replace("<motor", "<moter"), "did you mean motor?")
        self.refuse_model(MODEL.replace('joint="a" ctrl', 'joint="z" ctrl'), "z")
        self.refuse_model(MODEL.replace('mass="1"', 'mass="-1"', 1), "mass")

    def test_not_a_double_pendulum(self):
        two_bodies = MODEL.replace('<body pos="0 0 -0.5">', '</body>\n<body pos="0 0 -0.5">')
        two_bodies = two_bodies.replace("      </body>\n    </body>\n", "      </body>\n")
        for text in (
                "<mujoco/>",
                two_bodies,
                MODEL.replace('type="hinge"', 'type="slide"', 1),
                MODEL.replace('axis="0 1 0"', 'axis="1 0 0"', 1),
                MODEL.replace('joint="a" ctrl', 'joint="b" ctrl'),
                MODEL.replace('ctrllimited="true" ctrlrange="-5 5"', ""),
                MODEL.replace('type="capsule" size="0.04" fromto="0 0 0 0 0 -0.5"',
                                   'type="sphere" size="0.1"', 1),
                MODEL.replace('<body pos="0 0 -0.5">', '<body pos="0 0 -0.4">'),
                MODEL.replace('fromto="0 0 0 0 0 -0.5"', 'fromto="0 0 0 0.5 0 0"', 1),
                MODEL.replace("<actuator>", '<actuator><motor joint="b"/>'),
                MODEL.replace('<joint name="b"', '<joint name="b" stiffness="1" springref="5"')):
            with self.subTest(model=text):
                self.refuse_model(text, "not a double pendulum: expected")

    def test_what_the_settings_cannot_express_is_not_silently_changed(self):
        body = '<joint name="b"'
        for text in (MODEL.replace('ctrlrange="-5 5"', 'ctrlrange="-1 5"'),
                     MODEL.replace(body, '<inertial pos="0 0 -0.25" mass="1" '
                                              'diaginertia="0.1 0.1 0.1"/>' + body)):
            with self.subTest(model=text):
                self.refuse_model(text, "expected")

    def test_timestep_that_does_not_divide_the_control_period(self):
        self.refuse_model(MODEL.replace("0.005", "0.007", 1), "timestep", "0.02", "0.007")


class TorqueFileTest(FileTest):
    def refuse_torques(self, text, *words):
        self.write("torques.csv", text)
        self.refuse(["simulate", "--torque", "torques.csv"], "torques.csv", *words)

    def test_missing_file(self):
        self.refuse(["simulate", "--torque", "none.csv"], "none.csv", "No such file")

    def test_missing_column(self):
        self.refuse_torques("t,torqe\n0,1\n", "torques.csv:1:", '"torque"', "t,torqe")
        self.refuse_torques("# first\n0,1\n", "torques.csv:2:", '"torque"')

    def test_rows_of_another_length(self):
        self.refuse_torques("t,torque\n0,1\n0.02\n", "torques.csv:3:", "expected 2 columns, got 1")
        self.refuse_torques("torque\n1,2\n", "torques.csv:2:", "expected 1 columns, got 2")

    def test_not_a_finite_number(self):
        for text in ("high", "nan", "NaN", "inf", "-inf", "", "1e999", "1,5", "0x10", "--1"):
            with self.subTest(text=text):
                self.refuse_torques(f"t,torque,x\n0,1,2\n# c\n0.02,{text},2\n", "torques.csv:4:")

    def test_no_rows(self):
        self.refuse_torques("", "expected", "torque")
        self.refuse_torques("torque\n", "expected", "got none")

    def test_shorter_than_the_seconds(self):
        self.write("torques.csv", "torque\n" + "1\n" * 50)
        self.refuse(["simulate", "--torque", "torques.csv", "--seconds", "1.02"], "--seconds",
                    "1.02", "torques.csv")
        self.succeed("simulate", "--torque", "torques.csv", "--seconds", "1")

    def test_policy_beside_a_schedule(self):
        self.write("torques.csv", "torque\n1\n")
        self.refuse(["simulate", "run", "--torque", "torques.csv"], "policy", "--torque")


class NotFiniteTest(ProgramTest):
    # A deep network without normalisation and a huge learning rate: its Q-values overflow.
    DIVERGING = {"hidden": ",".join(["64"] * 8), "layer_norm": False, "learning_rate": 10,
                 "learning_starts": 1000}

    def test_training_stops_and_keeps_the_last_checkpoint(self):
        done = self.run_here(*small(**self.DIVERGING))
        self.assert_one_line(done, 1, "training stopped at step 10", "expected a finite number",
                             "checkpoint of step 1000 is kept in run")
        self.assertNotIn("Done", done.stdout)
        self.assertIn("training stopped at step",
                      (self.folder / "run/log.txt").read_text(encoding="utf-8"))
        self.assertFalse(list(self.folder.rglob("*.tmp")))

        # What was kept is whole: it leads to the same end again.
        again = self.run_here("train", "--resume", "run")
        self.assertEqual((again.returncode, again.stderr), (1, done.stderr))

    def test_rollout_that_blows_up(self):
        done = self.run_here("simulate", "--start", "0,0,1e9,-1e9", "--csv", "out.csv")
        self.assert_one_line(done, 1, "blew up", "t = ")
        self.assertFalse((self.folder / "out.csv").exists())
        self.assertFalse((self.folder / "MUJOCO_LOG.TXT").exists())


if __name__ == "__main__":
    unittest.main()
