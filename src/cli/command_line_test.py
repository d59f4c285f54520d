#!/usr/bin/env python3
"""Tests of the command line: help, numbers, `-` for standard streams, and error messages."""

import os
import re
import shutil
import signal
import subprocess
import unittest

from testing import ROOT, UPSWING, ProgramTest, small, train_once

COMMANDS = ("train", "eval", "simulate", "map", "plot", "info", "compare", "study", "export",
            "realaigym")
# Phrases of the command-line library that must not appear in our messages.
FOREIGN = ("not in range", "Could not convert", "is required", "required but received", "missing",
           "Value ", "RequiredError", "At Most", "The following argument")


class HelpTest(ProgramTest):
    def test_lines_are_within_100_columns(self):
        for command in ([], *([name] for name in COMMANDS)):
            for line in self.succeed(*command, "--help").splitlines():
                with self.subTest(command=command, line=line):
                    self.assertLessEqual(len(line), 100)

    def test_help_without_flags(self):
        self.assertEqual(self.succeed(), self.succeed("--help"))
        self.assertEqual(self.succeed("help"), self.succeed("--help"))
        for words in (["help", "eval"], ["--help", "eval"]):
            self.assertEqual(self.succeed(*words), self.succeed("eval", "--help"))
        self.refuse(["help", "evla"], 'got "evla"', "did you mean eval?")

    def test_examples_come_first_and_a_short_help_has_no_settings(self):
        full, short = self.succeed("train", "--help"), self.succeed("train", "-h")
        for text in (full, short):
            self.assertRegex(text, r"^Train .*\nUsage: .*\n\nExamples:\n(  .*\n)+\nOptions:\n")
            self.assertIn("\n  --out FOLDER ", text)
        self.assertIn("--gamma", full)
        self.assertIn("Named agents:", full)
        self.assertNotIn("Named agents:", short)
        self.assertNotIn("  --gamma", short.split("Options:")[1])
        self.assertTrue(short.endswith("\n--help also shows all settings.\n"))

    def test_own_flags_are_sorted(self):
        for command in ("train", "eval", "map", "view", "study", "grade", "run", "export", "machine identify"):
            for flag in ("--help", "-h"):
                with self.subTest(command=command, flag=flag):
                    text = self.succeed(*command.split(), flag).split("\nOptions:\n")[1].split("\n\n")[0]
                    flags = re.findall(r"(?m)^  (?:-h,)?(--[a-z-]+)", text)
                    self.assertGreater(len(flags), 4)
                    self.assertEqual(flags, ["--help", *sorted(flags[1:])])

    # The function of zsh is called as zsh's bashcompinit calls it.
    COMPLETIONS = {
        "bash": ("source <({0} completion bash); COMP_WORDS=({1} {2} '{3}'); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); "
                 "_upswing {1}; printf '%s\\n' \"${{COMPREPLY[@]}}\""),
        "zsh": ("autoload -U compinit; compinit -D; source <({0} completion zsh); emulate -L sh; "
                "setopt kshglob noshglob braceexpand; COMP_WORDS=({1} {2} '{3}'); "
                "COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _upswing {1}; printf '%s\\n' \"${{COMPREPLY[@]}}\""),
        "fish": "{0} completion fish | source; complete -C '{1} {2} {3}'"}

    def test_completion(self):
        words = (("upswing", "", "ev", {"eval"}),
                 (ROOT / "upswing", "", "tes", {"test"}),
                 ("upswing", "machine", "ad", {"adapt"}),
                 ("upswing", "eval", "--epis", {"--episodes", "--episodes-csv"}),
                 ("upswing", "machine adapt", "--th", {"--threads"}),
                 ("upswing", "eval lqr --physics", "", {"mujoco", "closed-form"}),
                 ("upswing", "train --agent", "sac", {"sac", "sac-fast"}),
                 ("upswing", "train", "--gam", {"--gamma"}),
                 ("upswing", "completion", "", {"bash", "zsh", "fish"}),
                 ("upswing", "eval", "d3qn-a", {"d3qn-adaptive"}),
                 ("upswing", "eval fast", "tv", {"tvlqr"}),
                 ("upswing", "eval", "mine", {"mine.toml", "mine-seed1"}),
                 ("upswing", "info", "", {"fast", "mpc", "mine-seed1"}),
                 ("upswing", "export", "", {"fast", "tvlqr", "mine-seed1"}),
                 ("upswing", "run", "en", {"energy"}),
                 ("upswing", "compare", "mine-", {"mine-seed1"}),
                 ("upswing", "eval fast --plant", "real", {"realaigym", "realaigym-c1", "realaigym-twin"}),
                 ("upswing", "eval fast --plant", "mine", {"mine.toml", "mine-seed1"}),
                 ("upswing", "eval fast --made-for", "realaigym-", {"realaigym-c1", "realaigym-twin"}),
                 ("upswing", "run fast --link", "realaigym-", {"realaigym-c1", "realaigym-twin"}),
                 ("upswing", "run fast --link", "ser", {"serial:"}),
                 ("upswing", "run fast --link", "ud", {"udp:"}),
                 ("upswing", "fake", "cloud", {"cloudpendulum"}),
                 ("upswing", "fake x.toml --link", "p", {"pty"}),
                 ("upswing", "machine identify --plant", "real", {"realaigym", "realaigym-c1", "realaigym-twin"}),
                 ("upswing", "run fast --robot", "", {"pendubot", "acrobot"}),
                 ("upswing", "eval hybrid --swing-up", "do", {"double-dqn"}),
                 ("upswing", "train --start-policy", "mine-", {"mine-seed1"}),
                 ("upswing", "train --config", "mine.", {"mine.toml"}),
                 ("upswing", "export fast --c", "--", set()),
                 ("upswing", "eval fast --episodes", "--", set()))
        self.write("mine.toml", "")
        (self.folder / "mine-seed1").mkdir()
        for shell, script in self.COMPLETIONS.items():
            if not shutil.which(shell):
                continue
            for program, before, word, expected in words:
                with self.subTest(shell=shell, words=f"{before} {word}"):
                    done = subprocess.run([shell, "-c", script.format(UPSWING, program, before, word)],
                                          check=True, capture_output=True, encoding="utf-8",
                                          cwd=self.folder, env=os.environ | {"PATH": f"{UPSWING.parent}:{os.environ['PATH']}"})
                    # zsh leaves the choice by prefix to its own code, and fish adds files.
                    found = {name.rstrip("/") for name in done.stdout.split() if name.startswith(word)}
                    self.assertEqual((found & expected if word == "" else found, done.stderr),
                                     (expected, ""))
        self.refuse(["completion", "ksh"], "expected bash, zsh or fish, got ksh")

    def help_of(self, flag, *arguments):
        """The help lines of a flag, joined into one."""
        text = self.succeed(*arguments, "--help")
        found = re.search(rf"(?m)^  {flag}\b.*\n(?: {{30}}.*\n)*", text)
        self.assertIsNotNone(found, flag)
        return " ".join(found[0].split())

    def test_defaults_come_from_the_agent_and_the_file(self):
        self.assertIn("default 256,256)", self.help_of("--hidden", "train"))
        self.assertIn("default 48,32)", self.help_of("--hidden", "train", "--agent", "fast"))
        self.assertIn("(default fast)", self.help_of("--agent", "train", "--agent", "fast"))
        self.assertIn("; default closed-form)", self.help_of("--physics", "train", "--agent=fast"))
        self.write("s.toml", '[train]\nagent = "dqn"\n[agent]\ngamma = 0.9\n')
        self.assertIn("(0 to 1; default 0.9)", self.help_of("--gamma", "train", "--config", "s.toml"))
        self.assertIn("(default false)", self.help_of("--double", "train", "--config", "s.toml"))
        self.refuse(["train", "--agent", "quick", "--help"], "got \"quick\"")

    def test_ranges_and_units(self):
        self.assertIn("[s] (0.001 to 1000000; default 4)",
                      self.help_of("--episode-seconds", "train"))
        self.assertIn("(1 to 1000000; default 100)", self.help_of("--episodes", "eval"))
        self.assertIn("(1 to 4096; default one per processor)", self.help_of("--jobs", "study"))
        self.assertRegex(self.help_of("--randomize", "train"), r"± this share.* \(0 to 0.99\)")
        self.assertIn("(0.001 to 100000)", self.help_of("--mass", "train"))

    def test_lines_end_only_where_the_width_asks_for_it(self):
        for command in COMMANDS:
            lines = self.succeed(command, "--help").split("\n\nOptions:")[1].splitlines()
            for line, after in zip(lines, lines[1:]):
                if not re.match(r" {30}\S", line) or not re.match(r" {30}\S", after):
                    continue
                with self.subTest(command=command, line=line, after=after):
                    self.assertGreater(len(line) + 1 + len(after.split()[0]), 100)

    def test_agents_are_described_to_the_end(self):
        text = " ".join(self.succeed("train", "--help").split())
        self.assertIn("with a memory: many plants, and few updates for each d3qn-small", text)


class NumberTest(ProgramTest):
    """All commands parse and refuse numbers in the same way."""

    def refuse_numbers(self, *cases):
        for arguments, message in cases:
            with self.subTest(arguments=arguments):
                done = self.run_here(*arguments)
                self.assert_one_line(done, 2, message)
                for words in FOREIGN:
                    self.assertNotIn(words, done.stderr)

    def test_wording(self):
        self.refuse_numbers(
            (["eval", "x", "--episodes", "many"],
             '--episodes: expected an integer in [1, 1000000], got "many"'),
            (["eval", "x", "--episodes", "2e6"],
             '--episodes: expected an integer in [1, 1000000], got "2e6"'),
            (["eval", "x", "--seed", "-1"],
             '--seed: expected an integer in [0, 9000000000000000], got "-1"'),
            (["map", "x", "--threads", "1.5"], '--threads: expected an integer in [0, 256]'),
            (["plot", "x", "--seconds", "nan"],
             '--seconds: expected a number in [0.1, 1000] s, got "nan"'),
            (["train", "--hidden", "64,x"],
             '--hidden: expected a list of integers in [1, 4096], got "64,x"'),
            (["train", "--seeds", "3", "--jobs", "0"],
             '--jobs: expected an integer in [1, 4096], got "0"'),
            (["train", "--seeds", ""], "--seeds: expected a number of seeds or a list"),
            (["study", "x", "--seeds", ""], "--seeds: expected a number of seeds or a list"))

    def test_missing_and_superfluous_arguments(self):
        self.refuse_numbers(
            (["evla"], 'got "evla" (did you mean eval?)'),
            (["evaluate"], 'got "evaluate" (did you mean eval?)'),
            (["tets"], 'got "tets" (did you mean test?)'),
            (["pyhton"], 'got "pyhton" (did you mean python?)'),
            (["demos"], 'got "demos" (did you mean demo?)'),
            (["doc", "--help"], 'expected a command, one of train, '),
            (["doc", "train"], 'got "doc"'),
            (["--help", "doc"], 'got "doc"'),
            (["--version", "x"], 'got "x"'),
            (["eval"], "eval: expected POLICY|RUN (policy.safetensors, run folders, shipped "
                       "policies or controllers (energy, hybrid, lqr, mpc, pfl, tvlqr)"),
            (["plot"], "plot: expected POLICY|RUN (policy.safetensors, a run folder, a shipped "
                       "policy such as sac, or a controller "
                       "(energy, hybrid, lqr, mpc, pfl, tvlqr)), got none"),
            (["compare"], "compare: expected RUN|FOLDER"),
            (["study"], "study: expected FILE.toml"),
            (["train", "--gamma"], "--gamma: expected a value, got none"),
            (["train", "--out", "a", "--out", "b"], "--out: expected a value, got several"),
            (["plot", "a", "b"], "expected no argument b"),
            (["eval", "a", "--json=3"], "--json: expected no value, got one"))

    def test_integers_may_have_an_exponent(self):
        self.succeed(*small(steps="4e1", eval_every="2e1", eval_episodes="1e0"))
        config = (self.folder / "run/config.toml").read_text(encoding="utf-8")
        self.assertIn("\nsteps = 40 ", config)
        self.assertIn("1 of 1", self.succeed("train", *small(steps=8, out=None)[1:],
                                             "--seeds", "1", "--jobs", "1e0"))

    def test_seconds_are_whole_control_periods(self):
        self.refuse(["simulate", "--seconds", "0.03"],
                    '--seconds: expected a multiple of 0.02, the control period, got "0.03"; '
                    "the nearest are 0.02 and 0.04")
        self.refuse(["train", "--episode-seconds", "0.05"], "the nearest are 0.04 and 0.06")
        self.assertEqual(len(self.succeed("simulate", "--seconds", "0.04").splitlines()), 1 + 3)

    def test_a_setting_in_no_section(self):
        self.write("s.toml", "steps = 100\n")
        self.refuse(["train", "--config", "s.toml"], "s.toml:1: steps: expected in section [train]")
        self.write("s.toml", "mass = 1\n")
        self.refuse(["train", "--config", "s.toml"], "s.toml:1: mass: expected in section [plant]")
        self.write("s.toml", "seeds = 1\nsteps = 100\n[variants.a]\n")
        self.refuse(["study", "s.toml"], "s.toml:2: steps: expected in [settings]")

    def test_names_of_an_axis(self):
        policy = train_once(type(self), steps=8, eval_episodes=1)
        for text in ("foo", "foo=0:1"):
            self.refuse(["map", policy, "--x", text], "--x", "mass1", "sensor_noise", "delay",
                        "q1", "w2", "damping")


class SettingsTest(ProgramTest):
    def test_print_config_is_a_file_for_config(self):
        text = self.succeed("train", "--agent", "fast", "--gamma", "0.98", "--print-config")
        self.assertRegex(text, r"(?m)^gamma = 0.98  # discount factor per control step \(0 to 1\)$")
        self.assertRegex(text, r"(?m)^hidden = \[48, 32\]  # ")
        self.assertRegex(text, r'(?m)^agent = "fast"  # ')
        self.assertEqual(list(self.folder.iterdir()), [])
        self.write("s.toml", text)
        self.assertEqual(self.succeed("train", "--config", "s.toml", "--print-config"), text)
        # --print-config prints the same text that a run writes.
        changes = {"agent": "fast", "steps": 8}
        printed = self.succeed(*small(**changes), "--print-config")
        self.succeed(*small(**changes))
        self.assertEqual((self.folder / "run/config.toml").read_text(encoding="utf-8"), printed)
        self.assertEqual(self.succeed("train", "--resume", "run", "--print-config"), printed)

    def test_settings_that_cannot_learn_are_refused(self):
        self.refuse(small(batch=128, replay=100, learning_starts=50),
                    "batch: expected at most 100 transitions", "(replay)", "got 128")
        self.refuse(small(replay=1), "batch: expected at most 1 transitions", "(replay)")
        self.refuse(small(replay=200, learning_starts=201), "--learning-starts: expected at most 200",
                    "(replay)", "got 201")
        self.write("s.toml", "[agent]\nreplay = 100\n")
        self.refuse(["train", "--config", "s.toml"], "s.toml: batch: expected at most")

    def test_settings_that_hardly_learn_are_warned_of(self):
        for changes, words in (({"learning_starts": 5000}, "learning_starts is 5,000"),
                               ({"updates_per_step": 0}, "updates_per_step is 0"),
                               ({"learning_rate": 0, "learning_rate_end": 0}, "learning_rate and learning_rate_end are 0"),
                               ({"tau": 0}, "tau is 0"),
                               ({name + "_weight": 0 for name in ("energy", "height", "balance",
                                                                  "velocity", "torque")},
                                "every reward weight is 0")):
            with self.subTest(changes=changes):
                out = f"run{len(list(self.folder.iterdir()))}"
                settings = {"steps": 400, "learning_starts": 200, "eval_episodes": 1} | changes
                self.assertIn("  Warning: " + words, self.succeed(*small(**settings, out=out)))
        self.assertNotIn("Warning", self.succeed(*small(steps=400, out="good")))
        self.assertNotIn("Warning", self.succeed(*small(steps=400, out="copied", tau=0,
                                                        target_period=10)))
        # A run with 32 environments ends at step 416.
        rounded = {"envs": 32, "steps": 400, "learning_starts": 400, "eval_episodes": 1}
        self.assertNotIn("Warning", self.succeed(*small(**rounded, out="rounded")))
        none = rounded | {"learning_starts": 416}
        self.assertIn("has only 416 steps: the agent learns nothing", self.succeed(*small(**none, out="none")))

    @unittest.skipIf("UPSWING_SANITIZED" in os.environ, "a sanitizer reserves the address space")
    def test_a_network_that_does_not_fit_into_memory_leaves_nothing(self):
        script = 'ulimit -v 4000000; exec "$@"'
        command = [UPSWING, *small(hidden=",".join(["4096"] * 8))]
        done = subprocess.run(["sh", "-c", script, "sh", *command], cwd=self.folder, check=False,
                              capture_output=True, encoding="utf-8")
        self.assert_one_line(done, 2, "expected at most ", "memory", ", got 6.",
                             "--hidden")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_solved_run_says_so_and_how_to_go_on(self):
        self.succeed(*small())
        output = self.succeed("train", "--resume", "run")
        self.assertIn("Nothing to do: the run has all 4,000 steps", output)
        self.assertIn("./upswing train --resume run --steps 8000", output)


class StreamTest(ProgramTest):
    def test_dash_is_standard_output(self):
        csv = self.succeed("simulate", "--seconds", "0.1")
        self.assertEqual(self.succeed("simulate", "--seconds", "0.1", "--csv", "-"), csv)
        self.succeed("simulate", "--seconds", "0.1", "--csv", "out.csv")
        self.assertEqual((self.folder / "out.csv").read_text(encoding="utf-8"), csv)
        (self.folder / "out.csv").unlink()
        self.assertEqual(list(self.folder.iterdir()), [])

    def feed(self, text, *arguments):
        return subprocess.run([UPSWING, *map(str, arguments)], cwd=self.folder, check=False,
                              input=text, capture_output=True, encoding="utf-8")

    def test_dash_is_standard_input(self):
        done = self.feed('\ufeff"torque"\n1\n2\n', "simulate", "--torque", "-")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        rows = done.stdout.splitlines()
        torque = rows[0].split(",").index("torque")
        self.assertEqual([row.split(",")[torque] for row in rows[1:]], ["1", "2", "0"])
        self.assert_one_line(self.feed("t\n1\n", "simulate", "--torque", "-"), 2,
                             'standard input:1: expected a column "torque", got "t"')
        settings = "[agent]\ngamma = 0.5\n"
        done = self.feed(settings, "train", "--config", "-", "--print-config")
        self.assertIn("\ngamma = 0.5 ", done.stdout)
        self.assert_one_line(self.feed("[agent]\ngama = 1\n", "train", "--config", "-"), 2,
                             "standard input:2:")

    def test_a_reader_that_has_seen_enough_ends_it_quietly(self):
        policy = train_once(type(self), steps=8, eval_episodes=1)
        for arguments in (["simulate", "--seconds", 200], ["train", "--help"],
                          ["export", policy, "--c", "-"], ["train", "--print-config"],
                          ["info", policy]):
            with self.subTest(arguments=arguments):
                read_end, write_end = os.pipe()
                os.close(read_end)
                done = subprocess.run([UPSWING, *map(str, arguments)], cwd=self.folder, check=False,
                                      stdout=write_end, stderr=subprocess.PIPE, encoding="utf-8")
                os.close(write_end)
                self.assertEqual((done.returncode, done.stderr), (-signal.SIGPIPE, ""))

    def test_a_training_goes_on_without_a_reader(self):
        # More lines than any buffer holds.
        settings = small(eval_every=8, eval_episodes=1, steps=2000, out="unread")
        read_end, write_end = os.pipe()
        os.close(read_end)
        done = subprocess.run([UPSWING, *settings], cwd=self.folder, check=False, stdout=write_end,
                              stderr=subprocess.PIPE, encoding="utf-8")
        os.close(write_end)
        self.assertEqual((done.returncode, done.stderr), (-signal.SIGPIPE, ""))
        self.assertIn("finished at step 2000",
                      (self.folder / "unread/log.txt").read_text(encoding="utf-8"))

    def test_a_table_replaces_an_older_table_only(self):
        commands = (["simulate", "fast", "--seconds", 0.1, "--csv"],
                    ["eval", "fast", "--episodes", 1, "--physics", "closed-form", "--episodes-csv"],
                    ["eval", "fast", "sac", "--episodes", 1, "--physics", "closed-form", "--episodes-csv"])
        for number, command in enumerate(commands):
            self.write("mine.txt", "mine")
            self.refuse([*command, "mine.txt"], "mine.txt: expected a new file or an older table")
            self.assertEqual((self.folder / "mine.txt").read_text(encoding="utf-8"), "mine")
            for _ in range(2):
                self.succeed(*command, f"table-{number}.csv")

    def test_a_file_that_eval_could_not_write_is_refused_before_it_evaluates(self):
        self.write("file", "")
        for path in ("nodir/x.csv", "file/x.csv", "/proc/x.csv"):
            with self.subTest(path=path):
                self.refuse(["eval", "mpc", "--episodes", 1000000, "--episodes-csv", path], "--episodes-csv", path)


class LauncherTest(ProgramTest):
    """Tests of ./upswing in a folder that only looks like the repository: nothing is installed or
    built."""

    def setUp(self):
        super().setUp()
        (self.folder / "upswing").write_bytes((ROOT / "upswing").read_bytes())
        (self.folder / "upswing").chmod(0o755)
        (self.folder / "tools").symlink_to(ROOT / "tools")
        # A copy: another user may not read the folder of the repository.
        (self.folder / "src/cli").mkdir(parents=True)
        shutil.copy(ROOT / "src/cli/commands.tsv", self.folder / "src/cli")
        program = self.folder / "build/release/bin/upswing"
        program.parent.mkdir(parents=True)
        program.write_text('#!/bin/sh\necho "ran: $*"\n')
        program.chmod(0o755)
        (self.folder / "build/release/build.ninja").touch()

    def launch(self, *arguments, **more):
        return subprocess.run([self.folder / "upswing", *arguments], check=False,
                              capture_output=True, encoding="utf-8", **more)

    def test_a_fresh_clone_tells_its_version_without_a_build(self):
        (self.folder / "build/release/bin/upswing").unlink()
        shutil.copy(ROOT / "CMakeLists.txt", self.folder)
        done = self.launch("--version")
        self.assertEqual((done.returncode, done.stdout, done.stderr),
                         (0, self.succeed("--version"), ""))

    def test_an_unknown_command_is_refused_before_anything_is_built(self):
        self.assertEqual(self.launch("trian").stdout, "ran: trian\n")  # the program suggests one
        (self.folder / "build/release/bin/upswing").unlink()
        done = self.launch("tr\x1bian", "--agent", "fast")
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("upswing: expected a command, one of train, eval, ", done.stderr)
        self.assertTrue(done.stderr.endswith('; got "trian" (did you mean train?)\n'), done.stderr)
        for word, meant in (("Tranin", "train"), ("evl", "eval"), ("rnu", "run"), ("machin", "machine"),
                            ("fak", "fake"), ("comapre", "compare")):
            self.assert_one_line(self.launch(word), 2, f'; got "{word}" (did you mean {meant}?)')
        for word in ("launch", "zzz", "7", "x" * 10000):
            done = self.launch(word)
            self.assert_one_line(done, 2, f'; got "{word}"')
            self.assertNotIn("did you mean", done.stderr)

    def stub(self, name, script):
        """Puts a program first on the PATH of self.stubbed()."""
        path = self.folder / "stubs" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)

    def stubbed(self, *arguments):
        """Launches with the programs of stub()."""
        path = f"{self.folder / 'stubs'}:{os.environ['PATH']}"
        return self.launch(*arguments, env=os.environ | {"PATH": path})

    def make_build(self, place, *folders):
        """Build folders as CMake and Python make them in the repository `place`."""
        for folder in folders:
            path = self.folder / folder
            path.mkdir(parents=True, exist_ok=True)
            if "venv" in folder:
                (path / "pyvenv.cfg").write_text(f"command = /usr/bin/python3 -m venv {place}/{folder}\n")
            else:
                (path / "CMakeCache.txt").write_text(f"CMAKE_CACHEFILE_DIR:INTERNAL={place}/{folder}\n")

    def test_builds_of_another_folder_are_made_again(self):
        here = self.folder.resolve()
        program = self.folder / "build/release/bin/upswing"
        # All packages are installed; CMake makes a program, and Ninja then has nothing to do.
        self.stub("dpkg-query", "for name; do printf '/%s:all=installed/' \"$name\"; done")
        self.stub("ninja", "echo 'ninja: no work to do.'")
        self.stub("cmake", f"mkdir -p {program.parent} && touch build/release/build.ninja && "
                           f"echo '#!/bin/sh\necho new' >{program} && chmod +x {program}")
        made = ("build/release", "build/debug", "build/pip/cp312", "build/python-venv", "build/package/venv")
        kept = self.folder / "build/deps/mujoco/lib"
        kept.mkdir(parents=True)
        with self.subTest("built here, also seen through a link"):
            (self.folder / "link").symlink_to(self.folder)
            for place in (here, here / "link"):
                self.make_build(place, *made)
                done = self.stubbed("info")
                self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "ran: info\n", ""), done)
        for place in ("/no/such/place", f"{here}/other", f"/old{here}"):
            with self.subTest(place=place):
                self.make_build(place, *made)
                program.write_text("#!/bin/sh\necho old\n")
                done = self.stubbed("info")
                self.assertEqual((done.returncode, done.stdout), (0, "new\n"), done)
                lines = [line for line in done.stderr.splitlines() if "another folder" in line]
                self.assertEqual(len(lines), 1, done.stderr)
                for word in (place, *made):
                    self.assertIn(word, lines[0])
                self.assertEqual([name for name in made[1:] if (self.folder / name).exists()], [])
                self.assertTrue(kept.exists())
                self.assertEqual(self.stubbed("info").stderr, "")

    def test_no_setup_in_the_wrong_place_or_misspelt(self):
        for words in (["info", "--no-setup"], ["info", "--nosetup"], ["test", "-R", "x",
                                                                      "--no-setup"]):
            with self.subTest(words=words):
                self.assert_one_line(self.launch(*words), 2,
                                     f"expected before the command: ./upswing --no-setup {words[0]}")
        self.assert_one_line(self.launch("--nosetup", "info"), 2, "unknown flag --nosetup",
                             "expected --no-setup or a command")
        self.assertEqual(self.launch("--no-setup", "info", "x").stdout, "ran: info x\n")
        self.assertEqual(self.launch("--no-setup", "--no-setup", "info").stdout, "ran: info\n")
        self.assert_one_line(self.launch("--no-setup", "run", "lqr"), 1, "upswing-machine is not built",
                             "./upswing run --help once without --no-setup")

    def test_its_help_lists_the_commands_of_the_program(self):
        def commands(text, title):
            return re.findall(r"(?m)^  (\w+) +(\S.*)$", text.split(f"{title}:\n")[1].split("\n\n")[0])

        listed = commands(self.launch("--no-setup", "help").stdout, "Commands")
        self.assertEqual(listed, commands(self.succeed("--help"), "Subcommands"))
        self.assertIn(("realaigym", "Score policies and logs by the rules of RealAIGym"), listed)
        self.assertEqual(self.launch("--no-setup", "help", "info").stdout, "ran: info --help\n")

    def test_words_that_ctest_would_ignore(self):
        for words in (["--cluster", "foo"], ["foo"], ["--preset", "debug", "foo"]):
            with self.subTest(words=words):
                self.assert_one_line(self.launch("--no-setup", "test", *words), 2,
                                     "expected flags of ctest, such as -R dqn, got foo")
        for word in ("--cluster", "--windows", "--benchmarks"):
            self.assert_one_line(self.launch("--no-setup", "test", "--preset=debug", word), 2,
                                 f"expected {word}")

    def test_flags_that_ctest_would_ignore(self):
        for words in (["--foo"], ["-R", "dqn", "--foo"], ["--preset", "debug", "--foo=3"], ["-Rx", "--foo"],
                      ["--cluster", "--foo"]):
            with self.subTest(words=words):
                self.assert_one_line(self.launch("--no-setup", "test", *words), 2, "test: unknown flag -",
                                     "expected --preset, --cluster, --windows, --benchmarks or flags of ctest")
        # Flags of ctest pass this check and reach the next one: nothing is built here.
        for words in ("-R dqn", "-R --foo", "-LE slow -j4 -V", "-j 4 --parallel 2 -I 1,3", "--tests-regex=dqn",
                      "-N", "--show-only=json-v1", "--no-tests=ignore", "--timeout 5 -E -x", "-FA x -U",
                      "--repeat until-fail:2 --stop-on-failure --rerun-failed --output-on-failure"):
            with self.subTest(words=words):
                self.assert_one_line(self.launch("--no-setup", "test", *words.split()), 1, "are not built")

    def test_benchmarks_that_are_not_built(self):
        self.assert_one_line(self.launch("--no-setup", "test", "--benchmarks"), 1,
                             "run ./upswing test --benchmarks without --no-setup")

    def test_tests_that_are_not_built(self):
        done = self.launch("--no-setup", "test", "-R", "rl.Dqn")
        self.assert_one_line(done, 1, "the tests in build/release are not built (only the program",
                             "without --no-setup")

    @unittest.skipIf(os.geteuid() != 0, "only root can become somebody else")
    def test_a_second_user_runs_the_built_program(self):
        os.chmod(self.folder, 0o755)
        nobody = {"user": 65534, "group": 65534, "extra_groups": []}
        done = self.launch("info", "x", **nobody)
        self.assertEqual((done.returncode, done.stdout), (0, "ran: info x\n"), done)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn("may not write to", done.stderr)
        (self.folder / "build/release/bin/upswing").unlink()
        done = self.launch("info", "x", **nobody)
        self.assertEqual(done.returncode, 1)
        self.assertIn("the program upswing is not built", done.stderr)
        (self.folder / "build/release/bin/base_test").write_text("")
        (self.folder / "build/release/bin/base_test").chmod(0o755)
        done = self.launch("test", **nobody)
        self.assertEqual(done.returncode, 1)
        self.assertIn("tests write to", done.stderr)


if __name__ == "__main__":
    unittest.main()
