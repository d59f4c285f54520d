#!/usr/bin/env python3
"""Writes the project's address on the web into all files that name it: address.py URL.

Run it once, when you publish the project, and commit the changes.
"""

import os
import re
import sys
from pathlib import Path
from urllib.parse import urlsplit

ROOT = Path(os.environ.get("UPSWING_ROOT", Path(__file__).resolve().parents[2]))
# Of each file: the place of the address, with an older address in it, and the text for a new one.
PLACES = (
    ("README.md", r"git clone \S+ upswing", "git clone {url} upswing"),
    ("docs/start/install.md", r"--repo \S+(?=`)", "--repo {repository}"),
    ("docs/answers.md", r"  year    = \{2026\}(,\n  url     = \{.*\})?\n\}", "  year    = {{2026}},\n  url     = {{{url}}}\n}}"),
    ("CITATION.cff", r"license: Apache-2.0\n(repository-code: .*\n)?", "license: Apache-2.0\nrepository-code: {url}\n"),
    ("pyproject.toml", r'(urls\.Source = .*\n)?urls\."Post', 'urls.Source = "{url}"\nurls."Post'),
)


def main():
    if len(sys.argv) != 2:
        sys.exit("address.py: expected the address of the repository, such as https://github.com/OWNER/NAME")
    url = sys.argv[1].rstrip("/")
    parts = urlsplit(url)
    if parts.scheme != "https" or not re.fullmatch(r"[\w.-]+(:\d+)?", parts.netloc) or \
            not re.fullmatch(r"(/[\w.~-]+)+", parts.path) or parts.query or parts.fragment:
        sys.exit(f"address.py: expected an address such as https://github.com/OWNER/NAME, got {sys.argv[1]!r}")
    texts = {}
    for name, pattern, text in PLACES:
        before = (ROOT / name).read_text(encoding="utf-8")
        new = text.format(url=url, repository=parts.path[1:])
        texts[name], places = re.subn(pattern, lambda _, new=new: new, before)
        if places != 1:
            sys.exit(f"address.py: {name}: expected the place of the address once, found it {places} times")
    for name, text in texts.items():
        (ROOT / name).write_text(text, encoding="utf-8")
        print(f"{name}: {url}")


if __name__ == "__main__":
    main()
