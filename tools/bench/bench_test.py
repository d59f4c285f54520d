#!/usr/bin/env python3
"""Tests of `upswing bench`: its output and files, but no speeds."""

import json
import signal
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "src/cli"))
from testing import ProgramTest  # noqa: E402

SHORT = ["--seconds", "0.001", "--repetitions", "1"]

# The measurements of each part with one thread, in this order.
KERNELS = [f"kernels/{product}/{width}x{width}/batch:{batch}"
           for width in (64, 128, 256) for batch in (1, 32, 128, 256)
           for product in ("forward", "backward_input", "backward_weight")]
KERNELS += [f"kernels/adam_polyak/{n}" for n in (13000, 136000)]
KERNELS += [f"kernels/transpose/{width}x{width}" for width in (64, 128, 256)]
KERNELS += ["kernels/triad/L2", "kernels/triad/DRAM"]
GRADIENT = [f"gradient/{network}/{width}-{width}/batch:{batch}/threads:1"
            for network in ("plain", "dueling") for width in (64, 128, 256)
            for batch in (32, 64, 128, 256)]
SAC = ["sac/64-64/batch:100/threads:1", "sac/256-256/batch:256/threads:1"]
PPO = ["ppo/64-64/batch:256/threads:1"]
ACT = [f"act/256-256/batch:{batch}" for batch in (1, 8, 100)]
REPLAY = ["replay/sample/batch:128", "replay/add/batch:128"]
PHYSICS = [f"physics/{engine}/envs:{envs}/threads:1" for engine in ("mujoco", "closed-form")
           for envs in (8, 128, 1024)]
ENV = [name.replace("physics", "env") for name in PHYSICS]
TRAIN = [f"train/{agent}/{engine}/threads:1" for agent in ("d3qn", "d3qn-small")
         for engine in ("mujoco", "closed-form")]


class BenchTest(ProgramTest):
    def bench(self, *arguments):
        """Runs the command with a JSON file. Returns the rows of its table and the JSON."""
        text = self.succeed("bench", *SHORT, "--json", "bench.json", *arguments)
        rows = {line.split()[0]: line for line in text.splitlines()[3:]}
        written = json.loads((self.folder / "bench.json").read_text(encoding="utf-8"))
        return rows, written

    def check(self, names, rows, written):
        """Asserts that table and JSON have all cases, with plausible rates."""
        benchmarks = written["benchmarks"]
        self.assertEqual([entry["name"] for entry in benchmarks], names)
        self.assertEqual(list(rows), names)
        for entry in benchmarks:
            with self.subTest(entry["name"]):
                self.assertEqual(entry["run_type"], "iteration")
                self.assertGreater(entry["items_per_second"], 0)
                self.assertGreater(entry["real_time"], 0)
                self.assertGreaterEqual(entry["cpu_time"], 0)
                self.assertIn("/s ", rows[entry["name"]])
                if "gflops" in entry:
                    self.check_peak(entry, written["context"], rows[entry["name"]])

    def check_peak(self, entry, context, row):
        """Asserts that operations per second are below the processor's peak. The margin is
        generous, because other load may have disturbed the measurement of the peak."""
        peak = context["peak_gflops"][str(entry["threads"])]
        self.assertGreater(entry["gflops"], 0)
        self.assertLess(entry["peak_share"], 3)
        self.assertAlmostEqual(entry["peak_share"], entry["gflops"] / peak, delta=1e-6)
        self.assertIn("%", row)

    def test_every_part(self):
        parts = {"kernels": KERNELS, "gradient": GRADIENT, "sac": SAC, "ppo": PPO, "act": ACT, "replay": REPLAY,
                 "physics": PHYSICS, "env": ENV, "train": TRAIN}
        rows, written = self.bench("--threads", 1)
        self.check([name for names in parts.values() for name in names], rows, written)
        with_flops = {entry["name"] for entry in written["benchmarks"] if "gflops" in entry}
        self.assertLessEqual({*KERNELS[:38], *GRADIENT, *SAC, *PPO, *ACT}, with_flops)
        with_bytes = {entry["name"] for entry in written["benchmarks"]
                      if entry.get("bytes_per_second", 0) > 0}
        self.assertEqual(with_bytes, {*KERNELS[36:]})

    def test_context(self):
        _, written = self.bench("act", "--threads", "2,1,2")
        context = written["context"]
        self.assertEqual(context["threads"], [1, 2])
        self.assertEqual(context["seconds"], 0.001)
        self.assertEqual(context["repetitions"], 1)
        self.assertEqual(list(context["peak_gflops"]), ["1"])
        self.assertIn(f"upswing {context['upswing_version']}", self.succeed("--version"))
        self.assertGreater(context["num_cpus"], 0)
        self.assertTrue(context["cpu_model"])
        self.assertTrue(context["simd_path"])

    def test_one_case(self):
        rows, written = self.bench("gradient", "--network", "plain", "--hidden", "24,16",
                                   "--batch", 8, "--threads", 2)
        self.check(["gradient/plain/24-16/batch:8/threads:2"], rows, written)
        entry = written["benchmarks"][0]
        self.assertEqual(entry["threads"], 2)
        # Work: two forward passes, the gradients of weights, and the gradients of inputs without
        # the observations.
        layers = [8 * 24, 24 * 16, 16 * 9]
        flops = 2 * 8 * (3 * sum(layers) + sum(layers[1:]))
        self.assertAlmostEqual(entry["gflops"] / entry["items_per_second"] * 1e9, flops, delta=1e-3)

    def test_dueling_counts_three_forward_passes(self):
        _, written = self.bench("gradient", "--network=dueling", "--hidden=256,256", "--batch=128",
                                "--threads=1")
        entry = written["benchmarks"][0]
        self.assertEqual(entry["name"], "gradient/dueling/256-256/batch:128/threads:1")
        flops = 2 * 128 * (5 * 134_400 - 2048)
        self.assertAlmostEqual(entry["gflops"] / entry["items_per_second"] * 1e9, flops, delta=1)

    def test_repetitions_and_threads(self):
        text = self.succeed("bench", "env", "--seconds", "0.001", "--repetitions", 3,
                            "--threads", "1,2", "--json", "bench.json")
        self.assertEqual(len(text.splitlines()), 3 + 12)
        entries = json.loads((self.folder / "bench.json").read_text())["benchmarks"]
        names = {entry["name"] for entry in entries if entry["run_type"] == "iteration"}
        self.assertEqual(names, {name.replace("threads:1", f"threads:{threads}")
                                 for name in ENV for threads in (1, 2)})
        medians = [entry for entry in entries if entry.get("aggregate_name") == "median"]
        self.assertEqual(len(medians), 12)

    def test_automatic_threads(self):
        parts = {"gradient": ["gradient/plain/24-16/batch:8"], "sac": ["sac/24-16/batch:8"],
                 "ppo": ["ppo/24-16/batch:8"]}
        rows, written = self.bench(*parts, "--network", "plain", "--hidden", "24,16", "--batch", 8,
                                   "--threads", "0,1")
        self.check([f"{name}/threads:{threads}" for names in parts.values() for name in names
                    for threads in (0, 1)], rows, written)

    def test_vector_instructions(self):
        rows, written = self.bench("act", "--simd", "portable")
        self.check(ACT, rows, written)
        self.assertEqual(written["context"]["simd_path"], "portable")

    def test_bad_input(self):
        for arguments, words in (
                (["kernel"], ["kernel", "did you mean kernels?", "gradient, sac, ppo, act"]),
                (["--threads", "-1"], ["--threads"]), (["--threads", "1,x"], ["--threads"]),
                (["--threads", ""], ["--threads"]), (["--seconds", "0"], ["--seconds"]),
                (["--seconds", "nan"], ["--seconds"]), (["--repetitions", "0"], ["--repetitions"]),
                (["--repetitions", "1.5"], ["--repetitions"]), (["--simd", "mmx"], ["mmx"]),
                (["--network", "cnn"], ["--network", "cnn"]), (["--hidden", "64,x"], ["--hidden"]),
                (["--batch", "0"], ["--batch"]), (["--json", ""], ["empty"]),
                (["--json", "no/such/bench.json"], ["no/such"]),
                (["act", "--batch", "8"], ["--batch", "gradient"]),
                (["--thread", "2"], ["did you mean --threads?"])):
            with self.subTest(arguments=arguments):
                self.refuse(["bench", *SHORT[2:], *arguments], *words)

    def test_interrupt(self):
        process = self.start("bench", "act", "--seconds", 1000, "--json", "b.json", wait=False)
        self.assertIn("processors", process.stdout.readline())
        code, text = self.end(process, signal.SIGINT)
        self.assertEqual(code, 128 + signal.SIGINT)
        self.assertIn("stopped after 0 of 3 cases", text.splitlines()[-1])
        self.assertFalse((self.folder / "b.json").exists())


if __name__ == "__main__":
    unittest.main()
