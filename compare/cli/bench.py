"""``nlp-gait bench``."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Literal

from typer import Option

from compare.bench.baseline import BASELINE, EVALUATIONS, RUNS, choose_instances, load_table, plan_bench_runs
from compare.bench.leaderboard import make_leaderboard_page, rank_solvers
from compare.cli.command import OUTPUT, command
from compare.cli.compare import run_in_folder
from compare.cli.options import Evaluations, Jobs, Scheduler, parse_names
from compare.cli.printing import Output, Rows, describe_command
from compare.report.writing import add_origin, write_document
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder


@dataclass(frozen=True, kw_only=True)
class Instances:
    """Instances of GaitBench."""

    suite: Literal["small", "full", "drawn"] = "small"
    instances: str | None = None
    families: str | None = None
    seeds: str = "0:5"

    @property
    def title(self) -> str:
        """What was chosen, in words."""
        return "chosen instances" if self.instances or self.families else f"suite {self.suite}"


@dataclass(frozen=True, kw_only=True)
class BenchEffort:
    """What runs, and where its results are."""

    against: str = "random,pso,de,cma"
    runs: Annotated[int, Option(min=2, max=1000)] = RUNS
    evaluations: Evaluations = EVALUATIONS
    out: Annotated[Path, OUTPUT] = Path("bench")
    jobs: Jobs = None
    scheduler: Scheduler = None


@command
def bench(
    algorithm: str | None = None,
    *,
    chosen: Instances,
    label: str = "",
    effort: BenchEffort,
) -> Output:
    """Run an algorithm on GaitBench and rank it with the shipped baseline, or with others that run beside it.

    Run k has the seed k. The baseline has 10 000 evaluations; with another budget, and on instances without one, the solvers of
    --against run, too.

    Examples: `nlp-gait bench --algorithm my.py:MyAlgo --suite small --out DIR`,
    `nlp-gait bench --algorithm my.py:MyAlgo --families walk12-long,ssp --seeds 0:5 --out DIR`,
    `nlp-gait bench --algorithm pso --label pso-again`
    """
    instances = choose_instances(chosen.suite, chosen.instances, chosen.families, chosen.seeds)
    shipped = effort.evaluations == EVALUATIONS and set(instances) <= load_table().keys()
    solvers = {} if shipped else {name: "" for name in parse_names(effort.against) if name != algorithm}
    if algorithm is not None:
        solvers[algorithm] = label or (f"my-{algorithm}" if algorithm in BASELINE else "")  # the last one
    out, records, name = make_writable_folder(effort.out), [], None
    if solvers:
        runs = plan_bench_runs(instances, solvers, runs=effort.runs, evaluations=effort.evaluations)
        name = runs[-1].title if algorithm is not None else None
        if name in BASELINE:
            raise InputError(f"{name!r} is a solver of the baseline; give yours another name with --label")
        records = run_in_folder(runs, out, effort.jobs, effort.scheduler)
    board = rank_solvers(instances, records, shipped=shipped)
    page = make_leaderboard_page(board, name, chosen.title, effort.evaluations)
    rows = [
        (str(k), one.solver, f"{one.mean_rank:.2f}", f"{100 * one.solved:.1f} %", f"{100 * one.feasible:.0f} %")
        for k, one in enumerate(board.standings, start=1)
    ]
    header = ("rank", "solver", "mean rank", "targets solved", "runs feasible")
    table = Rows(f"GaitBench, {chosen.title}: {len(instances)} instances", header, rows)
    return Output(
        data={
            "suite": chosen.title,
            "instances": list(instances),
            "solver": name,
            "rank": None if name is None else board.place(name),
            "standings": [asdict(standing) for standing in board.standings],
        },
        parts=[table, *page.headline],
        written=write_document(out, add_origin(page, describe_command()), "leaderboard"),
    )
