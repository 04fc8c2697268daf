"""``nlp-gait bench``."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from compare.bench.baseline import BASELINE, EVALUATIONS, RUNS, choose_instances, make_bench_study
from compare.cli.command import OUTPUT, command
from compare.cli.compare import run_in_folder
from compare.cli.options import AsJson, Evaluations, Jobs, Scheduler, Tune, parse_names
from compare.cli.printing import describe_command, print_result, print_table, show_progress, stdout
from compare.study.settings import SolverSpec
from compare.study.task import check_task
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder

# Solvers that run beside yours on instances or with a budget for which no baseline is shipped.
RIVALS = "random,pso,de,cma"


@dataclass(frozen=True, kw_only=True)
class InstanceOptions:
    """Instances of GaitBench."""

    suite: Annotated[
        Literal["small", "full", "drawn"],
        typer.Option(
            help="small (ten instances, minutes), full, or drawn: instances of families that the baseline has, too."
        ),
    ] = "small"
    instances: Annotated[
        str | None, typer.Option(help="Only these instances, separated by commas, instead of a suite.")
    ] = None
    families: Annotated[
        str | None,
        typer.Option(help="Only instances that these families draw, separated by commas: ssp, dsp, humanoid-ssp, ..."),
    ] = None
    seeds: Annotated[
        str,
        typer.Option(
            help="Of the drawn instances: FIRST:END (END is not among them), numbers separated by "
            "commas, or test:COUNT for those of today."
        ),
    ] = "0:5"

    @property
    def title(self) -> str:
        """What was chosen, in words."""
        return "chosen instances" if self.instances or self.families else f"suite {self.suite}"


@dataclass(frozen=True, kw_only=True)
class BenchEffort:
    """What runs, and where its results are."""

    against: Annotated[
        str, typer.Option(help="Solvers that run beside yours where no baseline is shipped, separated by commas.")
    ] = RIVALS
    runs: Annotated[int, typer.Option(min=2, max=1000, help="Runs on each instance; the baseline has 15.")] = RUNS
    evaluations: Evaluations = EVALUATIONS
    out: Annotated[
        Path, typer.Option(help="Folder for the page and the records; finished runs in it are reused."), OUTPUT
    ] = Path("bench")
    jobs: Jobs = None
    scheduler: Scheduler = None


@command
def bench(
    algorithm: Annotated[
        str | None,
        typer.Option(
            help="Your algorithm as my.py:MyAlgo or module:name, or a name; without it, only the baseline is shown."
        ),
    ] = None,
    *,
    chosen: InstanceOptions,
    tune: Tune = 0,
    audit: Annotated[
        bool,
        typer.Option(
            help="Examine --algorithm for biases instead: does it gain where the optimum is in the "
            "middle, or clip to bounds?"
        ),
    ] = False,
    label: Annotated[str, typer.Option(help="Name of your algorithm on the page (default: its own name).")] = "",
    effort: BenchEffort,
    as_json: AsJson = False,
) -> None:
    """Run an algorithm on GaitBench and rank it with the shipped baseline, or with others that run beside it.

    Run k has the seed k. The baseline has 10 000 evaluations; with another budget, and on instances without one, the solvers of
    --against run, too.

    Examples: `nlp-gait bench --algorithm my.py:MyAlgo --suite small --out DIR`,
    `nlp-gait bench --algorithm my.py:MyAlgo --families walk12-long,ssp --seeds 0:5 --out DIR`,
    `nlp-gait bench --algorithm pso --label pso-again`, `nlp-gait bench --audit --algorithm my.py:MyAlgo`
    """
    if audit:
        _audit(algorithm, as_json)
    else:
        _rank(algorithm, label, chosen, effort, tune, as_json)


def _rank(
    algorithm: str | None, label: str, chosen: InstanceOptions, effort: BenchEffort, tune: int, as_json: bool
) -> None:
    """Run what the baseline lacks on the instances, rank all, and write the leaderboard."""
    from compare.bench.baseline import list_baselines, list_drawn
    from compare.bench.leaderboard import make_leaderboard_page, make_verdict, rank_solvers
    from compare.report.writing import add_session, write_document

    out = effort.out
    instances = choose_instances(chosen.suite, chosen.instances, chosen.families, chosen.seeds)
    shipped = effort.evaluations == EVALUATIONS and set(instances) <= {*list_baselines(), *list_drawn()}
    solvers = {} if shipped else {other: "" for other in parse_names(effort.against) if other != algorithm}
    if algorithm is not None:
        solvers[algorithm] = label or (f"my-{algorithm}" if algorithm in BASELINE else "")  # the last one
    if tune and not solvers:
        raise InputError(
            "--tune needs a search that runs here: name it with --algorithm, or drawn instances with --families"
        )
    make_writable_folder(out)
    records, name = [], None
    if solvers:
        specs = [SolverSpec(name=solver, label=own) for solver, own in solvers.items()]
        settings = make_bench_study(instances, *specs, runs=effort.runs, evaluations=effort.evaluations)
        name = settings.tasks()[-1].title if algorithm is not None else None
        if name in BASELINE:
            raise InputError(f"{name!r} is a solver of the baseline; give yours another name with --label")
        records = run_in_folder(settings, out, effort.jobs, effort.scheduler, tune, "rerun the command to continue")
    board = rank_solvers(instances, records, shipped=shipped)
    page = make_leaderboard_page(board, name, chosen.title, effort.evaluations)
    problems = [{"name": "gaitbench", "options": {"instance": id}} for id in instances]
    workers = effort.scheduler or str(effort.jobs or available_cores())
    written = write_document(out, add_session(page, describe_command(), problems, workers), "leaderboard")

    def tables() -> None:
        rows = [
            (str(k), s.solver, f"{s.mean_rank:.2f}", f"{100 * s.solved:.1f} %", f"{100 * s.feasible:.0f} %")
            for k, s in enumerate(board.standings, start=1)
        ]
        header = ("rank", "solver", "mean rank", "targets solved", "runs feasible")
        print_table(f"GaitBench, {chosen.title}: {len(instances)} instances", header, rows)
        for sentence in () if name is None else make_verdict(board, name):
            stdout.print(sentence)

    data = {
        "suite": chosen.title,
        "instances": list(instances),
        "solver": name,
        "rank": None if name is None else board.place(name),
        "standings": [asdict(standing) for standing in board.standings],
    }
    print_result(as_json, data, written, tables)


def _audit(algorithm: str | None, as_json: bool) -> None:
    """Audit a search and print what was found."""
    from compare.bench.audit import INSTANCES, audit_search

    if algorithm is None:
        raise InputError("--audit examines one search: name it with --algorithm")
    task = make_bench_study(INSTANCES[:1], SolverSpec(name=algorithm)).tasks()[0]
    if not task.is_search:
        raise InputError(f"--audit examines searches, and {algorithm} uses gradients; choose a search")
    check_task(task)
    with show_progress("audit", len(INSTANCES) + 1) as advance:
        found = audit_search(task.make_search(), progress=advance)
    rows = [(e.change, e.verdict, f"{e.a12:.2f}", f"{e.p:.2g}") for e in found.effects]

    def tables() -> None:
        print_table(f"{task.title}: gait problems in other places of the box", ("change", "result", "A12", "p"), rows)
        stdout.print(
            f"on noise, {100 * found.edge:.1f} % of the variables end at a bound (unbiased: 0 %), {100 * found.middle:.0f} % in "
            "the middle 10 % of their ranges (unbiased: 10 %)"
        )
        stdout.print("; ".join(found.accusations) or "no bias found")

    effects = [{**asdict(effect), "verdict": effect.verdict} for effect in found.effects]
    print_result(as_json, {**asdict(found), "effects": effects, "accusations": list(found.accusations)}, (), tables)
