"""Helpers that the package's tests share."""

import unittest

import upswing


class BadInputTest(unittest.TestCase):
    def refuse(self, what, call, *arguments, **settings):
        """Asserts an InputError with a one-line message that contains `what`."""
        with self.assertRaises(upswing.InputError) as caught:
            call(*arguments, **settings)
        self.assertIn(what, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))
