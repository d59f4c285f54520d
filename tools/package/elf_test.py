#!/usr/bin/env python3
"""Tests how programs and modules are linked: in the build folder, after `cmake --install`, and in files
with faults. The packages are tested in package_test.py.

UPSWING names the program; its build folder is used (see src/cli/testing.py).
"""

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import elf

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parent.parent.parent))
UPSWING = Path(os.environ.get("UPSWING", ROOT / "build/release/bin/upswing"))
BUILD = UPSWING.parent.parent
PROGRAMS = ["upswing", "upswing-deploy", "upswing-machine", "upswing-realaigym"]


class BuildTest(unittest.TestCase):
    def test_built_programs_and_the_module(self):
        programs = [path for path in (BUILD / "bin").iterdir() if elf.is_elf(path)]
        self.assertLessEqual(set(PROGRAMS), {path.name for path in programs})
        modules = list((BUILD / "python/upswing").glob("*.so"))
        self.assertEqual([fault for path in [*programs, *modules]
                          for fault in elf.faults_of(path, packaged=False)], [])

    def test_the_installed_files(self):
        with tempfile.TemporaryDirectory() as folder:
            prefix = Path(folder) / "installed"
            install = ["cmake", "--install", BUILD, "--prefix", prefix, "--strip"]
            for _ in range(2):  # the second time over the first
                subprocess.run(install, check=True, stdout=subprocess.DEVNULL)
                self.assertEqual(sorted(path.name for path in (prefix / "bin").iterdir()), PROGRAMS)
                self.assertEqual(elf.faults_below(prefix, {"bin"}), [])
            # A library of the current folder is not loaded.
            work = Path(folder) / "policies"
            work.mkdir()
            for name in ("libfmt.so.9", "libmujoco.so.4.0.0", "libz.so.1"):
                (work / name).write_text("not a library", encoding="utf-8")
            done = subprocess.run([prefix / "bin/upswing", "info"], cwd=work, check=True,
                                  encoding="utf-8", stdout=subprocess.PIPE)
            self.assertIn("MuJoCo 4.0.0", done.stdout)

    def test_a_library_of_the_current_folder_is_not_loaded(self):
        with tempfile.TemporaryDirectory() as folder:
            for line in subprocess.run(["readelf", "--dynamic", UPSWING], check=True, encoding="utf-8",
                                       stdout=subprocess.PIPE).stdout.splitlines():
                if "(NEEDED)" in line:
                    name = line.split("[")[1].split("]")[0]
                    (Path(folder) / name).write_text("not a library", encoding="utf-8")
            self.assertGreater(len(os.listdir(folder)), 5)
            for program in PROGRAMS:
                done = subprocess.run([UPSWING.with_name(program), "--help"], cwd=folder, check=False,
                                      encoding="utf-8", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
                self.assertEqual((done.returncode, done.stderr), (0, ""))


class FaultTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        (self.folder / "empty.cc").touch()

    def link(self, *flags):
        """The faults of a packaged library that is linked with these flags."""
        library = self.folder / "library.so"
        subprocess.run(["c++", "-shared", "-o", library, self.folder / "empty.cc", *flags], check=True)
        return [fault.removeprefix(f"{library}: ") for fault in elf.faults_below(self.folder, {"."})]

    def test_run_paths(self):
        full = "-Wl,-z,relro,-z,now"
        empty = "an empty entry, which is the current folder"
        for path, fault in (("$ORIGIN/../lib:${ORIGIN}", None), ("$ORIGIN:", empty), (":$ORIGIN", empty),
                            ("$ORIGIN::$ORIGIN/lib", empty), ("lib", "the relative entry lib"),
                            ("./$ORIGIN", "the relative entry ./$ORIGIN"),
                            ("$ORIGINAL", "the relative entry $ORIGINAL"),
                            ("/tmp", "the entry /tmp of the build machine"),
                            ("/dev/shm/lib", "the entry /dev/shm/lib of the build machine")):
            for kind, tags in (("RUNPATH", "--enable-new-dtags"), ("RPATH", "--disable-new-dtags")):
                with self.subTest(path=path, kind=kind):
                    found = self.link(full, f"-Wl,{tags},-rpath,{path}")
                    self.assertEqual(found, [f"{kind} has {fault}"] if fault else [])

    def test_hardening(self):
        self.assertEqual(self.link("-Wl,-z,relro,-z,lazy"),
                         ["no BIND_NOW: addresses of functions stay writable"])
        self.assertEqual(self.link("-Wl,-z,norelro,-z,now"),
                         ["no GNU_RELRO: addresses of functions are writable"])
        self.assertEqual(self.link("-Wl,-z,relro,-z,now,-z,execstack"), ["an executable stack"])


if __name__ == "__main__":
    unittest.main()
