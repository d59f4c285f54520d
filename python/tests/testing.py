"""Helpers that the package's tests share."""

import signal
import subprocess
import sys
import time
import unittest

import upswing

# A shell that starts tests in the background makes them ignore Ctrl-C, which some of them send.
signal.signal(signal.SIGINT, signal.default_int_handler)


class BadInputTest(unittest.TestCase):
    def refuse(self, what, call, *arguments, **settings):
        """Asserts an InputError with a one-line message that contains `what`."""
        with self.assertRaises(upswing.InputError) as caught:
            call(*arguments, **settings)
        self.assertIn(what, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))


def interrupted(script, has_begun, timeout):
    """Runs a Python script, sends Ctrl-C once `has_begun()`, and returns its output and exit code."""
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE,
                          encoding="utf-8") as process:
        while process.poll() is None and not has_begun():
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=timeout)
    return output, process.returncode
