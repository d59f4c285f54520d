#!/usr/bin/env python3
"""Tests of policy files that are damaged, handmade or hostile: refused with one clear error
line."""

import json
import math
import os
import resource
import struct
import unittest

from testing import SmallRunTest, read_tensors, with_number, write_tensors


class PolicyFileTest(SmallRunTest):
    def refuse_policy(self, *words):
        for command in (["eval"], ["simulate"], ["info"]):
            self.refuse([*command, "run/policy.safetensors"], "run/policy.safetensors", *words)

    def refuse_info(self, *words):
        self.refuse(["info", "run/policy.safetensors"], "run/policy.safetensors", *words)

    def change(self, metadata=(), tensors=(), drop=()):
        """Rewrites the policy file with other content; the file itself is well-formed."""
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
        self.refuse(["eval", "run"], "run", "expected a run with a policy.safetensors")

    def test_truncated(self):
        whole = self.policy.read_bytes()
        for size in (0, 7, 8, 100, len(whole) // 2, len(whole) - 1):
            with self.subTest(size=size):
                self.policy.write_bytes(whole[:size])
                self.refuse(["eval", "run"], "policy.safetensors", "not a valid safetensors file")

    def test_too_long(self):
        self.policy.write_bytes(self.policy.read_bytes() + b"\0" * 8)
        self.refuse_policy("not a valid safetensors file", "bytes of data, got")

    def test_corrupted(self):
        whole = self.policy.read_bytes()
        for position in self.places(self.policy):
            with self.subTest(position=position):
                self.flip(self.policy, position)
                self.refuse(["eval", "run"], "policy.safetensors")
                self.policy.write_bytes(whole)

    def test_something_else(self):
        self.policy.write_text("t,torque\n0,1\n" * 20)
        self.refuse_policy("not a valid safetensors file")
        self.refuse(["info", "run/config.toml"], "run/config.toml", "not a valid safetensors file")

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
                self.restore()

    def test_not_finite(self):
        _, tensors = read_tensors(self.policy)
        for name, number in (("feature.0.weight", math.nan), ("value.bias", math.inf),
                             ("torques", math.nan), ("torques", -math.inf),
                             ("sample.q", math.inf), ("sample.q", math.nan),
                             ("sample.obs", math.inf), ("sample.torque", math.nan)):
            with self.subTest(tensor=name, number=number):
                self.change(tensors={name: with_number(tensors[name], 0, number)})
                self.refuse_policy(f'"{name}"', "expected finite numbers", str(number))
                self.restore()

    def test_samples_that_the_network_does_not_give(self):
        _, tensors = read_tensors(self.policy)
        for name, number in (("sample.q", 3.0), ("sample.q", -1e38), ("sample.obs", 5.0),
                             ("value.bias", 9.0), ("value.bias", 3e38), ("feature.0.weight", 9.0),
                             ("sample.torque", 4.9)):
            with self.subTest(tensor=name, number=number):
                self.change(tensors={name: with_number(tensors[name], 0, number)})
                self.refuse_policy("self-check")
                self.restore()

    def test_a_little_more_than_rounding(self):
        # A change of the value's bias changes every Q-value by the same amount.
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
                self.refuse_policy("not a valid safetensors file")

    def test_a_file_of_another_writer_needs_none(self):
        self.change(drop=["upswing_version"])
        self.assertNotIn(b"checksum", self.policy.read_bytes())
        text = self.succeed("info", "run/policy.safetensors")
        self.assertIn("checksum    none: a changed weight goes unnoticed", text)
        self.assertIn("upswing unknown", text)

    def test_metadata(self):
        metadata, _ = read_tensors(self.policy)
        network = json.loads(metadata["network"])
        for change in ({"format": "other"}, {"format_version": "2"}, {"output": "gaussian"},
                       {"network": "{}"}, {"network": "nonsense"}, {"plant": "nonsense"},
                       {"plant": "{}"}, {"plant": metadata["plant"].replace("9.81", "-9.81")},
                       {"plant": json.dumps(json.loads(metadata["plant"]) | {"actuated_joint": 3})},
                       {"plant": json.dumps(json.loads(metadata["plant"]) | {"mass": 3})},
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
                self.restore()
        for key in ("format", "format_version", "output", "network", "plant"):
            with self.subTest(missing=key):
                self.change(drop=[key])
                words = 'metadata "plant": no mass1' if key == "plant" else f'no metadata "{key}"'
                self.refuse(["eval", "run"], f"upswing: run/policy.safetensors: {words}")
                self.restore()

    def test_sizes_and_actions_are_told_apart(self):
        data = self.policy.read_bytes()
        length = int.from_bytes(data[:8], "little")
        self.policy.write_bytes(data[:length])
        self.refuse(["eval", "run"], f"header: expected {length} bytes after the first 8, got {length - 8}")
        self.restore()
        metadata, tensors = read_tensors(self.policy)
        kind, shape, torques = tensors["sample.torque"]
        first, = struct.unpack_from("<d", torques)
        wrong = math.nextafter(first, math.inf)
        tensors["sample.torque"] = (kind, shape, struct.pack("<d", wrong) + torques[8:])
        write_tensors(self.policy, metadata, tensors)
        self.refuse(["eval", "run"], f"self-check: expected action {wrong!r}, got {first:g} (sample 0)")

    def test_unknown_parameters_of_the_plant(self):
        metadata, _ = read_tensors(self.policy)
        self.change(metadata={"plant": json.dumps(json.loads(metadata["plant"]) | {"centre1": 0.2})})
        for command in ("eval", "plot", "simulate"):
            self.refuse([command, "run"], 'metadata "plant": expected parameters of a plant, got "centre1" '
                                          '(did you mean center1?)')

    def test_metadata_that_the_program_uses(self):
        metadata, _ = read_tensors(self.policy)
        observation = json.loads(metadata["observation"])
        changes = [(key, text) for key, texts in {
            "control_period": ("1.5", "0", "banana", "nan", "-0.02", ""),
            "seed": ("nan", "1e19", "-1", "7.5", "99999999999999999999"),
            "step": ("nan", "1e19", "-1", "many"),
            "success_rate": ("nan", "1e19", "-0.5", "2"),
            "mean_return": ("nan", "1e61", "-inf"),
            "gamma": ("nan", "2"), "reward_scale": ("0", "inf"),
            "agent": ("a\nself-check  passed", "\x1b[2J", "a" * 65),
            "upswing_version": ("0.3.0\n", "\u202e"),
            "observation": ("{}", "nonsense", json.dumps(observation | {"max_velocity": [10, 10]}),
                            json.dumps(observation | {"memory": {"steps": 2, "names": [],
                                                                 "velocity": 1, "torque": 5}}),
                            json.dumps(observation | {"identified": 13}),
                            json.dumps(observation | {"goal": 1})),
        }.items() for text in texts]
        for key, text in changes:
            with self.subTest(key=key, text=text):
                self.change({key: text})
                self.refuse_info(f'metadata "{key}"')
                self.restore()
        for key in ("control_period", "observation"):
            with self.subTest(missing=key):
                self.restore()
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
        """Limits the address space to a gigabyte; the program and its libraries need most of it
        anyway."""
        limit = None
        if "UPSWING_SANITIZED" not in os.environ:  # sanitizers need far more
            limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30))
        self.refuse(["info", "claims.safetensors"], "claims.safetensors", *words,
                    preexec_fn=limit)

    def claim(self, network, tensors):
        """Writes a policy with metadata that claim this network."""
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

        # Each sample has 4096 Q-values; the file holds those of 16 samples.
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
        self.refuse_policy(f"dtype: expected a known type, got {shown}")
        self.restore()
        self.change({"format": forged})
        self.refuse_policy(f'got "{shown}"')
        self.restore()
        self.change({"network": json.dumps({"inputs": forged})})
        self.refuse_policy("network")
        self.restore()
        self.change(tensors={"y" * 100000: ("F32", [1], bytes(8))})
        done = self.run_here("info", "run/policy.safetensors")
        self.assert_one_line(done, 2, "expected as many bytes as F32 [1] has, got 8")
        self.assertLess(len(done.stderr), 2500)

    def test_policy_for_other_observations(self):
        self.change_inputs(4)
        self.refuse_policy("expected", "8", "4")

    def test_policies_of_other_tasks(self):
        policy = "run/policy.safetensors"
        self.change({"task": "gymnasium/CartPole-v1"})
        self.succeed("export", policy, "--onnx", "policy.onnx")
        self.assertIn("task        gymnasium/CartPole-v1", self.succeed("info", policy))
        for command in (["eval"], ["simulate"], ["plot"], ["map"], ["realaigym", "score"],
                        ["view", "--record", "x.png"], ["export", "--page", "page"]):
            self.refuse([*command, policy], f"{policy}: expected a policy of double-pendulum, got one "
                        "of gymnasium/CartPole-v1")
        self.refuse(["eval", "hybrid", "--swing-up", policy], "--swing-up", "CartPole")
        self.change({"task": "acrobot-v1"})
        self.refuse_policy('metadata "task": expected double-pendulum, got "acrobot-v1"')

    def change_inputs(self, inputs):
        """Writes a policy of zeros for observations of another size."""
        metadata, tensors = read_tensors(self.policy)
        network = json.loads(metadata["network"]) | {"inputs": inputs}
        zeros = {name: (dtype, shape, bytes(len(data)))
                 for name, (dtype, shape, data) in tensors.items() if dtype == "F32"}
        zeros["feature.0.weight"] = ("F32", [32, inputs], bytes(32 * inputs * 4))
        zeros["sample.obs"] = ("F32", [16, inputs], bytes(16 * inputs * 4))
        self.change({"network": json.dumps(network)}, zeros)


if __name__ == "__main__":
    unittest.main()
