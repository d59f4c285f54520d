#!/usr/bin/env python3
"""Short trainings keep their bits: a change that should not alter learning, such as a refactoring,
keeps these fingerprints.

A fingerprint is a hash of the policy's tensors and a hash of the tables without clock times. Bits
depend on the vector instructions, and on how a compiler fuses and orders operations. Fingerprints
are therefore pinned for each vector path, and only for release builds by g++. After a deliberate
change, `src/cli/fingerprint_test.py --print` prints the new ones.
"""

import csv
import hashlib
import json
import os
import platform
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
SLOW = {"d3qn", "d3qn-bare", "dqn"}  # without vector instructions

PINNED = {
    ("d3qn", "avx512"): ("c601d5b4b79d40ae", "9fa491f37b4a8673"),
    ("d3qn-bare", "avx512"): ("49a53614a224402d", "7354f565dc255071"),
    ("d3qn-randomized", "avx512"): ("9d11d1abda2f248f", "7eefd69483a7eeb1"),
    ("d3qn-small", "avx512"): ("49920dc73d4e5c34", "c8f97f01465c8821"),
    ("dqn", "avx512"): ("ebd2fa1039aebeb3", "6cf57e5da6b300cf"),
    ("fast", "avx512"): ("994f52d9405b61f1", "b1c4d3444a78c650"),
    ("ppo", "avx512"): ("ce863a10c4591c03", "b83fd75bcb1f6108"),
    ("ppo --actions levels", "avx512"): ("77bb72242c932e1e", "28ba5f0b80c29322"),
    ("sac-fast", "avx512"): ("78cc21007713adca", "e05c8e8d44483c3b"),
    ("d3qn", "avx2"): ("a8f77da6918371ea", "0eadbc2cb91c019f"),
    ("d3qn-bare", "avx2"): ("49a53614a224402d", "7354f565dc255071"),
    ("d3qn-randomized", "avx2"): ("2e8af1142c4a8210", "e5cd7c049d829d80"),
    ("d3qn-small", "avx2"): ("e30e2dd7d8aa810a", "f62b4f36cc8fe7de"),
    ("dqn", "avx2"): ("25bb5dc7dd9d3864", "ea359cd2088207cc"),
    ("fast", "avx2"): ("bcbccf5991703e16", "271c0159ad2f62e7"),
    ("ppo", "avx2"): ("ce863a10c4591c03", "ffcafd666cc4a3bd"),
    ("ppo --actions levels", "avx2"): ("2bc534143160ffe1", "ded4fe6412d2b8cd"),
    ("sac-fast", "avx2"): ("eea8d9483ce97703", "9381935c11a69779"),
    ("d3qn-randomized", "portable"): ("87f0338a06d508c1", "5af7b35d41b99212"),
    ("d3qn-small", "portable"): ("bc4f2a57c6f1d5b5", "82249aba8a26fe3f"),
    ("fast", "portable"): ("1f7334c9666b2312", "c3630aa12653a076"),
    ("ppo", "portable"): ("ebda7e5f8c50a8db", "6f0087929cae8b04"),
    ("ppo --actions levels", "portable"): ("52694e6fd553c6fd", "fed33d50d51c7d08"),
    ("sac-fast", "portable"): ("fc3a7ded716622ca", "e81540cb781d91a7"),
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


def cases():
    for vectors in ("avx512", "avx2", "portable"):
        for agent in CASES:
            if vectors != "portable" or agent not in SLOW:
                yield agent, vectors


@unittest.skipUnless(os.environ.get("UPSWING_FINGERPRINTS") and platform.machine() == "x86_64",
                     "bits are pinned for release builds by g++ on x86-64")
class FingerprintTest(unittest.TestCase):
    def test_trainings_give_the_pinned_bits(self):
        tried = 0
        for agent, vectors in cases():
            with self.subTest(agent=agent, vectors=vectors):
                got = fingerprint(agent, vectors)
                if got is None:
                    continue  # not supported by this processor
                tried += 1
                self.assertEqual(got, PINNED[agent, vectors])
        self.assertGreater(tried, 0)

    def test_unknown_vector_instructions_are_refused(self):
        result = run("train", "--print-config", env={**os.environ, "UPSWING_VECTORS": "mmx"})
        self.assertEqual(result.returncode, 2)
        self.assertIn("expected one of", result.stderr)


if __name__ == "__main__":
    if sys.argv[1:] == ["--print"]:
        for case in cases():
            print(f"    {case}: {fingerprint(*case)},".replace("'", '"'))
    else:
        unittest.main()
