#!/usr/bin/env python3
"""What the documentation says, held against the program and the repository."""

import csv
import io
import math
import re
import unittest

from testing import ROOT, ProgramTest, read_csv, train_once

DOCUMENTS = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md")),
             ROOT / "tools/peers/README.md"]


def text_of(name):
    return (ROOT / name).read_text(encoding="utf-8")


def first_column(markdown):
    """What stands in backticks at the beginning of the rows of a table."""
    return re.findall(r"^\| `([^`]+)`", markdown, re.MULTILINE)


class RunFolder(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.run_path = train_once(cls)
        cls.sections = dict(re.findall(r"^## (\S+\.csv)\n(.*?)(?=^## |\Z)",
                                       text_of("docs/run-folder.md"), re.MULTILINE | re.DOTALL))

    def test_every_column_is_explained(self):
        self.assertEqual(set(self.sections), {path.name for path in self.run_path.glob("*.csv")})
        for name, section in self.sections.items():
            with open(self.run_path / name, encoding="utf-8", newline="") as file:
                self.assertEqual(first_column(section), next(csv.reader(file)), name)

    def test_every_file_is_named(self):
        files = first_column(text_of("docs/run-folder.md").split("## ", maxsplit=1)[0])
        self.assertEqual(set(files) - {"model.xml"}, {path.name for path in self.run_path.iterdir()})

    def test_terms_add_up_to_the_return(self):
        for row in read_csv(self.run_path / "episodes.csv"):
            terms = [row[name] for name in first_column(self.sections["episodes.csv"])[-5:]]
            self.assertAlmostEqual(math.fsum(terms), row["return"], delta=1e-9)


def reward_terms(q1, q2, w1, w2, tau, m1=1, m2=1, l1=0.5, l2=0.5, g=9.81):
    """docs/task.md in Python."""
    pe = (-m1 * g * l1 / 2 * math.cos(q1)
          - m2 * g * (l1 * math.cos(q1) + l2 / 2 * math.cos(q1 + q2)))
    ke = (m1 * l1**2 / 12 * w1**2 / 2 + m2 * l2**2 / 12 * (w1 + w2)**2 / 2
          + m1 * (l1 / 2)**2 * w1**2 / 2
          + m2 / 2 * (l1**2 * w1**2 + (l2 / 2)**2 * (w1 + w2)**2
                      + l1 * l2 * math.cos(q2) * w1 * (w1 + w2)))
    target = m1 * g * l1 / 2 + m2 * g * (l1 + l2 / 2)
    energy = (ke + pe + target) / (2 * target)
    height = -(l1 * math.cos(q1) + l2 * math.cos(q1 + q2)) / (l1 + l2)
    inverted = max(math.cos(q1), math.cos(q1 + q2)) <= -math.cos(math.radians(30))
    return {"energy": min(max(energy, 0), 1.5), "height": (height + 1) / 2,
            "balance": 5 if inverted else 0,
            "velocity_penalty": -0.01 * (w1**2 + w2**2) if inverted else 0,
            "torque_penalty": -(0.05 if inverted else 0.01) * tau**2}


class Task(ProgramTest):
    def test_reward(self):
        rows = self.succeed("simulate", ROOT / "web/public/agents/d3qn.safetensors", "--seconds",
                            5, "--physics", "closed-form")
        seen = set()
        names = first_column(text_of("docs/task.md").split("## Reward")[1].split("##")[0])
        for row in csv.DictReader(io.StringIO(rows)):
            x = {name: float(text) for name, text in row.items()}
            # The torque of a row is held from its state on: its reward's terms are of both.
            terms = reward_terms(x["qpos0"], x["qpos1"], x["qvel0"], x["qvel1"], x["torque"])
            self.assertEqual(names, list(terms))
            for name in names:
                column = name if name.endswith("penalty") else f"{name}_reward"
                self.assertAlmostEqual(terms[name], x[column], delta=1e-9, msg=(name, row))
            seen.add(terms["balance"])
        self.assertEqual(seen, {0, 5})


class Documents(ProgramTest):
    def test_links_lead_somewhere(self):
        for path in DOCUMENTS:
            text = path.read_text(encoding="utf-8")
            for target in re.findall(r'\]\(([^)\s]+)\)|src="([^"]+)"', text):
                target = "".join(target)
                if not re.match(r"https?://", target):
                    self.assertTrue((path.parent / target.split("#")[0]).exists(),
                                    f"{path.name}: {target}")

    def test_readme_leads_to_every_document(self):
        for path in (ROOT / "docs").glob("*.md"):
            self.assertIn(f"(docs/{path.name})", text_of("README.md"))

    def test_the_post_is_named_where_it_is_mentioned(self):
        for path in DOCUMENTS:
            text = " ".join(path.read_text(encoding="utf-8").split())
            if re.search(r"\bthe post\b|\bpost's\b", text, re.IGNORECASE):
                self.assertTrue("Balancing a Double Pendulum with DQN and MuJoCo" in text, path.name)

    def test_map_of_the_code_has_every_folder(self):
        built = {"build", "runs", "node_modules"}
        folders = {path.name for path in ROOT.iterdir()
                   if path.is_dir() and not path.name.startswith(".")} - built
        code_map = text_of("CONTRIBUTING.md").split("## The map")[1].split("\n## ")[0]
        for folder in sorted(folders):
            self.assertIn(f"`{folder}/`", code_map)

    def test_one_version(self):
        version = re.search(r"project\(upswing VERSION (\S+)", text_of("CMakeLists.txt"))[1]
        self.assertIn(f"\nversion: {version}\n", text_of("CITATION.cff"))
        self.assertEqual(re.search(r"^## \[(\S+)\]", text_of("CHANGELOG.md"), re.MULTILINE)[1],
                         version)

    def test_security_names_every_fuzzing_target_and_tests_that_exist(self):
        text = text_of("SECURITY.md")
        self.assertEqual(set(re.findall(r"(\w+_fuzz)`", text)),
                         {path.stem for path in (ROOT / "fuzz").glob("*_fuzz.cc")})
        for name in re.findall(r"`(\w+/\w+_test\.\w+)`", text):
            self.assertTrue((ROOT / name).exists(), name)

    def test_launcher_and_readme_name_the_same_systems(self):
        for name in ("README.md", "upswing"):
            self.assertIn("Debian 12 ", text_of(name))
            self.assertRegex(text_of(name), r"Debian 12 (and|or) 13")
        self.assertIn('"debian 12 "* | "debian 13 "*', text_of("upswing"))

    def test_shipped_policies_can_be_evaluated_as_the_readme_says(self):
        policy = re.search(r"upswing eval (web/public/agents/\S+)", text_of("README.md"))[1]
        self.assertIn("success", self.succeed("eval", ROOT / policy, "--episodes", 2, "--physics",
                                              "closed-form"))


if __name__ == "__main__":
    unittest.main()
