#!/usr/bin/env python3
"""Tests of study workers: any number, on any hosts, killed at any moment; reduced runs; bad
folders."""

import json
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import time
import unittest

from testing import PATIENCE, ROOT, UPSWING, ProgramTest, snapshot

STUDY = """title = "Little"
seeds = 4
[settings]
agent = "d3qn-small"
hidden = [8]
head = 8
steps = 400
eval_every = 200
eval_episodes = 2
log_every = 200
learning_starts = 50
[variants.one]
[variants.two]
gamma = 0.9
"""
ENDLESS = STUDY.replace("steps = 400", "steps = 1000000000")
# UPSWING_TEST_SEEDS makes the test longer: 500 seeds are 1,000 runs.
SEEDS = int(os.environ.get("UPSWING_TEST_SEEDS", 20))
WORKERS = 4 if SEEDS <= 20 else 8


def without_clocks(done):
    """A finished run's result, without values that depend on the clock or the machine."""
    result = json.loads(done.read_text(encoding="utf-8"))
    for name in ("busy", "seconds", "solved_seconds"):
        result.pop(name)
    rows = [line.split(",") for line in result.pop("evaluations").splitlines()]
    clock = rows[0].index("seconds")
    return result, [row[:clock] + row[clock + 1:] for row in rows]


class WorkersTest(ProgramTest):
    def prepare(self, text=STUDY, out="study", *more):
        self.write("little.toml", text)
        self.succeed("study", "little.toml", "--out", out, "--prepare", *more)
        return self.folder / out

    def work(self, out="study", code=0, **options):
        done = self.run_here("study", "--work", out, **options)
        self.assertEqual(done.returncode, code, done.stderr)
        return done

    def start_worker(self, **env):
        worker = subprocess.Popen([os.environ["UPSWING"], "study", "--work", "study"],
                                  cwd=self.folder, env=os.environ | env)
        self.addCleanup(worker.wait)
        self.addCleanup(worker.kill)
        return worker

    def runs(self, out):
        return [f"{out}/{variant}/seed{seed}" for seed in range(1, 5) for variant in ("one", "two")]

    def assert_same_study(self, a, b, seeds=range(1, 5)):
        for variant in ("one", "two"):
            for seed in seeds:
                done = [self.folder / out / variant / f"seed{seed}.done" for out in (a, b)]
                self.assertEqual(*map(without_clocks, done))

    # ---- Workers.

    def test_a_worker_does_all_that_a_plan_says(self):
        study = self.prepare()
        self.assertEqual({path.name for path in study.iterdir()},
                         {"study.toml", "plan.json", "one", "two"})
        self.work()
        self.succeed("study", "little.toml", "--out", "whole")
        self.assert_same_study("study", "whole")
        for a, b in zip(self.runs("study"), self.runs("whole")):
            self.assert_same_run(a, b)
        self.assertFalse(list(study.rglob("*.claim*")))
        before = snapshot(study)
        self.work()
        self.assertEqual(snapshot(study), before)
        # The study command has nothing left to train, and compares.
        self.assertIn("8 already done, resuming 0",
                      self.succeed("study", "little.toml", "--out", "study"))

    def test_workers_that_are_killed_lose_no_run_and_change_no_bit(self):
        text = STUDY.replace("seeds = 4", f"seeds = {SEEDS}").replace("400", "1000")
        study = self.prepare(text, "study", "--keep", "tables")
        rng = random.Random(1)
        workers, kills = [], 0
        deadline = time.monotonic() + PATIENCE + 20 * SEEDS
        while sum(len(list((study / name).glob("*.done"))) for name in ("one", "two")) < 2 * SEEDS:
            self.assertLess(time.monotonic(), deadline)
            workers = [worker for worker in workers if worker.poll() is None]
            while len(workers) < WORKERS:
                workers.append(self.start_worker())
            time.sleep(0.05 * rng.random())
            if kills < SEEDS:
                rng.choice(workers).kill()
                kills += 1
        for worker in workers:
            self.assertIn(worker.wait(PATIENCE), (0, -signal.SIGKILL))
        self.work()  # a worker may have died before it removed its claim
        self.assertFalse(list(study.rglob("*.claim")) + list(study.rglob("*.failed")))
        self.succeed("study", "little.toml", "--out", "whole", "--keep", "tables")
        self.assert_same_study("study", "whole", range(1, SEEDS + 1))

    def test_claims_that_no_process_holds_block_nothing(self):
        study = self.prepare()
        for name in ("one/seed1.claim", "two/seed2.claim"):  # as 0.5.0 left them
            self.write(f"study/{name}", "elsewhere/0123abcd 17 trains it\n")
        status = self.succeed("study", "little.toml", "--out", "study", "--status")
        self.assertRegex(status, r"one +0 +0 +0 +0 +0 +4\n")
        self.assertNotIn("claimed", status)
        self.work()
        self.assertEqual(len(list(study.rglob("*.done"))), 8)
        self.assertFalse(list(study.rglob("*.claim")))

    def test_a_run_of_a_killed_worker_is_resumed_at_once(self):
        study = self.prepare(ENDLESS)
        log = study / "one/seed1/log.txt"

        def begun():
            return log.read_text(encoding="utf-8").count(" at step ") if log.exists() else 0
        worker = self.start_worker()
        self.wait_for(lambda: begun() == 1)
        worker.kill()
        worker.wait()
        status = self.succeed("study", "study", "--status")
        self.assertRegex(status, r"one +0 +0 +0 +0 +1 +3\n")
        other = self.start_worker()
        self.wait_for(lambda: begun() == 2)
        other.terminate()
        self.assertEqual(other.wait(PATIENCE), 75)

    def test_a_stopped_worker_leaves_its_run_to_be_resumed(self):
        study = self.prepare(ENDLESS)
        for number in (signal.SIGTERM, signal.SIGINT):
            with self.subTest(signal=number):
                worker = self.start_worker()
                log = study / "one/seed1/log.txt"
                before = log.read_text(encoding="utf-8").count("\n") if log.exists() else 0
                self.wait_for(lambda: log.exists() and
                              log.read_text(encoding="utf-8").count("\n") > before)
                worker.send_signal(number)
                self.assertEqual(worker.wait(PATIENCE), 75)
                self.assertFalse(list(study.rglob("*.claim")))
                self.assertIn("stopped at step", log.read_text(encoding="utf-8"))
        self.assertIn("resumed at step", (study / "one/seed1/log.txt").read_text(encoding="utf-8"))

    def test_a_slurm_task_queues_itself_again_before_its_time_limit_only(self):
        """Without Slurm; `cluster_test.py` runs with one."""
        study = self.prepare(ENDLESS)
        queued = self.folder / "queued"
        scontrol = self.folder / "scontrol"
        scontrol.write_text(f'#!/bin/sh\necho "$@" >>{queued}\n', encoding="utf-8")
        scontrol.chmod(0o755)
        env = os.environ | {"PATH": f"{self.folder}:{os.environ['PATH']}",
                            "SLURM_ARRAY_JOB_ID": "7", "SLURM_ARRAY_TASK_ID": "3"}
        command = ["sh", ROOT / "examples/slurm.sh", UPSWING, "study", "--work", "study"]
        for number, text in ((signal.SIGTERM, ""), (signal.SIGUSR2, "requeue 7_3\n")):
            with self.subTest(signal=number):
                task = subprocess.Popen(command, cwd=self.folder, env=env)
                self.addCleanup(task.kill)
                self.wait_for(lambda: list(study.rglob("*.claim")))
                task.send_signal(number)
                self.assertEqual(task.wait(PATIENCE), 75)
                self.assertFalse(list(study.rglob("*.claim")))
                self.assertEqual(queued.read_text("utf-8") if queued.exists() else "", text)
        done = subprocess.run([*command[:-1], "none"], cwd=self.folder, env=env, check=False,
                              stderr=subprocess.DEVNULL)
        self.assertEqual(done.returncode, 2)

    def test_a_failed_run_waits_until_the_study_is_started_again(self):
        study = self.prepare()
        (study / "one/seed2").mkdir()
        self.write("study/one/seed2/precious", "mine")
        self.work(code=1)
        failed = study / "one/seed2.failed"
        self.assertIn("expected a new or empty folder", failed.read_text(encoding="utf-8"))
        self.assertEqual(len(list(study.rglob("*.done"))), 7)
        self.work()  # no runs are left
        status = self.succeed("study", "little.toml", "--out", "study", "--status")
        self.assertRegex(status, r"one/seed2 +failed: .*expected a new or empty folder")
        (study / "one/seed2/precious").unlink()
        self.prepare()
        self.assertFalse(failed.exists())
        self.work()
        self.assertEqual(len(list(study.rglob("*.done"))), 8)

    def test_a_run_at_its_end_that_does_not_say_so_is_finished_by_the_study(self):
        study = self.prepare(STUDY, "study", "--keep", "tables")
        self.work()
        self.prepare(STUDY, "all", "--keep", "all")
        self.work("all")
        shutil.copytree(self.folder / "all/one/seed1", study / "one/seed1")
        (study / "one/seed1.done").unlink()  # as if the worker had been killed in between
        self.succeed("study", "little.toml", "--out", "study")  # still keeps only the tables
        self.assertTrue((study / "one/seed1.done").exists())
        self.assertFalse((study / "one/seed1").exists())
        self.assert_same_study("study", "all")

    def test_a_worker_that_dies_is_replaced_and_a_run_that_kills_twice_fails(self):
        self.write("little.toml", ENDLESS)
        process = self.start("study", "little.toml", "--out", "study", "--seeds", "1-1", "--jobs", 1)
        log = self.folder / "study/one/seed1/log.txt"

        def kill_worker(number):
            self.wait_for(lambda: log.exists() and len(re.findall("at step", log.read_text("utf-8")))
                          == number)
            children = f"/proc/{process.pid}/task/{process.pid}/children"
            with open(children, encoding="ascii") as file:
                os.kill(int(file.read().split()[0]), signal.SIGKILL)
        kill_worker(1)
        kill_worker(2)
        failed = self.folder / "study/one/seed1.failed"
        self.wait_for(failed.exists)
        self.assertEqual(failed.read_text(encoding="utf-8"), "ended by signal 9\n")
        self.assertEqual(self.end(process, signal.SIGINT)[0], 130)

    def test_a_halted_worker_keeps_its_claim(self):
        study = self.prepare(ENDLESS)
        worker = self.start_worker()
        self.wait_for((study / "one/seed1/log.txt").exists)
        worker.send_signal(signal.SIGSTOP)
        other = self.start_worker()
        self.wait_for((study / "two/seed1/log.txt").exists)
        status = self.succeed("study", "study", "--status")
        self.assertRegex(status, r"one +0 +0 +1 +0 +0 +3\n")
        self.assertRegex(status, rf"one/seed1 .* claimed by {socket.gethostname()} {worker.pid}\n")
        (study / "one/seed1.claim").unlink()  # its run is still taken
        third = self.start_worker()
        self.wait_for((study / "one/seed2/log.txt").exists)
        self.assertFalse(list(study.rglob("*.failed")))
        worker.send_signal(signal.SIGCONT)
        for process in (worker, other, third):
            process.terminate()
            self.assertEqual(process.wait(PATIENCE), 75)
        self.assertFalse(list(study.rglob("*.failed")))

    def test_odd_things_in_place_of_files(self):
        study = self.prepare()
        (study / "one/seed1.claim").mkdir()
        (study / "one/seed2.failed").mkdir()
        self.write("study/one/seed2.failed/precious", "mine")
        (one, *_) = json.loads(self.succeed("study", "study", "--status", "--json"))["variants"]
        self.assertEqual((one["variant"], one["failed"]), ("one", 1))
        self.work(code=1)
        self.assertEqual(len(list(study.rglob("*.done"))), 6)
        again = ["study", "little.toml", "--out", "study"]
        self.assertIn("seed2.failed", self.run_here(*again).stderr)
        shutil.rmtree(study / "one/seed2.failed")
        self.assertIn("cannot write study/one/seed1.claim: Is a directory",
                      self.run_here(*again).stderr)
        self.assertEqual(len(list(study.rglob("*.done"))), 7)
        self.refuse(["study", "study", "--status", "--keep", "all"], "--status: expected no --keep")

    # ---- Kept files.

    def test_reduced_studies_say_the_same(self):
        self.write("little.toml", STUDY.replace("seeds = 4", 'seeds = 4\nkeep = "policy"'))
        self.succeed("study", "little.toml", "--out", "policy")
        self.succeed("study", "little.toml", "--out", "tables", "--keep", "tables")
        self.succeed("study", "little.toml", "--out", "all", "--keep", "all")
        for out in ("policy", "tables"):
            self.assert_same_study(out, "all")
        kept = {path.name for path in (self.folder / "policy/one/seed1").iterdir()}
        self.assertEqual(kept, {"config.toml", "evals.csv", "log.txt", "policy.safetensors"})
        self.assertEqual({path.name for path in (self.folder / "tables/one").iterdir()},
                         {"settings.toml", *(f"seed{seed}.done" for seed in range(1, 5))})
        self.succeed("eval", "policy/one/seed1", "--episodes", 2)
        seen = {out: self.succeed("compare", out, "--json") for out in ("all", "policy", "tables")}
        clock = re.compile(r'"[a-z_]*seconds[a-z_]*": (\{[^}]*\}|[^,\n]*)|"(run|path)": "[^"]*"|'
                           r'(all|policy|tables)/')
        for out in ("policy", "tables"):
            self.assertEqual(clock.sub("", seen[out]), clock.sub("", seen["all"]))
        rows = (self.folder / "tables/evaluations.csv").read_text(encoding="utf-8").splitlines()
        self.assertTrue(rows[0].startswith("variant,seed,step,success_rate,"))
        self.assertEqual(len(rows), 1 + 8 * 2)
        # With more steps, runs that were not kept are trained again.
        longer = STUDY.replace("= 400", "= 800")
        self.write("little.toml", longer)
        for out in ("tables", "all"):
            self.succeed("study", "little.toml", "--out", out, "--keep", out)
        self.assert_same_study("tables", "all")

    # ---- Bad input.

    def test_folders_of_strangers(self):
        study = self.prepare()
        plan = json.loads((study / "plan.json").read_text(encoding="utf-8"))
        for changes, words in (({"version": "0.0.1"}, "got one of 0.0.1"),
                               ({"keep": "none"}, "keep: expected all, policy or tables"),
                               ({"seeds": "1-9999999"}, "1 to 10000 seeds"),
                               ({"seeds": 3}, "seeds"),
                               ({"variants": [{"name": "../x", "settings": "0"}]}, "letters"),
                               ({"variants": [{"name": "one", "settings": "0"}]}, "one/settings.toml: expected the settings of plan.json"),
                               ({"variants": [3]}, "variants: expected a list of objects")):
            with self.subTest(changes=changes):
                self.write("study/plan.json", json.dumps(plan | changes))
                self.refuse(["study", "--work", "study"], words)
        self.write("study/plan.json", "{")
        self.refuse(["study", "--work", "study"], "study/plan.json")
        self.refuse(["study", "--work", "none"],
                    "none: expected the folder of a study, got no such folder")
        self.refuse(["study", "none.toml", "--status"], "none.toml: no such file or folder; expected a study's file or folder")
        self.refuse(["study", "none.toml"], "cannot read none.toml: No such file")
        self.refuse(["study", "--work", "study", "--jobs", "2"], "--work: expected no --jobs")
        self.refuse(["study", "--work", "study", "x.toml"], "--work: expected no FILE.toml")
        self.refuse(["study", "--work", ""], "--work: expected a path")
        self.refuse(["study", "x.toml", "--keep", "none"], "x.toml")
        self.refuse(["study", "little.toml", "--keep", "none"], "--keep: expected all, policy")

    def test_settings_that_are_no_file_are_not_waited_for(self):
        study = self.prepare(STUDY, "study", "--keep", "tables")
        self.work()
        commands = [["study", "--work", "study"], ["study", "study", "--status"],
                    ["compare", "study"]]
        settings = study / "one/settings.toml"
        whole = settings.read_text(encoding="utf-8")

        def refuse_all(why):
            for command in commands:
                with self.subTest(command=command, why=why):
                    done = self.run_here(*command, timeout=PATIENCE)
                    self.assertIn("one/settings.toml: " + why, done.stdout + done.stderr)
            settings.unlink()

        settings.unlink()
        os.mkfifo(settings)
        refuse_all("expected a file, got a pipe or a device")
        settings.symlink_to("/dev/zero")
        refuse_all("expected a file, got a pipe or a device")
        settings.touch()
        os.truncate(settings, 1 << 40)
        refuse_all("expected at most 67108864 bytes")

    def test_texts_of_a_result_split_no_row_of_a_table(self):
        study = self.prepare()
        self.work()
        done = study / "one/seed1.done"
        result = json.loads(done.read_text(encoding="utf-8"))
        texts = {name: ["a\nb\r\u2028\x1b[2J"] for name in ("hosts", "processors", "vectors")}
        done.write_text(json.dumps(result | texts), encoding="utf-8")
        self.succeed("compare", "study", "--out", "compared")
        rows = (self.folder / "compared/runs.csv").read_text(encoding="utf-8").splitlines()
        self.assertEqual(len(rows), 1 + 8)
        self.assertEqual(rows[1].split(",")[-3:], [r"a\nb\r\u2028\x1b[2J"] * 3)

    def test_broken_results(self):
        study = self.prepare()
        self.write("study/one/seed1.done", "{")
        self.work(code=1)
        self.assertIn("seed1.done", (study / "one/seed1.failed").read_text(encoding="utf-8"))
        self.prepare()
        self.work("study", 1)
        done = study / "two/seed1.done"
        result = json.loads(done.read_text(encoding="utf-8"))
        self.write("study/two/seed1.done", json.dumps(result | {"settings": "0"}))
        self.work(code=1)
        self.assertIn("expected the settings of ", (study / "two/seed1.failed").read_text("utf-8"))
        target = self.write("elsewhere.done", "{}")
        (study / "one/seed1.done").unlink()
        (study / "one/seed1.done").symlink_to(target)
        self.prepare()
        self.work(code=1)
        self.assertEqual((self.folder / "elsewhere.done").read_text(encoding="utf-8"), "{}")


if __name__ == "__main__":
    unittest.main()
