#!/usr/bin/env python3
"""Tests of `upswing bench`: its output and files, but no speeds."""

import json
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "src/cli"))
from testing import ProgramTest  # noqa: E402


# The names of the cases with one thread, in this order.
GRADIENT = [f"gradient/{network}/{width}-{width}/batch:{batch}/threads:1"
            for network in ("plain", "dueling") for width in (64, 128, 256)
            for batch in (32, 64, 128, 256)]
ENV = [f"env/{engine}/envs:{envs}/threads:1" for engine in ("mujoco", "closed-form")
       for envs in (8, 128, 1024)]


class BenchTest(ProgramTest):
    def bench(self, *arguments):
        """Runs the command. Returns the context and the cases by name, without the settings that
        Google Benchmark appends to names."""
        self.succeed("bench", "--seconds", "0.001", "--json", "bench.json", *arguments)
        written = json.loads((self.folder / "bench.json").read_text(encoding="utf-8"))
        return written["context"], {entry["name"].removesuffix("/process_time/real_time"): entry
                                    for entry in written["benchmarks"]}

    def test_every_case(self):
        context, cases = self.bench("--threads", 1)
        self.assertEqual(list(cases), [*GRADIENT, *ENV])
        for name, entry in cases.items():
            with self.subTest(name):
                self.assertGreater(entry["items_per_second"], 0)
        self.assertIn(f"upswing {context['upswing_version']}", self.succeed("--version"))
        self.assertTrue(context["cpu_model"])

    def test_chosen_cases(self):
        _, cases = self.bench("gradient/plain", "env/mujoco/envs:8/", "--hidden", "24,16",
                              "--batch", 8, "--threads", "2,1,2")
        names = [f"gradient/plain/24-16/batch:8/threads:{threads}" for threads in (1, 2)]
        env = [f"env/mujoco/envs:8/threads:{threads}" for threads in (1, 2)]
        self.assertEqual(list(cases), [*names, *env])

    def test_repetitions(self):
        table = self.succeed("bench", ENV[0], "--seconds", "0.001",
                             "--repetitions", 3)
        self.assertEqual(table.count("_median"), 1)

    def test_vector_instructions(self):
        context, cases = self.bench(ENV[0], "--simd", "portable")
        self.assertEqual(list(cases), ENV[:1])
        self.assertEqual(context["simd_path"], "portable")

    def test_bad_input(self):
        for arguments, words in (
                (["kernel/"], ["kernel/", "gradient or env"]), (["train"], ["train"]),
                (["--threads", "0"], ["--threads"]), (["--threads", ""], ["--threads"]),
                (["--seconds", "0"], ["--seconds"]), (["--seconds", "nan"], ["--seconds"]),
                (["--repetitions", "1.5"], ["--repetitions"]), (["--simd", "mmx"], ["mmx"]),
                (["--hidden", "64,x"], ["--hidden"]), (["--batch", "0"], ["--batch"]),
                (["--json", ""], ["empty"]), (["--json", "no/such/bench.json"], ["no/such"]),
                (["--thread", "2"], ["did you mean --threads?"])):
            with self.subTest(arguments=arguments):
                self.refuse(["bench", *arguments], *words)


if __name__ == "__main__":
    unittest.main()
