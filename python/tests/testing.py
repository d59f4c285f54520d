"""What the tests of the package share."""

import unittest

import upswing


class BadInputTest(unittest.TestCase):
    def refuse(self, what, call, *arguments, **settings):
        """Expects an InputError of one line that says `what`."""
        with self.assertRaises(upswing.InputError) as caught:
            call(*arguments, **settings)
        self.assertIn(what, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))
