#!/usr/bin/env python3
"""Tests of `upswing grade`: its table and page, hostile class folders, and that every machine gives
the same table."""

import csv
import hashlib
import json
import os
import pickle
import re
import shutil
import socket
import unittest

from testing import ROOT, ProgramTest, read_tensors, run, small, write_tensors

AGENTS = ROOT / "web/public/agents"
QUICK = ("--episodes", 4, "--plants", 4)
# Hash of table.csv for the policies of ONE_OF_EACH, on every machine.
PINNED = "2c2063e700f5db8c"
# Levels, clipped and squashed Gaussians, and an identified plant.
ONE_OF_EACH = ("fast", "ppo", "sac", "d3qn-adaptive")


class GradeTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.folder_of_class = self.folder / "class"
        self.folder_of_class.mkdir()

    def hand_in(self, agent, name):
        """Puts a shipped policy into the class folder."""
        path = self.folder_of_class / name
        path.parent.mkdir(exist_ok=True)
        shutil.copy(AGENTS / f"{agent}.safetensors", path)

    def rows(self, out="out"):
        with open(self.folder / out / "table.csv", encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def data(self):
        """The data in the page."""
        page = (self.folder / "out/index.html").read_text(encoding="utf-8")
        found = re.findall(r'<script type="application/json" id="data">(.*)</script>', page)
        self.assertEqual(len(found), 1)
        return json.loads(found[0])

    def test_table_and_page(self):
        self.hand_in("fast", "alice.safetensors")
        self.hand_in("sac", "bob/policy.safetensors")
        self.hand_in("d3qn-at-0", "carol.safetensors")
        printed = self.succeed("grade", "class", *QUICK, "--out", "out")
        rows = self.rows()
        self.assertEqual([row["name"] for row in rows], ["bob", "alice", "carol"])
        self.assertEqual([row["rank"] for row in rows], ["1", "2", "3"])
        self.assertEqual([row["successes"] for row in rows], ["4", "4", "0"])
        self.assertEqual(rows[0]["file"], "bob/policy.safetensors")
        self.assertGreater(float(rows[0]["return"]), float(rows[1]["return"]))
        self.assertLess(float(rows[0]["torque_variation"]), float(rows[1]["torque_variation"]))
        self.assertRegex(printed, r"1  bob +100\.0% +\d+\.\d\d ")
        self.assertRegex(printed, r"3  carol +0\.0% ")
        # The page has the same figures, and the motion of 20 s, which begins near hanging.
        data = self.data()["rows"]
        self.assertEqual([row["return"] for row in data], [row["return"] for row in rows])
        self.assertEqual({len(row["motion"]) for row in data}, {2 * 501})
        self.assertTrue(all(abs(angle) < 1000 for row in data for angle in row["motion"][:2]))
        first_link, second_link = data[0]["motion"][-2:]
        self.assertAlmostEqual(abs(first_link / 3142), 1, delta=0.05)
        self.assertAlmostEqual(second_link, 0, delta=150)

    def test_namesakes_are_told_apart(self):
        self.hand_in("fast", "anna.safetensors")
        self.hand_in("sac", "anna/policy.safetensors")
        self.hand_in("ppo", "bob.safetensors")
        printed = self.succeed("grade", "class", *QUICK, "--out", "out")
        self.assertEqual({row["name"] for row in self.rows()}, {"anna", "anna.safetensors", "bob"})
        self.assertEqual({row["name"] for row in self.data()["rows"]},
                         {"anna", "anna.safetensors", "bob"})
        self.assertRegex(printed, r"(?m)^ +\d  anna\.safetensors +\d")

    def test_copies_share_a_rank_and_are_named(self):
        self.hand_in("fast", "alice.safetensors")
        self.hand_in("fast", "bob/policy.safetensors")
        self.hand_in("d3qn-at-0", "zoe.safetensors")
        # The same network under another name: other bytes, the same figures.
        metadata, tensors = read_tensors(AGENTS / "fast.safetensors")
        write_tensors(self.folder_of_class / "carol.safetensors", metadata | {"agent": "mine"}, tensors)
        printed = self.succeed("grade", "class", *QUICK, "--out", "out")
        self.assertEqual([(row["name"], row["rank"], row["note"]) for row in self.rows()],
                         [("alice", "1", ""), ("bob", "1", "the same file as alice"),
                          ("carol", "1", "the same figures as alice"), ("zoe", "4", "")])
        self.assertRegex(printed, r"(?m)^ +1  bob .*\n +the same file as alice\n +1  carol .*\n +the same figures")
        self.assertRegex(printed, r"(?m)^ +4  zoe ")
        self.assertEqual([(row["rank"], row.get("note", "")) for row in self.data()["rows"]],
                         [(int(row["rank"]), row["note"]) for row in self.rows()])

    def test_the_plant_of_another_training_is_named(self):
        metadata, tensors = read_tensors(AGENTS / "fast.safetensors")
        plant = json.loads(metadata["plant"])
        for name, changes in (("one", {"mass2": 1.25}),
                              ("five", {"mass1": 0.5, "mass2": 0.6, "length1": 0.7, "length2": 0.8, "gravity": 3.7})):
            write_tensors(self.folder_of_class / f"{name}.safetensors",
                          metadata | {"plant": json.dumps(plant | changes)}, tensors)
        printed = self.succeed("grade", "class", *QUICK, "--out", "out")
        notes = {row["name"]: row["note"] for row in self.rows()}
        self.assertIn("trained on another plant: mass2 1.25 kg (here 1)", notes["one"])
        self.assertIn("trained on another plant: mass1 0.5 kg (here 1), ", notes["five"])
        self.assertIn("and 1 more", notes["five"])
        for note in notes.values():
            self.assertIn(f"\n      {note}\n", printed)

    def test_no_output_inside_the_class_folder(self):
        self.hand_in("fast", "anna.safetensors")
        (self.folder / "link").symlink_to("class")
        for folder, out in (("class", "class/out"), ("class/", "./class/a/b"), ("link", "class/out"),
                            (".", "out"), ("class", "link/out")):
            with self.subTest(folder=folder, out=out):
                self.refuse(["grade", folder, *QUICK, "--out", out],
                            f"--out: expected a folder outside {folder}, whose entries are graded, got {out}")
        self.succeed("grade", "class", *QUICK, "--out", "class-out")

    def test_figures_are_those_of_eval(self):
        self.hand_in("ppo", "a.safetensors")
        self.succeed("grade", "class", "--episodes", 20, "--plants", 20, "--out", "out")
        row = self.rows()[0]
        for name, flags in (("successes", []), ("plant_successes", ["--randomize", 0.25])):
            result = json.loads(self.succeed("eval", "class/a.safetensors", "--json", "--episodes",
                                             20, "--physics", "closed-form", *flags))
            self.assertEqual(int(row[name]), result["successes"])
            if flags:
                continue
            for figure in ("return", "torque_variation", "energy_used"):
                self.assertAlmostEqual(float(row[figure]), result[figure]["mean"], delta=0.02)

    def test_every_machine_gives_the_same_table(self):
        for agent in ONE_OF_EACH:
            self.hand_in(agent, f"{agent}.safetensors")
        hashes = set()
        older = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA"}
        ways = [({}, 1), ({}, 3), (older, 2)]
        for path in ("avx512", "avx2", "neon", "portable"):
            ways.append(({"UPSWING_VECTORS": path}, 2))
        for i, (environment, threads) in enumerate(ways):
            done = run("grade", "class", *QUICK, "--out", f"out-{i}", "--threads", threads,
                       cwd=self.folder, env=os.environ | environment)
            if "on this processor" in done.stderr:
                continue
            self.assertEqual((done.returncode, done.stderr), (0, ""), done)
            table, page = ((self.folder / f"out-{i}" / name).read_bytes()
                           for name in ("table.csv", "index.html"))
            hashes.add((hashlib.sha256(table).hexdigest()[:16], page))
        self.assertEqual({table for table, _ in hashes}, {PINNED})
        self.assertEqual(len(hashes), 1, "the pages differ")

    def test_hostile_entries(self):
        self.hand_in("fast", "good.safetensors")
        self.hand_in("fast", ".hidden")
        folder = self.folder_of_class
        (folder / "pickled.pkl").write_bytes(pickle.dumps({"weights": [1, 2]}))
        (folder / "renamed.safetensors").write_bytes(pickle.dumps({"weights": [1, 2]}))
        os.mkfifo(folder / "pipe.safetensors")
        (folder / "link.safetensors").symlink_to("good.safetensors")
        (folder / "to-itself.safetensors").symlink_to("to-itself.safetensors")
        (folder / "linked-folder").symlink_to("/")
        (folder / "folder.safetensors").mkdir()
        (folder / "linked-inside").mkdir()
        (folder / "linked-inside/policy.safetensors").symlink_to("../good.safetensors")
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(str(folder / "socket.safetensors"))
        with open(folder / "huge.safetensors", "wb") as file:
            file.truncate(1 << 40)
        (folder / "readme.safetensors").write_text("# My policy\nIt swings up.\n")
        (folder / "long.safetensors").write_text("# My policy\n" * (1 << 20))
        (folder / "torch.safetensors").write_bytes(b"PK\3\4" + bytes(100))
        self.succeed(*small(steps=400, out="run"))
        checkpoint = (self.folder / "run/checkpoint.safetensors").read_bytes()
        (folder / "checkpoint.safetensors").write_bytes(checkpoint)
        self.succeed(*small(steps=400, out="large", hidden="640,640"))
        large = (self.folder / "large/checkpoint.safetensors").read_bytes()
        self.assertGreater(len(large), 8 << 20)
        (folder / "large.safetensors").write_bytes(large)
        metadata, tensors = read_tensors(AGENTS / "fast.safetensors")
        kind, (rows, columns), data = tensors["feature.0.weight"]
        tensors["feature.0.weight"] = (kind, [columns, rows], data)
        write_tensors(folder / "shape.safetensors", metadata, tensors)
        expected = {
            "pickled.pkl": "another file", "renamed": "got a pickle of Python",
            "readme": 'got a text that begins with "# My pol"', "long": "got a text that begins with",
            "torch": "got a zip archive", "checkpoint": "got the checkpoint of a training",
            "large": "got the checkpoint of a training",
            "pipe": "no regular file", "link": "a link", "to-itself": "a link",
            "linked-folder": "a link", "folder": "a folder without it", "linked-inside": "a link",
            "socket": "no regular file", "huge": "expected at most 8388608 bytes",
            "shape": "feature.0.weight"}
        done = self.run_here("grade", "class", *QUICK, "--out", "out")
        self.assertEqual((done.returncode, done.stderr), (1, ""))
        rows = self.rows()
        self.assertEqual((rows[0]["name"], rows[0]["rank"]), ("good", "1"))
        self.assertEqual({row["name"] for row in rows[1:]}, set(expected))
        for row in rows[1:]:
            self.assertIn(expected[row["name"]], row["refused"])
            self.assertEqual((row["rank"], row["return"]), ("", ""))
            self.assertEqual(len(re.findall(rf"(?m)^ +{re.escape(row['name'])}  refused: .+$",
                                            done.stdout)), 1)
            self.assertNotIn("class/", row["refused"])

    def test_policies_of_another_task(self):
        metadata, tensors = read_tensors(AGENTS / "fast.safetensors")
        for name, more in (("foreign", {"task": "Pendulum-v1"}), ("other", {"model": "<mujoco/>"})):
            write_tensors(self.folder_of_class / f"{name}.safetensors", metadata | more, tensors)
        done = self.run_here("grade", "class", *QUICK)
        self.assertEqual((done.returncode, done.stderr), (1, ""))
        self.assertIn("metadata \"model\": expected none", done.stdout)
        self.assertRegex(done.stdout, "foreign  refused: .*task")

    def test_names_do_no_harm(self):
        names = ["<img src=x onerror=alert(1)>", "\x1b[31mred", "=1+1", "a\nb", "</script>", "ä,\"b",
                 "\udcff", "@SUM(1)", "+1+1", "-1+1", " =1", "x;=1+1", "-7"]
        for name in names:
            self.hand_in("d3qn-at-0", f"{name}.safetensors".replace("/", "⁄"))
            self.hand_in("d3qn-at-0", f"{name.replace('/', '')}2/policy.safetensors")
        printed = self.succeed("grade", "class", "--episodes", 1, "--plants", 0, "--out", "out")
        self.assertNotIn("\x1b", printed)
        self.assertEqual(len(re.findall(r"(?m)^ +1  ", printed)), 2 * len(names))
        rows = self.rows()
        self.assertEqual(len(rows), 2 * len(names))
        self.assertLessEqual({"'=1+1", "'@SUM(1)", "'+1+1", "'-1+1", " '=1", "x;'=1+1", "-7"},
                             {row["name"] for row in rows})
        # No cell is a formula for a spreadsheet that separates by commas, nor for one with semicolons.
        for row in (self.folder / "out/table.csv").read_text(encoding="utf-8").splitlines():
            for cell in re.split("[,;]", row):
                self.assertRegex(cell, r'^"*(?![ "]*[=+@]|[ "]*-(?!\d+(\.\d+)?"*$))')
        page = (self.folder / "out/index.html").read_text(encoding="utf-8")
        self.assertEqual([page.count(text) for text in ("<img", "\x1b", "</script>")], [0, 0, 2])
        self.assertEqual(len(self.data()["rows"]), 2 * len(names))

    def test_five_hundred_files(self):
        self.hand_in("fast", "good.safetensors")
        for i in range(500):
            (self.folder_of_class / f"{i}.pkl").write_bytes(b"\x80\x04K\x01.")
        done = self.run_here("grade", "class", *QUICK)
        self.assertEqual((done.returncode, done.stderr), (1, ""))
        self.assertEqual(done.stdout.count("refused: "), 500)
        self.assertIn("1  good", done.stdout)

    def test_bad_arguments(self):
        self.refuse(["grade"], "folder")
        self.refuse(["grade", "none"], "none", "No such file")
        self.refuse(["grade", "class"], "class", "expected 1 to 2000 policies", "got none")
        self.hand_in("fast", "good.safetensors")
        self.refuse(["grade", "class/good.safetensors"], "good.safetensors", "Not a directory")
        self.refuse(["grade", "class", "--episodes", 0], "--episodes: expected", 'got "0"')
        self.refuse(["grade", "class", "--plants", -1], "--plants: expected", 'got "-1"')
        self.refuse(["grade", "class", "--out", "class"], "class", "--out")


if __name__ == "__main__":
    unittest.main()
