"""Gallery of examples: order, execution, and figures."""

from __future__ import annotations

import tempfile
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
    "your_own_problem.py",
    "your_own_algorithm.py",
    "results_from_matlab.py",
    "custom_robot.py",
    "physics_engine.py",
    "export_motion.py",
    "compile_function.py",
    "notebook.py",
    "cluster.py",
)


def configuration(root: Path) -> dict[str, Any]:
    """Return the settings of sphinx-gallery."""
    return {
        "examples_dirs": str(root / "examples"),
        "gallery_dirs": "generated/gallery",
        "filename_pattern": r"\.py$",
        "ignore_pattern": r"(bring_your_own|__init__)\.py$",
        "within_subsection_order": Graded(),
        "image_scrapers": (figures,),
        "reset_modules": (),
        "reset_argv": OwnFolder(),
        "capture_repr": ("_repr_html_", "__repr__"),
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


class OwnFolder:
    """Pass an empty folder as the first argument of an example, to which it writes."""

    def __call__(self, configuration: Any, variables: Any) -> list[str]:
        """Return the arguments of an example."""
        return [tempfile.mkdtemp(prefix="nlp-gait-example-")]

    def __repr__(self) -> str:
        """Return a constant."""
        return "own folder"


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
