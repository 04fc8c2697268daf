"""``nlp-gait prices``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from compare.analysis.units import heading, with_unit
from compare.cli.command import command
from compare.cli.common import fail, print_result, print_rows, progress_bar, stdout
from compare.cli.interrupts import whole
from compare.cli.options import RESULTS, AsJson, NamedProblem, Seed, TableFolder
from nlp_gait.files import writable_folder

if TYPE_CHECKING:
    from compare.questions.prices.price import Price, Prices
    from nlp_gait.problem import GaitProblem

SHOWN = 12  # rows of the robot's table; all are in the CSV and in --json


@command
def prices(
    *,
    starts: Annotated[int, typer.Option(min=1, help="Random starts within the bounds.")] = 10,
    seed: Seed = 0,
    checks: Annotated[int, typer.Option(min=0, help="Quantities of the robot that are checked by solving again.")] = 3,
    problem: NamedProblem,
    out: TableFolder = RESULTS,
    as_json: AsJson = False,
) -> None:
    """Say what each limit costs the optimum, and which error of masses, lengths or soles would change it most.

    Derivatives of optimum and x* by the first-order conditions, checked by solving again. Example: `nlp-gait prices nao-ssp`
    """
    from compare.questions.prices.report import write_prices
    from compare.questions.prices.study import prices as find

    folder = writable_folder(out)
    spec = problem.spec()
    with whole(), progress_bar("steps", None) as advance:
        found = find(spec, starts=starts, seed=seed, checks=checks, progress=advance)
    written = write_prices(folder, found)
    print_result(as_json, asdict(found), written, lambda: _print(found, spec.load()))
    if found.reason is not None:
        fail(f"no prices at this optimum: {found.reason}")


def _print(found: Prices, problem: GaitProblem) -> None:
    objective = with_unit(found.objective, found.unit)
    stdout.print(f"{found.problem}: {found.objective_name} {objective}, to {found.sense}")
    ranges = dict(zip(problem.names, map(float, problem.scale), strict=True))
    if found.limits:
        title = "What holds it back: change of the optimum for one step upwards of a limit or coefficient"
        _print_prices(title, found.limits, found.unit, ranges)
    stdout.print(f"{found.free} other parameters cost nothing here")
    if found.robot:
        shown = f"first {SHOWN} of {len(found.robot)}"
        title = f"Which error of the robot would change it most, limits as they are ({shown})"
        _print_prices(title, found.robot[:SHOWN], found.unit, ranges)
    stdout.print(
        f"First-order conditions hold to {found.residual:.1e}; {found.dependent} of the active rows follow from others. "
        "x* moves along a line only as far as the last column says: beyond, another kink or limit takes over."
    )
    if found.weak:
        stdout.print(f"Held without a price, so that derivatives may differ to both sides: {', '.join(found.weak)}")


def _print_prices(title: str, prices: Sequence[Price], unit: str, ranges: Mapping[str, float]) -> None:
    print_rows(
        title,
        prices,
        {
            "quantity": lambda p: p.name,
            "step": lambda p: p.words,
            heading("by the slope", unit): lambda p: f"{p.per_step:+.5f}",
            heading("- step", unit): lambda p: _change(p, 0),
            heading("+ step", unit): lambda p: _change(p, 1),
            "slope, x* off": _agreement,
            "x* moves most in": lambda p: _move(p, ranges),
            "line [steps]": lambda p: " to ".join(f"{end / p.step:+.2g}" for end in p.reach),
        },
    )


def _change(price: Price, side: int) -> str:
    """Change of the optimum by solving again one step below (side 0) or above (1)."""
    if price.one_step is None:
        return "-"
    change = price.one_step[side]
    return "none" if change is None else f"{change:+.5f}"


def _move(price: Price, ranges: Mapping[str, float]) -> str:
    """Variable that moves most, for its range, and by how much."""
    if price.x is None:
        return "no derivative"
    furthest = price.furthest(ranges)
    return "-" if furthest is None else f"{furthest[0]} {furthest[1]:+.3g}"


def _agreement(price: Price) -> str:
    """Relative difference of the slope of the optimum, and of x*, from what solving again gives."""
    if price.one_step is None:
        return "-"
    return ", ".join("-" if error is None else f"{error:.0e}" for error in (price.error, price.x_error))
