"""``nlp-gait pareto``."""

from __future__ import annotations

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
    print_json,
    print_table,
    problem_spec,
    progress_bar,
    stdout,
)
from compare.cli.resumable import resumable, whole
from nlp_gait.errors import InputError
from nlp_gait.files import write_json

if TYPE_CHECKING:
    from compare.questions.pareto.study import ParetoStudy

SEARCHES = ["NSGA2=10000,100000", "CMOPSO=10000,100000"]


@command
def pareto(
    problem: ProblemName,
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
    robot: Robot = None,
    intervals: Intervals = None,
    derivatives: Derivatives = None,
    option: Options = None,
    values: Set = None,
    fix: Fix = None,
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
    from nlp_gait.files import writable_folder

    names = parse_objectives(objectives)
    searches = parse_searches(search or SEARCHES)
    three = len(names) == 2  # beside power
    if three and search and searches:
        raise InputError("three objectives are traded without searches; leave out --search")
    folder = writable_folder(out)
    loaded = problem_spec(problem, robot, intervals, derivatives, option, values, fix).load()
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
    target = folder / f"{problem}-pareto-{'-'.join(names)}.json"
    write_json(target, data)
    if as_json:
        print_json({**data, "files": [str(path) for path in (*written, target)]})
        return
    if not three:
        _print(study)
    for path in (*written, target):
        stdout.print(f"wrote {path}", soft_wrap=True)


def _print(study: ParetoStudy) -> None:
    unit, front = study.criterion.unit, study.front
    shown = [front[i] for i in sorted({round(k * (len(front) - 1) / 9) for k in range(10)})]
    print_table(
        f"{study.problem.name}: front of power against {study.criterion.name}, {len(front)} points, {len(shown)} shown",
        (study.criterion.name, "power", "price"),
        [(f"{p.value:.5f} {unit}", f"{p.power_W:.5f} W", f"{p.price:.4g} W per {unit}") for p in shown],
    )
    print_table(
        "Knees: turns of at least 15 degrees within a tenth of the front's length, both ranges being 1",
        (study.criterion.name, "power", "turn", "price before", "price after"),
        [
            (
                f"{k.value:.5f} {unit}",
                f"{k.power_W:.5f} W",
                f"{k.turn_deg:.0f} degrees",
                f"{k.price_before:.4g} W per {unit}",
                f"{k.price_after:.4g} W per {unit}",
            )
            for k in study.bends.knees
        ],
    )
    if study.challenge is None:
        return
    print_table(
        "Searches: median over runs (least to greatest)",
        ("algorithm", "evaluations", "hypervolume, of the front's", "IGD", "mean power above the front"),
        [
            (
                q.algorithm,
                f"{q.budget:,}",
                _spread(q.hypervolume, 100, " %"),
                "-" if q.igd is None else _spread(q.igd, 1, ""),
                "-" if q.excess is None else _spread(q.excess, 100, " %"),
            )
            for q in study.qualities
        ],
    )
    c = study.challenge
    stdout.print(
        f"{c.points} points that no search point betters; {c.solved} lowest of these solved for: the nearest is "
        f"{100 * c.least_excess:+.4f} % above the least power at its {study.criterion.name}; "
        f"{c.moved} of them moved the front, {c.infeasible} are infeasible for the exact functions",
        soft_wrap=True,
    )


def _spread(values: tuple[float, float, float], factor: float, unit: str) -> str:
    least, median, greatest = (f"{factor * value:.3g}" for value in values)
    return f"{median}{unit} ({least} to {greatest}{unit})"
