"""Gallery of examples: order, execution, and figures."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

# From the first solve to a cluster; all other files of the folder are left out.
ORDER = (
    "first_solve.py",
    "evaluate_your_own_x.py",
    "price_of_a_constraint.py",
    "sweep.py",
    "front.py",
    "your_own_objective.py",
    "your_own_limit.py",
    "your_own_problem.py",
    "your_own_algorithm.py",
    "your_own_paper.py",
    "results_from_matlab.py",
    "custom_robot.py",
    "physics_engine.py",
    "tune_in_engine.py",
    "export_motion.py",
    "notebook.py",
    "cluster.py",
)


def configuration(root: Path) -> dict[str, Any]:
    """Return the settings of sphinx-gallery, which runs a copy of the examples: they write files to the current folder."""
    copy = root / "docs" / "generated" / "examples"
    shutil.copytree(
        root / "examples", copy, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__", "callers")
    )
    return {
        "examples_dirs": str(copy),
        "gallery_dirs": "generated/gallery",
        "filename_pattern": r"(?<!your_own_paper)\.py$",  # which finds its table by its own place: tests run it
        "ignore_pattern": r"(bring_your_own|welded_beam|__init__)\.py$",
        "within_subsection_order": Graded(),
        "image_scrapers": (figures,),
        "reset_modules": (),
        "capture_repr": ("_repr_html_", "__repr__"),
        "ignore_repr_types": r"Figure",  # shown as a picture
        "abort_on_example_error": True,
        "download_all_examples": False,
        "remove_config_comments": True,
        "min_reported_time": 10_000,
        "show_memory": False,
        "plot_gallery": "True",
        "nested_sections": False,
        "write_computation_times": False,
    }


class Graded:
    """Order of the examples."""

    def __call__(self, name: str) -> int:
        """Return the position of a file."""
        return ORDER.index(Path(name).name)

    def __repr__(self) -> str:
        """Return a constant, so that a page is rebuilt only when its example has changed."""
        return "graded"


def make_notebook(example: Path) -> dict[str, Any]:
    """Return an example as the notebook that its page offers for download."""
    from sphinx_gallery.gen_gallery import DEFAULT_GALLERY_CONF
    from sphinx_gallery.notebook import jupyter_notebook
    from sphinx_gallery.py_source_parser import split_code_and_text_blocks

    _, blocks = split_code_and_text_blocks(str(example))
    notebook: dict[str, Any] = jupyter_notebook(blocks, DEFAULT_GALLERY_CONF | {"pypandoc": False}, example.parent)
    return notebook


def run_notebook(notebook: dict[str, Any], folder: Path) -> tuple[str, int]:
    """Run a notebook in a new kernel, in a folder; return what it printed and the number of figures that it shows.

    Raises:
        nbclient.exceptions.CellExecutionError: a cell raised an error.
    """
    import nbformat
    from nbclient import NotebookClient

    cells = nbformat.from_dict(notebook)
    for cell in cells.cells:
        cell.source = "".join(cell.source)
    NotebookClient(cells, timeout=600, resources={"metadata": {"path": str(folder)}}).execute()
    outputs = [output for cell in cells.cells for output in cell.get("outputs", ())]
    figures = sum("image/png" in output.get("data", {}) for output in outputs)
    return "".join(output.get("text", "") for output in outputs), figures


def figures(block: Any, variables: dict[str, Any], configuration: dict[str, Any]) -> str:
    """Save every Matplotlib figure of a block of an example, and show it there."""
    from matplotlib.figure import Figure
    from sphinx_gallery.scrapers import figure_rst

    kept = variables.setdefault("kept_figures", [])
    paths = []
    for value in variables["example_globals"].values():
        if isinstance(value, Figure) and not any(value is other for other in kept):
            kept.append(value)
            paths.append(next(variables["image_path_iterator"]))
            value.savefig(paths[-1], dpi=150)
    return figure_rst(paths, configuration["src_dir"])
