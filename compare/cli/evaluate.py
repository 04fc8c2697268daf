"""``nlp-gait evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from compare.cli.common import (
    AsJson,
    Derivatives,
    Intervals,
    Options,
    ProblemName,
    Robot,
    Set,
    command,
    fail,
    output_file,
    parse_numbers,
    print_json,
    print_table,
    problem_spec,
    quantity,
    stdout,
)
from compare.judge import Evaluation

SHOWN_VIOLATIONS = 10


@command
def evaluate(
    problem: ProblemName,
    x: Annotated[str, typer.Option("--x", help="Decision variables in order, separated by commas.")],
    robot: Robot = None,
    intervals: Intervals = None,
    derivatives: Derivatives = None,
    option: Options = None,
    values: Set = None,
    signals: Annotated[Path | None, typer.Option(help="Write time histories to this .npz file.")] = None,
    as_json: AsJson = False,
) -> None:
    """Evaluate one candidate by the exact functions, on the problem's samples and on a dense grid.

    Example: `nlp-gait evaluate nao-ssp --x 0.31,-0.002,0.0034,0.008,0.0025,0.0243,-0.0256,0.015,4`
    """
    from compare.judge import evaluate as judge

    loaded = problem_spec(problem, robot, intervals, derivatives, option, values).load()
    point = loaded.check_x(parse_numbers(x))
    if signals is not None:
        if loaded.motion is None:
            fail(f"problem {problem!r} has no signals")
        from nlp_gait.export.signals import write_npz

        target = output_file(signals)
        write_npz(target, loaded.signals(point))
    evaluation = judge(loaded, point)
    if as_json:
        print_json(evaluation.to_json())
    else:
        _print(evaluation)


def _print(evaluation: Evaluation) -> None:
    objective = evaluation.objective
    stdout.print(f"{evaluation.problem}: {objective['name']} {quantity(objective['value'], objective['unit'])}")
    dense = evaluation.dense or {}
    rows = [
        (name, f"{v:.6f}", f"{dense[name]:.6f}" if name in dense else "-") for name, v in evaluation.indexes.items()
    ]
    grid = f"{evaluation.dense_intervals} intervals" if evaluation.dense else "no dense grid"
    print_table("Indexes", ("index", "own samples", grid), rows)
    for title, violated in (("own samples", evaluation.violations), ("dense grid", evaluation.dense_violations)):
        if not violated:
            stdout.print(f"feasible on the {title}" if title == "own samples" or evaluation.dense else "")
            continue
        table = [
            (v.name, f"{v.value:.6g}", _bound(v.lower), _bound(v.upper), quantity(v.violation, v.unit, ".3g"))
            for v in violated[:SHOWN_VIOLATIONS]
        ]
        title = f"Infeasible on the {title}: {len(violated)} rows, worst first"
        print_table(title, ("row", "value", "lower", "upper", "violation"), table)


def _bound(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"
