"""``nlp-gait solve``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from compare.analysis.best_known import describe_value
from compare.analysis.units import with_unit
from compare.cli.command import command
from compare.cli.common import (
    end_interrupted,
    fail,
    print_json,
    print_rows,
    print_table,
    print_written,
    progress_bar,
    stdout,
    until_interrupted,
)
from compare.cli.options import AsJson, Jobs, NamedProblem, Seed, parse_x
from compare.cli.outputs import output_file
from nlp_gait.backends.identity import identify_problem
from nlp_gait.formulation.solution import Solution


@command
def solve(
    *,
    starts: Annotated[
        int | None,
        typer.Option(
            min=1, max=100_000, help="Random starts within the bounds (default: 20, fewer for slow problems)."
        ),
    ] = None,
    seed: Seed = 0,
    x0: Annotated[str | None, typer.Option("--x0", help="First start: values separated by commas.")] = None,
    problem: NamedProblem,
    solver: Annotated[str, typer.Option(help="NLP solver; see nlp-gait list.")] = "ipopt",
    linear_solver: Annotated[
        str | None,
        typer.Option(help="Linear solver of IPOPT, for example ma57 if its library is installed (default: mumps)."),
    ] = None,
    jobs: Jobs = None,
    out: Annotated[Path | None, typer.Option(help="Write the solution to this JSON file.")] = None,
    as_json: AsJson = False,
) -> None:
    """Solve a problem with an NLP solver from several random starts; the exact functions judge the best.

    Examples: `nlp-gait solve nao-ssp --starts 20 --seed 0`, `nlp-gait solve nao-ssp --fix swing_height_m=0.024`
    """
    import nlp_gait
    from compare.study.references import find_reference
    from nlp_gait.backends.solvers import registry
    from nlp_gait.files import replace_nan, write_json
    from nlp_gait.proofs.guarantee import guarantee

    target = None if out is None else output_file(out)
    loaded = problem.spec().load()
    first = None if x0 is None else loaded.check_x(parse_x(x0))
    chosen = registry.make_solver(solver, **({} if linear_solver is None else {"linear_solver": linear_solver}))
    starts = loaded.hints.starts if starts is None else starts
    with progress_bar(f"{solver} starts", starts) as advance:
        solution, stopped = until_interrupted(
            lambda: nlp_gait.solve(
                loaded,
                starts=starts,
                seed=seed,
                x0=first,
                solver=chosen,
                workers=jobs,
                progress=lambda outcome: advance(f"{outcome.objective:.6g}, {outcome.status}"),
            )
        )
    proven = guarantee(loaded, loaded.check_x(solution.x)) if solution.feasible else None
    known = find_reference(identify_problem(loaded))
    data = {
        **solution.to_json(),
        "guaranteed": None if proven is None else asdict(proven),
        **known.to_json(),
    }
    try:  # write before printing: a broken pipe must not lose the file
        if target is not None:
            write_json(target, replace_nan(data))
    finally:  # print even if the disk is full
        if as_json:
            print_json(data)
        else:
            _print(solution)
            if proven is not None:
                stdout.print(f"Guaranteed: {proven}", soft_wrap=True)
            if solution.feasible:
                stdout.print(describe_value(known, solution.objective, loaded.objective), soft_wrap=True)
            if target is not None and target.exists():
                print_written(target)
    if stopped:
        where = "printed" if target is None else f"in {target}"
        end_interrupted(f"{stopped}; the best point so far is {where}")
    if not solution.converged:
        fail(solution.status)


def _print(solution: Solution) -> None:
    value = with_unit(solution.objective, solution.objective_unit)
    converged = sum(start.converged for start in solution.starts)
    if solution.feasible:
        stdout.print(f"{solution.problem}: {solution.objective_name} {value} ({solution.status})")
    else:
        stdout.print(f"{solution.problem}: no feasible point was found ({solution.status})")
    kind = "Optimum" if solution.converged else "Best feasible point" if solution.feasible else "Least infeasible point"
    print_table(kind, ("variable", "value"), [(name, f"{value:.6g}") for name, value in solution.x.items()])
    if solution.active_constraints:
        print_rows(
            "Active constraints",
            solution.active_constraints,
            {
                "bound": lambda a: a.name,
                "side": lambda a: a.side,
                "at": lambda a: with_unit(a.bound, a.unit, "g"),
                "price": lambda a: f"{a.price:.4g} {a.price_unit}",
            },
        )
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
