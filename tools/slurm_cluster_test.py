#!/usr/bin/env python3
"""Tests, with shell jobs, the behaviour of slurm_cluster.py's Slurm that the program's tests rely
on."""

import shutil
import sys
import tempfile
import time
import unittest
from pathlib import Path

from slurm_cluster import NODES, Cluster, enter_namespaces, problem

# Records its beginning, the signals it receives, and its end.
NOTES = """#!/bin/sh
note() { echo "$*" >>"{folder}/notes"; }
note begin "$(hostname)" "${SLURM_RESTART_COUNT:-0}"
trap 'note TERM; exit 3' TERM
trap 'note USR2; exit 4' USR2
for i in $(seq {seconds}0); do sleep 0.1; done
note end
"""


class SlurmClusterTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cluster = cls.enterClassContext(Cluster())

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="upswing-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.addCleanup(self.cluster.cancel_all)

    def submit(self, *options, seconds=600):
        """Queues a job that writes notes. Returns its number."""
        script = NOTES.replace("{folder}", str(self.folder)).replace("{seconds}", str(seconds))
        return self.cluster.submit(*options, f"--output={self.folder}/log", script=script)

    def notes(self):
        path = self.folder / "notes"
        return path.read_text(encoding="utf-8").splitlines() if path.exists() else []

    def await_notes(self, *notes, seconds=60):
        self.cluster.wait(lambda: set(notes) <= set(self.notes()), seconds)

    def state(self, job):
        return self.cluster.job(job)["JobState"]

    def test_an_array_uses_both_nodes(self):
        self.submit("--array=1-4", seconds=1)
        self.cluster.wait(lambda: self.notes().count("end") == 4)
        self.assertEqual({note for note in self.notes() if note.startswith("begin")},
                         {f"begin {node} 0" for node in NODES})

    def test_a_cancelled_job_is_told_and_stays_away(self):
        job = self.submit("--nodelist=node1", "--requeue")
        self.await_notes("begin node1 0")
        self.cluster.ask("scancel", job)
        self.await_notes("TERM")
        self.cluster.wait(lambda: self.state(job) == "CANCELLED")

    def test_a_job_of_more_priority_preempts_one_which_is_requeued(self):
        job = self.submit("--nodelist=node1", "--requeue")
        self.await_notes("begin node1 0")
        urgent = self.cluster.submit("--partition=high", "--nodelist=node1", "--exclusive",
                                     "--output=/dev/null", script="#!/bin/sh\nsleep 1\n")
        self.await_notes("TERM")
        self.cluster.wait(lambda: self.state(urgent) == "COMPLETED")
        self.assertEqual(self.state(job), "PENDING")
        self.cluster.hurry(job)
        self.await_notes("begin node1 1")

    def test_before_its_time_limit_a_job_is_warned_and_may_queue_itself_again(self):
        # Slurm checks time limits about every half minute.
        begin = time.monotonic()
        job = self.submit("--time=1", "--signal=B:USR2@30", "--requeue")
        self.await_notes("USR2", seconds=100)
        self.assertLess(time.monotonic() - begin, 65)
        self.assertNotIn("TERM", self.notes())
        self.cluster.wait(lambda: self.state(job) == "FAILED")
        self.assertEqual(self.cluster.job(job)["ExitCode"], "4:0")
        self.cluster.ask("scontrol", "requeue", job)
        self.cluster.wait(lambda: self.state(job) == "PENDING")
        self.cluster.hurry(job)
        self.cluster.wait(lambda: sum(note.startswith("begin") for note in self.notes()) == 2)

    def test_the_job_of_a_lost_node_begins_anew_on_the_other(self):
        job = self.submit("--nodelist=node2", "--requeue")
        self.await_notes("begin node2 0")
        self.cluster.lose("node2")
        try:
            self.cluster.wait(lambda: self.state(job) == "PENDING")
            self.assertEqual(self.notes(), ["begin node2 0"])  # the job got no signal
            self.cluster.ask("scontrol", "update", f"JobId={job}", "ReqNodeList=")
            self.cluster.hurry(job)
            self.await_notes("begin node1 1")
        finally:
            self.cluster.start_node("node2")
            self.cluster.wait_for_nodes()


if __name__ == "__main__":
    reason = problem()
    if reason:
        print(f"skipped: {reason}")
        sys.exit(77)
    enter_namespaces()
    unittest.main()
