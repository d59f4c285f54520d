#!/usr/bin/env python3
"""Checks that independent readers agree with the program's files: TensorBoard's reader of event
files, the safetensors package, and the network's forward pass in numpy.

The packages are in a separate virtual environment (test_environment.py).
"""

import json
import unittest

import test_environment
from testing import ROOT, ProgramTest, read_csv, read_tensors, small

test_environment.enter(__file__, "readers")

# pylint: disable=wrong-import-position
import numpy as np
from safetensors import safe_open
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator


def linear(weights, name, x):
    return x @ weights[name + ".weight"].T.astype(np.float64) + weights[name + ".bias"]


def features(network, weights, obs, prefix=""):
    """Features (B × H) of inputs (B × D), in double precision."""
    x = obs.astype(np.float64)
    for i in range(len(network["hidden"])):
        name = f"{prefix}feature.{i}"
        x = linear(weights, name, x)
        if network["layer_norm"]:
            x = (x - x.mean(axis=1, keepdims=True)) / np.sqrt(x.var(axis=1, keepdims=True) + 1e-5)
            x = x * weights[name + ".norm.weight"] + weights[name + ".norm.bias"]
        x = np.tanh(x) if network.get("activation") == "tanh" else np.maximum(x, 0)
    return x


def forward(network, weights, obs):
    """Q-values (B × A) of observations (B × D)."""
    x = features(network, weights, obs)
    if not network["dueling"]:
        return linear(weights, "output", x)
    streams = np.maximum(linear(weights, "streams", x), 0)
    value = linear(weights, "value", streams[:, :network["head"]])
    advantage = linear(weights, "advantage", streams[:, network["head"]:])
    return value + advantage - advantage.mean(axis=1, keepdims=True)


def act(output, weights, outputs):
    """Torques (B) from an actor network's outputs (B × outputs)."""
    if output == "categorical":
        return weights["torques"][outputs.argmax(axis=1)]
    mean = outputs[:, 0]
    bounded = np.tanh(mean) if output == "squashed-gaussian" else np.clip(mean, -1, 1)
    return weights["action_limit"][0] * bounded


def load(path):
    """Metadata and arrays of a safetensors file, read by the package."""
    with safe_open(path, framework="np") as file:
        return file.metadata(), {name: file.get_tensor(name) for name in file.keys()}


class ReadersTest(ProgramTest):
    def scalars(self):
        """{tag: [(step, value)]} of the run's event file, read by TensorBoard."""
        events = EventAccumulator(str(self.folder / "run"), size_guidance={"scalars": 0})
        events.Reload()
        return {tag: [(event.step, event.value) for event in events.Scalars(tag)]
                for tag in events.Tags()["scalars"]}

    def assert_scalars_are_the_tables(self):
        scalars = self.scalars()
        for prefix, table in (("train/", "metrics.csv"), ("episode/", "episodes.csv"),
                              ("evaluation/", "evals.csv")):
            rows = read_csv(self.folder / "run" / table)
            for column in list(rows[0])[1:]:
                self.assertEqual(scalars.pop(prefix + column),
                                 [(row["step"], float(np.float32(row[column]))) for row in rows],
                                 column)
        self.assertEqual(scalars, {})

    def test_tensorboard_reads_the_values_of_the_tables(self):
        self.succeed(*small())
        self.assert_scalars_are_the_tables()

    def test_tensorboard_reads_a_run_that_was_killed_and_resumed(self):
        process = self.start(*small(steps=10**9))
        self.wait_for((self.folder / "run/policy.safetensors").exists)
        self.end(process)
        steps = int(load(self.folder / "run/checkpoint.safetensors")[1]["train/steps"]) + 4000
        self.succeed("train", "--resume", "run", "--steps", steps)
        self.assert_scalars_are_the_tables()

    def check_policy(self, **changes):
        """The package reads the expected names, shapes and samples of the network."""
        self.succeed(*small(**changes))
        path = self.folder / "run/policy.safetensors"
        about, tensors = load(path)
        network = json.loads(about["network"])
        self.assertEqual({name: list(array.shape) for name, array in tensors.items()},
                         expected_shapes(network))
        self.assertEqual(about["format"], "upswing-policy")
        self.assertEqual(json.loads(about["plant"])["gravity"], 9.81)
        np.testing.assert_array_equal(tensors["torques"], np.linspace(-5, 5, 9))

        q = forward(network, tensors, tensors["sample.obs"])
        # The program computes in single precision: allow some rounding errors of numbers of this
        # size.
        np.testing.assert_allclose(tensors["sample.q"], q, rtol=0, atol=2e-5 * np.abs(q).max())
        np.testing.assert_array_equal(tensors["sample.torque"],
                                      tensors["torques"][tensors["sample.q"].argmax(axis=1)])
        self.assertGreater(np.ptp(tensors["sample.q"]), 0)

    def check_actor(self, path, output):
        """The package reads the actor's and the critic's arrays, and both reproduce the samples."""
        about, tensors = load(path)
        self.assertEqual(about["output"], output)
        network, critic = json.loads(about["network"]), json.loads(about["critic"])
        outputs = len(tensors["torques"]) if output == "categorical" else 2
        shapes = actor_shapes(network, outputs) | actor_shapes(critic, 1, "critic.")
        for name, shape in shapes.items():
            self.assertEqual(list(tensors[name].shape), shape, name)
        self.assertEqual(tensors.keys() - shapes.keys(),
                         {"action_limit", "sample.obs", "sample.output", "sample.action",
                          "sample.value"} | ({"torques"} if output == "categorical" else set()))

        obs = tensors["sample.obs"]
        got = linear(tensors, "output", features(network, tensors, obs))
        np.testing.assert_allclose(tensors["sample.output"], got, rtol=0,
                                   atol=2e-5 * np.abs(got).max())
        torque = act(output, tensors, got)
        np.testing.assert_allclose(tensors["sample.action"][:, 0], torque, rtol=0, atol=1e-4)
        self.assertGreater(np.ptp(got), 0)
        if critic["inputs"] > network["inputs"]:
            share = torque / tensors["action_limit"][0]
            obs = np.concatenate([obs, share[:, np.newaxis]], axis=1)
        value = linear(tensors, "critic.output", features(critic, tensors, obs, "critic."))
        np.testing.assert_allclose(tensors["sample.value"], value, rtol=0,
                                   atol=2e-5 * np.abs(value).max())

    def test_actor_of_a_training(self):
        self.succeed(*small(agent="sac", hidden="24,16", head=None, steps=4000))
        self.check_actor(self.folder / "run/policy.safetensors", "squashed-gaussian")

    def test_actors_of_other_kinds(self):
        for output in ("clipped-gaussian", "categorical"):
            self.check_actor(ROOT / f"tools/fuzz/corpus/policy/accepted/{output}.safetensors", output)

    def test_dueling_policy(self):
        self.check_policy(hidden="32,24")

    def test_plain_policy(self):
        self.check_policy(agent="dqn", hidden="24,32")

    def test_policy_without_layer_normalisation(self):
        self.check_policy(layer_norm=False)

    def test_policy_of_the_default_agent(self):
        self.check_policy(agent="d3qn", hidden=None, head=None, steps=400, eval_every=400)

    def test_checkpoint(self):
        self.succeed(*small())
        path = self.folder / "run/checkpoint.safetensors"
        about, tensors = load(path)
        self.assertEqual(about["format"], "upswing-checkpoint-1")
        self.assertIn("gamma = 0.99", about["config"])
        self.assertEqual(int(tensors["train/steps"]), 4000)
        _, expected = read_tensors(path)
        self.assertEqual(tensors.keys(), expected.keys())
        parameters = tensors["agent/theta"].size
        self.assertEqual(parameters, 1578)
        for name in ("agent/theta", "agent/theta_target", "agent/adam/m", "agent/adam/v"):
            self.assertEqual((tensors[name].dtype, tensors[name].shape),
                             (np.float32, (parameters,)))
            self.assertTrue(np.isfinite(tensors[name]).all(), name)
        self.assertEqual(tensors["run/size/metrics"],
                         (self.folder / "run/metrics.csv").stat().st_size)


def actor_shapes(network, outputs, prefix=""):
    """Names and shapes of the arrays of an actor's or its critic's network."""
    shapes = {}
    width = network["inputs"]
    for i, out in enumerate(network["hidden"]):
        name = f"{prefix}feature.{i}"
        shapes |= {name + ".weight": [out, width], name + ".bias": [out]}
        if network["layer_norm"]:
            shapes |= {name + ".norm.weight": [out], name + ".norm.bias": [out]}
        width = out
    return shapes | {prefix + "output.weight": [outputs, width], prefix + "output.bias": [outputs]}


def expected_shapes(network):
    """Names and shapes of a policy file's tensors."""
    shapes = {}

    def linear(name, out, width):
        shapes[name + ".weight"] = [out, width]
        shapes[name + ".bias"] = [out]

    width = network["inputs"]
    for i, out in enumerate(network["hidden"]):
        linear(f"feature.{i}", out, width)
        if network["layer_norm"]:
            shapes[f"feature.{i}.norm.weight"] = shapes[f"feature.{i}.norm.bias"] = [out]
        width = out
    if network["dueling"]:
        linear("streams", 2 * network["head"], width)
        linear("value", 1, network["head"])
        linear("advantage", network["actions"], network["head"])
    else:
        linear("output", network["actions"], width)
    return shapes | {"torques": [9], "sample.obs": [16, 8], "sample.q": [16, 9],
                     "sample.torque": [16]}


if __name__ == "__main__":
    unittest.main()
