"""Commands about optima: how certain they are (``certainty``), and how they change (``variants``, ``prices``, ``sweep``, ...)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.cli.command import command
from compare.cli.options import (
    AnyProblem,
    AsJson,
    Code,
    Evaluations,
    NamedProblem,
    NaoPhase,
    OutFolder,
    Seed,
    name_all,
    parse_names,
    parse_options,
    parse_pairs,
)
from compare.cli.printing import print_json, show_progress, stdout
from compare.cli.questions.output import Output
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder
from nlp_gait.formulation import GaitProblem
from nlp_gait.gaits.biped.cycle import SPEED

if TYPE_CHECKING:
    from compare.questions.variants import Variant

FRONT_SEARCHES = ["NSGA2=10000,100000", "CMOPSO=10000,100000"]
CYCLES = ("nao-cycle", "humanoid-cycle")  # whose speed is a parameter if the objective is the power


@command
def certainty(
    *,
    starts: Annotated[int, typer.Option(min=1, max=1000000, help="Random starts of IPOPT.")] = 10_000,
    evaluations: Annotated[
        int, typer.Option(min=0, max=1000000000000, help="Budget of one long CMA-ES with restarts; 0 for none.")
    ] = 1_000_000,
    time_limit: Annotated[
        float, typer.Option(min=0.0, help="Of the proof [s], for at most four variables and NAO's phases; 0 for none.")
    ] = 1800.0,
    seed: Seed = 0,
    problem: AnyProblem,
    check: Annotated[
        Path | None,
        typer.Option(help="Certificate to check instead: look for a better point, then repeat paths of its proof."),
    ] = None,
    complete: Annotated[
        bool, typer.Option("--complete", help="With --check: also repeat the whole proof; rerun to continue.")
    ] = False,
    code: Code = None,
    out: OutFolder = Path("certainty"),
    as_json: AsJson = False,
) -> None:
    """Gather evidence that the best optimum is the global one: many starts, a long search, and a proof for few variables.

    Examples: `nlp-gait certainty walk12 --set lambda=1`, `nlp-gait certainty nao-ssp --starts 1000 --evaluations 0`,
    `nlp-gait certainty --check certainty/walk12-certificate.json`
    """
    if check is not None:
        if problem != AnyProblem():
            raise InputError("--check takes the problem and its options from the certificate; leave them out")
        name_all(code)
        _check(check, seed, out if complete else None, as_json)
        return
    if complete:
        raise InputError("--complete repeats the proof of a certificate; name its file by --check FILE")
    from compare.questions.certainty import Certainty

    loaded = problem.spec().load()
    question = Certainty(problem=loaded, starts=starts, evaluations=evaluations, time_limit_s=time_limit, seed=seed)
    Output(out=out, as_json=as_json).answer(question)


def _check(path: Path, seed: int, repeat_in: Path | None, as_json: bool) -> None:
    from compare.questions.certainty import search_point
    from nlp_gait.proofs.certificate import check_certificate, load_certified_problem, read_certificate, repeat_proof

    file = read_certificate(path)
    proof, points = file.certificate, {"a search": search_point(load_certified_problem(file), seed)}
    found, repeated = check_certificate(file, points=points, seed=seed), None
    if repeat_in is not None:
        make_writable_folder(repeat_in)
        with show_progress("boxes", None) as advance:
            repeated = repeat_proof(file, progress=advance, checkpoint=repeat_in / f".{path.stem}.open")
    if as_json:
        print_json({"schema": 1, **asdict(found), "repeated": None if repeated is None else asdict(repeated)})
        return
    stdout.print(
        f"{file.problem['name']}: bound {proof.bound:.9g}, incumbent {proof.objective:.9g}. No better point was found; the best "
        f"one is of {found.source}, {found.best:.9g}. {found.paths} paths of up to {found.deepest} halvings end; "
        f"{found.pieces:,} boxes dropped on them are proven to contain nothing better; they suggest about {found.boxes:,.0f} "
        f"boxes in total (within a factor of ten), the certificate has {proof.boxes:,}"
        + ("" if found.same_prover else "; it was made by another version of the prover"),
        soft_wrap=True,
    )
    if repeated is not None:
        stdout.print(
            f"The whole proof was repeated: {repeated.boxes:,} boxes, {repeated.cpu_s:.0f} s of the processor; no feasible "
            f"point is better than {repeated.bound:.9g}",
            soft_wrap=True,
        )


@command
def variants(
    *,
    over: Annotated[
        str | None,
        typer.Option(
            metavar="motors|trajectory|OPTION=V1,V2,...",
            help="Real motors, feature by feature; richer and richer motions with free joints at the end; "
            "or values of an option.",
        ),
    ] = None,
    variant: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME:OPTION=VALUE,...",
            help="A variant by name, next to the problem itself; `problem` is another problem's name; repeatable.",
        ),
    ] = None,
    starts: Annotated[
        int, typer.Option(min=1, max=100000, help="Starts of each variant, an earlier optimum among them.")
    ] = 10,
    seed: Seed = 0,
    problem: NaoPhase,
    output: Output,
) -> None:
    """Solve variants of a problem, each from the richest earlier one that it contains, and show what changes.

    Free joints take minutes each. Rerun the command to continue after an interruption.

    Examples: `nlp-gait variants nao-ssp --over motors`, `nlp-gait variants nao-dsp --over trajectory --starts 2`,
    `nlp-gait variants nao-ssp --variant "smooth:objective=jerk" --variant "quick motors:motors=limits,rotor"`
    """
    from compare.questions.variants import Variants

    base = problem.load()
    output.answer(Variants(problem=base, variants=_list_variants(base, over, variant), starts=starts, seed=seed))


def _list_variants(problem: GaitProblem, over: str | None, named: Sequence[str] | None) -> list[Variant]:
    """Return the variants that ``--over`` and ``--variant`` describe."""
    from compare.questions.variants import MOTORS, PROBLEM, Variant, list_trajectories

    option, _, values = (over or "").partition("=")
    if over is None:
        found = [Variant(name="as given")]
    elif values:
        found = [
            Variant(name=value, options=parse_options(problem.address, [(option, value)]))
            for value in parse_names(values)
        ]
    elif option in ("motors", "trajectory"):
        found = [*(MOTORS if option == "motors" else list_trajectories(problem))]
    else:
        raise InputError(f"--over takes motors, trajectory or OPTION=VALUE,VALUE,..., got {over!r}")
    for text in named or ():
        name, _, rest = text.partition(":")
        parts: list[str] = []
        for part in rest.split(","):  # a value may contain commas
            parts = [*parts, part] if "=" in part else [*parts[:-1], f"{parts[-1]},{part}" if parts else part]
        options = dict(parse_pairs(parts, "--variant NAME:"))
        other = options.pop(PROBLEM, "")
        changed = parse_options(other or problem.address, options.items())
        found.append(Variant(name=name.strip(), options=changed, problem=other))
    if len(found) < 2:
        raise InputError(
            "name at least two variants by --over or --variant; the problem itself is one of those of --variant"
        )
    return found


@command
def pareto(
    *,
    against: Annotated[str, typer.Option(help="dbm_y_mean or dbm_x_mean [m], or speed [m/s].")] = "dbm_y_mean",
    points: Annotated[int, typer.Option(min=5, max=10000, help="Points of the front.")] = 40,
    starts: Annotated[int, typer.Option(min=1, max=100000, help="Random starts at every third point.")] = 5,
    search: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=BUDGET,BUDGET",
            show_default=False,
            help="NSGA2 or CMOPSO; repeatable. 'none' for no search.",
        ),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, max=100000, help="Runs of each search.")] = 11,
    seed: Seed = 0,
    problem: NamedProblem,
    out: OutFolder = Path("pareto"),
    as_json: AsJson = False,
) -> None:
    """Power against stability or speed: the true front by IPOPT, its knees, and how near NSGA-II and CMOPSO come to it.

    Examples: `nlp-gait pareto nao-ssp --search NSGA2=10000`, `nlp-gait pareto nao-ssp --against speed`
    """
    from compare.questions.pareto.pareto import Pareto, parse_searches

    output, searches = Output(out=out, as_json=as_json), parse_searches(search or FRONT_SEARCHES)
    effort = {"points": points, "starts": starts, "seed": seed, "runs": runs}
    output.answer(Pareto(problem=problem.load(), against=against, searches=searches, **effort))


@command
def prices(
    *,
    starts: Annotated[int, typer.Option(min=1, max=100000, help="Random starts within the bounds.")] = 10,
    seed: Seed = 0,
    checks: Annotated[int, typer.Option(min=0, help="Quantities of the robot that are verified by solving again.")] = 3,
    problem: NamedProblem,
    output: Output,
) -> None:
    """Compute what each limit costs the optimum, and which error of masses, lengths or soles would change it most.

    Derivatives of optimum and x* by the first-order conditions, verified by solving again. Example: `nlp-gait prices nao-ssp`
    """
    from compare.questions.prices import Prices

    output.answer(Prices(problem=problem.load(), starts=starts, seed=seed, checks=checks))


@command
def robust(
    *,
    mass: Annotated[float, typer.Option(min=0.0, max=50.0, help="Tolerance of every mass, up and down [%].")] = 5.0,
    sole: Annotated[
        float, typer.Option(min=0.0, max=20.0, help="Tolerance of the soles' position in x and y [mm].")
    ] = 2.0,
    starts: Annotated[int, typer.Option(min=1, max=100000, help="Random starts of the nominal problem.")] = 10,
    seed: Seed = 0,
    problem: NaoPhase,
    output: Output,
) -> None:
    """Find the least power of a gait that keeps its limits for all masses and soles within their tolerances.

    One motion for all robots of a box, whose worst corners are found one after the other. Both gaits are written for each corner,
    for `nlp-gait simulate`. Example: `nlp-gait robust nao-ssp`
    """
    from compare.questions.robust import Robust

    effort = {"starts": starts, "seed": seed}
    output.answer(Robust(problem=problem.load(), mass=mass, sole=sole, **effort))


@command
def sweep(
    *,
    over: Annotated[
        list[str] | None, typer.Option(metavar="NAME=LOW:HIGH:COUNT", help="Axis; repeatable. Or NAME=V1,V2,...")
    ] = None,
    capabilities: Annotated[
        bool,
        typer.Option(
            "--capabilities", help="Of a walking cycle instead: its highest speed, longest step, highest lift."
        ),
    ] = False,
    algorithm: Annotated[str, typer.Option(help="ipopt, or a search algorithm.")] = "ipopt",
    starts: Annotated[int, typer.Option(min=1, max=100000, help="Random starts where no neighbour helps.")] = 5,
    evaluations: Evaluations = 10_000,
    seed: Seed = 0,
    engine: Annotated[
        bool, typer.Option("--engine", help="Simulate steps of each walking cycle in MuJoCo (extra sim).")
    ] = False,
    steps: Annotated[int, typer.Option(min=1, max=1000, help="With --engine: number of steps.")] = 10,
    problem: NamedProblem,
    output: Output,
) -> None:
    """Solve a problem over a grid of parameter values or fixed variables, each point from its neighbour.

    Rerun the command to continue after an interruption.

    With speeds as an axis the objective of a walking cycle is its power. Simulations are open loop.

    With `--capabilities` each quantity comes with the limits that stop it. Bounds on times and velocities that are this
    package's, not the robot's, are named, and moved where they stop the robot. The sharpest turn is reported, too.

    Examples: `nlp-gait sweep nao-ssp --over swing_height_m=0.015:0.028:6`,
    `nlp-gait sweep nao-cycle --over speed_m_s=0.01:0.1:10 --engine`,
    `nlp-gait sweep humanoid-cycle --robot my.urdf --over speed_m_s=0.02,0.05`,
    `nlp-gait sweep humanoid-cycle --robot my.urdf --set intervals=5 --capabilities`
    """
    from compare.questions.capabilities import Capabilities
    from compare.questions.sweep import Sweep, parse_axis

    if capabilities == bool(over):
        raise InputError("a sweep takes either --over NAME=LOW:HIGH:COUNT or --capabilities")
    if capabilities:
        output.answer(Capabilities(problem=problem.load(), starts=starts, seed=seed))
        return
    axes, effort = (
        [parse_axis(text) for text in over or ()],
        {"starts": starts, "evaluations": evaluations, "seed": seed},
    )
    if problem.name in CYCLES and any(axis.name == SPEED for axis in axes):
        problem = replace(problem, values=["objective=power", *(problem.values or ())])
    effort["steps"] = steps if engine else 0
    output.answer(Sweep(problem=problem.load(), axes=axes, algorithm=algorithm, **effort))
