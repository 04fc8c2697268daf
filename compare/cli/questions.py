"""Commands that answer a question about a problem: how certain its optimum is, and how it changes."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Option

from compare.cli import options
from compare.cli.command import CONTINUE, Output, Rows, command, describe_command, describe_stored, show_progress
from compare.cli.simulate import ConditionOptions, DriveOptions
from compare.questions.certainty import Certainty
from compare.questions.pareto.pareto import Pareto, parse_searches
from compare.questions.prices import Prices
from compare.questions.question import Question, Work
from compare.questions.sweep import Sweep, parse_axis
from compare.report.document import Table, iterate_leaves
from compare.report.writing import add_origin
from compare.study.memo import Memo
from metaheuristics import make_algorithm
from nlp_gait.errors import OutputError
from nlp_gait.formulation import Result
from nlp_gait.gaits.biped.cycle import SPEED
from nlp_gait.interrupts import defer_interrupts

FRONT_SEARCHES = ["NSGA2=10000,100000", "CMOPSO=10000,100000"]
CYCLES = ("nao-cycle", "humanoid-cycle")  # whose speed is a parameter if the objective is the power


@command
def certainty(
    *,
    starts: Annotated[int, Option(min=1, max=1000000)] = 10_000,
    time_limit: Annotated[float, Option(min=0.0, max=1000000000.0)] = 1800.0,
    seed: options.Seed = 0,
    problem: options.NamedProblem,
    out: options.OutFolder = Path("certainty"),
) -> Output:
    """Gather evidence that the best optimum is the global one: many starts, and a proof for few variables.

    Examples: `nlp-gait certainty walk12 --set lambda=1`, `nlp-gait certainty nao-ssp --starts 1000`
    """
    question = Certainty(problem=problem.load(), starts=starts, time_limit_s=time_limit, seed=seed)
    return run_question(question, out)


@command
def pareto(
    *,
    against: str = "dbm_y_mean",
    points: Annotated[int, Option(min=5, max=10000)] = 40,
    starts: Annotated[int, Option(min=1, max=100000)] = 5,
    search: Annotated[list[str] | None, Option(metavar="NAME=BUDGET,BUDGET", show_default=False)] = None,
    runs: options.Runs = 11,
    seed: options.Seed = 0,
    problem: options.NamedProblem,
    out: options.OutFolder = Path("pareto"),
) -> Output:
    """Power against stability or speed: the true front by IPOPT, its knees, and how near NSGA-II and CMOPSO come to it.

    Examples: `nlp-gait pareto nao-ssp --search NSGA2=10000`, `nlp-gait pareto nao-ssp --against speed`
    """
    searches, effort = parse_searches(search or FRONT_SEARCHES), {"points": points, "starts": starts, "runs": runs}
    return run_question(Pareto(problem=problem.load(), against=against, searches=searches, seed=seed, **effort), out)


@command
def prices(
    *,
    starts: options.Starts = 10,
    seed: options.Seed = 0,
    problem: options.NamedProblem,
    out: options.OutFolder = options.RESULTS,
) -> Output:
    """Compute what each limit costs the optimum, and which error of masses, lengths or soles would change it most.

    Derivatives of optimum and x* by the first-order conditions, verified by solving again. Example: `nlp-gait prices nao-ssp`
    """
    return run_question(Prices(problem=problem.load(), starts=starts, seed=seed), out)


@command
def sweep(
    *,
    over: Annotated[list[str], Option(metavar="NAME=LOW:HIGH:COUNT")],
    starts: options.Starts = 5,
    seed: options.Seed = 0,
    problem: options.NamedProblem,
    out: options.OutFolder = options.RESULTS,
) -> Output:
    """Solve a problem over a grid of parameter values or fixed variables, each point from its neighbour.

    With speeds as an axis the objective of a walking cycle is its power; each of its gaits is a file for `nlp-gait simulate`.

    Examples: `nlp-gait sweep nao-ssp --over swing_height_m=0.015:0.028:6`,
    `nlp-gait sweep nao-cycle --over speed_m_s=0.01:0.1:10`,
    `nlp-gait sweep humanoid-cycle --robot my.urdf --set intervals=5 --over speed_m_s=0.1:0.6:6`
    """
    axes = [parse_axis(text) for text in over]
    if problem.name in CYCLES and any(axis.name == SPEED for axis in axes):
        problem = replace(problem, values=["objective=power", *(problem.values or ())])
    return run_question(Sweep(problem=problem.load(), axes=axes, starts=starts, seed=seed), out)


@command
def tune(
    *,
    over: Annotated[list[str] | None, Option(metavar="NAME=LOW:HIGH:COUNT")] = None,
    algorithms: str = "cma,pso,ga",
    simulations: Annotated[int, Option(min=10, max=10**6)] = 300,
    runs: options.Runs = 3,
    seed: options.Seed = 0,
    steps: Annotated[int, Option(min=1, max=1000)] = 4,
    problem: options.NamedProblem,
    world: ConditionOptions,
    drive_options: DriveOptions,
    out: options.OutFolder = Path("tuned"),
) -> Output:
    """Tune a gait in MuJoCo (extra `sim`): searches whose scores are simulations, beside IPOPT's optimum of the model.

    A score is the energy of the drives per metre; a gait must not fall, slip, miss its way or use torque limits for long. All are
    judged after ten steps and on three held-out floors. Rerun the command to continue after an interruption. Example:
    `nlp-gait tune nao-cycle --bumps-mm 1 --over ssp_dbm_y_mean_limit_m=0.003:0.02:5 --simulations 300 --out tuned`
    """
    from compare.questions.tune import Tune
    from nlp_gait.simulation.plan import make_plan

    names, loaded, axes = options.parse_names(algorithms), problem.load(), [parse_axis(text) for text in over or ()]
    for name in names:
        make_algorithm(name)
    plan = make_plan(Result(problem=loaded, x=loaded.start_point(np.random.default_rng(seed))))
    question = Tune(
        problem=loaded,
        drive=drive_options.make(plan),
        conditions=world.make(),
        limits=axes,
        algorithms=names,
        simulations=simulations,
        runs=runs,
        seed=seed,
        steps=None if plan.from_rest_to_rest else steps,
    )
    return run_question(question, out)


def run_question(question: Question[Any], out: Path) -> Output:
    """Answer a question, continuing from the results stored in the folder; also from partial findings after Ctrl-C.

    The output has sentences and tables, without those for other programs, also if the answer cannot be written.
    """
    findings, stopped, notes = None, "", 0
    with show_progress(question.counts, question.total) as advance:

        def progress(note: str) -> None:
            nonlocal notes
            notes += 1
            advance(note)

        try:
            for partial in question.find(Work(memo=Memo(out), progress=progress)):
                findings = partial
        except KeyboardInterrupt as interrupt:
            done = "" if question.total is None else f" after {notes} of {question.total} {question.counts}"
            stopped = str(interrupt) or f"interrupted{done}"
    if findings is None:
        return Output(data={}, interrupted=f"{stopped}; {describe_stored(out)}")
    answer = question.add_best_known(findings)
    written, failures = list[Path](), list[str]()
    with defer_interrupts() as pressed:
        try:
            written = add_origin(answer, describe_command()).write(out)
        except OutputError as error:
            failures.append(str(error))
    if pressed() and not stopped:
        stopped = "interrupted at the end"
    parts: list[str | Rows] = [answer.title, *answer.headline]
    for block in iterate_leaves(answer.parts):
        if isinstance(block, str):
            parts.append(block)
        elif isinstance(block, Table) and not block.name:
            parts.append(Rows(block.caption, tuple(block.columns), block.cells))
    interrupted = f"{stopped}; the results are in {out}; {CONTINUE}" if stopped else ""
    return Output(data=answer.data, parts=parts, written=written, failures=failures, interrupted=interrupted)
