"""How Sphinx builds the documentation. `./upswing docs` runs it through tools/docs.py, on a copy of
docs/ to which the generated pages of the reference are added.

Links that leave docs/ work on GitHub as they stand. In the copy, tools/docs.py turns a link to
README.md, CHANGELOG.md, CONTRIBUTING.md or SECURITY.md into one to a page of the site, a link to
another file of the repository into a download of that file, and a link to a folder into its text.
"""

import importlib.util
import os
import re
import sys
from pathlib import Path

from sphinx import addnodes

root = Path(os.environ["UPSWING_ROOT"])
sys.path.insert(0, str(root / "python"))

project = "Upswing"
copyright = "the Upswing developers"
version = release = re.search(r"project\(upswing VERSION (\S+)",
                              (root / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc", "sphinx.ext.napoleon",
              "sphinx.ext.mathjax", "sphinx_copybutton"]

myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 4

breathe_projects = {"upswing": os.environ["UPSWING_DOXYGEN_XML"]}
breathe_default_project = "upswing"
breathe_show_include = False
toc_object_entries = False  # with names in the contents of each page, the build takes twice as long
smartquotes = False  # an s' in a formula is no quotation
default_role = "literal"  # docstrings have names in single backticks

# The package's own sources are read; what it imports is not needed for that.
autodoc_mock_imports = ["gymnasium", "numpy", "typing_extensions", "upswing._mujoco",
                        "upswing._types", "upswing._upswing"]
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
napoleon_numpy_docstring = False

html_theme = "furo"
html_title = f"Upswing {version}"
# One file of MathJax, with its fonts, from a package that has all of it: no network, no other host.
package = importlib.util.find_spec("sphinx-mathjax-offline").submodule_search_locations[0]
mathjax_path = "tex-svg-full.js"
html_static_path = ["_static", str(Path(package) / "static/mathjax" / mathjax_path)]
html_css_files = ["style.css"]
html_js_files = [("site.js", {"defer": "defer"})]
html_favicon = "_static/icon.svg"
html_search_scorer = str(Path(__file__).parent / "search.js")  # with words, by tools/docs.py
html_show_sourcelink = html_copy_source = True  # "view": the page's Markdown, also without a network
html_show_sphinx = False
FACE = {"font-stack": "'Hanken Grotesk', system-ui, sans-serif"}
html_theme_options = {  # the page's face and colours (web/src/style)
    "light_logo": "icon.svg", "dark_logo": "icon.svg",
    "light_css_variables": FACE | {
        "color-background-primary": "#fffdf8", "color-background-secondary": "#f4efe4",
        "color-foreground-primary": "#1a2133", "color-foreground-secondary": "#555c6d",
        "color-foreground-muted": "#555c6d", "color-brand-primary": "#08766b",
        "color-brand-content": "#2456c4", "color-brand-visited": "#2456c4"},
    "dark_css_variables": FACE | {
        "color-background-primary": "#0b1020", "color-background-secondary": "#151c30",
        "color-foreground-primary": "#ecf0f9", "color-foreground-secondary": "#a8b2ca",
        "color-foreground-muted": "#a8b2ca", "color-brand-primary": "#35d0bd",
        "color-brand-content": "#82abff", "color-brand-visited": "#82abff"}}
# "edit", if the address of the repository is known (as in the page, web/build/addresses.ts).
source = os.environ.get("UPSWING_SOURCE", "").rstrip("/")
if re.match("https://git(hub|lab).com/", source):
    html_theme_options |= {"source_repository": source, "source_branch": "main",
                           "source_directory": "docs"}
templates_path = ["_templates"]
html_sidebars = {"**": ["sidebar/brand.html", "page-link.html", "sidebar/search.html",
                        "sidebar/scroll-start.html", "sidebar/navigation.html",
                        "sidebar/scroll-end.html"]}


def setup(app):
    app.connect("doctree-read", simplify, priority=0)  # before Sphinx collects the contents
    app.connect("html-page-context", hide_source)
    app.connect("html-page-context", give_levels, priority=900)  # after the theme


def give_levels(app, page, template, context, doctree):
    """Gives the headings of the list of pages a level, which the theme leaves out."""
    tree = context.get("furo_navigation_tree", "")
    context["furo_navigation_tree"] = tree.replace('role="heading"', 'role="heading" aria-level="2"')


def hide_source(app, page, template, context, doctree):
    """Leaves out "view" and "edit" of pages that are not written by hand."""
    if not (root / f"docs/{page}.md").exists():
        context["page_source_suffix"] = None


def simplify(app, doctree):
    """Shortens the build. Breathe adds C++ names to the contents of a page in spite of
    `toc_object_entries`, and Sphinx searches all names for links to `std`."""
    for described in doctree.findall(addnodes.desc):
        described["no-contents-entry"] = True
    for link in list(doctree.findall(addnodes.pending_xref)):
        if link["refdomain"] == "cpp" and link["reftarget"].split("::")[0] == "std":
            link.replace_self(link.children)
