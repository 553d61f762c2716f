"""Sphinx: the documentation site. `make docs` makes what it includes first, and then calls it."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent
STATUS = (ROOT / "include/gpom/status.h").read_text(encoding="utf-8")

project = "gpom"
author = "the gpom authors"
release = ".".join(re.search(rf"GPOM_VERSION_{part} (\d+)", STATUS).group(1)
                   for part in ("MAJOR", "MINOR", "PATCH"))

extensions = ["breathe", "myst_parser"]
exclude_patterns = ["README.md"]
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
primary_domain = "c"
highlight_language = "none"
nitpicky = False

breathe_projects = {"gpom": str(ROOT / "build/docs/xml")}
breathe_default_project = "gpom"
breathe_domain_by_extension = {"h": "c"}
breathe_show_include = False

myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"gpom {release}"
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
