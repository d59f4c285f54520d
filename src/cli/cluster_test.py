#!/usr/bin/env python3
"""Tests of `upswing study --slurm` on a Slurm of two nodes: a study leaves the same files as on one
machine, whatever happens to the tasks."""

import os
import re
import signal
import sys
import unittest
from pathlib import Path

from testing import ROOT, ProgramTest, without_seconds

sys.path.insert(0, str(ROOT / "tools"))
from slurm_cluster import NODES, Cluster, enter_namespaces, problem  # noqa: E402

STUDY = """title = "Little"
seeds = SEEDS
[settings]
agent = "fast"
steps = STEPS
stop_when_solved = false
[settings.train]
checkpoint_every = 10000
[variants.with]
[variants.but]
gamma = 0.98
"""
VARIANTS = ("with", "but")


class ClusterTest(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.cluster = cls.enterClassContext(Cluster())

    def setUp(self):
        super().setUp()
        self.cluster.wait_for_nodes()
        self.addCleanup(self.cluster.cancel_all)

    def write_study(self, seeds, steps):
        self.seeds = range(1, seeds + 1)
        self.write("little.toml", STUDY.replace("SEEDS", str(seeds)).replace("STEPS", str(steps)))

    def follow(self, tasks, options="--partition=low"):
        """Starts `study --slurm`. Returns the process, the array's number, and the line with the
        number."""
        process = self.start("study", "little.toml", "--slurm", options, "--tasks", tasks)
        for line in process.stdout:
            if found := re.search(r"ob array (\d+)", line):
                return process, found[1], line
        return self.fail("nothing was queued: " + str(process.wait()))

    def assert_as_on_one_machine(self):
        (self.folder / "alone").mkdir()
        self.succeed("study", "../little.toml", cwd=self.folder / "alone")
        for variant in VARIANTS:
            for seed in self.seeds:
                run = f"runs/little/{variant}/seed{seed}"
                self.assert_same_run(run, f"alone/{run}")
        for name in ("summary.csv", "runs.csv", "evaluations.csv"):
            table = f"runs/little/{name}"
            self.assertEqual(without_times(self.folder / table),
                             without_times(self.folder / "alone" / table), table)

    def claims(self, node):
        """Runs that a worker on a node has claimed and trained for a while."""
        return [path for path in (self.folder / "runs/little").glob("*/seed*.claim")
                if read_if_there(path).startswith(node + "/")
                and (path.with_suffix("") / "checkpoint.safetensors").exists()]

    def tasks(self, array, node):
        """The tasks of an array on a node, such as 3_1."""
        rows = self.cluster.ask("squeue", "--noheader", "--array", f"--jobs={array}",
                                f"--nodelist={node}", "--states=running", "--format=%i")
        return rows.split()

    def wait_for_state(self, task, state):
        self.cluster.wait(lambda: self.cluster.job(task)["JobState"] == state, 100)

    @staticmethod
    def worker_of(task):
        """The process id of a task's worker."""
        array, index = task.split("_")
        for process in Path("/proc").glob("[0-9]*"):
            environment = read_if_there(process / "environ").split("\0")
            if (f"SLURM_ARRAY_JOB_ID={array}" in environment
                    and f"SLURM_ARRAY_TASK_ID={index}" in environment
                    and "\0--work\0" in read_if_there(process / "cmdline")):
                return int(process.name)
        raise AssertionError(f"task {task} has no worker")

    def test_a_node_is_lost_and_tasks_are_killed_and_preempted(self):
        self.write_study(3, 300000)
        follower, array, _ = self.follow(4)
        self.wait_for(lambda: all(len(self.claims(node)) == 2 for node in NODES))
        lost = self.tasks(array, "node2")
        killed, preempted = self.tasks(array, "node1")

        self.cluster.lose("node2")
        self.addCleanup(self.cluster.start_node, "node2")
        os.kill(self.worker_of(killed), signal.SIGKILL)
        self.wait_for_state(killed, "FAILED")
        urgent = self.cluster.submit("--partition=high", "--nodelist=node1", "--exclusive",
                                     "--output=/dev/null", script="#!/bin/sh\nsleep 1\n")
        self.wait_for_state(urgent, "COMPLETED")
        self.cluster.hurry(preempted)
        self.wait_for_state(preempted, "RUNNING")
        self.assertEqual(self.cluster.job(preempted)["Restarts"], "1")

        # Slurm notices the lost node, and the claims expire.
        for task in lost:
            self.wait_for_state(task, "PENDING")
            self.cluster.ask("scontrol", "update", f"JobId={task}", "StartTime=now+1hour")
        self.cluster.wait(lambda: self.count_in_status("lost") == 2, 300)
        for task in lost:
            self.cluster.hurry(task)

        output = follower.communicate()[0]
        self.assertEqual(follower.returncode, 0, output)
        self.assertIn("6 of 6 runs done", output)
        self.assertIn("Written: summary.csv", output)
        self.assert_as_on_one_machine()

    def test_who_follows_may_leave_and_come_back_and_cancel(self):
        self.write_study(2, 150000)
        follower, array, _ = self.follow(2)
        self.wait_for(lambda: any(self.claims(node) for node in NODES))
        code, rest = self.end(follower, signal.SIGINT)
        self.assertEqual(code, 130)
        self.assertIn(f"Job array {array} continues; the same command follows it again, "
                      f"`scancel {array}` cancels it.", rest)
        follower, _, how = self.follow(2)
        self.assertIn(f"Following job array {array}: ", how)
        self.cluster.ask("scancel", array)
        output = follower.communicate()[0]
        self.assertEqual(follower.returncode, 1, output)
        self.assertRegex(output, rf"upswing: job array {array} has ended, but [1-4] runs are not done")
        # The workers were notified: no task is queued again, and the runs can be resumed
        # immediately.
        self.assertEqual(self.cluster.job(f"{array}_1")["JobState"], "CANCELLED")
        self.assertEqual(self.count_in_status("lost"), 0)
        follower, another, _ = self.follow(3)
        self.assertNotEqual(another, array)
        output = follower.communicate()[0]
        self.assertEqual(follower.returncode, 0, output)
        self.assert_as_on_one_machine()

    def test_a_task_that_is_warned_of_its_end_queues_itself_again(self):
        self.write_study(1, 300000)
        follower, array, _ = self.follow(2)
        self.wait_for(lambda: sum(len(self.claims(node)) for node in NODES) == 2)
        tasks = [f"{array}_1", f"{array}_2"]
        for task in tasks:  # as Slurm does before the time limit: slurm_cluster_test.py
            self.cluster.ask("scancel", "--batch", "--signal=USR2", task)
        for task in tasks:
            self.cluster.wait(lambda of=task: self.cluster.job(of)["Restarts"] == "1")
        self.assertEqual(self.count_in_status("stopped"), 2)
        for task in tasks:
            self.wait_for_state(task, "PENDING")
            self.cluster.hurry(task)
        output = follower.communicate()[0]
        self.assertEqual(follower.returncode, 0, output)
        self.assert_as_on_one_machine()

    def test_what_sbatch_refuses_is_said(self):
        self.write_study(1, 1000)
        done = self.run_here("study", "little.toml", "--slurm", "--partition=nosuch")
        self.assert_one_line(done, 1, "sbatch refused: ", "Invalid partition name specified")

    def test_a_folder_may_have_an_odd_name(self):
        self.write_study(1, 1000)
        out = "it's 10% $(id) \" #x"
        self.succeed("study", "little.toml", "--out", out, "--slurm", "")
        self.assertEqual({path.name for path in (self.folder / out / "slurm").iterdir()},
                         {"array", *(f"{self.number_in(out)}_{task}.log" for task in (1, 2))})

    def number_in(self, out):
        return (self.folder / out / "slurm/array").read_text(encoding="utf-8").strip()

    def count_in_status(self, column):
        """The sum of a column of `study --status` over the variants."""
        lines = self.succeed("study", "little.toml", "--status").splitlines()
        at = lines[1].split().index(column) + 1
        return sum(int(line.split()[at]) for line in lines[2:] if line.split()[:1] in
                   [[variant] for variant in VARIANTS])


def read_if_there(path):
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def without_times(path):
    """The rows of a study's table, without the columns of clock and host."""
    return [{name: text for name, text in row.items() if "seconds" not in name and name != "host"}
            for row in without_seconds(path)]


if __name__ == "__main__":
    reason = problem()
    if reason:
        print(f"skipped: {reason}")
        sys.exit(77)
    enter_namespaces()
    unittest.main()
