"""``nlp-gait evaluate``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.analysis.units import make_heading, with_unit
from compare.cli.command import OUTPUT_FILE, command
from compare.cli.endings import fail
from compare.cli.options import AnyProblem, AsJson, parse_number, parse_options, parse_pairs, parse_x
from compare.cli.outputs import check_output_file
from compare.cli.printing import print_json, print_result, print_rows, print_table, print_written, stdout
from compare.judge import Evaluation
from compare.judge import evaluate as judge
from compare.rounding import evaluate_rounded
from compare.study.import_runs import FINALS, read_points
from nlp_gait.export.joint_angles import read_joint_angles
from nlp_gait.files import format_csv, write_text
from nlp_gait.formulation import GaitProblem
from nlp_gait.gaits.capabilities import RECORDED_GAITS, resolve
from nlp_gait.robots import load_robot

if TYPE_CHECKING:
    from compare.questions.recorded import JudgedGait
    from nlp_gait.gaits.nao.recorded import RecordedGait

SHOWN_VIOLATIONS = 10


@command
def evaluate(
    x: Annotated[
        str | None,
        typer.Option(
            "--x", help="Decision variables in order, separated by commas; or a .csv file with one candidate per row."
        ),
    ] = None,
    motion: Annotated[
        Path | None,
        typer.Option(help="Joint angles over time instead: a CSV with columns t and joints."),
    ] = None,
    touch_down: Annotated[
        float | None,
        typer.Option(help="Landing time of the swing foot of a cycle in --motion [s] (default: inferred)."),
    ] = None,
    engine: Annotated[bool, typer.Option(help="Also simulate a motion in the physics engine (extra sim).")] = True,
    *,
    problem: AnyProblem,
    rounded: Annotated[
        bool, typer.Option("--rounded", help="Judge all points that round to the digits of --x, not that point alone.")
    ] = False,
    claimed: Annotated[
        str | None, typer.Option(metavar="VALUE", help="With --rounded: the objective as printed; can a point have it?")
    ] = None,
    signals: Annotated[Path | None, typer.Option(help="Write time histories to this .npz file."), OUTPUT_FILE] = None,
    table: Annotated[
        Path | None, typer.Option("--csv", help="Write the judged points to this CSV file."), OUTPUT_FILE
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Evaluate candidates with the exact functions, at the problem's samples and on a dense grid.

    Examples: `nlp-gait evaluate nao-ssp --x 0.31,-0.002,0.0034,0.008,0.0025,0.0243,-0.0256,0.015,4`, also with `--rounded`,
    `nlp-gait evaluate nao-ssp --x points.csv --csv judged.csv`, `nlp-gait evaluate --motion gait.csv --robot nao-v5`
    """
    if (x is None) == (motion is None):
        fail("give a point with --x, or a motion with --motion")
    if claimed is not None and not rounded:
        fail("--claimed compares an objective with all points of --rounded; add --rounded")
    if rounded and motion is not None:
        fail("--rounded refers to the digits of --x; leave it out for a motion")
    if motion is not None:
        _evaluate_motion(_read_motion(problem, motion, touch_down), engine, signals, as_json)
        return
    assert x is not None  # one of both is given; for the type checker
    loaded = problem.spec().load()
    if rounded:
        if x.endswith(".csv") or signals is not None or table is not None:
            fail("--rounded takes one candidate as printed, and no --signals or --csv; give --x as numbers")
        _evaluate_rounded(loaded, x, claimed, as_json)
        return
    many = x.endswith(".csv")
    if many and signals is not None:
        fail("--signals takes one candidate; give it as numbers")
    if signals is not None and loaded.display.motion is None:
        fail(f"problem {problem.name!r} has no signals")
    written = [check_output_file(path) for path in (signals, table) if path is not None]
    points = read_points(Path(x), loaded, FINALS)[1] if many else [loaded.check_x(parse_x(x))]
    judged = [judge(loaded, point) for point in points]
    if signals is not None:
        from nlp_gait.export.formats import write_npz

        write_npz(signals, loaded.signals(points[0]))
    if table is not None:
        _write(table, judged)
    if many:
        data = {"schema": 1, "points": [evaluation.to_json() for evaluation in judged]}
        print_result(as_json, data, written, lambda: _print_many(judged))
    elif as_json:
        print_json(judged[0].to_json())
    else:
        _print(judged[0])
        print_written(*written)


def _evaluate_rounded(problem: GaitProblem, x: str, claimed: str | None, as_json: bool) -> None:
    found = evaluate_rounded(problem, x.split(","), claimed)
    if as_json:
        print_json(found.to_json())
        return
    unit = found.objective["unit"]
    best, worst = with_unit(found.best, unit), with_unit(found.worst, unit)
    bounds = (
        "cannot be enclosed"
        if found.enclosure is None
        else "enclosed: {} to {}".format(*(with_unit(end, unit) for end in found.enclosure))
    )
    for sentence in (
        f"{found.problem}, all points that round to the printed digits: {found.objective['name']} from {best} (best) to "
        f"{worst} (worst) at evaluated points; {bounds}",
        f"feasible {found.feasible}, {found.how}",
        f"at the best point that was found {found.at_best}",
        f"at the worst point that was found {found.at_worst}",
        *([] if found.claim is None else [f"the claimed {claimed}: {found.claim}"]),
    ):
        stdout.print(sentence, soft_wrap=True)


def _read_motion(problem: AnyProblem, motion: Path, touch_down_s: float | None) -> RecordedGait:
    """Read a gait from joint angles, with changed limits; InputError for a file without a gait, or an option without effect."""
    robot, values = problem.robot or "nao-v5", dict(parse_pairs(problem.values, "--set"))
    intervals = values.pop("intervals", None)
    name = problem.name or next(iter(RECORDED_GAITS))
    gait: RecordedGait = resolve(RECORDED_GAITS, name)(
        read_joint_angles(motion, load_robot(robot)),
        robot=robot,
        gait=problem.name,
        touch_down_s=touch_down_s,
        **({} if intervals is None else parse_options(name, [("intervals", intervals)])),
    )
    numbers = {key: parse_number(key, text, "--set") for key, text in values.items()}
    return replace(gait, problem=gait.problem.with_values(**numbers))


def _evaluate_motion(gait: RecordedGait, engine: bool, signals: Path | None, as_json: bool) -> None:
    from compare.questions.recorded import judge_gait
    from nlp_gait.export.formats import write_npz

    written = [] if signals is None else [check_output_file(signals)]
    judged = judge_gait(gait, in_engine=engine)
    for path in written:
        write_npz(path, gait.problem.signals(gait.x))
    print_result(as_json, judged.to_json(), written, lambda: _print_gait(judged))


def _print_gait(judged: JudgedGait) -> None:
    gait = judged.recorded
    times = ", ".join(
        f"{name} {value:.4g} s" for name, value in zip(gait.problem.display.durations, gait.x, strict=False)
    )
    stdout.print(f"{gait.gait}: step {1000 * gait.step_m:.1f} mm, {times}", soft_wrap=True)
    for note in judged.notes:
        stdout.print(note, soft_wrap=True)
    print_table(
        "Compared with the optimum at the same step and times",
        ("index", "this gait", "optimum"),
        [(name, f"{value:z.6f}", "-" if math.isnan(best) else f"{best:z.6f}") for name, value, best in judged.rows()],
    )
    _print_violations(judged.evaluation)
    if judged.engine is not None:
        found = judged.engine
        fate = "stays up" if found.fell_at_s is None else f"FALLS at {found.fell_at_s:.2f} s"
        stdout.print(
            f"In the engine the robot {fate}; largest tilt {found.largest_tilt_deg:.1f} degrees; power "
            f"{found.measured.total_W:.3f} W measured, {found.predicted.total_W:.3f} W by the model; tracking error "
            f"{found.tracking_rms_rad:.4f} rad RMS",
            soft_wrap=True,
        )


def _print_many(judged: Sequence[Evaluation]) -> None:
    objective = make_heading(judged[0].objective["name"], judged[0].objective["unit"])
    print_table(
        f"{judged[0].problem}: {len(judged)} candidates",
        ("row", objective, "violation", "feasible", "between samples", "guaranteed", "largest violation"),
        [
            (
                str(k),
                f"{e.objective['value']:.6g}",
                f"{e.violation:.3g}",
                "yes" if e.feasible else "no",
                "-" if e.dense is None else "no" if e.dense_violations else "yes",
                "-" if e.guaranteed is None else e.guaranteed.word,
                next((row.name for row in (*e.violations, *e.dense_violations)), "-"),
            )
            for k, e in enumerate(judged, start=1)
        ],
    )


def _write(path: Path, judged: Sequence[Evaluation]) -> None:
    found = ("violation", "feasible", "feasible_between_samples", "guaranteed")
    name = judged[0].objective["name"]
    indexes = [index for index in judged[0].indexes if index != name]
    rows = [
        [
            *e.x.values(),
            e.objective["value"],
            e.violation,
            e.feasible,
            "" if e.dense is None else not e.dense_violations,
            "" if e.guaranteed is None or e.guaranteed.satisfied is None else e.guaranteed.satisfied,
            *(e.indexes[index] for index in indexes),
        ]
        for e in judged
    ]
    write_text(path, format_csv([[*judged[0].x, name, *found, *indexes], *rows]))


def _print(evaluation: Evaluation) -> None:
    objective = evaluation.objective
    stdout.print(f"{evaluation.problem}: {objective['name']} {with_unit(objective['value'], objective['unit'])}")
    dense = evaluation.dense or {}
    means = {} if evaluation.guaranteed is None else evaluation.guaranteed.means
    rows = [
        (
            name,
            f"{value:z.6f}",
            with_unit(dense.get(name), "1"),
            "{:.6f} to {:.6f}".format(*means[name]) if name in means else "-",
        )
        for name, value in evaluation.indexes.items()
    ]
    grid = f"{evaluation.dense_intervals} intervals" if evaluation.dense else "no dense grid"
    columns = 4 if means else 3
    header = ("index", "samples", grid, "proven over time")[:columns]
    print_table("Indexes", header, [row[:columns] for row in rows])
    _print_violations(evaluation)
    if evaluation.guaranteed is not None:
        stdout.print(f"Guaranteed: {evaluation.guaranteed}", soft_wrap=True)


def _print_violations(evaluation: Evaluation) -> None:
    for title, violated in (("samples", evaluation.violations), ("dense grid", evaluation.dense_violations)):
        if not violated:
            stdout.print(f"feasible on the {title}" if title == "samples" or evaluation.dense else "")
            continue
        print_rows(
            f"Infeasible on the {title}: {len(violated)} violated constraints, worst first",
            violated[:SHOWN_VIOLATIONS],
            {
                "constraint": lambda v: v.name,
                "value": lambda v: f"{v.value:.6g}",
                "lower": lambda v: with_unit(v.lower, "1", ".6g"),
                "upper": lambda v: with_unit(v.upper, "1", ".6g"),
                "violation": lambda v: with_unit(v.violation, v.unit, ".3g"),
            },
        )
