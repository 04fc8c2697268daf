"""``nlp-gait evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from compare.analysis.units import with_unit
from compare.cli.command import command
from compare.cli.common import fail, output_file, print_json, print_rows, print_table, stdout
from compare.cli.options import AsJson, NamedProblem, numbers_in
from compare.judge import Evaluation

SHOWN_VIOLATIONS = 10


@command
def evaluate(
    x: Annotated[str, typer.Option("--x", help="Decision variables in order, separated by commas.")],
    problem: NamedProblem,
    signals: Annotated[Path | None, typer.Option(help="Write time histories to this .npz file.")] = None,
    as_json: AsJson = False,
) -> None:
    """Evaluate one candidate by the exact functions, on the problem's samples and on a dense grid.

    Example: `nlp-gait evaluate nao-ssp --x 0.31,-0.002,0.0034,0.008,0.0025,0.0243,-0.0256,0.015,4`
    """
    from compare.judge import evaluate as judge

    loaded = problem.spec().load()
    point = loaded.check_x(numbers_in(x))
    if signals is not None:
        if loaded.motion is None:
            fail(f"problem {problem.name!r} has no signals")
        from nlp_gait.export.tables import write_npz

        target = output_file(signals)
        write_npz(target, loaded.signals(point))
    evaluation = judge(loaded, point)
    if as_json:
        print_json(evaluation.to_json())
    else:
        _print(evaluation)


def _print(evaluation: Evaluation) -> None:
    objective = evaluation.objective
    stdout.print(f"{evaluation.problem}: {objective['name']} {with_unit(objective['value'], objective['unit'])}")
    dense = evaluation.dense or {}
    rows = [(name, f"{value:.6f}", with_unit(dense.get(name), "1")) for name, value in evaluation.indexes.items()]
    grid = f"{evaluation.dense_intervals} intervals" if evaluation.dense else "no dense grid"
    print_table("Indexes", ("index", "own samples", grid), rows)
    for title, violated in (("own samples", evaluation.violations), ("dense grid", evaluation.dense_violations)):
        if not violated:
            stdout.print(f"feasible on the {title}" if title == "own samples" or evaluation.dense else "")
            continue
        print_rows(
            f"Infeasible on the {title}: {len(violated)} rows, worst first",
            violated[:SHOWN_VIOLATIONS],
            {
                "row": lambda v: v.name,
                "value": lambda v: f"{v.value:.6g}",
                "lower": lambda v: with_unit(v.lower, "1", ".6g"),
                "upper": lambda v: with_unit(v.upper, "1", ".6g"),
                "violation": lambda v: with_unit(v.violation, v.unit, ".3g"),
            },
        )
