#!/usr/bin/env python3
"""Tests of `upswing export --onnx`, for every kind of policy. ONNX's own checker accepts the file,
and onnxruntime computes the program's results from it.
"""

import json
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "src/cli"))
import test_environment  # noqa: E402
from testing import ROOT, UPSWING, ProgramTest, probe, read_tensors, small  # noqa: E402

test_environment.enter(__file__, "readers")

# pylint: disable=wrong-import-position
import numpy as np
import onnx
import onnxruntime

AGENTS = ROOT / "web/public/agents"
ACTORS = sorted((ROOT / "web/tests/actors").glob("*.safetensors"))
COUNT = 10_000
ERROR = 1e-5  # relative to the largest value


def session_of(path):
    """A session of onnxruntime for a file, with one thread."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def shapes(values):
    """{name: [batch, size]} of a graph's inputs or outputs."""
    return {value.name: [dim.dim_param or dim.dim_value for dim in value.type.tensor_type.shape.dim]
            for value in values}


def observations(size):
    """Observations near those of a swing-up, some far away."""
    rng = np.random.default_rng(0)
    scale = rng.choice([0.5, 1, 3], size=(COUNT, 1))
    return (scale * rng.standard_normal((COUNT, size))).astype(np.float32)


def what_the_program_says(policy, obs):
    """Rows of torque, an actor's outputs, Q-values or V."""
    return np.array(probe(policy, "observations", obs.ravel())).reshape(COUNT, -1)


class OnnxTest(ProgramTest):
    def export(self, policy):
        """Exports and checks a policy. Returns the model and its outputs for the observations."""
        self.assertIn("policy.onnx (", self.succeed("export", policy, "--onnx", "policy.onnx"))
        model = onnx.load(self.folder / "policy.onnx")
        onnx.checker.check_model(model, full_check=True)
        self.assertEqual([(opset.domain, opset.version) for opset in model.opset_import],
                         [("", 17)])
        self.assertEqual({node.domain for node in model.graph.node}, {""})
        ((name, (batch, size)),) = shapes(model.graph.input).items()
        self.assertEqual((name, batch), ("observation", "batch"))
        session = session_of(self.folder / "policy.onnx")
        obs = observations(size)
        names = [output.name for output in session.get_outputs()]
        got = dict(zip(names, session.run(names, {"observation": obs}), strict=True))
        for name, (batch, size) in shapes(model.graph.output).items():
            self.assertEqual((batch, got[name].shape), ("batch", (COUNT, size)), name)
        # A single row gives the same outputs; zero rows work, too.
        one = session.run(names, {"observation": obs[:1]})
        for name, row in zip(names, one, strict=True):
            np.testing.assert_allclose(row, got[name][:1], rtol=0, atol=1e-5 * np.abs(got[name]).max())
        return model, obs, got

    def assert_near(self, got, expected):
        np.testing.assert_allclose(got, expected, rtol=0, atol=ERROR * np.abs(expected).max())
        self.assertGreater(np.ptp(expected), 0)

    def assert_same_choice(self, got, torque, preferences):
        """Asserts equal torques, except where two preferences are practically equal."""
        differs = got[:, 0] != torque.astype(np.float32)
        ordered = np.sort(preferences[differs], axis=1)
        margin = ordered[:, -1] - ordered[:, -2]
        self.assertTrue((margin <= 2 * ERROR * np.abs(preferences).max()).all(), margin)
        self.assertLess(differs.sum(), COUNT / 1000)
        self.assertGreater(len(np.unique(got)), 1)

    def check_q_network(self, policy):
        model, obs, got = self.export(policy)
        self.assertEqual(got.keys(), {"q_values", "torque"})
        expected = what_the_program_says(policy, obs)
        q = expected[:, 1:]
        self.assert_near(got["q_values"], q)
        self.assert_same_choice(got["torque"], expected[:, 0], q)
        about = {entry.key: entry.value for entry in model.metadata_props}
        self.assertEqual(len(json.loads(about["torques"])), q.shape[1])
        self.assertLessEqual(set(got["torque"][:, 0]), set(np.float32(json.loads(about["torques"]))))

    def check_actor(self, policy, output):
        _, obs, got = self.export(policy)
        expected = what_the_program_says(policy, obs)
        torque, outputs, value = expected[:, 0], expected[:, 1:], None
        if "value" in got:
            outputs, value = expected[:, 1:-1], expected[:, -1:]
            self.assert_near(got["value"], value)
        if output == "categorical":
            self.assertEqual(got.keys() - {"value"}, {"probabilities", "torque"})
            weights = np.exp(outputs - outputs.max(axis=1, keepdims=True))
            self.assert_near(got["probabilities"], weights / weights.sum(axis=1, keepdims=True))
            return self.assert_same_choice(got["torque"], torque, outputs)
        self.assertEqual(got.keys() - {"value"}, {"mean", "log_std", "torque"})
        self.assert_near(got["mean"], outputs[:, :1])
        np.testing.assert_allclose(got["log_std"], np.clip(outputs[:, 1:], -5, 2), rtol=0,
                                   atol=ERROR * max(5, np.abs(outputs).max()))
        return self.assert_near(got["torque"], torque[:, np.newaxis])

    def test_agents_of_the_page(self):
        for name in ("fast", "dqn", "d3qn-randomized", "d3qn-adaptive"):
            with self.subTest(name):
                self.check_q_network(AGENTS / f"{name}.safetensors")
        for name in ("sac", "any-pose"):
            self.check_actor(AGENTS / f"{name}.safetensors", "squashed-gaussian")
        self.check_actor(AGENTS / "ppo.safetensors", "clipped-gaussian")

    def test_q_networks_of_other_kinds(self):
        for changes in ({"layer_norm": False, "agent": "dqn", "hidden": "24,32"},
                        {"layer_norm": False}, {"hidden": "20"}):
            with self.subTest(changes):
                self.succeed(*small(**changes, out="run"))
                self.check_q_network(self.folder / "run")
                shutil.rmtree(self.folder / "run")

    def test_actors_of_other_kinds(self):
        """Tests each output, with tanh and ReLU, with and without layer normalisation and a
        critic."""
        kinds = []
        for path in ACTORS:
            kinds.append(read_tensors(path)[0]["output"])
            with self.subTest(path.name):
                self.check_actor(path, kinds[-1])
        self.assertEqual(set(kinds), {"squashed-gaussian", "clipped-gaussian", "categorical"})

    def test_metadata(self):
        model, _, _ = self.export(AGENTS / "d3qn-randomized.safetensors")
        about = {entry.key: entry.value for entry in model.metadata_props}
        self.assertEqual(about["task"], "double-pendulum")
        self.assertEqual(json.loads(about["plant"])["mass1"], 1)
        self.assertEqual((about["control_period"], about["torque_limit"]), ("0.02", "5.0"))
        self.assertEqual(about["memory_steps"], "4")
        self.assertEqual(about["agent"], "d3qn-randomized")
        self.assertRegex(about["upswing_version"], r"^\d+\.\d+\.\d+$")
        observation = json.loads(about["observation"])
        self.assertEqual(len(observation), 20)
        self.assertEqual([entry["name"] for entry in observation[:3]], ["cos q1", "sin q1", "w1"])
        self.assertIn("rad/s", observation[2]["meaning"])
        self.assertEqual(observation[-1]["name"], "torque, 4 steps ago")
        self.assertEqual(model.producer_name, "upswing")

    def test_goal_and_identification_are_inputs(self):
        """Metadata describe each of them, in the order of the observation."""
        self.succeed(*small(any_pose=True, identify=True, memory=1, out="all"))
        goal = ["goal of link 1", "goal of link 2"]
        identified = ["J1", "J2", "b", "G1", "G2", "d1", "d2", "delta", "tanh(0.1 / delta)",
                      "identified energy", "faster fall", "slower fall", "torque against the falls"]
        memory = ["change of w1, 1 step ago", "change of w2, 1 step ago", "torque, 1 step ago"]
        for policy, inputs in ((AGENTS / "any-pose.safetensors", goal),
                               (AGENTS / "d3qn-adaptive.safetensors", identified),
                               ("all", identified + goal + memory)):
            with self.subTest(policy):
                self.succeed("export", policy, "--onnx", "policy.onnx")
                model = onnx.load(self.folder / "policy.onnx")
                about = {entry.key: entry.value for entry in model.metadata_props}
                observation = json.loads(about["observation"])
                self.assertEqual([entry["name"] for entry in observation[8:]], inputs)
                self.assertEqual(len({entry["meaning"] for entry in observation[8:]}),
                                 len(inputs) - (goal[0] in inputs))
                ((_, size),) = shapes(model.graph.input).values()
                self.assertEqual(size, len(observation))

    def test_the_documentation(self):
        """The page's Python code runs, and the page names every output and every metadatum."""
        text = (ROOT / "docs/howto/export.md").read_text(encoding="utf-8")
        (code,) = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
        named = set(re.findall(r"`(\w+)`", text))
        for name in ("d3qn-randomized", "sac", "fast"):
            model, _, got = self.export(AGENTS / f"{name}.safetensors")
            self.assertLessEqual(got.keys() | {entry.key for entry in model.metadata_props}, named)
        done = subprocess.run([sys.executable, "-c", code], cwd=self.folder, check=True,
                              stdout=subprocess.PIPE, encoding="utf-8")
        self.assertRegex(done.stdout, r"w1 - velocity of q1 over 10 rad/s\n[^$]*"
                                      r"\n-?\d\S* N·m for 0.02 s\n$")

    def test_standard_output(self):
        path = AGENTS / "fast.safetensors"
        self.succeed("export", path, "--onnx", "policy.onnx")
        with open(self.folder / "piped.onnx", "wb") as file:
            subprocess.run([UPSWING, "export", path, "--onnx", "-"], check=True, stdout=file)
        self.assertEqual((self.folder / "piped.onnx").read_bytes(),
                         (self.folder / "policy.onnx").read_bytes())


if __name__ == "__main__":
    unittest.main()
