#!/usr/bin/env python3
"""Tests of the documentation's figures."""
import re
import sys
import unittest
from importlib import metadata
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
import figures
from pages import pages

DARK = "@media (prefers-color-scheme:dark)"

# Drawn by the program itself, not by tools/results/figures.py: it shows a user's output.
OUTPUT = {"map.svg"}


def shown():
    """(page, file) of every picture in docs/figures that a page shows."""
    for page in pages():
        text = page.read_text(encoding="utf-8")
        for link in re.findall(r"!\[[^\]]*\]\(([^)\s]+)\)", text) + re.findall(r'<img[^>]* src="([^"]+)"', text):
            path = (page.parent / link).resolve()
            if figures.FIGURES in path.parents:
                yield page.relative_to(figures.ROOT), path


def matplotlib_is_pinned():
    """Whether this Python has the matplotlib version that drew the figures."""
    pinned = re.search(r"^matplotlib==(\S+)", (figures.ROOT / "tools/docs-requirements.txt").read_text("utf-8"), re.M)
    try:
        return bool(pinned) and metadata.version("matplotlib") == pinned[1]
    except metadata.PackageNotFoundError:
        return False


class Figures(unittest.TestCase):
    def test_every_picture_of_a_page_exists(self):
        pictures = list(shown())
        self.assertTrue(pictures)
        for page, path in pictures:
            self.assertTrue(path.is_file(), f"{page}: {path.name} does not exist")

    def test_drawings_are_svg_with_a_dark_variant(self):
        for page, path in shown():
            if path.suffix == ".svg" and path.name not in OUTPUT:
                text = path.read_text(encoding="utf-8")
                self.assertIn("<svg", text, f"{page}: {path.name}")
                self.assertIn(DARK, re.sub(r"scheme: ", "scheme:", text), f"{page}: {path.name}")

    def test_drawn_figures_are_small_and_have_text(self):
        for name in figures.DRAWN:
            path = figures.FIGURES / f"{name}.svg"
            if path.exists():
                self.assertLess(path.stat().st_size, 150_000, name)
                self.assertIn("<text", path.read_text(encoding="utf-8"), name)

    def test_colors_are_distinct(self):
        self.assertEqual(len(set(figures.AGENTS.values())), len(figures.AGENTS))

    @unittest.skipUnless(matplotlib_is_pinned(), "needs the matplotlib of tools/docs-requirements.txt")
    def test_figures_are_current(self):
        for name in figures.DRAWN:
            path = figures.FIGURES / f"{name}.svg"
            drawn = figures.draw(name)
            on_disk = path.read_text(encoding="utf-8") if path.exists() else None
            self.assertTrue(drawn == on_disk, f"{name}.svg is out of date: run python3 tools/results/figures.py {name}")


if __name__ == "__main__":
    unittest.main()
