"""``nlp-gait list``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.common import AsJson, command, print_json, print_table, problem_spec, stdout
from nlp_gait.problem import problem_names


@command
def list_problems(
    problem: Annotated[
        str | None, typer.Argument(metavar="[PROBLEM]", help="Show its variables and parameters.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List problems, algorithms and robots; or the variables and parameters of one problem.

    Examples: `nlp-gait list`, `nlp-gait list nao-ssp`
    """
    if problem is None:
        _overview(as_json)
    else:
        _details(problem, as_json)


def _overview(as_json: bool) -> None:
    from compare.study.task import solver_names
    from nlp_gait.robots import robot_names

    problems = {name: problem_spec(name, None, None, None, None, None).load() for name in problem_names()}
    if as_json:
        described = {
            n: {"title": p.title, "variables": list(p.names), "options": dict(p.options)} for n, p in problems.items()
        }
        print_json({"problems": described, "algorithms": list(solver_names()), "robots": list(robot_names())})
        return
    rows = [(name, p.title, str(len(p.names)), str(len(p.own_parameters))) for name, p in problems.items()]
    print_table("Problems", ("name", "what", "variables", "parameters"), rows)
    stdout.print(f"algorithms: {', '.join(solver_names())}")
    stdout.print(f"robots: {', '.join(robot_names())}")


def _details(name: str, as_json: bool) -> None:
    problem = problem_spec(name, None, None, None, None, None).load()
    if as_json:
        variables = [
            {"name": v.name, "unit": v.unit, "lower": v.lower, "upper": v.upper, "description": v.description}
            for v in problem.variables
        ]
        parameters = [
            {"name": q.name, "unit": q.unit, "default": q.default, "description": q.description}
            for q in problem.own_parameters
        ]
        print_json(
            {"problem": name, "options": dict(problem.options), "variables": variables, "parameters": parameters}
        )
        return
    rows = [(v.name, f"{v.lower:g}", f"{v.upper:g}", v.unit, v.description) for v in problem.variables]
    print_table(f"{name}: variables", ("name", "lower", "upper", "unit", "what"), rows)
    limits = [(q.name, f"{q.default:g}", q.unit, q.description) for q in problem.own_parameters]
    print_table(f"{name}: parameters, for --set", ("name", "default", "unit", "what"), limits)
    options = ", ".join(f"{key}={value}" for key, value in problem.options.items())
    stdout.print(f"options: {options}\na variable's bounds are parameters too: --set {problem.names[0]}.lower=...")
