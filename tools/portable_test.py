#!/usr/bin/env python3
"""Tests that the layers base, nn, pendulum, rl, control and agents need no operating system. A program
linked with all of them trains in memory, and uses only the allowed symbols below.

The program is portable_test next to the program in UPSWING (see src/cli/testing.py).
"""

import os
import re
import subprocess
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parent.parent))
UPSWING = Path(os.environ.get("UPSWING", ROOT / "build/release/bin/upswing"))
PROGRAM = UPSWING.parent / "portable_test"

# The only permitted undefined symbols, as nm prints them, by purpose. Refused are all others: files
# (open, fopen, stat, std::filesystem, std::ofstream), processes, sockets, MuJoCo (mj_…), protobuf.
ALLOWED = {
    "start, exceptions and allocation of a compiled C++ program":
        r"_ITM_\w+|__gmon_start__|__libc_start_main|__cxa_\w+|__gxx_personality_v0|_Unwind_Resume|"
        r"(typeinfo|vtable|VTT) for (std|__cxxabiv1)::.*|__dynamic_cast|operator (new|delete)\b.*|"
        r"__stack_chk_fail|__errno_location|__tls_get_addr|__libc_single_threaded",
    "the C++ library: containers, text in memory, exceptions, threads, the steady clock":
        r"std::.*",
    "memory and text in memory":
        r"mem(chr|cmp|cpy|move|set)|str(cmp|len)|snprintf|strto(d|ll|ull)|__isoc23_strto(ll|ull)|localeconv|[cm]alloc|realloc|"
        r"free",
    "numbers":
        r"(a?(sin|cos|tan)h?|sincos|atan2|exp(2|m1)?|log(2|10|1p)?|pow|sqrt|cbrt|hypot|erfc?|fmod|"
        r"remainder|floor|ceil|l?l?round|nearbyint|rint|trunc|fabs|fma|fmin|fmax|copysign|lgamma)f?|"
        r"__(mul|div)[sd]c3|c(abs|exp|log|sqrt)f?",
    "threads: std::mutex, and waiting by std::atomic (on Linux the system call futex)":
        r"pthread_\w+|sched_yield|syscall",
    "toml++, whose parser of text is a shared library":
        r"(typeinfo for |vtable for )?toml::.*",
    "muParser, the parser of rewards":
        r"(typeinfo for |vtable for )?mu::.*",
    "Highway: the processor's vector instructions, and error messages":
        r"hwy::.*",
    "assertions, in some builds":
        r"__assert_fail|abort",
    "printf of the test's own result":
        r"printf|puts|putchar|__printf_chk",
    "checked copies of hardened builds":
        r"__(snprintf|mem(cpy|move|set))_chk",
}
# Symbols of the C++ library that are refused anyway, because they open files or write to a
# terminal.
REFUSED = r"filesystem|basic_\w*file|fstream|std::(cout|cerr|clog|cin)\b|random_device"


def undefined():
    """The symbols that the program imports from shared libraries, demangled, without versions."""
    lines = subprocess.run(["nm", "-D", "-C", "--undefined-only", PROGRAM], check=True,
                           encoding="utf-8", stdout=subprocess.PIPE).stdout.splitlines()
    return [re.sub(r"@.*", "", re.sub(r"^\s*[Uw] ", "", line)) for line in lines]


def offenders(symbols):
    """The symbols that are not allowed."""
    allowed = "|".join(f"(?:{pattern})" for pattern in ALLOWED.values())
    return [symbol for symbol in symbols
            if not re.fullmatch(allowed, symbol) or re.search(REFUSED, symbol)]


class Portable(unittest.TestCase):
    def test_it_trains_in_memory(self):
        done = subprocess.run([PROGRAM], check=False, encoding="utf-8", stdout=subprocess.PIPE)
        self.assertEqual(done.returncode, 0, done.stdout)
        updates = int(re.match(r"(\d+) updates", done.stdout)[1])
        self.assertGreater(updates, 100)

    @unittest.skipIf("UPSWING_SANITIZED" in os.environ, "sanitizers bring their own")
    def test_it_needs_nothing_of_the_system(self):
        symbols = undefined()
        self.assertIn("memcpy", symbols)
        self.assertEqual(offenders(symbols), [])

    def test_the_check_finds_forbidden_symbols(self):
        bad = ["open", "fopen", "fopen64", "stat", "getenv", "mj_step", "mjb_step", "socket", "fork",
               "google::protobuf::MessageLite::SerializeToString() const",
               "std::filesystem::status(std::filesystem::__cxx11::path const&)", "std::cout",
               "std::basic_ofstream<char, std::char_traits<char> >::close()"]
        self.assertEqual(offenders(bad), bad)
        self.assertEqual(offenders(["memcpy", "std::terminate()", "pthread_mutex_lock"]), [])


if __name__ == "__main__":
    unittest.main()
