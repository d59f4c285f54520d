#!/usr/bin/env python3
"""Finds the worst habits of English by patterns: in README.md, docs/ and notebooks, in the code's
comments, help lines, messages and names of tests, and in the texts of the page.

  prose.py [FILE...]    lists what it finds, and ends with 1 if anything is found
"""

import inspect
import json
import re
import sys
from pathlib import Path

from pages import pages, without_code
from program import ROOT

MOST_WORDS = 40  # per sentence

# Patterns, and what to write instead.
HABITS = {
    r"(?<!#)\bbeside\b": "next to",
    r"\banew\b": "again",
    r"\balone\b": "only",
    r"\bone[’']s own\b": "your own",
    r"\boneself\b": "yourself",
    r"\b(?:no|some|any|every)body\b": "no one, any user; name who",
    r"\bwhoever\b|\b(?:for|of|to|by|with) who\b": "anyone who",
    r"\bwhat (?!does\b)(?:[a-z]+s|are|were)\b": "name the thing",
    r"\bthose (?:that|which|who|it|they)\b|^(?:that|those) of\b": "name the thing",
    r"(?:^|\b(?:as|if|when|where|while|that|so|because) )one (?:can|may|must|should|sees|goes)\b": "you",
    r"\bso (?:many|much)\b|\bfor so long\b": "a number, or N",
    r"\bsuch as (?:those|that|these)\b": "name the thing",
    r"\bthe same of\b": "name the equal things",
    r"\b(?:befell|mended|reckons?|thereof|whereby|lest|whilst)\b": "a word of today",
    r"\bsays? of\b|\bsaid of\b": "describes",
    r"(?:[a-z)]; (?!\w+:)\w+ \w+ .*){3}": "a sentence for each fact, or a list",
}

# Comments and strings in each language. A string is text for people if it has some words.
C_LIKE = r"(?P<comment>//[^\n]*|/\*.*?\*/)"
STRING = r'"(?:\\.|[^"\\\n])*"'
PATTERNS = {
    "cpp": rf"{C_LIKE}|R\"(?P<end>\w*)\((?P<raw>.*?)\)(?P=end)\"|(?P<string>{STRING})|"
           r"(?<!\w)'(?:\\.|[^'\\\n])*'",
    "typescript": rf"{C_LIKE}|(?P<string>{STRING}|'(?:\\.|[^'\\\n])*'|`(?:\\.|[^`\\])*`)",
    "python": rf"(?P<comment>#[^\n]*)|(?P<string>\"\"\".*?\"\"\"|{STRING}|'(?:\\.|[^'\\\n])*')",
    "shell": r"(?P<comment>(?<!\S)#[^\n]*)|(?P<string>\"(?:\\.|[^\"\\])*\"|'[^'\n]*')",
}
PATTERNS = {language: re.compile(pattern, re.DOTALL) for language, pattern in PATTERNS.items()}
LANGUAGES = {
    **dict.fromkeys((".cc", ".h", ".c", ".in", ".proto"), "cpp"),
    **dict.fromkeys((".ts", ".mjs", ".css"), "typescript"),
    **dict.fromkeys((".sh", ".cmake", ".toml"), "shell"), ".py": "python", ".html": "html",
    **dict.fromkeys(("CMakeLists.txt", "upswing", "web_test", "fetch_wheel"), "shell"),
}
FOLDERS = ("src", "extras", "tools", "python", "cmake", "configs", "examples", "web/src", "web/wasm",
           "web/tests")
INLINE = re.compile(r"</?(?:a|b|br|code|em|i|kbd|output|small|span|strong|sub|sup|time)\b[^>]*>")


def language(path):
    return LANGUAGES.get(path.name) or LANGUAGES.get(path.suffix)


def sources():
    """The files with code and with words of the page."""
    files = [ROOT / "CMakeLists.txt", ROOT / "upswing", ROOT / "web/index.html"]
    for folder in FOLDERS:
        files += sorted((ROOT / folder).rglob("*"))
    return [path for path in files if language(path) and path.is_file()
            and not {"testdata", "corpus", "__pycache__"} & set(path.parts)]


def notebooks():
    return sorted((ROOT / "examples/notebooks").glob("*.ipynb"))


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


def texts(path):
    """The names of tests, comments and strings of a source file. Adjacent ones form one text."""
    source = path.read_text(encoding="utf-8")
    if language(path) == "html":
        source = re.sub(r"<(script|style)\b.*?</\1>", "", source, flags=re.DOTALL)
        yield from re.split(r"<[^>]*>", re.sub(r"<!--|-->", "<>", INLINE.sub("", source)))
        yield from re.findall(r"(?:label|title|alt|content)=\"([^\"]*)\"", source)
        return
    for name in re.findall(r"TEST\w*\(\s*\w+,\s*(\w+)\)|def (test_\w+)", source):
        yield re.sub(r"_|(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", "".join(name))
    only_docstrings = re.search(r"(_test|^testing)\.", path.name) is not None
    text, is_comment, column, end = "", False, 0, 0
    for found in PATTERNS[language(path)].finditer(source):
        before = source[source.rfind("\n", 0, found.start()) + 1:found.start()]
        gap = source[end:found.start()]
        if bool(found["comment"]) != is_comment or not (
                re.fullmatch(r"[ \t]*\n[ \t]*", gap) and len(before) == column if is_comment else
                re.fullmatch(r"[\s+fr]*", gap)):
            yield text
            text = ""
        is_comment, column, end = bool(found["comment"]), len(before), found.end()
        if is_comment:
            text += plain_comment(found[0])
        elif not only_docstrings or found[0].startswith('"""') and not before.strip():
            text += plain_string(found[0])
    yield text


def plain_comment(text):
    return separated(re.sub(r"^\s*(?:/\*+|//[/!]?<?|#+!?|\*+/?) ?|\*/$", "", text,
                            flags=re.MULTILINE)) + "\n"


def plain_string(text):
    """The content of a string, if it is text for people."""
    if len(text.split()) < 4 or "\\b" in text:
        return ""
    is_docstring = text.startswith('"""')
    text = re.sub(r"^(?:R\"\w*\(|\"\"\"|[\"'`])|(?:\"\"\"|\)\w*\"|[\"'`])$", "", text)
    text = re.sub(r"\$?\{[^{}\n]*\}", "X", text.replace("\\n", "\n"))
    return separated(inspect.cleandoc(text) if is_docstring else text)


def separated(text):
    """The text with each line of a layout in columns as a paragraph of its own."""
    return re.sub(r"^ *(.*  .*)$", r"\n\1\n", text, flags=re.MULTILINE)


def sentences(paragraph):
    return re.split(r"(?<=[.!?:])[”\"*_)]*\s+(?=[\"“(*_]*[A-Z0-9])", paragraph)


def faults(markdown):
    """(sentence, fault) for each fault."""
    for paragraph in paragraphs(markdown):
        for sentence in sentences(paragraph):
            for habit, instead in HABITS.items():
                found = re.search(habit, sentence, re.IGNORECASE)
                # A question may begin with "What".
                if found and not (found[0].lower().startswith("what") and sentence.endswith("?")):
                    yield sentence, f"\"{found[0]}\": {instead}"
            words = len(re.findall(r"\S*[a-z]\S*", sentence))  # formulas have none
            if words > MOST_WORDS:
                yield sentence, f"{words} words, of at most {MOST_WORDS}"


def faults_of(path):
    """(sentence, fault) for each fault of a page or a source file."""
    if path.suffix == ".md":
        return list(faults(path.read_text(encoding="utf-8")))
    if path.suffix == ".ipynb":
        return [fault for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]
                if cell["cell_type"] == "markdown" for fault in faults("".join(cell["source"]))]
    return [fault for text in texts(path) for fault in faults(text)]


def main(names):
    paths = [Path(name) for name in names] or pages() + notebooks() + sources()
    found = [f"{path}: {fault}: {sentence}\n" for path in paths
             for sentence, fault in faults_of(path)]
    print("".join(found), end="")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
