"""The Markdown pages of README and docs/: their files, and helpers for tools and tests that read
them."""

import re

from program import ROOT

FENCED = re.compile(r"^(```+|~~~+)[^\n]*\n.*?^\1[^\n]*$", re.MULTILINE | re.DOTALL)


def pages():
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def without_code(text):
    """The text with fenced blocks replaced by blanks, so that their content does not count."""
    return FENCED.sub(lambda block: re.sub(r"[^\n]", " ", block[0]), text)


def markdown_table(columns, rows):
    head = f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}\n"
    return head + "".join(f"| {' | '.join(cells)} |\n" for cells in rows)
