"""How Sphinx builds the documentation. `./upswing docs` runs it through tools/docs.py, on a copy of
docs/ to which the generated pages of the reference are added.

Links that leave docs/ work on GitHub as they stand. In the copy, tools/docs.py turns a link to
README.md, CHANGELOG.md, CONTRIBUTING.md or SECURITY.md into one to a page of the site, a link to
another file of the repository into a download of that file, and a link to a folder into its text.
"""

import os
import re
import sys
from pathlib import Path

from docutils import nodes
from latex2mathml import converter

root = Path(os.environ["UPSWING_ROOT"])
sys.path.insert(0, str(root / "python"))

project = "Upswing"
copyright = "the Upswing developers"
version = release = re.search(r"project\(upswing VERSION (\S+)",
                              (root / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]

myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 4

breathe_projects = {"upswing": os.environ["UPSWING_DOXYGEN_XML"]}
breathe_default_project = "upswing"
breathe_show_include = False
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
html_static_path = ["_static"]
html_css_files = ["style.css"]
html_favicon = "_static/icon.svg"
html_show_sourcelink = False
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"light_logo": "icon.svg", "dark_logo": "icon.svg"}
html_math_renderer = "mathml"


# Formulas become MathML, which browsers draw themselves: no script, no fonts, no network.
def mathml(formula, display):
    text = converter.convert(formula, display=display)
    # A prime is raised by itself; as an exponent it would be tiny with most fonts.
    return re.sub(r"<msup>(<mi>[^<]*</mi>)<mi>&#x02032;</mi></msup>",
                  r'<mrow>\1<mo lspace="0" rspace="0">&#x02032;</mo></mrow>', text)


def inline_math(translator, node):
    translator.body.append(mathml(node.astext(), "inline"))
    raise nodes.SkipNode


def displayed_math(translator, node):
    translator.body.append(f'<div class="formula">{mathml(node.astext(), "block")}</div>\n')
    raise nodes.SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", (inline_math, None), (displayed_math, None))
