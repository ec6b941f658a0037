"""How Sphinx builds these pages: `sphinx-build -W --keep-going -n docs docs/_build/html`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

from frictionsim import __version__

project = "frictionsim"
author = "The frictionsim developers"
copyright = "The frictionsim developers, MIT licence"
release = version = __version__

extensions = ["myst_parser", "mathml"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 4
suppress_warnings = ["epub.unknown_project_files"]
exclude_patterns = ["_build", "_ext"]
nitpicky = True

html_theme = "furo"
html_title = "frictionsim"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["maths.css"]
html_show_sourcelink = False
html_copy_source = False
