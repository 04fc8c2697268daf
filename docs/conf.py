"""Documentation site: ``sphinx-build -W -b html docs OUT`` from the root, with the extra ``docs``; needs no network.

What the program can say itself is made from it: ``docs/pages`` writes the pages of problems, papers, algorithms, commands and
names to ``docs/generated``, and the gallery runs the examples.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

import nlp_gait  # noqa: E402
from docs.pages import algorithms, api, commands, gallery, gradient, model, numbers, papers, playground, problems  # noqa: E402
from docs.pages.api import linked  # noqa: E402

project = "nlp-gait"
author = "The authors of nlp-gait"
project_copyright = "the authors of nlp-gait; BSD-3-Clause"
smartquotes = False  # two hyphens are an option
release = version = nlp_gait.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_gallery.gen_gallery", "docs.mathml"]
exclude_patterns = [
    "pages",
    "generated/papers",
    "generated/examples",
    "generated/model",
    "generated/gradient",
    "generated/study",
    "generated/numbers",
    "generated/gallery/*.ipynb",
    "generated/gallery/*.py",
    "**/sg_execution_times.*",
]
suppress_warnings = ["config.cache"]  # the gallery's configuration holds functions, which Sphinx cannot pickle
nitpicky = False
default_role = "code"

myst_enable_extensions = ["colon_fence", "dollarmath", "fieldlist"]
myst_dmath_double_inline = False
html_math_renderer = "mathml"
myst_heading_anchors = 4

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
autodoc_class_signature = "separated"
toc_object_entries = False  # each name has a heading; entries of members triple the time of the navigation
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_custom_sections = [("Source", "notes")]
napoleon_use_ivar = True

html_theme = "furo"
html_title = f"nlp-gait {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_extra_path = [f"generated/{playground.FOLDER}"]
(ROOT / "docs" / html_extra_path[0]).mkdir(parents=True, exist_ok=True)
html_use_index = False
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#005a8c", "color-brand-content": "#005a8c"},
    "dark_css_variables": {"color-brand-primary": "#56b4e9", "color-brand-content": "#56b4e9"},
}

sphinx_gallery_conf = gallery.configuration(ROOT)


slow_pages = []  # the process that writes them


def setup(app):
    """Write the generated pages before any page is read."""
    app.connect("builder-inited", start_slow_pages, priority=0)  # before the gallery runs the examples
    app.connect("builder-inited", write_pages)
    app.connect("autodoc-process-docstring", linked)
    app.connect("env-updated", wait_for_slow_pages)


def start_slow_pages(app):
    """Write pages that Sphinx does not read, in a process of their own: a study, films of gaits, the playground."""
    folder = Path(app.srcdir) / "generated"
    slow_pages.append(subprocess.Popen([sys.executable, "-m", "docs.pages.front", str(folder)], cwd=ROOT))


def write_pages(app):
    """Pages of problems, papers, algorithms, commands and names."""
    folder = Path(app.srcdir) / "generated"
    for part in (numbers, problems, papers, algorithms, commands, api, model, gradient, playground):
        part.write(folder)


def wait_for_slow_pages(app, env):
    """Wait until all files exist that Sphinx copies."""
    if slow_pages.pop().wait():
        raise RuntimeError("docs.pages.front failed; it has printed why")
