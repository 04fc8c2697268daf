"""``nlp-gait list``."""

import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from compare.cli.command import OUTPUT_FILE, command
from compare.cli.options import AsJson
from compare.cli.outputs import check_output_file
from compare.cli.printing import print_json, print_table, print_written, stdout
from compare.study.citations import find_citations
from compare.study.description import describe_solver, list_described_names
from compare.study.task import list_solvers
from metaheuristics.multi_objective import FRONT_ALGORITHMS
from nlp_gait import formulation
from nlp_gait.errors import InputError
from nlp_gait.robots import list_robots
from nlp_gait.user_code import find_entry_points


@command
def list_problems(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME]",
            help="A problem, for its variables, parameters and options; an algorithm or solver, for its settings.",
        ),
    ] = None,
    algorithms: Annotated[
        bool, typer.Option("--algorithms", help="Show the settings of all algorithms and solvers.")
    ] = False,
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Show a robot as read: URDF, MJCF (.xml), JSON, or a name; with a problem, that "
            "problem for this robot.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="With --robot: figure of the robot and its soles, as PNG and SVG."), OUTPUT_FILE
    ] = None,
    cite: Annotated[
        bool,
        typer.Option(
            "--cite", help="Print BibTeX of a problem, a paper or an instance of GaitBench; of all without NAME."
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """List problems, algorithms and robots, or describe one of them.

    Examples: `nlp-gait list`, `nlp-gait list nao-ssp`, `nlp-gait list pso`, `nlp-gait list --cite nao-ssp`,
    `nlp-gait list --robot my_robot.urdf --out my_robot.png`, `nlp-gait list humanoid-cycle --robot my_robot.urdf`
    """
    if cite:
        entries = find_citations(name)
        if as_json:
            print_json({"entries": entries})
        else:
            stdout.print("\n\n".join(entries), soft_wrap=True)
        return
    if robot is not None and name is None:
        _describe_robot(robot, out, as_json)
        return
    if out is not None:
        raise InputError("--out is the figure of a robot; give --robot FILE, and no problem")
    known = list_described_names()
    if robot is not None and (algorithms or name in known):
        raise InputError("--robot takes a problem, or no name")
    if algorithms or name in known:
        _print_algorithms(known if name is None else [name], as_json)
    elif name is None:
        _print_overview(as_json)
    else:
        _print_details(name, {} if robot is None else {"robot": robot}, as_json)


def _print_algorithms(names: Sequence[str], as_json: bool) -> None:
    found = [describe_solver(name) for name in names]
    if as_json:
        print_json({"algorithms": [asdict(one) for one in found]})
        return
    for one in found:
        stdout.print(f"{one.name}: {one.title}")
        if one.settings:
            rows = [(setting.name, setting.default, setting.meaning) for setting in one.settings]
            print_table(f"{one.name}: settings", ("name", "default", "description"), rows)
        if one.source:
            stdout.print(f"Source: {one.source}\n")


def _belongs_here(record: logging.LogRecord) -> bool:
    return "see nlp-gait list --robot" not in record.getMessage()


def _describe_robot(name: str, out: Path | None, as_json: bool) -> None:
    from nlp_gait.gaits.humanoid.body import describe_humanoid, make_humanoid

    target = None if out is None else check_output_file(out)
    log = logging.getLogger("nlp_gait")
    log.addFilter(_belongs_here)  # what it refers to is printed below
    try:
        body = make_humanoid(name)
    finally:
        log.removeFilter(_belongs_here)
    facts, notes = describe_humanoid(body), body.biped.full.notes
    if as_json:
        print_json({"robot": body.biped.full.name, **{key: value for key, value in facts}, "notes": list(notes)})
    else:
        print_table(f"Robot {body.biped.full.name} as read", ("item", "value"), facts)
        for note in notes:
            stdout.print(f"note: {note}")
        stdout.print(
            "override any of this in a JSON file next to the model, see docs/custom-robots.md; gaits: solve humanoid-ssp, "
            f"humanoid-dsp or humanoid-cycle with --robot {name}; whole walks: plan --robot"
        )
    if target is not None:
        from compare.drawing.robot_figures import plot_robot

        print_written(*plot_robot(body.biped, target.with_suffix("")))


def _print_overview(as_json: bool) -> None:
    problems = {name: formulation.load(name) for name in formulation.list_problems()}
    installed = {"problems": find_entry_points("problem"), "algorithms": find_entry_points("algorithm")}
    if as_json:
        described = {
            n: {"title": p.title, "variables": list(p.names), "options": dict(p.options)} for n, p in problems.items()
        }
        algorithms = [*list_solvers(), *installed["algorithms"]]
        data = {"problems": described, "algorithms": algorithms, "robots": list(list_robots()), "installed": installed}
        print_json(data)
        return
    rows = [(name, p.title, str(len(p.names)), str(len(p.own_parameters))) for name, p in problems.items()]
    print_table("Problems", ("name", "description", "variables", "parameters"), rows)
    stdout.print(f"algorithms: {', '.join(list_solvers())}")
    stdout.print(f"for several objectives (pareto): {', '.join(FRONT_ALGORITHMS)}")
    stdout.print(f"robots: {', '.join(list_robots())}")
    for kind, listed in installed.items():
        if listed:
            packages = ", ".join(f"{name} ({value})" for name, value in listed.items())
            stdout.print(f"{kind} of other installed packages: {packages}")
    stdout.print(
        "your own problem or algorithm can be used by name: FILE.py:NAME or MODULE:NAME; a program: cmd:COMMAND"
    )


def _print_details(name: str, given: Mapping[str, Any], as_json: bool) -> None:
    problem = formulation.load(name, **given)
    if as_json:
        print_json(
            {
                "problem": name,
                "options": dict(problem.options),
                "variables": _select_attributes(problem.variables, "name", "unit", "lower", "upper", "description"),
                "parameters": _select_attributes(problem.own_parameters, "name", "unit", "default", "description"),
            }
        )
        return
    rows = [(v.name, f"{v.lower:g}", f"{v.upper:g}", v.unit, v.description) for v in problem.variables]
    where = "".join(f" with --{key} {value}" for key, value in given.items())
    print_table(f"{name}{where}: variables", ("name", "lower", "upper", "unit", "description"), rows)
    limits = [(q.name, f"{q.default:g}", q.unit, q.description) for q in problem.own_parameters]
    print_table(f"{name}: parameters, for --set", ("name", "default", "unit", "description"), limits)
    options = ", ".join(f"{key}={value}" for key, value in problem.options.items())
    stdout.print(f"options: {options}\nbounds of variables are parameters: --set {problem.names[0]}.lower=...")


def _select_attributes(items: Iterable[object], *attributes: str) -> list[dict[str, Any]]:
    return [{name: getattr(item, name) for name in attributes} for item in items]
