#!/usr/bin/env python3
"""Tests of bad input: one clear error line, exit code 2 (usage or input) or 1 (failed), and no data
is lost."""

import gzip
import math
import os
import shutil
import subprocess
import unittest

from testing import (PATIENCE, ROOT, UPSWING, ProgramTest, SmallRunTest, limits, small, snapshot,
                     train_once)

# If one of these is wrongly accepted, the test stays short.
TRAIN = ["train", "--steps", "8", "--eval-episodes", "1", "--out", "run"]


class CommandLineTest(ProgramTest):
    def test_value_for_a_flag_that_takes_none(self):
        for flag in ("--double=maybe", "--no-double=maybe", "--json=3"):
            with self.subTest(flag=flag):
                command = "eval" if flag.startswith("--json") else "train"
                self.refuse([command, "x", flag] if command == "eval" else [command, flag],
                            flag.split("=")[0].replace("--no-", ""))

    def test_empty_path(self):
        for command in (["train", "--resume", ""], ["train", "--out", ""], ["train", "--config", ""],
                        ["eval", ""], ["info", ""], ["compare", ""], ["simulate", "--torque", ""],
                        ["simulate", "--csv", ""]):
            with self.subTest(command=command):
                self.refuse(command, "empty")

    def test_unknown_flag(self):
        self.refuse(["train", "--gama", "0.9"], "--gama", "did you mean --gamma?")
        self.refuse(["train", "--gama=0.9"], "--gama", "did you mean --gamma?")
        self.refuse(["eval", "x", "--episode", "3"], "--episode", "did you mean --episodes?")
        self.refuse(["simulate", "--secs", "3"], "--secs")
        for words in (["--set", "mass2=1.1"], ["--set=mass2=1.1"]):
            self.refuse(["train", *words],
                        "unknown flag --set: expected a flag for each setting, such as --mass2 1.1")

    def test_unknown_subcommand(self):
        self.refuse(["trian"], "trian", "did you mean train?")

    def test_too_much_or_too_little(self):
        self.refuse(["eval"], "policies")
        self.refuse(["info", "a", "b"], "b")
        self.refuse(["train", "--gamma"], "--gamma")
        self.refuse(["train", "something"], "something")

    def test_unknown_agent(self):
        self.refuse([*TRAIN, "--agent", "d3qm"], "d3qm", "did you mean d3qn?", "double-dqn")

    def test_value_of_the_wrong_type(self):
        for flag, value, expected in (("--gamma", "high", "a number"),
                                      ("--physics", "half", "one of mujoco, closed-form"),
                                      ("--batch", "1.5", "an integer"),
                                      ("--seed", "", "an integer"),
                                      ("--eval-every", "1O0", "an integer"),
                                      ("--hidden", "64,x", "a list of integers"),
                                      ("--hidden", "64,,64", "a list of integers"),
                                      ("--learning-rate", "nan", "a number"),
                                      ("--tau", "inf", "a number"), ("--mass", "1kg", "a number")):
            with self.subTest(flag=flag, value=value):
                self.refuse([*TRAIN, flag, value], flag, "expected " + expected, f'got "{value}"')

    def test_value_out_of_range(self):
        for flag, value, allowed in (("--gamma", "1.01", "[0, 1]"), ("--mass2", "0", "[0.001, 100000]"),
                                     ("--mass", "-1", "[0.001, 100000]"), ("--envs", "0", "[1, 4096]"),
                                     ("--hidden", "5000", "[1, 4096]"),
                                     ("--threads", "-1", "[0, 256]"),
                                     ("--seed", "99999999999999999999", "an integer"),
                                     ("--length1", "1e3", "[0.01, 100]"),
                                     ("--randomize-mass1", "1", "[0, 0.99]"),
                                     ("--randomize-gravity", "-0.1", "[0, 0.99]"),
                                     ("--sensor-noise", "-1", "[0, 10]"),
                                     ("--delay", "1.02", "[0, 1]")):
            with self.subTest(flag=flag, value=value):
                self.refuse([*TRAIN, flag, value], f" {flag}: expected", allowed,
                            f'got "{value}"')

    def test_boxes_and_disturbances_of_an_evaluation(self):
        for flag, value in (("--randomize", "1"), ("--randomize-mass", "-0.25"),
                            ("--randomize-delay", "2"), ("--sensor-noise", "nan"),
                            ("--delay", "20ms")):
            with self.subTest(flag=flag, value=value):
                self.refuse(["eval", self.write("policy", ""), flag, value], f" {flag}: expected",
                            f'got "{value}"')

    def test_delay_that_is_no_whole_number_of_control_periods(self):
        for flag in ("--delay", "--randomize-delay"):
            for value, nearest in (("0.001", "0 and 0.02"), ("0.99", "0.98 and 1"),
                                   ("0.70001", "0.7 and 0.72")):
                with self.subTest(flag=flag, value=value):
                    words = [f" {flag}: expected a multiple of 0.02", f'got "{value}"',
                             f"the nearest are {nearest}"]
                    self.refuse([*TRAIN, flag, value], *words)
                    self.refuse(["eval", "lqr", flag, value], *words)

    def test_physics(self):
        for engine in ("mujco", "", "MuJoCo"):
            with self.subTest(engine=engine):
                words = ["--physics", "expected one of mujoco, closed-form", f'got "{engine}"']
                self.refuse([*TRAIN, "--physics", engine], *words)
                self.refuse(["eval", "run", "--physics", engine], *words)

    def test_settings_of_another_algorithm(self):
        for flags, words in (
                (["--alpha", "0.1"], ["--alpha: expected a setting of dqn, the algorithm of agent d3qn, got alpha, a setting "
                                       "of sac"]),
                (["--agent", "sac", "--epsilon-start", "1"],
                 ["--epsilon-start: expected a setting of sac, the algorithm of agent sac", "of dqn"]),
                (["--agent", "ppo", "--n-step", "1"], ["expected a setting of ppo", "got n_step, a setting of dqn and sac"]),
                (["--algorithm", "sac"], ["--algorithm: expected dqn, the algorithm of agent d3qn, got sac"]),
                (["--algorithm", "sac", "--double-q"],
                 ["unknown flag --double-q; expected a setting of sac", "got double, a setting of dqn"]),
                (["--agent", "sac", "--double-q"],
                 ["unknown flag --double-q; expected a setting of sac", "got double, a setting of dqn"]),
                (["--agent", "sac", "--alhpa", "1"], ["--alhpa (did you mean --alpha?)"]),
                (["--alhpa", "1"], ["--alhpa; expected a setting of dqn", "agent d3qn, got alpha, a setting of sac"]),
                (["--algorithm", "sarsa"], ["--algorithm", "dqn, sac, ppo", "sarsa"]),
                (["--agent", "sac", "--target-entropy", "1"], ["--target-entropy", "0.69"]),
                (["--agent", "ppo", "--batch", "300"], ["batch", "256 or 512", "300"]),
                (["--agent", "ppo", "--initial-std", "3"], ["--initial-std", "max_std (1)", "3"]),
                (["--agent", "ppo", "--levels", "5"], ["levels", "continuous", "5"])):
            with self.subTest(flags=flags):
                self.refuse(["train", *flags], *words)

    def test_contradictions_name_the_flag_that_caused_them(self):
        posterior = "expected rows with different values of a machine"
        self.write("wide.toml", "[agent]\nbatch = 300\n")
        self.write("reward.toml", '[reward]\nreward = "E + w3"\n')
        for flags, start in (
                (["--agent", "ppo", "--batch", "300"], " --batch: expected a size"),
                (["--agent", "ppo", "--config", "wide.toml"], " wide.toml: batch: expected a size"),
                (["--config", "wide.toml", "--agent", "ppo", "--batch", "200"], " --batch: expected a size"),
                (["--reward", "E + w3"], " --reward: term1: expected a known name"),
                (["--config", "reward.toml"], " reward.toml: reward: term1: expected a known name"),
                (["--environment", "x"], " --environment: expected a JSON object"),
                (["--randomize-posterior"], " --randomize-posterior: expected --plant"),
                (["--posterior", "foo 1"], f" --posterior: {posterior}"),
                (["--posterior", "mass1 -1"], " --posterior: expected a positive matrix")):
            with self.subTest(flags=flags):
                self.refuse([*TRAIN, *flags], f"upswing:{start}")
        for flags, start in ((["--randomize-posterior"], " --randomize-posterior: expected --plant"),
                             (["--posterior", "foo 1"], f" --posterior: {posterior}")):
            for command in ("eval", "simulate", "plot"):
                with self.subTest(command=command, flags=flags):
                    self.refuse([command, "fast", *flags], f"upswing:{start}")
        self.refuse(["export", "fast", "--c", "x.h", "--prefix", "3x"], " --prefix: expected a lower-case")

    def test_no_layers(self):
        self.refuse([*TRAIN, "--hidden", "[]"], "expected", "--hidden")

    def test_eval_values(self):
        for flag, value in (("--episodes", "0"), ("--episodes", "many"), ("--episodes", "1.5"),
                            ("--seed", "-1"), ("--threads", "257")):
            with self.subTest(flag=flag, value=value):
                self.refuse(["eval", "run", flag, value], flag, value)

    def test_set(self):
        for change, words in (("mss2=1", ["mss2", "did you mean mass2?"]),
                              ("gravty=1", ["gravty", "did you mean gravity?"]),
                              ("gamma=1", ["gamma"]), ("mass2", ["NAME=VALUE", "mass2"]),
                              ("mass2=", ["mass2", "expected a number"]),
                              ("mass2=heavy", ["mass2", "expected a number", "heavy"]),
                              ("damping=-1", ["damping", "[0, 1000000]"])):
            with self.subTest(change=change):
                self.refuse(["simulate", "--set", change], "--set", *words)

    def test_start(self):
        for start in ("0,0,0", "0,0,0,0,0", "a,b,c,d", "nan,0,0,0", "0,0,0,inf", "0;0;0;0"):
            with self.subTest(start=start):
                self.refuse(["simulate", "--start", start], "--start", "q1,q2,w1,w2", f'"{start}"')
        self.refuse(["simulate", "--start", ""], "--start", "q1,q2,w1,w2", "an empty text")

    def test_seconds(self):
        for seconds in ("-1", "1e9", "nan", "long"):
            with self.subTest(seconds=seconds):
                self.refuse(["simulate", "--seconds", seconds], "--seconds")

    def test_resume_with_out_or_config(self):
        self.refuse(["train", "--resume", "a", "--out", "b"], "--resume", "--out")
        self.refuse(["train", "--resume", "a", "--config", "b"], "--resume", "--config")


class TomlTest(ProgramTest):
    def refuse_toml(self, text, *words):
        self.write("s.toml", text)
        self.refuse([*TRAIN, "--config", "s.toml"], *words)

    def test_unknown_key(self):
        self.refuse_toml("[agent]\ngamma = 0.9\ngama = 0.9\n", "s.toml:3:", "gama",
                         "did you mean gamma?")

    def test_key_in_another_section(self):
        self.refuse_toml("[train]\n\ngamma = 0.9\n", "s.toml:3:", "gamma", "[agent]", "[train]")

    def test_unknown_section(self):
        self.refuse_toml("[train]\nseed = 1\n[agnet]\ngamma = 0.9\n", "s.toml:3:", "agnet",
                         "did you mean agent?")
        self.refuse_toml("gamma = 0.9\n", "s.toml:1:", "gamma")

    def test_unknown_agent(self):
        self.refuse_toml('[train]\nseed = 3\nagent = "d3qm"\n', "s.toml:3:", "d3qm",
                         "did you mean d3qn?")

    def test_wrong_type(self):
        for line, expected in (('gamma = "0.9"', "a number"), ("gamma = true", "a number"),
                               ("double = 1", "true or false"),
                               ("double = \"yes\"", "true or false"),
                               ("n_step = 2.5", "an integer"), ("gamma = [1]", "a number"),
                               ("gamma = nan", "a number"), ("gamma = 1979-05-27", "a number"),
                               ("gamma = {}", "a number")):
            with self.subTest(line=line):
                self.refuse_toml(f"# settings\n[agent]\n{line}\n", "s.toml:3:", line.split()[0],
                                 "expected " + expected)
        for line in ("hidden = \"64\"", "hidden = [64, \"a\"]", "hidden = [[64]]"):
            with self.subTest(line=line):
                self.refuse_toml(f"[network]\n{line}\n", "s.toml:2:", "hidden",
                                 "expected a list of integers")
        self.refuse_toml("[train]\nagent = 3\n", "s.toml:2:", "agent", "expected an agent", '"3"')

    def test_out_of_range(self):
        self.refuse_toml("[agent]\ngamma = 0.9\ntau = 2\n", "s.toml:3:", "tau", "[0, 1]", "2")
        self.refuse_toml("[plant]\nmass = -1\n", "s.toml:2:", "mass", "[0.001, 100000]", "-1")
        self.refuse_toml("[network]\nhidden = [64, 0]\n", "s.toml:2:", "hidden", "[1, 4096]")

    def test_physics(self):
        self.refuse_toml('[task]\n\nphysics = "bullet"\n', "s.toml:3:", "physics",
                         "expected one of mujoco, closed-form", 'got "bullet"')

    def test_syntax_error(self):
        for text in ("[agent]\ngamma = = 3\n", "[agent]\ngamma\n", "[agent]\ngamma = 0.9 tau = 1\n",
                     "[agent]\ngamma = \"0.9\n", "[train]\nseed = 1\n[train]\n" ):
            with self.subTest(text=text):
                self.refuse_toml(text, f"s.toml:{2 if 'agent' in text else 3}:")

    def test_missing_file_or_folder_in_its_place(self):
        self.refuse(["train", "--config", "none.toml"], "none.toml", "No such file")
        (self.folder / "d").mkdir()
        self.refuse(["train", "--config", "d"], "d", "expected a file")

    def test_binary_file(self):
        (self.folder / "s.toml").write_bytes(bytes(range(256)))
        self.refuse(["train", "--config", "s.toml"], "s.toml:1:")


class OutputFileTest(SmallRunTest):
    def test_no_output_replaces_a_policy(self):
        """Nor another file of a run that an argument names by its folder."""
        before = snapshot(self.folder)
        shipped = ROOT / "web/public/agents/fast.safetensors"
        for words, flag, path in (
                (["export", "run"], "--c", "run/policy.safetensors"),
                (["export", "run/"], "--onnx", "run/policy.safetensors"),
                (["eval", "run"], "--episodes-csv", "./run/policy.safetensors"),
                (["eval", "mpc", "run"], "--episodes-csv", "run/checkpoint.safetensors"),
                (["eval", "hybrid", "--swing-up", "run"], "--episodes-csv", "run/config.toml"),
                (["simulate", "run"], "--csv", "run/metrics.csv"),
                (["view", "run"], "--record", "run/log.txt"),
                (["demo", "run"], "--file", "run/policy.safetensors"),
                (["run", "run", "--link", "twin.toml"], "--log", "run/evals.csv"),
                (["run", "mpc", "--link", "run/config.toml"], "--log", "run/config.toml"),
                (["plot", "run"], "--out", "run/policy.safetensors"),
                (["eval", "fast"], "--episodes-csv", shipped),
                (["eval", "hybrid", "--swing-up", "fast"], "--episodes-csv", shipped)):
            with self.subTest(words=words):
                self.refuse([*words, flag, path], f" {flag}: expected another file than ", "which would be lost")
        for words in (["plot", "run"], ["map", "run"], ["grade", "run"], ["compare", "run"]):
            with self.subTest(words=words):
                self.refuse([*words, "--out", "run"], "expected a new")
        self.assertEqual(snapshot(self.folder), before)

    def test_a_table_of_an_evaluation_may_be_in_the_run_folder(self):
        for _ in range(2):  # the second one replaces the first one
            self.succeed("eval", "run", "--episodes", 2, "--episodes-csv", "run/mine.csv")


class PolicyNameTest(SmallRunTest):
    def test_a_folder_of_runs(self):
        for place in ("runs/a", "runs/study/b/seed1"):
            shutil.copytree(self.made, self.folder / place)
        for command in (["eval", "runs"], ["export", "runs", "--onnx", "x"]):
            self.refuse(command, "runs: expected a run with a policy.safetensors, got a folder of runs, such as runs/a")
        self.refuse(["eval", "runs/study"], "got a folder of runs, such as runs/study/b/seed1")
        (self.folder / "empty").mkdir()
        self.refuse(["eval", "empty"], "got another folder")

    def test_controllers_are_offered_only_where_they_are_taken(self):
        self.refuse(["eval", "nosuch"], "a shipped policy or a controller (any-pose, ", "tvlqr)")
        self.refuse(["eval", "hybrid", "--swing-up", "nosuch"],
                    "a run folder or a shipped policy (any-pose, ", " sac)\n")
        self.refuse(["export", "nosuch", "--page", "page"], "a run folder or a shipped policy (any-pose, ", " sac)\n")


class TorqueFileTest(SmallRunTest):
    def refuse_torques(self, text, *words):
        self.write("torques.csv", text)
        self.refuse(["simulate", "--torque", "torques.csv"], "torques.csv", *words)

    def test_missing_file(self):
        self.refuse(["simulate", "--torque", "none.csv"], "none.csv", "No such file")

    def test_missing_column(self):
        self.refuse_torques("t,torqe\n0,1\n", "torques.csv:1:", 'expected a column "torque", got "torqe" in "t,torqe"')
        self.refuse_torques("# first\n0,1\n", "torques.csv:2:", '"torque"')

    def test_rows_of_another_length(self):
        self.refuse_torques("t,torque\n0,1\n0.02\n", "torques.csv:3:", "expected 2 columns, got 1")
        self.refuse_torques("torque\n1,2\n", "torques.csv:2:", "expected 1 columns, got 2")

    def test_not_a_finite_number(self):
        for text in ("high", "nan", "NaN", "inf", "-inf", "", "1e999", "1,5", "0x10", "--1"):
            with self.subTest(text=text):
                self.refuse_torques(f"t,torque,x\n0,1,2\n# c\n0.02,{text},2\n", "torques.csv:4:")

    def test_no_rows(self):
        self.refuse_torques("", "expected", "torque")
        self.refuse_torques("torque\n", "expected", "got none")

    def test_too_many_rows(self):
        self.refuse_torques("torque\n" + "0\n" * 1_000_001,
                            "expected at most 1000000 rows of torques, got 1000001")

    def test_shorter_than_the_seconds(self):
        self.write("torques.csv", "torque\n" + "1\n" * 50)
        self.refuse(["simulate", "--torque", "torques.csv", "--seconds", "1.02"], "--seconds",
                    "1.02", "torques.csv")
        self.succeed("simulate", "--torque", "torques.csv", "--seconds", "1")

    def test_policy_with_a_schedule(self):
        self.write("torques.csv", "torque\n1\n")
        self.refuse(["simulate", "run", "--torque", "torques.csv"], "policy", "--torque")


class UntrustedFileTest(ProgramTest):
    """Files from strangers get one line, and take little time and memory."""

    # Commands and the place of the file, marked as FILE.
    READERS = (["study", "FILE"], [*TRAIN, "--config", "FILE"], [*TRAIN, "--plant", "FILE"],
               ["simulate", "--torque", "FILE"], ["simulate", "--plant", "FILE"],
               ["eval", "FILE"], ["eval", "lqr", "--made-for", "FILE"],
               ["info", "FILE"], ["machine", "check", "FILE"],
               ["machine", "check", "log.csv", "--columns", "FILE"],
               ["machine", "validate", "FILE", "log.csv"], ["run", "lqr", "--link", "FILE"],
               ["fake", "FILE", "--link", "pty"])
    OF_TOML = [command for command in READERS
               if set(command) & {"study", "--config", "--plant", "--columns", "validate", "--link"}]

    def refuse_in_all(self, file, readers, *words):
        for command in readers:
            command = [file if word == "FILE" else word for word in command]
            with self.subTest(command=command):
                done = self.run_here(*command, preexec_fn=limits, timeout=PATIENCE)
                self.assert_one_line(done, 2, *words)

    def test_a_path_that_is_no_file(self):
        os.mkfifo(self.folder / "pipe")
        (self.folder / "folder").mkdir()
        with open(self.folder / "sparse", "wb") as file:
            file.truncate(1 << 30)
        self.refuse_in_all("pipe", self.READERS, "pipe")
        self.refuse_in_all("/dev/zero", self.READERS, "/dev/zero")
        self.refuse_in_all("sparse", self.READERS, "sparse: ")
        self.refuse_in_all("folder", [command for command in self.READERS
                                      if command[0] not in ("eval", "info", "study")], "folder")

    def test_deep_toml(self):
        for text in ("[plant]\n" + "a." * 31000 + "a = 1", "[" + "a." * 31000 + "a]",
                     "a = " + "[" * 31000, "a = " + "{a.b=[\n" * 15000):
            self.refuse_in_all(self.write("deep.toml", text), self.OF_TOML,
                               "deep.toml:", "at most 16 levels")
        self.refuse_in_all(self.write("large.toml", "a" * 8_000_000 + " = 1"), self.OF_TOML,
                           "large.toml: expected ", "at most 1048576 bytes, got 8000004")

    def test_a_deep_list_of_agents(self):
        policy = train_once(type(self), steps=8, eval_episodes=1)
        (self.folder / "page").mkdir()
        self.write("page/agents.json", '{"agents": ' + "[" * 500_000 + "]" * 500_000 + "}")
        self.refuse(["export", "--page", "page", policy], "page/agents.json", "at most 8 levels deep",
                    preexec_fn=limits)

    def test_a_log_that_expands(self):
        names = b"time,pos_meas1,pos_meas2"
        for name, text in (("cells", names + b"," * (1 << 26)), ("lines", names + b"\n" * (1 << 26)),
                           ("rows", names + b"\n0,0,0" * (1 << 23))):
            (self.folder / "log.csv.gz").write_bytes(gzip.compress(text))
            (self.folder / "log.csv").write_bytes(text[:1 << 25])
            with self.subTest(name=name):
                self.refuse(["machine", "check", "log.csv.gz"], "bytes after decompression, got more",
                            preexec_fn=limits)
                done = self.run_here("machine", "check", "log.csv", preexec_fn=limits)
                self.assertIn(done.returncode, (1, 2))
                self.assertNotIn("out of memory", done.stderr)

    def test_a_forged_name_of_a_column(self):
        self.write("log.csv", "time,pos_meas1,pos_meas2\n" +
                   "".join(f"{k / 500},{math.sin(k / 100)},0\n" for k in range(2000)))
        self.write("twin.toml", 'name = "a,\\u001b[2J\\nb"\n[plant]\nmass1 = 1\n')
        done = self.run_here("machine", "validate", "twin.toml", "log.csv", "--csv", "motion.csv")
        self.assertEqual((done.returncode, done.stderr), (1, ""))  # no twin explains this motion
        names = (self.folder / "motion.csv").read_text(encoding="utf-8").splitlines()[0]
        self.assertEqual(names.split(",", 4)[4], '"a,\\x1b[2J\\nb 1","a,\\x1b[2J\\nb 2"')

    def test_covariance_of_an_alias(self):
        self.write("twin.toml", "[plant]\nmass1 = 1\n[covariance]\ndamping = [1e-6]\n")
        for command in (["run", "lqr", "--link", "twin.toml", "--draw"], ["simulate", "--plant", "twin.toml"],
                        ["fake", "twin.toml", "--link", "pty", "--draw"]):
            with self.subTest(command=command):
                self.refuse(command, "twin.toml:4: [covariance]: expected the name of one number",
                            'got "damping" (did you mean damping1?)')


class RunFolderTest(SmallRunTest):
    def test_existing_run_is_never_overwritten(self):
        self.refuse(small(), "run: expected a new or empty folder", "--resume run",
                    "--out")
        self.refuse(["train", "--config", "run/config.toml", "--out", "run"],
                    "run: expected a new or empty folder")

    def test_file_in_the_place_of_the_folder(self):
        self.write("taken", "mine")
        self.refuse(small(out="taken"), "taken: expected a new or empty folder, got a file")

    def test_unwritable_place(self):
        self.write("file", "mine")
        for out in ("file/run", "/proc/run", "/proc/1/deep/run"):
            with self.subTest(out=out):
                self.refuse(small(out=out), out)

    def test_a_pipe_that_no_program_reads(self):
        os.mkfifo(self.folder / "pipe")
        for command in (["simulate", "--csv", "pipe"], ["export", "sac", "--c", "pipe"],
                        ["eval", "sac", "--episodes", 1, "--episodes-csv", "pipe"]):
            self.refuse(command, "got a pipe that no program reads", timeout=PATIENCE)

    def test_a_link_to_nothing(self):
        (self.folder / "link.gif").symlink_to("nothing")
        self.refuse(["view", "sac", "--record", "link.gif"], "it is a link to nothing")

    def test_nul_in_a_file(self):
        self.write("nul.toml", 'gamma = "a\\u0000b"\n[agent]\n')
        self.refuse(["train", "--config", "nul.toml"], "nul.toml:1: gamma: ")
        self.write("nul.toml", '[agent]\ngamma = "a\\u0000b"\n')
        self.refuse(["train", "--config", "nul.toml"], 'got the text "a\\x00b"')

    def test_tables_of_another_type(self):
        for text in ("[[plant]]\n", "plant = 1\n"):
            self.write("p.toml", text)
            for command in ([*TRAIN, "--config", "p.toml"], ["eval", "lqr", "--plant", "p.toml"],
                            ["info", "lqr", "--made-for", "p.toml"]):
                self.refuse(command, "p.toml:1: expected a table [plant], got another type")

    def test_settings_outside_their_section(self):
        for text in ('agent = "fast"', "mass1 = 2"):
            self.write("p.toml", text)
            name, section = text.split()[0], "train" if "agent" in text else "plant"
            self.refuse([*TRAIN, "--config", "p.toml"],
                        f"p.toml:1: {name}: expected in section [{section}], got outside any section")

    def test_unwritable_csv(self):
        self.write("file", "mine")
        for csv in ("file/out.csv", "/proc/out.csv", "none/out.csv", "run"):
            with self.subTest(csv=csv):
                self.refuse(["simulate", "--seconds", "1", "--csv", csv], csv)

    def test_output_that_cannot_be_written(self):
        for command in (["simulate"], ["simulate", "--seconds", "1"],
                        ["eval", "run", "--episodes", "1", "--json"],
                        ["eval", "run", "--episodes", "1"], ["info", "run"]):
            with self.subTest(command=command), open("/dev/full", "w", encoding="utf-8") as full:
                done = self.run_here(*command, stdout=full)
                self.assert_one_line(done, 1, "No space left on device")

    def test_training_does_not_need_its_output(self):
        with open("/dev/full", "w", encoding="utf-8") as full:
            subprocess.run([UPSWING, *small(out="new")], cwd=self.folder, stdout=full,
                           stderr=subprocess.DEVNULL, check=False)
        self.succeed(*small(out="other"))
        self.assert_same_run("new", "other")


if __name__ == "__main__":
    unittest.main()
