"""Settings of Sphinx for the site: ``python -m sphinx docs build/site/html``.

Examples are run for the gallery, tutorials for their results; both are kept and run again only
when they change. ``-D plot_gallery=0 -D nb_execution_mode=off`` runs neither. With ``-t online``
names of NumPy, SciPy, Matplotlib and others in docstrings lead to their documentation.
"""

import logging
import sys
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "site"))

import gallery  # noqa: E402

import fecontact  # noqa: E402

project = "fecontact"
author = "The fecontact developers"
project_copyright = "The fecontact developers, BSD 3-clause licence"
for _name in ("skfem", "traitlets"):  # these tell of every assembly and every notebook
    logging.getLogger(_name).setLevel(logging.WARNING)
version = release = fecontact.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_gallery.gen_gallery",
              "equations", "public_names"]
root_doc = "index"
exclude_patterns = ["site/**", "validation/**", "gallery/*.ipynb", "gallery/*.py",
                    "gallery/**/*.json", "sg_execution_times.rst"]
# The gallery keeps settings that cannot be stored between builds, which is of no consequence.
suppress_warnings = ["config.cache"]

if tags.has("online"):  # type: ignore[name-defined]  # noqa: F821
    extensions.append("sphinx.ext.intersphinx")
intersphinx_mapping = {
    "python": ("https://docs.python.org/3", None),
    "numpy": ("https://numpy.org/doc/stable", None),
    "scipy": ("https://docs.scipy.org/doc/scipy", None),
    "matplotlib": ("https://matplotlib.org/stable", None),
    "pyvista": ("https://docs.pyvista.org", None),
    "pandas": ("https://pandas.pydata.org/docs", None),
}
linkcheck_anchors = False           # pages that scripts put together have none

myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 4
highlight_language = "none"

# Tutorials.
nb_execution_mode = "cache"
nb_execution_cache_path = str(DOCS.parent / "build" / "site" / "tutorials")
nb_execution_in_temp = True
nb_execution_timeout = 900
nb_execution_raise_on_error = True

# Examples: a part of the gallery each; those that need a file of the user are only shown.
sphinx_gallery_conf = {
    "examples_dirs": gallery.copied(),
    "gallery_dirs": "gallery",
    "filename_pattern": r"/(?!brake_reuss_beam)\w+\.py$",
    "within_subsection_order": "gallery.in_order",
    "image_scrapers": ("gallery.written",),
    "reset_modules": ("gallery.emptied",),
    "capture_repr": (),
    "remove_config_comments": True,
    "abort_on_example_error": True,
    "download_all_examples": False,
    "min_reported_time": 10_000,
    "write_computation_times": False,
    "copyfile_regex": r".*\.toml",
}

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
