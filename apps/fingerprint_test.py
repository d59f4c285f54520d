#!/usr/bin/env python3
"""Short trainings give the bits that they always gave: a change that should not alter learning, such
as a refactoring, keeps these fingerprints.

A fingerprint is a hash of the policy's tensors and one of the tables without clock times. Bits
depend on the vector instructions, and on how a compiler fuses and orders operations, so they are
pinned for each vector path and for release builds by g++ alone. Where a change alters them on
purpose, `apps/fingerprint_test.py --print` prints the new ones.
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

# In MuJoCo and in closed form, on random plants with a memory, and without any extension.
CASES = {
    "d3qn": ["--steps", "6000", "--eval-every", "3000", "--eval-episodes", "10"],
    "d3qn-bare": ["--steps", "3000", "--eval-every", "1000", "--eval-episodes", "5"],
    "d3qn-randomized": ["--steps", "12000", "--eval-every", "6000", "--eval-episodes", "20"],
    "d3qn-small": ["--steps", "6000", "--eval-every", "3000", "--eval-episodes", "10"],
    "dqn": ["--steps", "4000", "--eval-every", "2000", "--eval-episodes", "10"],
    "fast": ["--steps", "20000", "--eval-episodes", "20"],
}
SLOW = {"d3qn", "d3qn-bare", "dqn"}  # without vector instructions

PINNED = {
    ("d3qn", "avx512"): ("b7d2ed954e38f454", "1baa6bd6623d9581"),
    ("d3qn-bare", "avx512"): ("49a53614a224402d", "4d755dbe405890e9"),
    ("d3qn-randomized", "avx512"): ("edad694eea358b41", "ef3c69f61176f1d3"),
    ("d3qn-small", "avx512"): ("c6b1ee08204cbb1a", "ee063382a9e510a7"),
    ("dqn", "avx512"): ("e97e22afdab380bc", "ffe47bf354b056b2"),
    ("fast", "avx512"): ("a0b995bb1800dcd5", "6654e0b1837e7f24"),
    ("d3qn", "avx2"): ("f3292dc9bcd871bd", "025861e620767bd3"),
    ("d3qn-bare", "avx2"): ("49a53614a224402d", "4d755dbe405890e9"),
    ("d3qn-randomized", "avx2"): ("01533d70da9b6363", "f7dd557349870f1c"),
    ("d3qn-small", "avx2"): ("275e7b74c0c046ca", "48669f8ad255af44"),
    ("dqn", "avx2"): ("e7e873751d5bb77e", "2b563b64e03c17b8"),
    ("fast", "avx2"): ("87beb79ed39b5680", "dd803663c86d3a95"),
    ("d3qn-randomized", "portable"): ("0a0fb5e05949f407", "baf5de38df843a06"),
    ("d3qn-small", "portable"): ("55acee64b0902ba5", "be0de932f626f39f"),
    ("fast", "portable"): ("ff5ea96eb3a62dd8", "1f90dd27882b5431"),
}


def digest(data):
    return hashlib.sha256(data).hexdigest()[:16]


def policy_digest(path):
    """Hash of a safetensors file's tensors, by their names; metadata are left out."""
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
        result = run("train", "--agent", agent, *CASES[agent], "--threads", "1", "--out", out,
                     "--no-stop-when-solved", env={**os.environ, "UPSWING_VECTORS": vectors})
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
                    continue  # not on this processor
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
