#!/usr/bin/env python3
"""Short trainings keep their bits: a change that should not alter learning, such as a refactoring,
keeps these fingerprints.

A fingerprint is a hash of the policy's tensors and a hash of the tables without clock times. All
vector instructions with fused multiply-adds (AVX-512, AVX2, NEON) give the same. After a deliberate
change, `src/cli/fingerprint_test.py --print` prints the new ones.
"""

import csv
import hashlib
import itertools
import json
import os
import struct
import sys
import tempfile
import unittest
from pathlib import Path

from testing import run

# Cases, an agent and its flags: MuJoCo and closed form, random plants with a memory, no extension,
# and each algorithm.
CASES = {
    "d3qn": ["--steps", "6000", "--eval-every", "3000", "--eval-episodes", "10"],
    "d3qn-bare": ["--steps", "3000", "--eval-every", "1000", "--eval-episodes", "5"],
    "d3qn-randomized": ["--steps", "12000", "--eval-every", "6000", "--eval-episodes", "20"],
    "d3qn-small": ["--steps", "6000", "--eval-every", "3000", "--eval-episodes", "10"],
    "dqn": ["--steps", "4000", "--eval-every", "2000", "--eval-episodes", "10"],
    "fast": ["--steps", "20000", "--eval-episodes", "20"],
    "ppo": ["--steps", "20480", "--eval-every", "10240", "--eval-episodes", "10"],
    "ppo --actions levels": ["--steps", "20480", "--eval-every", "10240", "--eval-episodes", "10"],
    "sac-fast": ["--steps", "10000", "--eval-every", "5000", "--eval-episodes", "10"],
}
VECTORS = ("avx512", "avx2", "neon")

PINNED = {
    "d3qn": ("6fb9bf43c64bdac8", "bde31d224781aa44"),
    "d3qn-bare": ("49a53614a224402d", "7354f565dc255071"),
    "d3qn-randomized": ("ad865a26135f4416", "e5105232eccd77d1"),
    "d3qn-small": ("2f6600da35efe387", "d1fda76c026377aa"),
    "dqn": ("6bcd20162a53fa5c", "afdf0617efc61356"),
    "fast": ("5c552012c6c7e04d", "bb94d076dfb0edaa"),
    "ppo": ("f4a66f7f19712921", "45e46c02cd4e79a9"),
    "ppo --actions levels": ("0f04dadc6180894f", "a091e2c662ae3fda"),
    "sac-fast": ("a4146b06501a81f3", "38ff96e1e4d4147c"),
}


def digest(data):
    return hashlib.sha256(data).hexdigest()[:16]


def policy_digest(path):
    """Hash of a safetensors file's tensors, by their names, without metadata."""
    content = path.read_bytes()
    length = struct.unpack("<Q", content[:8])[0]
    header = json.loads(content[8:8 + length])
    header.pop("__metadata__", None)
    parts = []
    for name in sorted(header):
        begin, end = header[name]["data_offsets"]
        parts.append(name.encode() + content[8 + length + begin:8 + length + end])
    return digest(b"".join(parts))


def table_digest(folder):
    """Hash of the three tables without the column of clock times."""
    parts = []
    for name in ("metrics", "episodes", "evals"):
        with open(folder / f"{name}.csv", encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                row.pop("seconds", None)
                parts.append(json.dumps(row, sort_keys=True))
    return digest("\n".join(parts).encode())


def fingerprint(agent, vectors):
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        result = run("train", "--agent", *agent.split(), *CASES[agent], "--threads", "1",
                     "--out", out, "--no-stop-when-solved", env={**os.environ, "UPSWING_VECTORS": vectors})
        if result.returncode == 2 and "on this processor" in result.stderr:
            return None
        assert result.returncode == 0, result.stderr
        return policy_digest(out / "policy.safetensors"), table_digest(out)


@unittest.skipUnless(os.environ.get("UPSWING_FINGERPRINTS"), "bits are pinned for release builds by g++")
class FingerprintTest(unittest.TestCase):
    def test_trainings_give_the_pinned_bits(self):
        tried = 0
        for agent, vectors in itertools.product(CASES, VECTORS):
            with self.subTest(agent=agent, vectors=vectors):
                got = fingerprint(agent, vectors)
                if got is None:
                    continue  # not supported by this processor
                tried += 1
                self.assertEqual(got, PINNED[agent])
        self.assertGreater(tried, 0)

    def test_unknown_vector_instructions_are_refused(self):
        result = run("train", "--print-config", env={**os.environ, "UPSWING_VECTORS": "mmx"})
        self.assertEqual(result.returncode, 2)
        self.assertIn("expected one of", result.stderr)


if __name__ == "__main__":
    if sys.argv[1:] == ["--print"]:
        best = next(path for path in VECTORS if fingerprint("d3qn-small", path))
        for case in CASES:
            print(f"    {case!r}: {fingerprint(case, best)},".replace("'", '"'))
    else:
        unittest.main()
