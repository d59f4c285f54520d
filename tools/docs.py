#!/usr/bin/env python3
"""Builds the documentation: ./upswing docs runs this script in its virtual environment.

  docs.py build FOLDER    a static site, which works from any folder and from file://
  docs.py serve FOLDER    serves a folder on this machine only
  docs.py join FOLDER     links the page in FOLDER and the documentation in FOLDER/docs to each other

Sphinx builds from build/docs-work, which gets the pages of docs/ and the generated pages of the
reference. Unchanged pages are not rebuilt.
"""

import argparse
import functools
import http.server
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from urllib.parse import unquote

import program
from pages import FENCED, markdown_table
from program import ROOT

WORK = Path(os.environ.get("UPSWING_DOCS_WORK", ROOT / "build/docs-work"))
SOURCE = WORK / "source"
XML = WORK / "doxygen/xml"
DOCTREES = WORK / "doctrees"

# Pages of the repository's root that the site also has.
ROOT_PAGES = {"CHANGELOG.md": "development/changelog.md",
              "CONTRIBUTING.md": "development/contributing.md",
              "SECURITY.md": "development/security.md"}

LAYERS = {
    "base": "Contracts and basics", "nn": "Networks", "pendulum": "Tasks", "rl": "Learning",
    "control": "Controllers", "os": "Files and processes", "mujoco": "MuJoCo",
    "report": "Statistics and figures", "agents": "Settings and named agents", "runs": "Runs on disk",
    "judge": "Evaluation", "machine": "Logs of machines", "realaigym": "RealAIGym",
    "loop": "Control of machines", "deploy": "Export"}


class Stage:
    """The folder that Sphinx reads. Unchanged files keep their modification time."""

    def __init__(self, folder):
        self.folder = folder
        self.files = set()

    def write(self, name, content):
        content = content.encode() if isinstance(content, str) else content
        path = self.folder / name
        self.files.add(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_bytes() != content:
            path.write_bytes(content)

    def remove_others(self, out):
        """Removes files that no longer belong to the folder, and everything built from them. Returns
        the removed files."""
        removed = [path for path in self.folder.rglob("*")
                   if path.is_file() and path not in self.files]
        for path in removed:
            path.unlink()
            (out / path.relative_to(self.folder)).with_suffix(".html").unlink(missing_ok=True)
        return removed


# --- Pages written by hand ----------------------------------------------------------------------


def stage_pages(stage):
    docs = ROOT / "docs"
    for path in sorted(docs.rglob("*")):
        name = str(path.relative_to(docs))
        if path.suffix == ".md":
            stage_page(stage, path, name)
        elif path.is_file() and "__pycache__" not in name and name != "search.js":
            stage.write(name, path.read_bytes())
    stage.write("search.js", search_code())
    for root_name, name in ROOT_PAGES.items():
        stage_page(stage, ROOT / root_name, name)
    for name in ("icon.svg", "fonts/hanken-grotesk.woff2", "fonts/bricolage-grotesque.woff2"):
        stage.write(f"_static/{name}", (ROOT / "web/public" / name).read_bytes())


def search_code():
    """The code of the search, with the words that lead to pages and sections."""
    words = tomllib.loads((ROOT / "docs/search.toml").read_text(encoding="utf-8"))
    by_page = {place.replace(".md", ""): texts for place, texts in words.items()}
    code = (ROOT / "docs/search.js").read_text(encoding="utf-8")
    return f"const SEARCH_WORDS = {json.dumps(by_page)};\n{code}"


def stage_page(stage, path, name):
    """Copies a page, and adapts its links to the place of the copy."""
    folder = (SOURCE / name).parent

    def redirect(link):
        text, target = link[1], link[2]
        if re.match(r"[a-z]+:|#", target):
            return link[0]
        place, anchor = (target.split("#", 1) + [""])[:2]
        inside = os.path.relpath(os.path.normpath(path.parent / unquote(place)), ROOT)
        if (ROOT / inside).is_dir():
            return text.removeprefix("[").removesuffix("]") if not text.startswith("!") else link[0]
        if inside == "README.md":
            new = "index.md"
        elif inside in ROOT_PAGES:
            new = ROOT_PAGES[inside]
        elif inside.startswith("docs" + os.sep):
            new = str(Path(inside).relative_to("docs"))
        elif (ROOT / inside).is_file():
            new = f"files/{inside}" + (".txt" if inside.endswith(".md") else "")  # not a page
            stage.write(new, (ROOT / inside).read_bytes())
        else:
            return link[0]  # Sphinx reports the broken link
        target = os.path.relpath(SOURCE / new, folder) + ("#" + anchor if anchor else "")
        return f"{text}({target})"

    stage.write(name, outside_code(path.read_text(encoding="utf-8"), lambda text: re.sub(
        r"(!?\[(?:[^\[\]]|!\[[^\]]*\]\([^)]*\))*\])\(([^)\s]+)\)", redirect, text)))


def outside_code(text, change):
    """The text with a change applied outside fenced blocks."""
    pieces, end = [], 0
    for block in FENCED.finditer(text):
        pieces += [change(text[end:block.start()]), block[0]]
        end = block.end()
    return "".join([*pieces, change(text[end:])])


# --- Generated pages ----------------------------------------------------------------------------


def command_line_page():
    parts = ["# Command line\n\nThe help text of every command, as `./upswing COMMAND --help` prints "
             "it. [Settings](settings.md) has the settings of trainings as tables.\n",
             markdown_table(["command", "what it does"],
                            [[f"[`{name}`](#{name})", text]
                             for name, text in program.commands().items()])]
    for name in program.commands():
        text = program.help_of(name).rstrip().replace(str(ROOT), ".")
        parts.append(f"## {name}\n\n```text\n{text}\n```\n")
    return "\n".join(parts)


def settings_page():
    """One table per section; sections shared by the algorithms appear once."""
    per_algorithm = {name: program.settings(agent) for name, agent in program.ALGORITHMS.items()}
    own = {"network", "agent"}
    shared = {name: setting for settings in per_algorithm.values()
              for name, setting in settings.items() if setting.section not in own}
    parts = ["""# Settings

Every setting of a training is a key of a TOML file (`./upswing train --config FILE`), a flag with `-`
in place of `_` (`--eval-every` sets `eval_every`), and a line of the run's `config.toml`.
Precedence, from weak to strong: defaults, named agent, file, flags. `./upswing train --agent AGENT
--print-config` prints the settings of a named agent.

The defaults are those of the agents """
             + ", ".join(f"`{agent}`" for agent in program.ALGORITHMS.values())
             + ". A default that differs between them names the agent.\n"]
    for section in dict.fromkeys(setting.section for setting in shared.values()):
        parts.append(f"## {section}\n")
        parts.append(settings_table(
            [(setting, defaults_of(name, per_algorithm)) for name, setting in shared.items()
             if setting.section == section]))
    for algorithm, settings in per_algorithm.items():
        parts.append(f"## Algorithm {algorithm}\n")
        for section in ("network", "agent"):
            parts.append(f"### {algorithm}: {section}\n")
            parts.append(settings_table([(setting, code(setting.default))
                                         for setting in settings.values()
                                         if setting.section == section]))
    return "\n".join(parts)


def settings_table(rows):
    lines = [[f"`{setting.name}`", default, setting.values, setting.unit, setting.meaning]
             for setting, default in rows]
    return markdown_table(["name", "default", "range", "unit", "meaning"],
                          [[cell.replace("|", "\\|") for cell in line] for line in lines])


def code(value):
    return "none" if value in ("", '""') else f"`{value}`"


def defaults_of(name, per_algorithm):
    defaults = {program.ALGORITHMS[algorithm]: code(settings[name].default)
                for algorithm, settings in per_algorithm.items() if name in settings}
    if len(set(defaults.values())) == 1:
        return next(iter(defaults.values()))
    return ", ".join(f"{agent}: {default}" for agent, default in defaults.items())


PYTHON_PAGE = """# Python API

The package `upswing`. [Python](../howto/python.md) shows how to use it.

```{eval-rst}
.. automodule:: upswing
   :members:
   :exclude-members: Error, Failure, InputError
   :imported-members:

.. automodule:: upswing.machine
   :members:
   :special-members: __call__

.. py:exception:: upswing.InputError

   An argument is wrong. A :py:exc:`ValueError`.

.. py:exception:: upswing.Failure

   Work failed although its arguments are right, such as writing to a full disk. A
   :py:exc:`RuntimeError`.

.. py:exception:: upswing.Error

   The base class of both.
```
"""


def layers():
    text = (ROOT / "cmake/install.cmake").read_text(encoding="utf-8")
    return [name for names in re.findall(r"set\(UPSWING_(?:LAYERS|EXTRAS) ([^)]*)\)", text)
            for name in names.split()]


def headers_of(layer):
    """The headers that cmake --install installs, as they are included, with their paths."""
    return {path.relative_to(root).as_posix(): path
            for root, folder in ((ROOT / "src", layer), (ROOT, f"extras/{layer}"))
            for path in sorted((root / folder).rglob("*.h"))
            if not path.name.endswith(("testing.h", "-inl.h"))}


# Parts of a header that its page shows: everything except private parts.
SECTIONS = ("briefdescription detaileddescription innerclass define enum func typedef var "
            "user-defined public-type public-func public-attrib public-static-func "
            "public-static-attrib protected-type protected-func protected-attrib "
            "protected-static-func protected-static-attrib")


def stage_cpp_api(stage):
    names = layers()
    listing = markdown_table(["layer", "purpose", "headers"],
                             [[f"[`{name}`](cpp-api/{name}.md)", LAYERS.get(name, name),
                               str(len(headers_of(name)))] for name in names])
    stage.write("reference/cpp-api.md", f"""# C++ API

The installed headers, by layer. A layer uses only layers above it in this table. [The C++
library](../howto/cpp-library.md) shows how to link it. All names are in the namespace `upswing`.

{listing}
```{{toctree}}
:hidden:
:maxdepth: 1

{chr(10).join(f"cpp-api/{name}" for name in names)}
```
""")
    for name in names:
        parts = [f"# {LAYERS.get(name, name)}: {name}\n"]
        for path in headers_of(name):
            parts.append(f"## {path}\n\n```{{doxygenfile}} {path}\n:sections: {SECTIONS}\n```\n")
        stage.write(f"reference/cpp-api/{name}.md", "\n".join(parts))


DOXYFILE = """
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
EXTRACT_ALL = YES
JAVADOC_AUTOBRIEF = YES
SORT_MEMBER_DOCS = NO
MACRO_EXPANSION = YES
QUIET = YES
WARNINGS = NO
RECURSIVE = YES
# A struct and a function have this name, which Sphinx takes for one thing.
EXCLUDE_SYMBOLS = Difference
"""


def for_doxygen(text):
    """A header rewritten so that Doxygen and Sphinx can show it."""
    # A comment above the namespace describes the header. The namespace is removed, because it would
    # precede each name.
    text = re.sub(r"((?:^///.*\n)+)namespace upswing \{\n", r"/// \\file\n\1", text, flags=re.MULTILINE)
    text = re.sub(r"^namespace upswing \{\n|^\}  // namespace upswing\n", "", text, flags=re.MULTILINE)
    # A comment after a member describes the member.
    text = re.sub(r"([;,]) +// +", r"\1  ///< ", text)
    # Sphinx's C++ parser accepts neither a literal in several lines, nor designated initialisers, nor
    # lambdas.
    text = re.sub(r'"\n +"', "", text)
    text = re.sub(r"(?<=[{,])(\s*)\.\w+ = ", r"\1", text)
    return re.sub(r"=\s*\[\] *\{[^{}]*\}(\(\))?(?=[;,)])", "= {}", text)


def run_doxygen():
    """Writes the XML of the headers unless it is up to date."""
    headers = Stage(WORK / "headers")
    for name in layers():
        for header, path in headers_of(name).items():
            headers.write(header, for_doxygen(path.read_text(encoding="utf-8")))
    if headers.remove_others(WORK):
        shutil.rmtree(DOCTREES, ignore_errors=True)  # Breathe would look for the XML of each header
    settings = DOXYFILE + (f"OUTPUT_DIRECTORY = {XML.parent}\nINPUT = {headers.folder}\n"
                           f"STRIP_FROM_PATH = {headers.folder}\n")
    stamp = XML.parent / "made-of.txt"
    state = settings + "".join(f"{header} {header.stat().st_mtime_ns}\n"
                               for header in sorted(headers.files))
    if stamp.exists() and stamp.read_text(encoding="utf-8") == state:
        return
    shutil.rmtree(XML.parent, ignore_errors=True)
    XML.parent.mkdir(parents=True)
    subprocess.run(["doxygen", "-"], input=settings, check=True, encoding="utf-8")
    # Breathe looks up a header by its name in the index, which Doxygen writes without the folder.
    index = XML / "index.xml"

    def with_folder(entry):
        place = re.search(r'<location file="([^"]+)"',
                          (XML / f"{entry[1]}.xml").read_text(encoding="utf-8"))
        return entry[0].replace(f"<name>{entry[2]}</name>", f"<name>{place[1]}</name>")

    index.write_text(re.sub(r'<compound refid="([^"]+)" kind="file"><name>([^<]+)</name>',
                            with_folder, index.read_text(encoding="utf-8")), encoding="utf-8")
    stamp.write_text(state, encoding="utf-8")


# --- The site -----------------------------------------------------------------------------------


def build(out, jobs):
    run_doxygen()
    stage = Stage(SOURCE)
    stage_pages(stage)
    stage.write("reference/command-line.md", command_line_page())
    stage.write("reference/settings.md", settings_page())
    stage.write("reference/python-api.md", PYTHON_PAGE)
    stage_cpp_api(stage)
    stage.remove_others(out)
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-b", "html", "-q", "-W", "--jobs", jobs,
         "-d", DOCTREES, SOURCE, out], check=False, stdin=subprocess.DEVNULL,
        env=os.environ | {"UPSWING_ROOT": str(ROOT), "UPSWING_DOXYGEN_XML": str(XML)})
    if done.returncode != 0:
        shutil.rmtree(DOCTREES, ignore_errors=True)  # so that the next build warns again
        return 1
    return 0


def serve(folder):
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=folder)
    for port in range(4174, 4274):
        try:
            server = http.server.ThreadingHTTPServer(("127.0.0.1", port), handler)
        except OSError:
            continue
        print(f"upswing: the documentation is at http://localhost:{port}/ (Ctrl-C to end)",
              flush=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            return 130
    print("upswing: docs: ports 4174 to 4273 are all in use", file=sys.stderr)
    return 1


PAGE = "http://localhost:4173/"  # of ./upswing demo, where the documentation links to it


def join(site):
    page = site / "index.html"
    text = page.read_text(encoding="utf-8")
    page.write_text(re.sub(r'(class="site"[^>]*?) hidden(?:="")?', r"\1", text), encoding="utf-8")
    for path in (site / "docs").rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        root = os.path.relpath(site, path.parent) + "/"
        new = text.replace(f'href="{PAGE}', f'href="{root}').replace(f">{PAGE}#", ">#")
        if new != text:
            path.write_text(new, encoding="utf-8")
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("build", "serve", "join"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--jobs", default="auto", help="processes of Sphinx")
    arguments = parser.parse_args()
    if arguments.action == "serve":
        return serve(arguments.folder)
    if arguments.action == "join":
        return join(arguments.folder)
    return build(arguments.folder, arguments.jobs)


if __name__ == "__main__":
    sys.exit(main())
