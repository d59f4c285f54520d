#!/usr/bin/env python3
"""Compares the documentation with the program and the repository."""

import csv
import io
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

from testing import ROOT, UPSWING, ProgramTest, read_csv, train_once

sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "tools/results")]
import program  # noqa: E402
import prose  # noqa: E402
import results  # noqa: E402
from pages import pages, without_code  # noqa: E402

PAGES = pages()
DOCUMENTS = [*sorted(ROOT.glob("*.md")), *PAGES[1:], ROOT / "tools/peers/README.md"]
# Pages written when the site is built: tools/docs.py.
GENERATED = {f"docs/reference/{name}.md"
             for name in ("command-line", "settings", "cpp-api", "python-api")}


def text_of(name):
    return (ROOT / name).read_text(encoding="utf-8")


def tested_blocks(markdown):
    """The commands of each block marked as a test, and the output that the page shows below them: a
    block of text or a generated one, or None."""
    return [(commands, text or generated and re.sub(r"(?m)^    ", "", generated))
            for commands, text, generated in re.findall(
                r"^```sh test\n(.*?)^```\n(?:\n```text\n(.*?)^```|\n<!-- generated: .*? -->\n\n(.*?)\n<!-- end)?",
                markdown, re.MULTILINE | re.DOTALL)]


def pattern_of(shown):
    """Matches an output of which a page shows some lines. "…" stands for part of a line, or in a
    line of its own for any lines."""
    lines = [r"(?:.*\n)*?" if line.strip() == "…" else
             " *" + "[^\n]*".join(map(re.escape, line.strip().split("…"))) + r" *\n"
             for line in shown.splitlines()]
    return re.compile("^" + "".join(lines), re.MULTILINE)


def first_column(markdown):
    """The texts in backticks in the first cell of each table row."""
    return [name for cell in re.findall(r"^\|([^|]*)\|", markdown, re.MULTILINE)
            for name in re.findall("`([^`]+)`", cell)]


class RunFolder(ProgramTest):
    PAGE = "docs/reference/run-folder.md"

    @classmethod
    def setUpClass(cls):
        cls.run_path = train_once(cls)
        cls.sections = dict(re.findall(r"^## (\S+\.csv)\n(.*?)(?=^## |\Z)", text_of(cls.PAGE),
                                       re.MULTILINE | re.DOTALL))

    @staticmethod
    def header(path):
        with open(path, encoding="utf-8", newline="") as file:
            return next(csv.reader(file))

    def test_every_column_is_explained(self):
        self.assertEqual(set(self.sections), {path.name for path in self.run_path.glob("*.csv")})
        for name in self.sections.keys() - {"metrics.csv"}:
            self.assertEqual(first_column(self.sections[name]), self.header(self.run_path / name), name)

    def test_every_metric_is_explained(self):
        common, *parts = re.split(r"^### (DQN|SAC|PPO)\n", self.sections["metrics.csv"],
                                  flags=re.MULTILINE)
        dqn = {"head": None, "learning_starts": None, "updates_per_step": None}
        runs = {"DQN": self.run_path, "SAC": train_once(self, agent="sac-fast", head=None),
                "PPO": train_once(self, agent="ppo", **dqn)}
        self.assertEqual(parts[::2], list(runs))
        for algorithm, text in zip(parts[::2], parts[1::2]):
            self.assertEqual(sorted(first_column(common) + first_column(text)),
                             sorted(self.header(runs[algorithm] / "metrics.csv")), algorithm)

    def test_every_file_is_named(self):
        files = first_column(text_of(self.PAGE).split("## ", maxsplit=1)[0])
        self.assertEqual(set(files), {path.name for path in self.run_path.iterdir()})

    def test_terms_add_up_to_the_return(self):
        for row in read_csv(self.run_path / "episodes.csv"):
            terms = [row[name] for name in first_column(self.sections["episodes.csv"])[-5:]]
            self.assertAlmostEqual(math.fsum(terms), row["return"], delta=1e-9)


def reward_terms(q1, q2, w1, w2, tau, m1=1, m2=1, l1=0.5, l2=0.5, g=9.81):
    """The reward of docs/reference/task.md in Python."""
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
        text = self.succeed("simulate", ROOT / "web/public/agents/d3qn.safetensors", "--seconds",
                            5, "--physics", "closed-form")
        seen = set()
        names = first_column(text_of("docs/reference/task.md").split("## Reward")[1].split("##")[0])
        rows = [{name: float(cell) for name, cell in row.items()}
                for row in csv.DictReader(io.StringIO(text))]
        for row, x in zip(rows, rows[1:]):
            # A row's torque leads to the next row's state, and the reward's terms use both.
            terms = reward_terms(x["q1"], x["q2"], x["w1"], x["w2"], row["torque"])
            self.assertEqual(names, list(terms))
            for name in names:
                column = name if name.endswith("penalty") else f"{name}_reward"
                self.assertAlmostEqual(terms[name], row[column], delta=1e-9, msg=(name, row))
            seen.add(terms["balance"])
        self.assertEqual(seen, {0, 5})


def anchors(markdown):
    """The anchors of the headings, as GitHub and MyST generate them."""
    found = set()
    for heading in re.findall(r"^#+ +(.*?)\s*$", without_code(markdown), re.MULTILINE):
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        slug = re.sub(r"[^\w\- ]", "", text).replace(" ", "-")
        found.add(next(name for name in [slug, *(f"{slug}-{k}" for k in range(1, 99))]
                       if name not in found))
    return found


def commands_in(markdown):
    """[command, words] of each `./upswing …` in fenced blocks and inline code."""
    blocks = re.findall(r"^```[^\n]*\n(.*?)^```", markdown, re.MULTILINE | re.DOTALL)
    codes = re.findall(r"`([^`\n]+)`", without_code(markdown)) + [
        line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    for line in codes:
        for words in re.findall(r"\./upswing((?: +[^\s|&;#<>()]+)+)", line.split(" #")[0]):
            words = [word for word in words.split() if word != "--no-setup"]
            if words and re.fullmatch("[a-z]+", words[0]):
                yield words[0], words[1:]


class Documents(ProgramTest):
    def test_links_lead_somewhere(self):
        for path in DOCUMENTS:
            text = path.read_text(encoding="utf-8")
            seen = without_code(text)
            for target in re.findall(r'\]\(([^)\s]+)\)|src="([^"]+)"', seen):
                target = "".join(target)
                if re.match(r"[a-z]+:", target):
                    continue
                place, _, anchor = target.partition("#")
                there = Path(os.path.normpath(path.parent / place)) if place else path
                name = str(there.relative_to(ROOT))
                with self.subTest(page=path.name, target=target):
                    self.assertTrue(there.exists() or name in GENERATED)
                    if anchor and there.suffix == ".md" and name not in GENERATED:
                        self.assertIn(anchor, anchors(there.read_text(encoding="utf-8")))

    def test_commands_and_flags_exist(self):
        known = set(program.commands())
        for path in PAGES:
            for command, words in commands_in(path.read_text(encoding="utf-8")):
                with self.subTest(page=path.name, command=command):
                    self.assertIn(command, known | {"help"})
                    flags = {word.split("=")[0] for word in words if re.match("--[a-z]", word)}
                    if command == "test" or "--" in words or command == "python":
                        continue  # the rest is for ctest or Python
                    self.assertLessEqual(flags, program.flags(command) | {"--help"})

    def test_tables_and_values_are_up_to_date(self):
        done = subprocess.run([sys.executable, "-B", ROOT / "tools/results/results.py", "check"],
                              check=False, stdout=subprocess.PIPE, encoding="utf-8")
        self.assertEqual((done.returncode, done.stdout), (0, ""))

    def test_no_line_begins_with_the_mark_of_a_value(self):
        # In Markdown, a comment at the beginning of a line ends the paragraph.
        for path in PAGES:
            found = re.findall(r"^ *<!-- value.*", path.read_text(encoding="utf-8"), re.MULTILINE)
            self.assertEqual(found, [], path.name)

    def test_a_wrong_table_or_value_is_found(self):
        path = next(path for path in results.DATA.glob("*.json") if path.stem != "machines")
        table = results.load(path.stem)
        name, column = table["rows"][0][0].replace("`", ""), len(table["columns"]) - 1
        shown = f"<!-- table: {path.stem} -->\n{results.render('table', path.stem)}<!-- end -->\n"
        value = f"<!-- value: {path.stem} {name} {column} -->{{}}<!-- end -->\n"
        right = value.format(table["rows"][0][column])
        self.assertEqual(list(results.problems_of(shown + right)), [])
        self.assertEqual(len(list(results.problems_of(shown.replace("|---", "|----", 1)))), 1)
        self.assertEqual(len(list(results.problems_of(value.format("12345.678")))), 1)
        self.assertEqual(len(list(results.problems_of("<!-- table: no-such -->\n<!-- end -->"))), 1)
        self.assertEqual(results.rendered(shown.replace("|---", "|----", 1)), shown)

    def test_plain_english(self):
        for path in PAGES + prose.notebooks() + prose.sources():
            for sentence, fault in prose.faults_of(path):
                with self.subTest(file=path.name, fault=fault):
                    self.fail(sentence)

    def test_the_patterns_find_faults(self):
        # Sentences of the README of version 0.4.0 and similar ones.
        for sentence in (
                "Nobody has tried Ubuntu yet.",
                "learning_md says what is in a file.",
                "or `pip install .` into an environment of one's own.",
                "our scores beside the published ones",
                "A controller is made anew for the plant of each episode.",
                "Then one is the motor oneself.",
                "copy the target every so many instead",
                "It costs so much that nothing is left.",
                "Units such as those of the plant are kept.",
                "the same of the second link",
                "Of interest for who watches.",
                "A policy whose weights are those that it had.",
                "Asks anybody alone, and what reads files from them.",
                "*Everything* has all there is: drag the pendulum with mouse or finger, shove it, pause, "
                "go step by step or ten times slower, change masses, lengths, dampings, gravity, the "
                "motor, blur the sensors, delay the torque; compare two agents side by side."):
            with self.subTest(sentence):
                self.assertNotEqual(list(prose.faults(sentence)), [])
        for text in ("What is a plant?", "```text\nnobody\n```", "`anew`",
                     "The motor swings the pendulum up.", "| beside_x | 1 |"):
            with self.subTest(text):
                self.assertEqual(list(prose.faults(text)), [])

    def test_the_patterns_find_faults_in_code(self):
        files = {"a.cc": '// Says what\n// is wrong.\nx("It goes beside " "the page.\\n");',
                 "a.ts": "/// For who watches.\nconst x = `a text beside ${y}`;",
                 "a.py": '"""Begins the work\nanew."""\nx = "a text of nobody"  # alone',
                 "a.sh": "# made anew\nfail 'asked for so many words'",
                 "a.html": "<p>Shows what <b>follows</b> here.</p><i title='x' alt=\"nobody\">",
                 "a_test.cc": "TEST" '(A, SaysWhatIsWrong) { x("a text beside b"); }  // alone'}
        counts = {}
        for name, text in files.items():
            (self.folder / name).write_text(text, encoding="utf-8")
            counts[name] = len(prose.faults_of(self.folder / name))
        self.assertEqual(counts, {name: 3 if name == "a.py" else 2 for name in files})

    def test_blocks_marked_as_tests_succeed(self):
        launcher = self.folder / "launcher"
        launcher.write_text(f'#!/bin/sh\nexec "{UPSWING}" "$@"\n', encoding="utf-8")
        launcher.chmod(0o755)
        for path in PAGES:
            blocks = tested_blocks(path.read_text(encoding="utf-8"))
            if not blocks:
                continue
            # The blocks of a page run in order, in a folder that looks like a fresh checkout.
            here = self.folder / "page"
            here.mkdir()
            for entry in ROOT.iterdir():
                if entry.name not in {"upswing", "build", "runs", ".git"}:
                    (here / entry.name).symlink_to(entry)
            (here / "upswing").symlink_to(launcher)
            for block, shown in blocks:
                with self.subTest(page=path.name, block=block):
                    done = subprocess.run(["sh", "-eu"], input=block, cwd=here, check=False,
                                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                          encoding="utf-8")
                    self.assertEqual(done.returncode, 0, done.stdout)
                    if shown and "UPSWING_FINGERPRINTS" in os.environ:
                        self.assertRegex(done.stdout, pattern_of(shown))
            shutil.rmtree(here)

    def test_the_arduino_sketch_compiles(self):
        sketch, = re.findall(r"^```cpp\n(.*?)^```", text_of("docs/howto/export.md"),
                             re.MULTILINE | re.DOTALL)
        self.succeed("export", "lqr", "--c", self.folder / "policy.h")
        stubs = ("unsigned long micros(void); void STOP_MOTOR(void); void SET_MOTOR(float);"
                 "void READ_ANGLES(float *, float *); void READ_VELOCITIES(float *, float *);\n")
        (self.folder / "sketch.cc").write_text(stubs + sketch, encoding="utf-8")
        done = subprocess.run(["c++", "-Wall", "-Wextra", "-Werror", "-fsyntax-only",
                               self.folder / "sketch.cc"], check=False, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, encoding="utf-8")
        self.assertEqual((done.returncode, done.stdout), (0, ""))

    def test_shown_output_is_compared(self):
        markdown = "```sh test\na\n```\n\n```text\nsolved at … steps\n…\nend 5\n```\n"
        (commands, shown), = tested_blocks(markdown)
        self.assertEqual(commands, "a\n")
        self.assertRegex("solved at 90 steps\nx\ny\n  end 5\n", pattern_of(shown))
        self.assertNotRegex("solved at 90 steps\nx\ny\n  end 6\n", pattern_of(shown))
        self.assertNotRegex("solved at 90\nend 5\n", pattern_of(shown))

    def test_the_post_is_named_where_it_is_mentioned(self):
        for path in DOCUMENTS:
            text = " ".join(path.read_text(encoding="utf-8").split())
            if re.search(r"\bthe post\b|\bpost's\b", text, re.IGNORECASE):
                self.assertTrue("Balancing a Double Pendulum with DQN and MuJoCo" in text, path.name)

    def test_map_of_the_code_has_every_folder(self):
        built = {"build", "runs", "node_modules"}
        folders = {str(path.relative_to(ROOT)) for place in (".", "src", "extras")
                   for path in (ROOT / place).iterdir()
                   if path.is_dir() and not path.name.startswith((".", "__"))} - built
        code_map = text_of("CONTRIBUTING.md").split("## The map")[1].split("\n## ")[0]
        for folder in sorted(folders):
            self.assertIn(f"`{folder}/`", code_map)

    def test_the_reading_path_exists(self):
        path = re.findall(r"`(src/[\w/]+)\.cc`", text_of("CONTRIBUTING.md").split("## The map")[0])
        self.assertEqual(len(path), 5)
        for name in path:
            for ending in (".h", ".cc"):
                self.assertTrue((ROOT / (name + ending)).is_file(), name + ending)

    def test_one_version(self):
        version = re.search(r"project\(upswing VERSION (\S+)", text_of("CMakeLists.txt"))[1]
        self.assertIn(f"\nversion: {version}\n", text_of("CITATION.cff"))
        self.assertEqual(re.search(r"^## \[(\d\S*)\]", text_of("CHANGELOG.md"), re.MULTILINE)[1],
                         version)

    def test_the_python_page_and_the_package_name_the_same_python(self):
        needed = re.search(r'requires-python = ">=(\S+)"', text_of("pyproject.toml"))[1]
        self.assertEqual(re.findall(r"Python (\S+) or newer", text_of("docs/howto/python.md")), [needed])

    def test_security_names_every_fuzzing_target_and_tests_that_exist(self):
        text = text_of("SECURITY.md")
        self.assertEqual(set(re.findall(r"(\w+_fuzz)`", text)),
                         {path.stem for path in (ROOT / "tools/fuzz").glob("*_fuzz.cc")})
        for name in re.findall(r"`([\w/]+_test\.\w+)`", text):
            self.assertTrue((ROOT / name).exists(), name)

    def test_launcher_and_readme_name_the_same_systems(self):
        for name in ("README.md", "upswing"):
            self.assertIn("Debian 12 ", text_of(name))
            self.assertRegex(text_of(name), r"Debian 12 (and|or) 13")
        self.assertIn('"debian 12 "* | "debian 13 "*', text_of("upswing"))


# Questions of readers, and the page or section that the search has to show first.
FIRST_HITS = {
    "answers#can-i-use-my-own-robot": ["my own robot", "another robot", "use my robot arm"],
    "answers#what-is-q-learning": ["what is Q-learning", "Q-value"],
    "answers#how-long-does-training-take": ["how long does training take", "training time",
                                            "train faster"],
    "answers#gpu": ["GPU", "do I need a graphics card"],
    "answers#macos": ["Mac"],
    "answers#ipad-phone-chromebook": ["iPad", "Chromebook", "does it run on a phone"],
    "answers#matlab-and-simulink": ["MATLAB", "Simulink"],
    "answers#licence": ["license"],
    "answers#cite": ["how do I cite this"],
    "howto/model-files": ["MJCF", "URDF"],
    "howto/python#policies-evaluations-maps": ["load a policy in Python", "use a trained policy"],
    "howto/python#notebooks": ["Colab", "Jupyter", "notebook"],
    "howto/python#more-examples": ["Stable-Baselines3"],
    "howto/export#arduino": ["export to Arduino", "ESP32"],
    "howto/export": ["microcontroller", "export a policy"],
    "howto/gymnasium": ["train on my own environment"],
    "howto/random-plants": ["domain randomization"],
    "howto/random-plants#imperfect-sensors-and-motors": ["my encoder", "sensor noise"],
    "howto/reward": ["change the reward"],
    "howto/viewer#films-and-pictures": ["record a video"],
    "start/first-training#evaluate-and-train-on": ["stop training early", "resume a training"],
    "start/install#windows": ["install on Windows"],
    "start/page-tour#share-what-you-see": ["share my result"],
    "tutorials/your-own-plant": ["link length"],
    "start/install#container": ["Docker"],
    "start/install#bit-arm": ["Raspberry Pi"],
    "course/index": ["lesson plan"],
    "course/answers": ["worksheet answers", "solutions"],
    "course/sheet-2": ["reward hacking"],
    "controllers#lqr": ["LQR"],
    "agents/ppo": ["PPO"],
    "reference/run-folder": ["TensorBoard"],
    "reference/settings": ["hyperparameters", "learning rate"],
    "tutorials/cluster-study#use-slurm": ["Slurm"],
    "development/changelog": ["changelog", "release notes"],
}


class Site(ProgramTest):
    """Tests of the documentation as HTML, built by ./upswing docs in build/docs-venv."""

    PYTHON = ROOT / "build/docs-venv/bin/python"

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        if not cls.PYTHON.exists() or not shutil.which("doxygen"):
            if os.environ.get("UPSWING_REQUIRE_DOCS"):
                raise AssertionError("build/docs-venv or Doxygen is missing: run ./upswing docs")
            raise unittest.SkipTest("run ./upswing docs once, which installs Sphinx and Doxygen")
        folder = tempfile.TemporaryDirectory()  # pylint: disable=consider-using-with
        cls.addClassCleanup(folder.cleanup)
        cls.site = Path(folder.name) / "site"
        # Two processes would take 40% more processor time, in which other tests run.
        cls.built = subprocess.run([cls.PYTHON, "-B", ROOT / "tools/docs.py", "build", cls.site,
                                    "--jobs", "1"], check=False, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   encoding="utf-8")

    def skip_without(self, what):
        if os.environ.get("UPSWING_REQUIRE_WEB"):
            self.fail(f"{what} is missing: run ./upswing test")
        self.skipTest(f"{what} is missing, which ./upswing test installs")

    def node(self, *command, **more):
        """Runs a script with Node. Skips the test without Node."""
        if not shutil.which("node"):
            self.skip_without("Node")
        return subprocess.run(["node", *command], check=False, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8",
                              **more)

    def browse(self, site, *arguments):
        """Looks at a site in Chromium. Skips the test without it or the page's packages."""
        if not (ROOT / "web/node_modules/axe-core").exists():
            self.skip_without("web/node_modules")
        found = subprocess.run(["sh", "-c", 'root=$1; . "$1/tools/web.sh"; find_chromium || has_own_chromium',
                                "sh", ROOT], check=False, stdout=subprocess.PIPE, encoding="utf-8")
        if found.returncode != 0:
            self.skip_without("Chromium")
        chromium = {"UPSWING_CHROMIUM": found.stdout.strip()} if found.stdout else {}
        return self.node(ROOT / "web/tests/docs.mjs", site, *arguments, env=os.environ | chromium)

    def test_builds_without_a_warning_and_needs_no_network(self):
        site = self.site
        self.assertEqual((self.built.returncode, self.built.stdout), (0, ""))
        self.assertTrue((site / "searchindex.js").exists())
        answers = (site / "answers.html").read_text(encoding="utf-8")
        self.assertIn("_sources/answers.md.txt", answers)
        self.assertIn("copybutton.js", answers)
        for page in site.rglob("*.html"):
            text = page.read_text(encoding="utf-8")
            loaded = re.findall(r'<(?:script|link|img)\b[^>]*?(?:src|href)="([^"]+)"', text)
            for address in loaded:
                self.assertFalse(re.match(r"(?:[a-z]+:)?//", address), f"{page.name}: {address}")
            self.assertNotIn('href="/', text, page.name)
        for header in ("base/env.h", "rl/dqn/dqn.h"):
            page = site / "reference/cpp-api" / f"{header.split('/', maxsplit=1)[0]}.html"
            self.assertIn(header, page.read_text(encoding="utf-8"))
        self.assertIn("Dqn", (site / "reference/cpp-api/rl.html").read_text(encoding="utf-8"))

    def test_page_and_documentation_link_to_each_other(self):
        whole = self.folder / "whole"
        shutil.copytree(self.site, whole / "docs")
        (whole / "index.html").write_text(text_of("web/index.html"), encoding="utf-8")
        subprocess.run([self.PYTHON, "-B", ROOT / "tools/docs.py", "join", whole], check=True)
        shown = re.findall(r'class="site"[^>]*>', (whole / "index.html").read_text(encoding="utf-8"))
        self.assertEqual(len(shown), text_of("web/index.html").count('class="site"'))
        for tag in shown:
            self.assertNotIn("hidden", tag)
        tour = (whole / "docs/start/page-tour.html").read_text(encoding="utf-8")
        self.assertIn('href="../../#learn=fast', tour)
        self.assertIn('href="../../"', tour)
        for page in (whole / "docs").rglob("*.html"):
            self.assertNotIn('href="http://localhost', page.read_text(encoding="utf-8"), page.name)

    def hits(self, *queries):
        """The first hits of the search for each query."""
        done = self.node(ROOT / "tools/docs_search.mjs", self.site, *queries)
        self.assertEqual(done.returncode, 0, done.stdout)
        return [line.split("\t") for line in done.stdout.removesuffix("\n").split("\n")]

    def test_search_answers_questions_with_the_first_hit(self):
        expected = {query: place for place, queries in FIRST_HITS.items() for query in queries}
        for (query, place), found in zip(expected.items(), self.hits(*expected)):
            with self.subTest(query=query):
                self.assertEqual(found[0], place)

    def test_search_accepts_any_query(self):
        self.assertEqual(self.hits("xyzzy"), [[""]])
        self.assertEqual(len(self.hits("what is", "?", "__proto__")), 3)

    def test_words_of_the_search_lead_to_pages_and_sections(self):
        words = tomllib.loads(text_of("docs/search.toml"))
        for place in words:
            name, _, section = place.partition("#")
            with self.subTest(place=place):
                page = (self.site / name).with_suffix(".html").read_text(encoding="utf-8")
                if section:
                    self.assertIn(f'<section id="{section}">', page)
        listed = [word.lower() for group in words.values() for word in group]
        self.assertEqual(sorted(listed), sorted(set(listed)))

    def test_sheets_print_whole_and_pages_are_accessible(self):
        done = self.browse(self.site)
        self.assertEqual((done.returncode, done.stdout), (0, ""))

        # Without the rules for paper, commands are cut.
        shutil.copytree(self.site, self.folder / "site")
        style = self.folder / "site/_static/style.css"
        style.write_text(style.read_text(encoding="utf-8").replace("@media print", "@media none"),
                         encoding="utf-8")
        done = self.browse(self.folder / "site", "sheets")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, r"sheet-2 on A4: \d+ px of")


class Launcher(ProgramTest):
    """Tests of the errors of ./upswing docs."""

    def test_bad_input_is_refused_in_one_line(self):
        (self.folder / "full").mkdir()
        (self.folder / "full/file").touch()
        for arguments, *words in ((["--sreve"], "--sreve", "--help"),
                                  (["--site"], "--site"), (["--site="], "--site"),
                                  (["--site", "full"], "full", "empty"),
                                  (["--site", "no/where"], "no"),
                                  (["--serve", "--site", "new"], "--serve"),
                                  (["page"], "page")):
            with self.subTest(arguments=arguments):
                done = subprocess.run([ROOT / "upswing", "--no-setup", "docs", *arguments],
                                      cwd=self.folder, stdin=subprocess.DEVNULL, check=False,
                                      stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                      encoding="utf-8")
                self.assert_one_line(done, 2, "docs: ", *words)
                self.assertEqual(done.stdout, "")


if __name__ == "__main__":
    unittest.main()
