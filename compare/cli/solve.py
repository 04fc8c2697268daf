"""``nlp-gait solve`` and ``nlp-gait plan``."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

import nlp_gait
from compare.analysis.best_known import describe_value
from compare.analysis.units import with_unit
from compare.cli.command import OUTPUT_FILE, command
from compare.cli.endings import end_interrupted, fail, run_until_interrupted
from compare.cli.options import (
    AsJson,
    Jobs,
    NamedProblem,
    Seed,
    parse_names,
    parse_number,
    parse_options,
    parse_pairs,
    parse_x,
)
from compare.cli.outputs import check_output_file
from compare.cli.printing import print_json, print_rows, print_table, print_written, say, show_progress, stdout
from compare.study.references import find_reference
from nlp_gait.backends.identity import identify_problem
from nlp_gait.backends.plan_walk import WalkSettings
from nlp_gait.backends.solvers import registry
from nlp_gait.files import replace_nan, write_json
from nlp_gait.formulation.solution import Solution
from nlp_gait.proofs.guarantee import guarantee


@command
def solve(
    *,
    starts: Annotated[
        int | None,
        typer.Option(min=1, max=100000, help="Random starts within the bounds (default: 20, fewer for slow problems)."),
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
    out: Annotated[Path | None, typer.Option(help="Write the solution to this JSON file."), OUTPUT_FILE] = None,
    as_json: AsJson = False,
) -> None:
    """Solve a problem with an NLP solver from several random starts; the exact functions judge the best.

    Examples: `nlp-gait solve nao-ssp --starts 20 --seed 0`, `nlp-gait solve nao-ssp --set swing_height_m=0.024`
    """
    target = None if out is None else check_output_file(out)
    loaded = problem.spec().load()
    first = None if x0 is None else loaded.check_x(parse_x(x0))
    chosen = registry.make_solver(solver, **({} if linear_solver is None else {"linear_solver": linear_solver}))
    starts = loaded.hints.starts if starts is None else starts
    with show_progress(f"{solver} starts", starts) as advance:
        solution, stopped = run_until_interrupted(
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
    data = {**solution.to_json(), "guaranteed": None if proven is None else asdict(proven), **known.to_json()}
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
    value = with_unit(solution.objective, solution.problem.objective.unit)
    converged = sum(start.converged for start in solution.starts)
    best, name = solution.best, solution.problem.address
    if solution.feasible:
        stdout.print(f"{name}: {solution.problem.objective.name} {value} ({solution.status})")
    else:
        stdout.print(f"{name}: no feasible point was found ({solution.status})")
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
        f"{converged} of {len(solution.starts)} starts converged; {best.iterations} iterations of the best; "
        f"calls f {counts.f}, g {counts.g}, gradient {counts.gradient}, Jacobian {counts.jacobian}, Hessian {counts.hessian}"
    )
    time = solution.time_s
    stdout.print(
        f"build {time.build:.2f} s, derivatives {time.compile:.2f} s, solve {time.solve:.2f} s; "
        f"{best.solver}{f' with {best.linear_solver}' if best.linear_solver else ''}"
    )


@command
def plan(
    *,
    robot: Annotated[
        str,
        typer.Option(
            help="nao-v5, nao-v6, nao-v4, a robot file (.json, .urdf, .xml of MuJoCo), or "
            "PACKAGE:NAME of an installed package."
        ),
    ] = "nao-v5",
    steps: Annotated[
        int | None,
        typer.Option(min=2, max=1000, help="Swings of a foot, both half steps included (default: 10, or by distance)."),
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Speed of the inner steps [m/s] (default: the cheapest).")] = None,
    speeds: Annotated[
        str, typer.Option(help="Speeds of the inner steps [m/s], separated by commas; between them it changes evenly.")
    ] = "",
    distance: Annotated[float | None, typer.Option(help="Distance that the feet advance [m].")] = None,
    slope_deg: Annotated[float, typer.Option(help="By which the ground rises forward; negative falls.")] = 0.0,
    stairs: Annotated[
        str, typer.Option(metavar="RISExRUN:N", help="Climb N treads of this rise and depth [m], one with each step.")
    ] = "",
    turn_deg: Annotated[
        float,
        typer.Option(
            help="Turn to the left along an arc, by 15 degrees with each step unless --steps; "
            "negative turns to the right."
        ),
    ] = 0.0,
    footholds: Annotated[
        Path | None,
        typer.Option(
            help="CSV file with columns x_m,y_m,z_m,yaw_deg: where the right foot, the left foot and so on land."
        ),
    ] = None,
    values: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="intervals (of each phase), or a parameter or bound of nao-walk or humanoid-walk; repeatable.",
        ),
    ] = None,
    starts: Annotated[int, typer.Option(min=1, max=100, help="Most start points, until one converges.")] = 3,
    out: Annotated[Path | None, typer.Option(help="Write the plan to this JSON file."), OUTPUT_FILE] = None,
    as_json: AsJson = False,
) -> None:
    """Plan a whole walk from standing to standing: weight shift, half step, steps, half step, weight shift.

    Examples: `nlp-gait plan --robot nao-v5 --steps 10 --speed 0.05 --out walk.json`, then `nlp-gait simulate walk.json` and
    `nlp-gait export walk.json --to csv --period-ms 1`
    """
    target = None if out is None else check_output_file(out)
    given = dict(parse_pairs(values, "--set"))
    options = parse_options("nao-walk", [("intervals", given.pop("intervals", "10"))])
    numbers = {name: parse_number(name, text, "--set") for name, text in given.items()}
    settings = WalkSettings(values=numbers, starts=starts, progress=say, **options)
    if turn_deg or footholds is not None or speeds:
        if (speed, stairs, slope_deg) != (None, "", 0.0):
            fail("a walk whose steps differ is on a level floor; leave out --speed, --slope-deg and --stairs")
        inner_speeds = [parse_number("speed", part, "--speeds") for part in parse_names(speeds)]
        found = nlp_gait.plan_route(
            robot,
            footholds=footholds,
            turn_deg=turn_deg,
            steps=steps,
            distance_m=distance,
            speeds_m_s=inner_speeds,
            settings=settings,
        )
    elif stairs:
        if (steps, distance, slope_deg) != (None, None, 0.0):
            fail("stairs determine steps and distance and are level; leave out --steps, --distance and --slope-deg")
        found = nlp_gait.plan_climb(robot, stairs, speed_m_s=speed, settings=settings)
    else:
        found = nlp_gait.plan_walk(
            robot, steps, speed_m_s=speed, distance_m=distance, slope_deg=slope_deg, settings=settings
        )
    if target is not None:
        found.save(target)
    if as_json:
        print_json(found.to_json())
    else:
        step = found.solution.x.get("step_length_m")
        stdout.print(
            f"{found.steps} steps, {found.distance_m:.3f} m in {found.duration_s:.2f} s: {found.energy_J:.2f} J, "
            f"{found.energy_J / found.distance_m:.2f} J/m" + ("" if step is None else f"; steps of {step:.4f} m")
        )
        if target is not None:
            print_written(target)
    if not found.feasible:
        fail("no feasible walk was found. " + ". ".join(found.obstacles))
