"""Helpers that the program's end-to-end tests share: running it, small settings, reading its files.

The environment variable UPSWING names the program; without it, the release build of the repository
in UPSWING_ROOT is used.
"""

import csv
import ctypes
import errno
import json
import os
import pty
import re
import resource
import shutil
import signal
import struct
import subprocess
import tempfile
import time
import unittest
from array import array
from pathlib import Path

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parents[2]))
UPSWING = Path(os.environ.get("UPSWING", ROOT / "build/release/bin/upswing"))

# Seconds after which a wait counts as hanging. Passing tests never wait this long, even on a
# machine twenty times slower than two idle cores.
PATIENCE = 1200

RUN_FILES = {"config.toml", "metrics.csv", "episodes.csv", "evals.csv", "log.txt",
             "events.out.tfevents.0.upswing", "checkpoint.safetensors", "policy.safetensors"}
REWARD_TERMS = ["energy", "height", "balance", "velocity_penalty", "torque_penalty"]

# A training of a fraction of a second that evaluates twice.
SMALL = {"agent": "d3qn-small", "hidden": 32, "head": 16, "steps": 4000, "eval_every": 2000,
         "eval_episodes": 4, "checkpoint_every": 500, "log_every": 500, "learning_starts": 200,
         "threads": 1, "out": "run", "envs": 8, "updates_per_step": 0.25}


def limits():
    """Limits memory and time, so that expensive work fails."""
    resource.setrlimit(resource.RLIMIT_CPU, (20, 20))
    if "UPSWING_SANITIZED" not in os.environ:  # sanitizers reserve the address space
        resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30))


def without_locks(folders=True):
    """Makes the locks of files, and of folders, fail in this process, as on a file system without them:
    a filter of system calls. Skips the test where the system has no such filter."""
    calls = {"x86_64": (72, 73), "aarch64": (25, 32)}  # fcntl, flock
    load, equal, end, allow, fail = 0x20, 0x15, 0x06, 0x7fff0000, 0x00050000 | errno.ENOLCK
    no_new_privileges, seccomp, by_filter, set_lock, command = 38, 22, 2, 37, 24
    if os.uname().machine not in calls:
        raise unittest.SkipTest("no filter for this processor")
    fcntl, flock = calls[os.uname().machine]
    program = [(load, 0, 0, 0), (equal, 3, 0, flock if folders else -1 & 0xffffffff),
               (equal, 0, 3, fcntl), (load, 0, 0, command), (equal, 0, 1, set_lock), (end, 0, 0, fail),
               (end, 0, 0, allow)]
    code = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *line) for line in program))
    given = ctypes.create_string_buffer(struct.pack("HxxxxxxQ", len(program), ctypes.addressof(code)))
    system = ctypes.CDLL(None)
    if (system.prctl(no_new_privileges, 1, 0, 0, 0) != 0
            or system.prctl(seccomp, by_filter, given, 0, 0) != 0):
        raise OSError("cannot filter system calls")


def small(**changes):
    """`train` with small settings and the given changes. None removes a setting; True and False are
    flags."""
    arguments = ["train"]
    for name, value in (SMALL | changes).items():
        flag = name.replace("_", "-")
        if isinstance(value, bool):
            arguments.append(f"--{flag}" if value else f"--no-{flag}")
        elif value is not None:
            arguments += [f"--{flag}", str(value)]
    return arguments


def run(*arguments, cwd=None, stdout=subprocess.PIPE, **more):
    """Runs the program to its end; stdout and stderr are text. Removes from stderr the lines that
    long work writes every ten seconds."""
    emulator = os.environ.get("UPSWING_EMULATOR", "").split()
    done = subprocess.run([*emulator, UPSWING, *map(str, arguments)], cwd=cwd, check=False,
                          stdin=subprocess.DEVNULL, stdout=stdout,
                          stderr=subprocess.PIPE, encoding="utf-8", **more)
    done.stderr = re.sub(r"(?m)^upswing: \d+%  \S+ \w+/s  .+ left\n", "", done.stderr)
    return done


def probe(policy, what, numbers):
    """Results of the library's policy for rows of observations or states (extras/deploy/policy_probe.cc),
    as one array of doubles."""
    done = subprocess.run([UPSWING.parent / "policy_probe", policy, what], check=False,
                          input=array("d", numbers).tobytes(), stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE)
    assert done.returncode == 0, done.stderr
    return array("d", done.stdout)


def read_csv(path):
    """The rows of a table, as dictionaries of numbers."""
    with open(path, encoding="utf-8", newline="") as file:
        return [{name: float(text) for name, text in row.items()} for row in csv.DictReader(file)]


def without_seconds(path):
    """The rows of a table as text, without the column that differs between runs."""
    with open(path, encoding="utf-8", newline="") as file:
        return [{name: text for name, text in row.items() if name != "seconds"}
                for row in csv.DictReader(file)]


def snapshot(folder):
    """Every file below a folder with its bytes, and every subfolder with None."""
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
            for path in sorted(Path(folder).rglob("*"))}


def read_tensors(path):
    """Metadata and {name: (type, shape, bytes)} of a safetensors file."""
    data = Path(path).read_bytes()
    length = struct.unpack_from("<Q", data)[0]
    header = json.loads(data[8:8 + length])
    metadata = header.pop("__metadata__", {})
    tensors = {}
    for name, entry in header.items():
        begin, end = (8 + length + offset for offset in entry["data_offsets"])
        tensors[name] = (entry["dtype"], entry["shape"], data[begin:end])
    return metadata, tensors


def checksum(pieces):
    """The checksum of Upswing's files, over header and tensors
    (docs/reference/policy-format.md)."""
    value = 0xcbf29ce484222325
    for piece in pieces:
        for (word,) in struct.iter_unpack("<Q", piece + bytes(-len(piece) % 8)):
            value = (value ^ word) * 0x100000001b3 & (1 << 64) - 1
            value ^= value >> 32
    return f"{value:016x}"


def write_tensors(path, metadata, tensors):
    """Writes a safetensors file. If its metadata have upswing_version, the checksum is correct, so
    that only the content can be wrong."""
    zeros = "0" * 16
    about = {key: text for key, text in metadata.items() if key != "checksum"}
    if "upswing_version" in about:
        about["checksum"] = zeros
    header = {"__metadata__": about}
    offset = 0
    for name, (dtype, shape, data) in tensors.items():
        end = offset + len(data)
        header[name] = {"dtype": dtype, "shape": shape, "data_offsets": [offset, end]}
        offset = end
    text = json.dumps(header, separators=(",", ":")).encode()
    data = [data for _, _, data in tensors.values()]
    key = b'"checksum":"'
    text = text.replace(key + zeros.encode(), key + checksum([text, *data]).encode())
    Path(path).write_bytes(b"".join([struct.pack("<Q", len(text)), text, *data]))


def with_number(tensor, index, number):
    """The tensor with one of its numbers replaced."""
    dtype, shape, data = tensor
    code = {"F32": "f", "F64": "d", "I64": "q", "U64": "Q"}[dtype]
    changed = bytearray(data)
    struct.pack_into("<" + code, changed, index * struct.calcsize(code), number)
    return dtype, shape, bytes(changed)


def state_of(path):
    """A checkpoint's content without values that depend on the clock: the seconds, and the lengths
    of the tables."""
    _, tensors = read_tensors(path)
    return {name: tensor for name, tensor in tensors.items()
            if not name.endswith("seconds") and not name.startswith("run/size/")}


def train_once(test_class, **changes):
    """Trains with small settings for all tests of a class; deletes the run folder afterwards."""
    folder = tempfile.TemporaryDirectory(prefix="upswing-")
    test_class.addClassCleanup(folder.cleanup)
    path = Path(folder.name, "run")
    done = run(*small(out=path, **changes))
    assert done.returncode == 0, done
    return path


class ProgramTest(unittest.TestCase):
    """Base class for tests of the program; each test has its own current folder."""

    maxDiff = 2000

    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="upswing-")
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)

    def run_here(self, *arguments, **more):
        return run(*arguments, **{"cwd": self.folder} | more)

    def succeed(self, *arguments, **more):
        """Runs the program, asserts success and an empty stderr, and returns stdout."""
        done = self.run_here(*arguments, **more)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done)
        return done.stdout

    def assert_one_line(self, done, code, *words):
        """Asserts this exit code, and one line on stderr that contains all words."""
        self.assertEqual(done.returncode, code, done)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertTrue(done.stderr.startswith("upswing: "), done.stderr)
        self.assertTrue(done.stderr.endswith("\n"), done.stderr)
        self.assertTrue(done.stderr[:-1].isprintable(), repr(done.stderr))
        for word in words:
            self.assertIn(str(word), done.stderr)

    def refuse(self, arguments, *words, code=2, **more):
        """Runs the program, and asserts that it refuses: one line, no output, no changed file."""
        before = snapshot(self.folder)
        done = self.run_here(*arguments, **more)
        self.assert_one_line(done, code, *words)
        self.assertEqual(done.stdout, "")
        self.assertEqual(snapshot(self.folder), before)

    def write(self, name, text):
        """Writes a text file; returns its name."""
        (self.folder / name).write_text(text, encoding="utf-8")
        return name

    def start(self, *arguments, wait=True):
        """Starts the program, waits until it begins to train, and kills it at the end of the
        test."""
        process = subprocess.Popen([UPSWING, *map(str, arguments)], cwd=self.folder,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, encoding="utf-8")
        self.addCleanup(self.end, process)
        if wait:
            self.assertIn("Training", process.stdout.readline())
        return process

    @staticmethod
    def end(process, number=signal.SIGKILL):
        """Sends a signal and waits; returns the exit code and the rest of the output."""
        if process.poll() is None:
            process.send_signal(number)
        rest = "" if process.stdout.closed else process.stdout.read()
        process.stdout.close()
        return process.wait(), rest

    def wait_for(self, condition):
        """Waits until the condition holds."""
        deadline = time.monotonic() + PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, "nothing happened")
            time.sleep(0.01)

    def watch(self, columns, arguments, *patterns):
        """Runs the program on a terminal of that width until it has shown all patterns, or a lot of
        output. Then interrupts it, and returns what it showed."""
        terminal, its_end = pty.openpty()
        with subprocess.Popen(["sh", "-c", 'stty cols "$0"; exec "$@"', str(columns), UPSWING,
                               *map(str, arguments)], cwd=self.folder,
                              stdin=its_end, stdout=its_end, stderr=its_end) as process:
            os.close(its_end)
            shown = ""
            stopping = False
            while piece := self.read_terminal(terminal):
                shown += piece
                all_seen = all(re.search(pattern, shown) for pattern in patterns)
                if not stopping and (all_seen or len(shown) > 20000):
                    stopping = True  # a second signal would end it at once
                    process.send_signal(signal.SIGINT)
            os.close(terminal)
        self.assertEqual(process.returncode, 130, shown)
        for pattern in patterns:
            self.assertRegex(shown, pattern)
        return shown

    def screen(self, *arguments):
        """Runs the program on a terminal. Returns the lines left on the terminal after escape
        sequences."""
        terminal, its_end = pty.openpty()
        with subprocess.Popen([UPSWING, *map(str, arguments)], cwd=self.folder, stdin=its_end,
                              stdout=its_end, stderr=its_end) as process:
            os.close(its_end)
            shown = ""
            while piece := self.read_terminal(terminal):
                shown += piece
            os.close(terminal)
        self.assertEqual(process.returncode, 0, shown)
        return [line.rsplit("\x1b[K", 1)[-1] for line in shown.replace("\r\n", "\n").split("\n")]

    def read_terminal(self, terminal):
        """The next output; empty if the other end is closed."""
        try:
            return os.read(terminal, 65536).decode()
        except OSError:  # Linux: the other end is closed
            return ""

    def assert_same_run(self, a, b):
        """Asserts that two run folders are equal except for clock values: policy, tables, whole
        state."""
        a, b = self.folder / a, self.folder / b
        self.assertEqual((a / "policy.safetensors").read_bytes(),
                         (b / "policy.safetensors").read_bytes())
        for table in ("metrics.csv", "episodes.csv", "evals.csv"):
            self.assertEqual(without_seconds(a / table), without_seconds(b / table), table)
        state_a = state_of(a / "checkpoint.safetensors")
        state_b = state_of(b / "checkpoint.safetensors")
        self.assertEqual(state_a.keys(), state_b.keys())
        for name, tensor in state_a.items():
            self.assertTrue(tensor == state_b[name], f"checkpoint: {name} differs")


class SmallRunTest(ProgramTest):
    """Base class for tests of a small finished run in the folder `run`, trained once and copied for
    each test."""

    @classmethod
    def setUpClass(cls):
        cls.made = train_once(cls)

    def setUp(self):
        super().setUp()
        shutil.copytree(self.made, self.folder / "run")
        self.policy = self.folder / "run/policy.safetensors"
        self.checkpoint = self.folder / "run/checkpoint.safetensors"

    def restore(self):
        """Replaces the run with a fresh copy."""
        shutil.rmtree(self.folder / "run")
        shutil.copytree(self.made, self.folder / "run")

    @staticmethod
    def flip(path, position):
        """Inverts one bit of a file."""
        data = bytearray(path.read_bytes())
        data[position] ^= 0x10
        path.write_bytes(data)

    @staticmethod
    def places(path):
        """Positions all over a safetensors file: in its length, header, checksum and tensors."""
        data = path.read_bytes()
        header = int.from_bytes(data[:8], "little")
        checksum = data.index(b'"checksum":"') + 12
        return [0, 1, 7, 8, 8 + header // 4, checksum, checksum + 15, 8 + header // 2, 8 + header,
                8 + header + 5, (8 + header + len(data)) // 2, len(data) - 1]
