"""``nlp-gait solve``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, cast

import typer

from compare.cli.common import (
    AsJson,
    Derivatives,
    Fix,
    Intervals,
    Options,
    ProblemName,
    Robot,
    Seed,
    Set,
    command,
    end_interrupted,
    fail,
    output_file,
    parse_numbers,
    print_json,
    print_table,
    problem_spec,
    progress_bar,
    quantity,
    stdout,
)
from nlp_gait.problem.solution import Solution


@command
def solve(
    problem: ProblemName,
    starts: Annotated[
        int | None,
        typer.Option(
            min=1, max=100_000, help="Random starts within the bounds (default: 20, fewer where each takes long)."
        ),
    ] = None,
    seed: Seed = 0,
    x0: Annotated[str | None, typer.Option("--x0", help="First start, separated by commas.")] = None,
    robot: Robot = None,
    intervals: Intervals = None,
    derivatives: Derivatives = None,
    option: Options = None,
    values: Set = None,
    fix: Fix = None,
    solver: Annotated[str, typer.Option(help="NLP solver; see nlp-gait list.")] = "ipopt",
    linear_solver: Annotated[
        str | None, typer.Option(help="IPOPT's, for example ma57 if its library is there (default: mumps).")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the solution to this JSON file.")] = None,
    as_json: AsJson = False,
) -> None:
    """Solve a problem with an NLP solver from several random starts; the best is judged by the exact functions.

    Examples: `nlp-gait solve nao-ssp --starts 20 --seed 0`, `nlp-gait solve nao-ssp --fix swing_height_m=0.024`
    """
    import nlp_gait
    from nlp_gait.backends.interrupts import Interrupted
    from nlp_gait.backends.solvers import registry
    from nlp_gait.files import without_nan, write_json

    target = None if out is None else output_file(out)
    loaded = problem_spec(problem, robot, intervals, derivatives, option, values, fix).load()
    first = None if x0 is None else loaded.check_x(parse_numbers(x0))
    chosen = registry.solver(solver, **({} if linear_solver is None else {"linear_solver": linear_solver}))
    starts = loaded.starts if starts is None else starts
    stopped = ""
    with progress_bar(f"{solver} starts", starts) as advance:
        try:
            solution = nlp_gait.solve(
                loaded,
                starts=starts,
                seed=seed,
                x0=first,
                solver=chosen,
                progress=lambda outcome: advance(f"{outcome.objective:.6g}, {outcome.status}"),
            )
        except Interrupted as interrupt:
            solution, stopped = cast(Solution, interrupt.partial), interrupt.sentence
    if as_json:
        print_json(solution.to_json())
    else:
        _print(solution)
    if target is not None:  # after printing, lest a full disk take the result with it
        write_json(target, without_nan(solution.to_json()))
    if stopped:
        where = "printed" if target is None else f"in {target}"
        end_interrupted(f"{stopped}; the best point until then is {where}")
    if not solution.success:
        fail(solution.status)


def _print(solution: Solution) -> None:
    value = quantity(solution.objective, solution.objective_unit)
    converged = sum(start.success for start in solution.starts)
    stdout.print(f"{solution.problem}: {solution.objective_name} {value} ({solution.status})")
    print_table("Optimum", ("variable", "value"), [(name, f"{value:.6g}") for name, value in solution.x.items()])
    if solution.active_constraints:
        rows = [
            (a.name, a.side, quantity(a.bound, a.unit, "g"), f"{a.price:.4g} {a.price_unit}")
            for a in solution.active_constraints
        ]
        print_table("What holds it back", ("bound", "side", "at", "price of raising it"), rows)
    counts = solution.evaluations
    stdout.print(
        f"{converged} of {len(solution.starts)} starts converged; {solution.iterations} iterations of the best; "
        f"calls f {counts.f}, g {counts.g}, gradient {counts.gradient}, Jacobian {counts.jacobian}, Hessian {counts.hessian}"
    )
    time = solution.time_s
    stdout.print(
        f"build {time.build:.2f} s, derivatives {time.compile:.2f} s, solve {time.solve:.2f} s; "
        f"{solution.solver}{f' with {solution.linear_solver}' if solution.linear_solver else ''}"
    )
