#!/usr/bin/env python3
"""Finds the worst habits of English in README.md and docs/ by patterns.

  prose.py [FILE.md...]    lists what it finds, and ends with 1 if anything is found
"""

import re
import sys
from pathlib import Path

from pages import pages, without_code

MOST_WORDS = 40  # per sentence

# Patterns, and what to write instead.
HABITS = {
    r"\bbeside\b": "next to",
    r"\banew\b": "again",
    r"\bone[’']s own\b": "your own",
    r"\boneself\b": "yourself",
    r"\bnobody\b": "no one; name who",
    r"\bwhoever\b": "anyone who",
    r"\bwhat (?:is|was)\b": "name the thing",
    r"\bso (?:many|much)\b": "a number, or N",
    r"\bsuch as (?:those|that|these)\b": "name the thing",
    r"\bthe same of\b": "say what is the same",
    r"\b(?:befell|mended|reckons?)\b": "a word of today",
    r"\bsays? of\b|\bsaid of\b": "describes",
}


def paragraphs(markdown):
    """The prose of a page: paragraphs, list items, headings and table cells."""
    text = re.sub(r"(<!-- (?:table|generated): .*? -->).*?<!-- end -->", "\n", without_code(markdown),
                  flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"\$\$.*?\$\$", "\n\nX\n\n", text, flags=re.DOTALL)
    text = re.sub(r"\$[^$\n]+\$", "X", text)
    text = re.sub(r"`[^`]+`", "X", text)
    text = re.sub(r"!?\[((?:[^\[\]]|\[[^\]]*\])*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"<[^>]+>", "", text)
    text = re.sub(r"^    .*$", "", text, flags=re.MULTILINE)  # indented code
    for block in re.split(r"\n\s*\n|\n(?=\s*(?:[-*+]|\d+\.)\s)|\n(?=#)|(?<=\|)\n", text):
        cells = block.split("|") if block.lstrip().startswith("|") else [block]
        for cell in cells:
            if words := " ".join(cell.split()):
                yield re.sub(r"^(?:#+|[-*+]|\d+\.|>) ", "", words)


def sentences(paragraph):
    return re.split(r"(?<=[.!?:])[”\"*_)]*\s+(?=[\"“(*_]*[A-Z0-9])", paragraph)


def faults(markdown):
    """(sentence, fault) for each fault."""
    for paragraph in paragraphs(markdown):
        for sentence in sentences(paragraph):
            for habit, instead in HABITS.items():
                found = re.search(habit, sentence, re.IGNORECASE)
                # A question may begin with "What is".
                if found and not (found[0].lower().startswith("what") and sentence.endswith("?")):
                    yield sentence, f"\"{found[0]}\": {instead}"
            words = len(sentence.split())
            if words > MOST_WORDS:
                yield sentence, f"{words} words, of at most {MOST_WORDS}"


def main(names):
    paths = [Path(name) for name in names] or pages()
    found = [f"{path}: {fault}: {sentence}\n" for path in paths
             for sentence, fault in faults(path.read_text(encoding="utf-8"))]
    print("".join(found), end="")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
