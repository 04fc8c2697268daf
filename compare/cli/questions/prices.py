"""``nlp-gait prices``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
    print_json,
    print_table,
    problem_spec,
    progress_bar,
    quantity,
    stdout,
)
from compare.cli.resumable import whole

if TYPE_CHECKING:
    from compare.questions.prices.price import Price, Prices

SHOWN = 12  # rows of the robot's table; all are in the CSV and in --json


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
    from compare.questions.prices.report import write_prices
    from compare.questions.prices.study import prices as find
    from nlp_gait.files import writable_folder

    folder = writable_folder(out)
    spec = problem_spec(problem, robot, intervals, derivatives, option, values, fix)
    with whole(), progress_bar("steps", None) as advance:
        found = find(spec, starts=starts, seed=seed, checks=checks, progress=advance)
    written = write_prices(folder, found)
    if as_json:
        print_json({**asdict(found), "files": [str(path) for path in written]})
    else:
        loaded = spec.load()
        _print(found, dict(zip(loaded.names, map(float, loaded.scale), strict=True)), written)
    if found.reason is not None:
        fail(f"no prices at this optimum: {found.reason}")


def _print(found: Prices, ranges: Mapping[str, float], written: Sequence[Path]) -> None:
    stdout.print(f"{found.problem}: {found.objective_name} {quantity(found.objective, found.unit)}, to {found.sense}")
    if found.limits:
        title = "What holds it back: change of the optimum for one step upwards of a limit or coefficient"
        print_table(title, _header(found), [_row(price, ranges) for price in found.limits])
    stdout.print(f"{found.free} other parameters cost nothing here")
    if found.robot:
        title = (
            f"Which error of the robot would change it most, limits as they are (first {SHOWN} of {len(found.robot)})"
        )
        print_table(title, _header(found), [_row(price, ranges) for price in found.robot[:SHOWN]])
    stdout.print(
        f"First-order conditions hold to {found.residual:.1e}; {found.dependent} of the active rows follow from others. "
        "x* moves along a line only as far as the last column says: beyond, another kink or limit takes over."
    )
    if found.weak:
        stdout.print(f"Held without a price, so that derivatives may differ to both sides: {', '.join(found.weak)}")
    stdout.print(f"Written: {', '.join(map(str, written))}")


def _header(found: Prices) -> tuple[str, ...]:
    unit = "" if found.unit == "1" else f" [{found.unit}]"
    return ("quantity", "step", f"by the slope{unit}", f"- step{unit}", f"+ step{unit}", "slope, x* off") + (
        "x* moves most in",
        "line [steps]",
    )


def _row(price: Price, ranges: Mapping[str, float]) -> tuple[str, ...]:
    furthest = price.furthest(ranges)
    moves = "no derivative" if price.x is None else "-" if furthest is None else f"{furthest[0]} {furthest[1]:+.3g}"
    down, up = (value / price.step for value in price.reach)
    less, more = ("-", "-") if price.one_step is None else map(_change, price.one_step)
    return (
        price.name,
        price.words,
        f"{price.per_step:+.5f}",
        less,
        more,
        _agreement(price),
        moves,
        f"{down:+.2g} to {up:+.2g}",
    )


def _agreement(price: Price) -> str:
    """Relative difference of the slope of the optimum, and of x*, from what solving again gives."""
    if price.one_step is None:
        return "-"
    return ", ".join("-" if error is None else f"{error:.0e}" for error in (price.error, price.x_error))


def _change(value: float | None) -> str:
    return "none" if value is None else f"{value:+.5f}"
