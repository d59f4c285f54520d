#!/usr/bin/env python3
"""Tests of the process: exit codes after lost output, signals at any moment, no /proc."""

import os
import signal
import subprocess
import unittest
from pathlib import Path

from testing import UPSWING, ProgramTest, small

TINY = {"steps": 400, "hidden": 8, "head": 8, "eval_episodes": 2, "eval_every": 200,
        "log_every": 200, "learning_starts": 50, "threads": None, "out": "run"}
# Redirections with which standard error cannot be written.
NO_STDERR = ("2>/dev/full", "2>&-")
NO_OUTPUT = (">/dev/full", ">&-", ">/dev/full 2>&1", ">&- 2>&-", "<&- >&- 2>&-")


class OutputTest(ProgramTest):
    def shell(self, redirection, *arguments):
        """Exit code of the program with a shell redirection."""
        return subprocess.run(["sh", "-c", f'"$@" {redirection}', "sh", UPSWING,
                               *map(str, arguments)], cwd=self.folder, check=False,
                              stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL).returncode

    def test_an_error_keeps_its_exit_code(self):
        for redirection in NO_STDERR + NO_OUTPUT:
            for arguments, code in ((["trian"], 2), (["train", "--gamma", "2"], 2),
                                    (["eval", "nothing"], 2), (["--gama"], 2),
                                    (["simulate", "--start", "0,0,1e9,-1e9"], 1),
                                    (["simulate", "--csv", "/dev/full"], 1)):
                with self.subTest(redirection=redirection, arguments=arguments):
                    self.assertEqual(self.shell(redirection, *arguments), code)

    def test_success_without_a_place_for_errors(self):
        for redirection in NO_STDERR:
            self.assertEqual(self.shell(redirection, "info"), 0)

    def test_output_that_is_lost_is_a_failure(self):
        for redirection in NO_OUTPUT:
            for arguments in (["info"], ["simulate"], ["--help"], ["train", "--help"],
                              ["train", "--print-config"]):
                with self.subTest(redirection=redirection, arguments=arguments):
                    self.assertEqual(self.shell(redirection, *arguments), 1)
        done = subprocess.run(["sh", "-c", 'exec "$@" >/dev/full', "sh", UPSWING, "train",
                               "--print-config"], check=False, capture_output=True,
                              encoding="utf-8")
        self.assertIn("cannot write the output: No space left", done.stderr)

    def test_training_goes_on_without_a_place_for_its_output(self):
        # More lines than a buffer holds.
        many = TINY | {"steps": 4000, "eval_every": 40, "eval_episodes": 1,
                       "stop_when_solved": False, "eval_physics": "closed-form"}
        self.succeed(*small(**many | {"out": "usual"}))
        for i, redirection in enumerate(NO_OUTPUT):
            with self.subTest(redirection=redirection):
                self.assertEqual(self.shell(redirection, *small(**many | {"out": f"run{i}"})), 1)
                self.assert_same_run(f"run{i}", "usual")
        seeds = [*small(**TINY | {"out": "many"}), "--seeds", 2]
        self.assertEqual(self.shell(">/dev/full", *seeds), 1)
        self.assertTrue((self.folder / "many/seed2/policy.safetensors").exists())


class SignalTest(ProgramTest):
    def waiting(self):
        """A program that waits for the end of its input."""
        process = subprocess.Popen([UPSWING, "simulate", "--torque", "-"], cwd=self.folder,
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, encoding="utf-8")
        self.addCleanup(process.stdin.close)
        self.addCleanup(self.end, process)
        # More than a pipe holds: afterwards the program reads.
        process.stdin.write("torque\n1\n" + "# comment\n" * 20_000)
        process.stdin.flush()
        return process

    def test_usr1_and_usr2_do_not_end_a_program_that_has_hardly_begun(self):
        process = self.waiting()
        for number in (signal.SIGUSR1, signal.SIGUSR2) * 3:
            process.send_signal(number)
        process.stdin.close()
        self.assertIn("torque", process.stdout.readline())
        process.stdout.read()
        self.assertEqual(process.wait(), 0)
        process = self.start(*small(**TINY | {"out": "run"}))
        process.send_signal(signal.SIGUSR2)
        output = process.stdout.read()
        self.assertEqual(process.wait(), 0, output)

    def test_a_stop_before_anything_is_begun_ends_the_program(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            process = self.waiting()
            process.send_signal(number)
            process.stdout.read()
            self.assertEqual(process.wait(), -number)


@unittest.skipIf("UPSWING_SANITIZED" in os.environ, "a sanitizer's own start complains of it")
class NoProcTest(ProgramTest):
    def test_many_runs_start_themselves_without_proc(self):
        script = 'mount -t tmpfs tmpfs /proc || exit 99\n"$@"'
        done = subprocess.run(["unshare", "--mount", "--map-root-user", "sh", "-c", script, "sh",
                               UPSWING, *small(**TINY), "--seeds", "2"], cwd=self.folder,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8",
                              check=False)
        if done.returncode == 99 or "unshare:" in done.stderr:
            self.skipTest("mounting is not permitted here: " + done.stderr.strip())
        self.assertEqual((done.returncode, done.stderr), (0, ""), done)
        self.assertTrue((self.folder / "run/seed2/policy.safetensors").exists())


class InputTest(ProgramTest):
    """Every system error about the input gives exit code 2."""

    def setUp(self):
        super().setUp()
        (self.folder / "loop").symlink_to("loop")
        self.write("file", "mine")

    def test_paths_that_cannot_be(self):
        for arguments in (["train", "--resume", "loop"], ["eval", "loop"], ["info", "loop"],
                          ["compare", "loop"], ["train", "--config", "loop"], ["study", "loop"],
                          ["simulate", "--torque", "loop"],
                          ["simulate", "--csv", "loop"], ["simulate", "--csv", "none/x.csv"],
                          ["simulate", "--csv", "file/x.csv"], ["simulate", "--csv", "."],
                          ["export", "loop", "--page", "p"],
                          ["eval", "file/x"], ["info", "file/x"], ["compare", "file/x"],
                          ["map", "loop"], ["plot", "loop"],
                          ["train", "--resume", "file/x"], ["simulate", "--torque", "file/x"],
                          ["eval", "x" * 300], ["train", "--resume", "x" * 300],
                          ["simulate", "--csv", "x" * 300]):
            with self.subTest(arguments=arguments):
                self.refuse(arguments)
        for out in ("loop", "loop/x", "file", "file/x", "file/deep/x", "x" * 300, "/proc/x",
                    "/proc/1/deep/x"):
            with self.subTest(out=out):
                self.refuse(small(**TINY | {"out": out}), out)
                self.refuse([*small(**TINY | {"out": out}), "--seeds", "2"], out)

    def test_a_folder_that_cannot_be_read(self):
        closed = self.folder / "closed"
        closed.mkdir()
        closed.chmod(0)
        self.addCleanup(closed.chmod, 0o755)
        if os.geteuid() == 0:
            # Run as another user, who may still reach the given files.
            user = {"user": 65534, "group": 65534, "extra_groups": []}
            for path in (self.folder, *Path(UPSWING).resolve().parents):
                if not path.stat().st_mode & 0o001:
                    if path != self.folder:
                        self.skipTest(f"nobody else may enter {path}")
                    path.chmod(0o755)
        else:
            user = {}
        for arguments in (["compare", "closed"], ["eval", "closed"], ["info", "closed"],
                          ["train", "--resume", "closed"], ["eval", "closed/x"],
                          ["simulate", "--csv", "closed/x.csv"], ["compare", "."],
                          small(**TINY | {"out": "closed"}), small(**TINY | {"out": "closed/x"})):
            with self.subTest(arguments=arguments):
                done = self.run_here(*arguments, **user)
                self.assert_one_line(done, 2, "closed" if arguments[1] != "." else ".")
        (self.folder / "open").mkdir()
        (self.folder / "open").chmod(0o777)
        kept = self.folder / self.write("open/kept.csv", "mine")
        kept.chmod(0o444)
        done = self.run_here("simulate", "--seconds", "1", "--csv", "open/kept.csv", **user)
        self.assert_one_line(done, 2, "open/kept.csv: expected a file that can be written: ",
                             "Permission denied")
        self.assertEqual(kept.read_text("utf-8"), "mine")

    def test_a_page_of_something_else(self):
        self.succeed(*small(**TINY))
        (self.folder / "page").mkdir()
        for text in ("", "nonsense", "[]", "3", '{"agents": {}}', '{"agents": 5}',
                     '{"agents": null}', '{"agents": {"a": {"id": "b"}}}', '{"agents": [5]}',
                     '{"agents": [{}]}', '{"agents": [{"id": 5}]}'):
            with self.subTest(text=text):
                self.write("page/agents.json", text)
                self.refuse(["export", "run", "--page", "page"], "page/agents.json")
        (self.folder / "page/agents.json").unlink()
        (self.folder / "page/agents.json").mkdir()
        self.refuse(["export", "run", "--page", "page"], "page/agents.json")
        for page in ("loop", "loop/x", "file", "file/x"):
            with self.subTest(page=page):
                self.refuse(["export", "run", "--page", page], page)


if __name__ == "__main__":
    unittest.main()
