"""Settings of Sphinx for the site; see site/build.py, which calls it."""

import sys
from pathlib import Path

import fecontact

sys.path.insert(0, str(Path(__file__).parent / "site"))

project = "fecontact"
author = "The fecontact developers"
project_copyright = "The fecontact developers, BSD 3-clause licence"
version = release = fecontact.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon",
              "equations", "public_names"]
root_doc = "index"
exclude_patterns = ["site/**"]

myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 4
highlight_language = "none"

autodoc_typehints = "none"          # types and shapes stand in the docstrings
autodoc_class_signature = "mixed"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_param = napoleon_use_rtype = False
python_maximum_signature_line_length = 90
add_module_names = False
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_title = f"fecontact {version}"
html_static_path = ["_static"]
html_css_files = ["fecontact.css"]
html_copy_source = False
html_math_renderer = "mathml"
html_theme_options = {"navigation_with_keys": True}
