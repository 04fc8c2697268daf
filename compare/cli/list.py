"""``nlp-gait list``."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from typer import Argument, Option

from compare.cli.command import OUTPUT_FILE, Output, Rows, command
from nlp_gait.errors import InputError
from nlp_gait.user_code import find_entry_points

if TYPE_CHECKING:
    from compare.report.provenance import Description

OWN = "your own problem or algorithm can be used by name: FILE.py:NAME or MODULE:NAME; a program: cmd:COMMAND"
ALGORITHMS = "algorithms"  # the name that stands for all of them
OVERRIDE = (
    "override any of this in a JSON file next to the model, see docs/robots.md; gaits: solve humanoid-ssp, humanoid-dsp "
    "or humanoid-cycle with --robot {}; whole walks: plan --robot"
)


@command
def list_problems(
    name: Annotated[str | None, Argument(metavar="[NAME]")] = None,
    robot: Annotated[str | None, Option(metavar="FILE")] = None,
    out: Annotated[Path | None, OUTPUT_FILE] = None,
) -> Output:
    """List problems, algorithms, limits and robots, or describe one of them.

    Examples: `nlp-gait list`, `nlp-gait list algorithms`, `nlp-gait list limits`, `nlp-gait list nao-ssp`, `nlp-gait list pso`,
    `nlp-gait list --robot my_robot.urdf --out my_robot.png`, `nlp-gait list humanoid-cycle --robot my_robot.urdf`
    """
    if robot is not None and name is None:
        return _describe_robot(robot, out)
    if out is not None:
        raise InputError("--out is the figure of a robot; give --robot FILE, and no problem")
    if name is None:
        return _list_all()
    if name == "limits":
        return _list_limits()
    from compare.report.provenance import describe_solver, list_described_names

    names = list_described_names()
    if name != ALGORITHMS and name not in names:
        return _describe_problem(name, {} if robot is None else {"robot": robot})
    if robot is not None:
        raise InputError("--robot takes a problem, or no name")
    algorithms = [describe_solver(one) for one in (names if name == ALGORITHMS else [name])]
    parts: list[str | Rows]
    if name == ALGORITHMS:
        titles = [(algorithm.name, algorithm.title) for algorithm in algorithms]
        parts = [Rows("Algorithms", ("name", "description"), titles), "settings and source: nlp-gait list NAME"]
    else:
        parts = list(_describe_algorithm(algorithms[0]))
    return Output(data={"algorithms": [asdict(algorithm) for algorithm in algorithms]}, parts=parts)


def _list_limits() -> Output:
    from nlp_gait.limits import LIMITS

    header = ("name", "description", "parameters")
    rows = [
        (name, str(limit.__doc__).splitlines()[0], ", ".join(f"{q.name}={q.default:g}" for q in limit.parameters))
        for name, limit in LIMITS.items()
    ]
    data = [dict(zip(header, row, strict=True)) for row in rows]
    return Output(data={"limits": data}, parts=[Rows("Limits, for --limit", header, rows)])


def _describe_algorithm(algorithm: Description) -> Iterator[str | Rows]:
    yield f"{algorithm.name}: {algorithm.title}"
    if algorithm.settings:
        rows = [(setting.name, setting.default, setting.meaning) for setting in algorithm.settings]
        yield Rows(f"{algorithm.name}: settings", ("name", "default", "description"), rows)
    if algorithm.source:
        yield f"Source: {algorithm.source}\n"


def _describe_robot(name: str, target: Path | None) -> Output:
    from nlp_gait.gaits.humanoid.body import JOINT_COLUMNS, describe_humanoid, list_joints, make_humanoid

    body = make_humanoid(name)
    facts, notes, title = describe_humanoid(body), body.biped.full.notes, body.biped.full.name
    written = []
    if target is not None:
        from compare.drawing.robot_figures import plot_robot

        written.append(plot_robot(body.biped, target.with_suffix(".png")))
    table, joints = Rows(f"Robot {title} as read", ("item", "value"), facts), list_joints(body)
    both = (
        "Joints of the left leg: range, limits, rotor, damping; left / right where they differ: the tighter is planned"
    )
    return Output(
        data={
            "robot": title,
            **dict(facts),
            "joints": [dict(zip(JOINT_COLUMNS, row, strict=True)) for row in joints],
            "notes": list(notes),
        },
        parts=[table, Rows(both, JOINT_COLUMNS, joints), *(f"note: {note}" for note in notes), OVERRIDE.format(name)],
        written=written,
    )


def _list_all() -> Output:
    """List names from a file, which a test compares with the code: nothing else is imported."""
    listed = json.loads(files("compare.cli").joinpath("listed.json").read_text(encoding="utf-8"))
    kinds: tuple[Literal["problem", "algorithm"], ...] = ("problem", "algorithm")
    installed = {f"{kind}s": find_entry_points(kind) for kind in kinds}
    rows = [(name, title, str(n), str(p)) for name, (title, n, p) in listed["problems"].items()]
    parts: list[str | Rows] = [
        Rows("Problems", ("name", "description", "variables", "parameters"), rows),
        f"robots: {', '.join(listed['robots'])}",
        "algorithms: nlp-gait list algorithms; limits of gaits, for --limit: nlp-gait list limits",
    ]
    for kind, packages in installed.items():
        names = ", ".join(f"{name} ({value})" for name, value in packages.items())
        parts += [f"{kind} of other installed packages: {names}"] if names else []
    parts.append(OWN)
    keys = ("title", "variables", "parameters")
    described = {name: dict(zip(keys, row, strict=True)) for name, row in listed["problems"].items()}
    return Output(data={**listed, "problems": described, "installed": installed}, parts=parts)


def _describe_problem(name: str, options: Mapping[str, Any]) -> Output:
    import nlp_gait
    from nlp_gait.formulation.registry import describe_options, find_maker, list_choices

    problem = nlp_gait.load(name, **options)
    make = find_maker(problem.load_name)
    words, choices = describe_options(make), list_choices(make)
    where = "".join(f" with --{key} {value}" for key, value in options.items())
    variables = [(v.name, f"{v.lower:g}", f"{v.upper:g}", v.unit, v.description) for v in problem.variables]
    parameters = [(q.name, f"{q.default:g}", q.unit, q.description) for q in problem.own_parameters]
    chosen = [(k, str(value), words.get(k, ""), "\n".join(choices.get(k, ()))) for k, value in problem.options.items()]
    tables = (
        Rows(f"{name}{where}: variables", ("name", "lower", "upper", "unit", "description"), variables),
        Rows(f"{name}: parameters, for --set", ("name", "default", "unit", "description"), parameters),
        Rows(f"{name}: options, for --set", ("name", "value", "description", "one of"), chosen),
    )
    return Output(
        data={
            "problem": name,
            "options": dict(problem.options),
            "variables": _select_attributes(problem.variables, "name", "unit", "lower", "upper", "description"),
            "parameters": _select_attributes(problem.own_parameters, "name", "unit", "default", "description"),
        },
        parts=[
            *(rows for rows in tables if rows.rows),
            f"bounds of variables are parameters: --set {problem.names[0]}.lower=...",
        ],
    )


def _select_attributes(items: Sequence[object], *attributes: str) -> list[dict[str, Any]]:
    return [{name: getattr(item, name) for name in attributes} for item in items]
