"""Points of a study that are better than the shipped best known ones, to be contributed."""

from collections.abc import Sequence
from pathlib import Path

from compare.analysis.comparison import Comparison
from compare.judge import evaluate
from compare.study.record import load_gait
from nlp_gait.files import make_file_name, replace_nan, write_json


def write_better_points(folder: Path, comparisons: Sequence[Comparison]) -> list[Path]:
    """Judge every run that is better than the best known value again, write it as a result, and return the files.

    A file ``better-<problem>.json`` can be read by every command that reads the result of ``solve --out``.
    """
    written = []
    for comparison in comparisons:
        run = comparison.better
        if run is None:
            continue
        gait = load_gait(run)
        evaluation = evaluate(gait.problem, gait.x)
        if evaluation.feasible and comparison.known.is_beaten_by(evaluation.objective["value"], comparison.objective):
            known = {"objective": comparison.reference, "source": comparison.known.source}
            found = {"solver": run.solver, "run": run.run, "seed": run.seed, "settings": run.settings}
            path = folder / f"better-{make_file_name(comparison.problem)}.json"
            write_json(path, replace_nan({**evaluation.to_json(), "found_by": found, "best_known_before": known}))
            written.append(path)
    return written
