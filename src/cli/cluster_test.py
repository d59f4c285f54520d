#!/usr/bin/env python3
"""Tests of examples/slurm.sh on a Slurm of two nodes: a study leaves the same files as on one
machine, whatever happens to the tasks."""

import os
import signal
import sys
import unittest
from pathlib import Path

from testing import ROOT, UPSWING, ProgramTest, without_seconds

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

    def queue(self, tasks):
        """Prepares the study and queues a job array of workers. Returns its number."""
        self.succeed("study", "little.toml", "--prepare")
        return self.cluster.ask("sbatch", "--parsable", f"--array=1-{tasks}",
                                f"--chdir={self.folder}", ROOT / "examples/slurm.sh", UPSWING,
                                "study", "--work", "runs/little").strip()

    def assert_done(self, runs):
        """Waits until all runs are done, and compares them with those of one machine."""
        self.cluster.wait(lambda: self.count_in_status("done") == runs, 300)
        self.assertIn("Written: summary.csv", self.succeed("study", "little.toml"))
        self.assert_as_on_one_machine()

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
                if read_if_there(path).startswith(node + " ")
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
        array = self.queue(4)
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

        for task in lost:  # Slurm notices the lost node
            self.wait_for_state(task, "PENDING")
            self.cluster.hurry(task)

        self.assert_done(6)

    def test_cancelled_workers_are_notified_and_their_runs_resumed(self):
        self.write_study(2, 150000)
        array = self.queue(2)
        self.wait_for(lambda: any(self.claims(node) for node in NODES))
        self.cluster.ask("scancel", array)
        self.wait_for_state(f"{array}_1", "CANCELLED")
        self.cluster.wait(lambda: self.cluster.ask("squeue", "--noheader") == "")
        self.assertEqual(self.count_in_status("running"), 0)
        self.queue(3)
        self.assert_done(4)

    def test_a_task_that_is_warned_of_its_end_queues_itself_again(self):
        self.write_study(1, 300000)
        array = self.queue(2)
        self.wait_for(lambda: sum(len(self.claims(node)) for node in NODES) == 2)
        tasks = [f"{array}_1", f"{array}_2"]
        for task in tasks:  # as Slurm does before the time limit: see the next test
            self.cluster.ask("scancel", "--batch", "--signal=USR2", task)
        for task in tasks:
            self.cluster.wait(lambda of=task: self.cluster.job(of)["Restarts"] == "1")
        self.assertEqual(self.count_in_status("stopped"), 2)
        for task in tasks:
            self.wait_for_state(task, "PENDING")
            self.cluster.hurry(task)
        self.assert_done(2)

    def test_slurm_warns_a_job_before_its_time_limit(self):
        # Slurm checks time limits about every half minute.
        trap = f"trap 'echo USR2 >{self.folder}/notes; exit 4' USR2\n"
        job = self.cluster.submit("--time=1", "--signal=B:USR2@30", "--output=/dev/null",
                                  script="#!/bin/sh\n" + trap + 600 * "sleep 1\n")
        self.cluster.wait(lambda: self.cluster.job(job)["JobState"] == "FAILED", 100)
        self.assertEqual(self.cluster.job(job)["ExitCode"], "4:0")
        self.assertEqual((self.folder / "notes").read_text("utf-8"), "USR2\n")

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
