"""Sphinx configuration; before each build the demos draw the pictures of the gallery, and a notebook's cell is run."""

import importlib.util
import os
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
os.environ["PYVISTA_OFF_SCREEN"] = "true"

from sphinx.domains.python import PyObject  # noqa: E402

import simplexmesh  # noqa: E402

project = "simplexmesh"
author = "the simplexmesh developers"
copyright = author
version = release = simplexmesh.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "sphinx.ext.viewcode"]
myst_enable_extensions = ["amsmath", "dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "README.md"]
html_theme = "furo"
html_title = f"simplexmesh {version}"
html_static_path: list[str] = []

autodoc_typehints = "none"  # the shapes are in the docstrings
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": False}
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
for field in PyObject.doc_field_types:
    if field.name == "variable":
        field.rolename = ""  # names of attributes are text: as links they go to any class that has one of that name

ORDER = [
    *("frog", "shapes", "curvature", "dented", "noisy_scan", "sphere_to_face", "sphere_to_torus", "refinement"),
    *("saddle", "vase", "stabilizers"),
    *("decimated", "simplified", "features", "sharp", "plant", "recognition", "saliency", "occlusion"),
]


def draw_gallery(app):
    """Run every demo whose picture is missing or older than it, and write the gallery page."""
    folder = Path(app.srcdir) / "gallery"
    folder.mkdir(exist_ok=True)
    size = os.environ.get("SIMPLEXMESH_GALLERY", "large")
    lines = ["# Gallery", "", "Pictures by the scripts in `demos/`, which are also run as tests.", ""]
    for name in ORDER:
        script = ROOT / "demos" / f"{name}.py"
        picture = folder / f"{name}.png"
        demo = loaded(script)
        if not picture.exists() or picture.stat().st_mtime < script.stat().st_mtime:
            simplexmesh.plot.picture(picture, demo.show(demo.main(size=size)))
        title, _, rest = demo.__doc__.strip().partition("\n")
        lines += [f"## {title.rstrip('.')}", "", rest.strip(), "", f"![{title}](gallery/{name}.png)", ""]
        lines += [f"`demos/{name}.py`:", ""]
        lines += ["```{literalinclude} ../demos/" + f"{name}.py", ":language: python", "```", ""]
    page = Path(app.srcdir) / "gallery.md"
    text = "\n".join(lines)
    if not page.exists() or page.read_text(encoding="utf-8") != text:
        page.write_text(text, encoding="utf-8")


def run_cell(app):
    """Run the cell of the page of notebooks, and write what it shows."""
    page, shown, left = Path(app.srcdir) / "notebook.md", Path(app.srcdir) / "gallery" / "notebook.html", {}
    if not shown.exists() or shown.stat().st_mtime < page.stat().st_mtime:
        exec(page.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0], left)
        shown.write_text(left["model"]._repr_html_(), encoding="utf-8")


def loaded(script):
    """Import a demo as a module."""
    spec = importlib.util.spec_from_file_location(script.stem, script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def join_names(app, what, name, obj, options, lines):
    """Make names that share an explanation one word: of "a, b" Sphinx takes the first for the type of the second."""
    lines[:] = [re.sub(r"^\w+(, \w+)+(?= : )", lambda names: names[0].replace(", ", ","), line) for line in lines]


def setup(app):
    app.connect("autodoc-process-docstring", join_names, priority=400)  # before napoleon
    app.connect("builder-inited", draw_gallery)
    app.connect("builder-inited", run_cell)
