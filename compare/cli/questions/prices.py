"""``nlp-gait prices``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

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
    fail,
    problem_spec,
    progress_bar,
)
from compare.cli.questions.answers import hand_out
from compare.cli.resumable import whole


@command
def prices(
    problem: ProblemName,
    starts: Annotated[int, typer.Option(min=1, help="Random starts within the bounds.")] = 10,
    seed: Seed = 0,
    checks: Annotated[int, typer.Option(min=0, help="Quantities of the robot that are checked by solving again.")] = 3,
    robot: Robot = None,
    intervals: Intervals = None,
    derivatives: Derivatives = None,
    option: Options = None,
    values: Set = None,
    fix: Fix = None,
    out: Annotated[Path, typer.Option(help="Folder for the CSV table and the picture.")] = Path("results"),
    as_json: AsJson = False,
) -> None:
    """Say what each limit costs the optimum, and which error of masses, lengths or soles would change it most.

    Derivatives of optimum and x* by the first-order conditions, checked by solving again. Example: `nlp-gait prices nao-ssp`
    """
    from compare.questions.prices.report import prices_answer
    from compare.questions.prices.study import prices as find
    from nlp_gait.files import writable_folder

    folder = writable_folder(out)
    spec = problem_spec(problem, robot, intervals, derivatives, option, values, fix)
    with whole(), progress_bar("steps", None) as advance:
        found = find(spec, starts=starts, seed=seed, checks=checks, progress=advance)
    hand_out(prices_answer(found, spec.load()), folder, as_json)
    if found.reason is not None:
        fail(f"no prices at this optimum: {found.reason}")
