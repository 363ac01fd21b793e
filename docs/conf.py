"""Sphinx's settings; `make docs` builds the pages with warnings as errors."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]

import lobefem
import lobefem.linalg.dolfinx_compat  # first: it finds the stack

project = "lobefem"
author = "The lobefem developers"
release = version = lobefem.__version__
copyright = author  # noqa: A001  Sphinx's name

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "mathml"]
exclude_patterns = ["_generated/*", "_computed/*"]
source_suffix = {".md": "markdown"}
nitpicky = True
suppress_warnings = ["ref.python"]  # an attribute's name that several classes have is no reference
nitpick_ignore_regex = [("py:.*", ".*")]  # signatures name classes that are no part of these pages

myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3

math_number_all = False
html_math_renderer = "mathml"
html_theme = "furo"
html_title = f"lobefem {release}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_copy_source = False
html_show_copyright = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
napoleon_use_ivar = True
napoleon_use_rtype = False


def _as_prose(app, what, name, obj, options, lines):
    """Docstrings are prose: |z| is no substitution, and no property's text before a colon a type."""
    if what == "property" and lines:
        lines[0] = lines[0].replace(": ", ", ", 1)
    lines[:] = [line.replace("|", r"\|") for line in lines]


def setup(app):
    """Sphinx's hook."""
    app.connect("autodoc-process-docstring", _as_prose, priority=400)  # before napoleon
