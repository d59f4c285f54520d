#!/usr/bin/env python3
"""Runs a real Slurm cluster of two nodes on this host for tests, in its own network namespace.

    tools/slurm_cluster.py [COMMAND...]     run COMMAND (default: a shell) inside the cluster

Partitions: `low` (default) and `high`; jobs in `high` preempt jobs in `low`, which are requeued. Each
node has two processors and its own process namespace: Cluster.lose(node) simulates a power failure.
Needs root and Debian's slurm-wlm, munge and iproute2 (see `problem`). All files are in a temporary
folder. All processes end with this one.
"""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

NODES = ("node1", "node2")
HOSTS = {"control": "10.0.0.1", "node1": "10.0.0.2", "node2": "10.0.0.3"}
PROGRAMS = ("slurmctld", "slurmd", "munged", "sbatch", "ip", "unshare")
UNSHARE = ("unshare", "--net", "--uts", "--mount", "--pid", "--kill-child", "--mount-proc")
INSIDE = "UPSWING_INSIDE_CLUSTER"

CONFIG = """ClusterName=upswing
SlurmctldHost=control
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmctldPidFile={folder}/control.pid
SlurmctldLogFile={folder}/control.log
SlurmdSpoolDir={folder}/%n
SlurmdPidFile={folder}/%n.pid
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
# A node without an answer for this many seconds is lost, and its jobs are requeued.
SlurmdTimeout=10
ReturnToService=2
# Between TERM and KILL.
KillWait=20
MessageTimeout=5
# The nodes have the numbers of processors given here.
SlurmdParameters=config_overrides
{nodes}
PartitionName=low Nodes=ALL PriorityTier=1 PreemptMode=REQUEUE Default=YES
PartitionName=high Nodes=ALL PriorityTier=2 PreemptMode=OFF
"""


def problem():
    """The reason why this machine cannot run a cluster; None if it can."""
    if os.geteuid() != 0:
        return "a cluster needs root (for namespaces)"
    path = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
    missing = [name for name in PROGRAMS if not shutil.which(name, path=path)]
    if missing:
        return f"{', '.join(missing)} not found: install slurm-wlm, munge and iproute2"
    if subprocess.run([*UNSHARE, "true"], check=False, stderr=subprocess.DEVNULL).returncode != 0:
        return "no namespaces can be made here (unshare)"
    return None


def enter_namespaces():
    """Restarts this program in separate process, mount, network and host name namespaces. Returns
    inside them. All processes started there end with it."""
    if os.environ.get(INSIDE) != "1":
        os.environ[INSIDE] = "1"
        os.execvp("unshare", [*UNSHARE, sys.executable, "-B", *sys.argv])
    socket.sethostname("control")
    with tempfile.NamedTemporaryFile("w", encoding="utf-8") as hosts:
        print("127.0.0.1 localhost", *(f"{address} {name}" for name, address in HOSTS.items()),
              sep="\n", file=hosts, flush=True)
        for command in (["mount", "--bind", hosts.name, "/etc/hosts"],
                        ["ip", "link", "set", "lo", "up"],
                        *(["ip", "address", "add", address, "dev", "lo"]
                          for address in HOSTS.values())):
            subprocess.run(command, check=True)


class Cluster:
    """A cluster. Starts in `with Cluster() as cluster`, after enter_namespaces(); sets SLURM_CONF
    and PATH."""

    def __init__(self):
        self.folder = Path(tempfile.mkdtemp(prefix="upswing-slurm-"))
        self.folder.chmod(0o711)  # users need access to munge's socket
        self.daemons = {}

    def __enter__(self):
        os.environ["PATH"] = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
        os.environ["SLURM_CONF"] = str(self.folder / "slurm.conf")
        nodes = [f"NodeName={name} Port={7001 + i} CPUs=2 State=UNKNOWN"
                 for i, name in enumerate(NODES)]
        for name in ("state", *NODES):
            (self.folder / name).mkdir()
        (self.folder / "slurm.conf").write_text(
            CONFIG.format(folder=self.folder, nodes="\n".join(nodes)), encoding="utf-8")
        key = self.folder / "munge.key"
        key.touch(mode=0o600)
        key.write_bytes(os.urandom(128))
        try:
            self.start("munged", "munged", "--foreground", "--key-file", key,
                       *(f"--{what}-file={self.folder}/munge.{what}" for what in ("log", "pid", "seed")),
                       "--socket", self.folder / "munge.socket")
            self.wait(lambda: (self.folder / "munge.socket").exists())
            self.start("control", "slurmctld", "-D")
            for node in NODES:
                self.start_node(node)
            self.wait_for_nodes()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for daemon in self.daemons.values():
            daemon.kill()
        for daemon in self.daemons.values():
            daemon.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def start(self, name, *command):
        output = open(self.folder / f"{name}.out", "ab")
        with output:
            self.daemons[name] = subprocess.Popen(
                list(map(str, command)), stdin=subprocess.DEVNULL, stdout=output, stderr=output)

    def start_node(self, node):
        """Switches a node on."""
        # The shell is the node's first process, and adopts its orphaned processes.
        self.start(node, "unshare", "--uts", "--pid", "--kill-child", "--mount-proc", "sh", "-c",
                   'hostname "$1" && slurmd -D -N "$1" & wait', "sh", node)

    def lose(self, node):
        """Cuts a node's power: all its processes end at once, without notice."""
        daemon = self.daemons.pop(node)
        daemon.kill()
        daemon.wait()

    def wait(self, condition, seconds=60):
        """Waits for a condition. If the wait fails, shows the daemons' output."""
        end = time.monotonic() + seconds
        while not condition():
            ended = [name for name, daemon in self.daemons.items() if daemon.poll() is not None]
            if ended or time.monotonic() > end:
                for log in sorted([*self.folder.glob("*.out"), *self.folder.glob("*.log")]):
                    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
                    print(f"--- {log.name}", *lines[-20:], sep="\n", file=sys.stderr)
                raise TimeoutError(f"ended: {ended}" if ended else "the cluster did not do it")
            time.sleep(0.1)

    def ask(self, *command):
        """The output of a Slurm command."""
        return subprocess.run(list(map(str, command)), check=True, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, encoding="utf-8").stdout

    def submit(self, *options, script):
        """Queues a job. Returns its number."""
        return subprocess.run(["sbatch", "--parsable", *options], input=script, check=True,
                              stdout=subprocess.PIPE, encoding="utf-8").stdout.strip()

    def job(self, number):
        """Slurm's record of a job, or of a task such as 3_1: JobState, ExitCode, …"""
        told = self.ask("scontrol", "--oneliner", "show", "job", number)
        return dict(field.split("=", 1) for field in told.split() if "=" in field)

    def hurry(self, number):
        """Lets a requeued job begin; Slurm would make it wait for two minutes."""
        # Slurm kills a job that begins in the second in which it was requeued, because the
        # credentials of that second were revoked.
        time.sleep(2)
        def may_begin():
            # Slurm refuses or forgets the update while it still handles the job's last end.
            subprocess.run(["scontrol", "update", f"JobId={number}", "StartTime=now"], check=False,
                           stderr=subprocess.DEVNULL)
            job = self.job(number)
            return job["JobState"] != "PENDING" or job["Reason"] in ("Resources", "Priority")
        self.wait(may_begin)

    def cancel_all(self):
        """Cancels all jobs, and waits until they have ended."""
        self.ask("scancel", "--user=root")
        self.wait(lambda: self.ask("squeue", "--noheader") == "")

    def wait_for_nodes(self):
        """Waits until both nodes respond."""
        answering = ["sinfo", "-h", "-N", "-p", "low", "-r", "-t", "idle,mixed,allocated", "-o", "%N"]
        self.wait(lambda: subprocess.run(
            answering, check=False, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            encoding="utf-8").stdout.split() == list(NODES))


def main():
    reason = problem()
    if reason:
        sys.exit(f"slurm_cluster: {reason}")
    enter_namespaces()
    with Cluster():
        command = sys.argv[1:] or [os.environ.get("SHELL", "sh")]
        return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
