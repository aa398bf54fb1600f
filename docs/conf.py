"""How the documentation is built: `make docs`, warnings are errors."""

from __future__ import annotations

import logging
import os
import sys
from importlib.metadata import version as version_of
from pathlib import Path

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")  # small matrices: more threads only wait for each other; before numpy

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "_ext"))

logging.getLogger("skfem").setLevel(logging.WARNING)

project = "bayesplate"
author = "The bayesplate authors"
copyright = "The bayesplate authors"
release = version = version_of("bayesplate")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "numpydoc",
    "gallery",
    "sphinx_gallery.gen_gallery",
    "sphinx_copybutton",
    "mathml",
    "commands",
    "computed",
    "public_names",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
_tables = [path for path in (HERE / "validation").glob("*.md") if not path.read_text("utf-8").startswith("# ")]
exclude_patterns = ["_build", "_ext", "_generated", "images", *(f"validation/{path.name}" for path in _tables)]
nitpicky = True
default_role = "literal"  # in docstrings single backticks mean code
show_warning_types = True

myst_enable_extensions = ["dollarmath", "deflist", "colon_fence", "attrs_inline"]
myst_heading_anchors = 3

autodoc_typehints = "none"  # the docstrings state shape and unit
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
add_module_names = False
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = "bayesplate"
html_static_path = ["_static"]
html_extra_path = ["_generated/extra"]  # reports, written while pages are read
(HERE / "_generated" / "extra").mkdir(parents=True, exist_ok=True)
html_css_files = ["bayesplate.css"]
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#005a8c", "color-brand-content": "#005a8c"},
    "dark_css_variables": {"color-brand-primary": "#6fbdf0", "color-brand-content": "#6fbdf0"},
}
copybutton_prompt_text = "$ "

html_show_sphinx = False
html_copy_source = False

TOO_LONG = ("campaign", "closing_the_loop", "known_effects")
"""Examples that take more than about twenty seconds: shown, not run."""

sphinx_gallery_conf = {
    "examples_dirs": "_generated/examples",
    "gallery_dirs": "examples",
    "filename_pattern": rf"/(?!{'|'.join(TOO_LONG)})\w+\.py$",
    "ignore_pattern": r"__init__\.py",
    "reset_argv": "gallery.arguments_of",
    "image_scrapers": ("gallery",),
    "download_all_examples": False,
    "show_signature": False,
    "show_memory": False,
    "write_computation_times": False,
    "abort_on_example_error": True,
    "log_level": {"backreference_missing": "info"},
}
