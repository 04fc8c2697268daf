"""``nlp-gait pareto``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.analysis.units import with_unit
from compare.cli.command import command
from compare.cli.common import print_result, print_rows, progress_bar, stdout
from compare.cli.interrupts import resumable, whole
from compare.cli.options import AsJson, NamedProblem, Seed
from nlp_gait.errors import InputError
from nlp_gait.files import writable_folder, write_json

if TYPE_CHECKING:
    from compare.questions.pareto.study import ParetoStudy

SEARCHES = ["NSGA2=10000,100000", "CMOPSO=10000,100000"]


@command
def pareto(
    *,
    objectives: Annotated[
        str,
        typer.Option(
            help="power [W] and one or two of dbm_y_mean, dbm_x_mean, dbm_y_min, dbm_x_min [m] and speed [m/s], "
            "separated by commas."
        ),
    ] = "power,dbm_y_mean",
    points: Annotated[int, typer.Option(min=5, help="Points of the front.")] = 40,
    starts: Annotated[int, typer.Option(min=1, help="Random starts at every third point.")] = 5,
    search: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=BUDGET,BUDGET", help="NSGA2 or CMOPSO; repeatable. 'none' for no search.", show_default=False
        ),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Runs of each search.")] = 11,
    seed: Seed = 0,
    problem: NamedProblem,
    out: Annotated[Path, typer.Option(help="Folder; finished runs in it are kept.")] = Path("pareto"),
    as_json: AsJson = False,
) -> None:
    """Power against stability or speed: the true front by IPOPT, its knees, and how near NSGA-II and CMOPSO come to it.

    With three objectives the front is a surface, without searches.

    Examples: `nlp-gait pareto nao-ssp --search NSGA2=10000`, `nlp-gait pareto nao-ssp --objectives power,dbm_y_mean,speed`
    """
    from compare.questions.pareto.criteria import parse_objectives
    from compare.questions.pareto.report import write_front
    from compare.questions.pareto.study import pareto_study, parse_searches
    from compare.questions.pareto.surface import pareto_surface, surface_json, write_surface

    names = parse_objectives(objectives)
    searches = parse_searches(search or SEARCHES)
    three = len(names) == 2  # beside power
    if three and search and searches:
        raise InputError("three objectives are traded without searches; leave out --search")
    folder = writable_folder(out)
    loaded = problem.spec().load()
    with whole() if three else resumable(folder), progress_bar("front", None) as advance:
        if three:
            surface = pareto_surface(loaded, names, points=points, starts=starts, seed=seed, progress=advance)
            written = write_surface(folder, surface)
            data = surface_json(surface)
        else:
            study = pareto_study(
                loaded,
                names[0],
                folder,
                points=points,
                starts=starts,
                searches=searches,
                runs=runs,
                seed=seed,
                progress=advance,
            )
            written = write_front(folder, study.front, study.bends, study.searches, loaded, study.criterion)
            data = study.to_json()
    target = folder / f"{problem.name}-pareto-{'-'.join(names)}.json"
    write_json(target, data)
    print_result(as_json, data, [*written, target], lambda: None if three else _print(study))


def _print(study: ParetoStudy) -> None:
    name, unit, front = study.criterion.name, study.criterion.unit, study.front
    price_unit = f"W per {unit}"
    shown = [front[i] for i in sorted({round(k * (len(front) - 1) / 9) for k in range(10)})]
    print_rows(
        f"{study.problem.name}: front of power against {name}, {len(front)} points, {len(shown)} shown",
        shown,
        {
            name: lambda p: with_unit(p.value, unit, ".5f"),
            "power": lambda p: with_unit(p.power_W, "W", ".5f"),
            "price": lambda p: with_unit(p.price, price_unit, ".4g"),
        },
    )
    print_rows(
        "Knees: turns of at least 15 degrees within a tenth of the front's length, both ranges being 1",
        study.bends.knees,
        {
            name: lambda k: with_unit(k.value, unit, ".5f"),
            "power": lambda k: with_unit(k.power_W, "W", ".5f"),
            "turn": lambda k: with_unit(k.turn_deg, "degrees", ".0f"),
            "price before": lambda k: with_unit(k.price_before, price_unit, ".4g"),
            "price after": lambda k: with_unit(k.price_after, price_unit, ".4g"),
        },
    )
    if study.challenge is None:
        return
    print_rows(
        "Searches: median over runs (least to greatest)",
        study.qualities,
        {
            "algorithm": lambda q: q.algorithm,
            "evaluations": lambda q: f"{q.budget:,}",
            "hypervolume, of the front's": lambda q: _spread(q.hypervolume, 100, " %"),
            "IGD": lambda q: _spread(q.igd, 1, ""),
            "mean power above the front": lambda q: _spread(q.excess, 100, " %"),
        },
    )
    c = study.challenge
    stdout.print(
        f"{c.points} points that no search point betters; {c.solved} lowest of these solved for: the nearest is "
        f"{100 * c.least_excess:+.4f} % above the least power at its {name}; "
        f"{c.moved} of them moved the front, {c.infeasible} are infeasible for the exact functions",
        soft_wrap=True,
    )


def _spread(values: tuple[float, float, float] | None, factor: float, unit: str) -> str:
    if values is None:
        return "-"
    least, median, greatest = (f"{factor * value:.3g}" for value in values)
    return f"{median}{unit} ({least} to {greatest}{unit})"
