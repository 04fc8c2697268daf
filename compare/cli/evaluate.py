"""``nlp-gait evaluate``."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from compare.analysis.units import make_heading, with_unit
from compare.cli.command import OUTPUT_FILE, Output, Rows, command, fail
from compare.cli.options import ProblemOptions, parse_number, parse_numbers, parse_options, parse_pairs
from compare.judge import Evaluation
from compare.judge import evaluate as judge
from compare.study.import_runs import FINALS, read_points
from nlp_gait.export.joint_angles import read_joint_angles
from nlp_gait.files import format_csv, write_text
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.robots import load_robot

if TYPE_CHECKING:
    from compare.questions.recorded import JudgedGait

SHOWN_VIOLATIONS = 10
USUAL_TOLERANCE = 1e-4  # of equations in the competitions of evolutionary computation


@command
def evaluate(
    x: Annotated[str | None, Option("--x")] = None,
    motion: Path | None = None,
    touch_down: Annotated[float | None, Option(min=0.0, max=300.0)] = None,
    engine: bool = True,
    *,
    name: Annotated[str | None, Argument(metavar="[PROBLEM]")] = None,
    changes: ProblemOptions,
    table: Annotated[Path | None, Option("--csv"), OUTPUT_FILE] = None,
) -> Output:
    """Evaluate candidates with the exact functions, at the problem's samples and on a dense grid.

    Examples: `nlp-gait evaluate nao-ssp --x 0.31,-0.002,0.0034,0.008,0.0025,0.0243,-0.0256,0.015,4`,
    `nlp-gait evaluate nao-ssp --x points.csv --csv judged.csv`, `nlp-gait evaluate --motion gait.csv --robot nao-v5`
    """
    if motion is not None and x is None:
        return _evaluate_motion(name, changes, motion, touch_down, engine)
    if x is None or motion is not None:
        fail("give a point with --x, or a motion with --motion")
    if name is None:
        fail("name the problem, for example nao-ssp; it may be left out only where a file names it")
    loaded = changes.make_spec(name).load()
    many = x.endswith(".csv")
    points = read_points(Path(x), loaded, FINALS)[1] if many else [loaded.check_x(parse_numbers("x", x, "--x"))]
    judged = [judge(loaded, point) for point in points]
    written = [] if table is None else [write_text(table, format_csv(_list_cells(judged)))]
    if not many:
        return Output(data=judged[0].to_json(), parts=[*_describe(judged[0])], written=written)
    data = {"schema": 1, "points": [evaluation.to_json() for evaluation in judged]}
    return Output(data=data, parts=[_tabulate(judged)], written=written)


def _evaluate_motion(
    name: str | None, changes: ProblemOptions, motion: Path, touch_down_s: float | None, engine: bool
) -> Output:
    """Judge a gait from joint angles, with changed limits; InputError for a file without a gait, or an option without effect."""
    from compare.questions.recorded import judge_gait
    from nlp_gait.gaits.nao.recorded import GAITS, make_recorded_gait

    robot, values = changes.robot or "nao-v5", dict(parse_pairs(changes.values, "--set"))
    intervals = values.pop("intervals", None)
    gait = make_recorded_gait(
        read_joint_angles(motion, load_robot(robot)),
        robot=robot,
        gait=name,
        touch_down_s=touch_down_s,
        **({} if intervals is None else parse_options(name or GAITS[0], [("intervals", intervals)])),
    )
    numbers = {key: parse_number(key, text, "--set") for key, text in values.items()}
    gait = replace(gait, problem=gait.problem.with_values(**numbers))
    judged = judge_gait(gait, in_engine=engine)
    return Output(data=judged.to_json(), parts=[*_describe_gait(judged)])


def _describe_gait(judged: JudgedGait) -> Iterator[str | Rows]:
    gait, simulated = judged.recorded, judged.engine
    durations = zip(gait.problem.display.durations, gait.x, strict=False)
    yield f"{gait.gait}: step {1000 * gait.step_m:.1f} mm, " + ", ".join(f"{name} {s:.4g} s" for name, s in durations)
    yield from judged.notes
    rows = [(name, f"{value:z.6f}", "-" if math.isnan(best) else f"{best:z.6f}") for name, value, best in judged.rows()]
    yield Rows("Compared with the optimum at the same step and times", ("metric", "this gait", "optimum"), rows)
    yield from _describe_violations(judged.evaluation)
    if simulated is not None:
        fate = "stays up" if simulated.fell_at_s is None else f"FALLS at {simulated.fell_at_s:.2f} s"
        yield (
            f"In the engine the robot {fate}; largest tilt {simulated.largest_tilt_deg:.1f} degrees; power "
            f"{simulated.measured.total_W:.3f} W measured, {simulated.predicted.total_W:.3f} W by the model; tracking error "
            f"{simulated.tracking_rms_rad:.4f} rad RMS"
        )


def _tabulate(judged: Sequence[Evaluation]) -> Rows:
    objective, over_time = judged[0].objective, any(evaluation.dense is not None for evaluation in judged)
    header = ("row", make_heading(objective["name"], objective["unit"]), "violation", "feasible")
    rows = []
    for row, e in enumerate(judged, start=1):
        between = "-" if e.dense is None else "no" if e.dense_violations else "yes"
        dense = (between, "-" if e.guaranteed is None else e.guaranteed.word) if over_time else ()
        worst = next((violated.name for violated in (*e.violations, *e.dense_violations)), "-")
        feasible = "yes" if e.feasible else "no"
        rows.append((str(row), f"{e.objective['value']:.6g}", f"{e.violation:.3g}", feasible, *dense, worst))
    over = ("between samples", "guaranteed") if over_time else ()
    return Rows(f"{judged[0].problem}: {len(judged)} candidates", (*header, *over, "largest violation"), rows)


def _list_cells(judged: Sequence[Evaluation]) -> Iterator[Sequence[object]]:
    """Yield heading and rows of a CSV file."""
    name = judged[0].objective["name"]
    metrics = [metric for metric in judged[0].metrics if metric != name]
    yield [*judged[0].x, name, "violation", "feasible", "feasible_between_samples", "guaranteed", *metrics]
    for e in judged:
        proven = "" if e.guaranteed is None or e.guaranteed.satisfied is None else e.guaranteed.satisfied
        between = "" if e.dense is None else not e.dense_violations
        values = (e.metrics[metric] for metric in metrics)
        yield [*e.x.values(), e.objective["value"], e.violation, e.feasible, between, proven, *values]


def _describe(evaluation: Evaluation) -> Iterator[str | Rows]:
    objective, dense, guaranteed = evaluation.objective, evaluation.dense, evaluation.guaranteed
    yield f"{evaluation.problem}: {objective['name']} {with_unit(objective['value'], objective['unit'])}"
    header = ["metric", "value" if dense is None else "samples"]
    rows = [[name, f"{value:z.6f}"] for name, value in evaluation.metrics.items()]
    if dense is not None:
        header.append(f"{evaluation.dense_intervals} intervals")
        rows = [[*row, with_unit(dense.get(row[0]), "1")] for row in rows]
    if guaranteed is not None and guaranteed.means:
        header.append("proven over time")
        ends = {name: "{:.6f} to {:.6f}".format(*mean) for name, mean in guaranteed.means.items()}
        rows = [[*row, ends.get(row[0], "-")] for row in rows]
    if rows:
        yield Rows("Indexes", header, rows)
    yield from _describe_violations(evaluation)
    if guaranteed is not None and dense is not None:
        yield f"Guaranteed: {guaranteed}"


def _describe_violations(evaluation: Evaluation) -> Iterator[str | Rows]:
    for title, violated in (("samples", evaluation.violations), ("dense grid", evaluation.dense_violations)):
        place = "" if evaluation.dense is None else f" on the {title}"
        rows = []
        for v in violated[:SHOWN_VIOLATIONS]:
            lower, upper = (with_unit(end, "1", ".6g") for end in (v.lower, v.upper))
            rows.append((v.name, f"{v.value:.6g}", lower, upper, with_unit(v.violation, v.unit, ".3g")))
        if rows:
            header = ("constraint", "value", "lower", "upper", "violation")
            yield Rows(f"Infeasible{place}: {len(violated)} violated, worst first", header, rows)
        elif title == "samples" or evaluation.dense is not None:
            yield f"feasible{place}"
    if any(row.lower == row.upper and row.violation <= USUAL_TOLERANCE for row in evaluation.violations):
        yield (
            f"An equation is satisfied within {USUAL_TOLERANCE:g}, which is often allowed elsewhere; here the violations over "
            f"their scales may sum up to {FEASIBILITY_TOLERANCE:g}: give the point with more digits"
        )
