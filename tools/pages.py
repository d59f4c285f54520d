"""The Markdown pages of README and docs/: where they are, and how tools and tests read them."""

import re

from program import ROOT

FENCED = re.compile(r"^(```+|~~~+)[^\n]*\n.*?^\1[^\n]*$", re.MULTILINE | re.DOTALL)


def pages():
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def without_code(text):
    """The text with blanks for its fenced blocks, so that what stands in them does not count."""
    return FENCED.sub(lambda block: re.sub(r"[^\n]", " ", block[0]), text)


def markdown_table(columns, rows):
    head = f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}\n"
    return head + "".join(f"| {' | '.join(cells)} |\n" for cells in rows)
