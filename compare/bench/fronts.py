"""GaitBench with two objectives: searches on all its instances, their distances from the true fronts, and the page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.drawing.figures import assign_looks, make_figure, use_style
from compare.report.document import Document, Figure, Section, make_text_table
from compare.study.store import Computation, Store
from metaheuristics.multi_objective import (
    FRONT_ALGORITHMS,
    FrontAlgorithm,
    check_budgets,
    make_front_algorithm,
    minimize_many,
)
from nlp_gait.errors import InputError, UserCodeError
from nlp_gait.formulation import Array
from nlp_gait.gaitbench.fronts import FrontQuality, get_front_definition, load_front
from nlp_gait.progress import Progress
from nlp_gait.user_code import hash_source, is_reference, load_object, shorten_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

SEARCHES = ("NSGA2", "CMOPSO")
COLUMNS = 3  # of panels in the figure
SMALL_RINGS: Mapping[str, Any] = {"markersize": 3, "markerfacecolor": "none"}  # markers of points


@dataclass(frozen=True, kw_only=True)
class FrontResult:
    """All runs of one search on one instance."""

    instance: str
    solver: str
    runs: tuple[FrontQuality, ...]
    points: Array  #: (k, 2) scaled objectives of the run of median hypervolume

    def get_median(self, name: str) -> float:
        """Return the median over the runs of a measure; runs without a feasible point have the worst value."""
        return median(getattr(run, name) for run in self.runs)


def make_front_search(name: str) -> FrontAlgorithm:
    """Return a search by name or, for the user's code, the object that a reference names.

    Raises SearchError for an unknown name, and UserCodeError if the code fails or is no search for several objectives.
    """
    if name in FRONT_ALGORITHMS or not is_reference(name):
        return make_front_algorithm(name)
    own: Any = load_object(name, "algorithm")
    own = own() if isinstance(own, type) else own
    if not callable(getattr(own, "start", None)) or not isinstance(getattr(own, "population", None), int):
        raise UserCodeError(f"{name!r} must have `population` and `start(start, objectives)`, got {type(own).__name__}")
    search: FrontAlgorithm = own
    return search


def run_fronts(
    instances: Sequence[str],
    solvers: Sequence[str],
    *,
    runs: int,
    evaluations: int,
    folder: Path,
    jobs: int,
    progress: Progress,
) -> list[FrontResult]:
    """Run searches on instances with two objectives; run k has the seed k. Finished runs are stored: the same call continues.

    Raises as ``make_front_search``, and InputError for an unknown instance or a budget that is not allowed.
    """
    for solver in solvers:
        check_budgets(make_front_search(solver), [evaluations])
    pairs = [(id, solver) for id in instances for solver in solvers]
    computations = [
        Computation(
            name=f"{id}-{shorten_name(solver)}-{run}".replace(":", "_"),
            inputs={
                "instance": asdict(get_front_definition(id)),
                "solver": solver,
                "evaluations": evaluations,
                "seed": run,
                "source": hash_source(solver, "algorithm")
                if is_reference(solver)
                else repr(make_front_algorithm(solver)),
            },
            function=partial(run_search, id, solver, evaluations, run),
        )
        for id, solver in pairs
        for run in range(runs)
    ]
    found = list(Store(folder).compute_all(computations, jobs=jobs, progress=progress).values())
    groups = [found[k : k + runs] for k in range(0, len(found), runs)]
    return [_collect(id, shorten_name(solver), group) for (id, solver), group in zip(pairs, groups, strict=True)]


def run_search(id: str, solver: str, evaluations: int, seed: int) -> dict[str, Any]:
    """Return the points that one run has found, as plain data."""
    (snapshot,) = minimize_many(load_front(id), make_front_search(solver), evaluations=[evaluations], seed=seed)
    return {"X": snapshot.X.tolist()}


def _collect(id: str, solver: str, found: Sequence[dict[str, Any]]) -> FrontResult:
    """Judge the points of all runs again; infeasible ones do not count."""
    instance = load_front(id)
    fronts = []
    for run in found:
        F, violation = instance(np.array(run["X"]).reshape(-1, len(instance.names)))
        fronts.append(F[violation == 0.0])
    qualities = [instance.measure(F) for F in fronts]
    middle = sorted(range(len(fronts)), key=lambda k: qualities[k].hypervolume)[(len(fronts) - 1) // 2]
    return FrontResult(instance=id, solver=solver, runs=tuple(qualities), points=fronts[middle])


def rank_searches(results: Sequence[FrontResult]) -> dict[str, float]:
    """Return the mean rank over the instances by median hypervolume of each search, best first; equals share a rank."""
    from scipy.stats import rankdata

    solvers, instances = (list(dict.fromkeys(getattr(r, key) for r in results)) for key in ("solver", "instance"))
    values = {(r.instance, r.solver): -r.get_median("hypervolume") for r in results}
    ranks = rankdata([[values[id, solver] for solver in solvers] for id in instances], axis=1).mean(axis=0)
    return dict(sorted(zip(solvers, ranks.tolist(), strict=True), key=lambda item: item[1]))


def make_fronts_page(results: Sequence[FrontResult], runs: int, evaluations: int) -> Document:
    """Return the page of all searches on instances with two objectives."""
    if not results:
        raise InputError("there are no results; name at least one instance and one search")
    ranks, count = rank_searches(results), len({result.instance for result in results})
    header = ("instance", "search", "hypervolume", "IGD+", "epsilon", "runs without a point")
    rows = [
        (
            *(result.instance, result.solver, f"{100 * result.get_median('hypervolume'):.1f} %"),
            *(f"{v:.4f}" if math.isfinite(v := result.get_median(name)) else "-" for name in ("igd_plus", "epsilon")),
            f"{sum(not run.hypervolume for run in result.runs)} of {len(result.runs)}",
        )
        for result in results
    ]
    best, rank = next(iter(ranks.items()))
    return Document(
        title=f"GaitBench with two objectives: {count} instances, {len(ranks)} searches",
        verdict=(f"{best} has the best mean rank by median hypervolume, {rank:.2f} of {len(ranks)} searches.",),
        parts=(
            f"{runs} runs of {evaluations} evaluations, run k with the seed k. The true fronts are IPOPT's; both of their ranges "
            "are 1. Hypervolume: share of the true front's, whose points are joined by straight lines, so that a search may "
            "exceed 100 % by a little; the reference is 1.1 in both. IGD+: mean over the true front of the distance by which the "
            "search is worse. Epsilon: what would have to be subtracted from both objectives of every point to be nowhere worse. "
            "Medians over runs; every point was judged again by the exact functions.",
            make_text_table(
                ("search", "mean rank"), [(name, f"{value:.2f}") for name, value in ranks.items()], "By hypervolume"
            ),
            Figure(
                name="fronts",
                caption="True fronts (lines) and each search's run of median hypervolume, 0 at the best and 1 at the worst value "
                "of each objective on the true front.",
                drawing=plot_fronts(results),
            ),
            Section(title="Instance by instance", parts=(make_text_table(header, rows),)),
        ),
    )


def plot_fronts(results: Sequence[FrontResult]) -> Drawing:
    """Plot the true front of each instance and the points of each search's median run."""
    instances = list(dict.fromkeys(result.instance for result in results))
    rows = -(-len(instances) // COLUMNS)
    with use_style():
        figure = make_figure(7.4, 0.6 + 2.2 * rows)
        looks = assign_looks(dict.fromkeys(result.solver for result in results))
        panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
        for axes, id in zip(panels, instances, strict=False):
            axes.plot(*load_front(id).front.T, color="black", linewidth=1.0)
            for result in (r for r in results if r.instance == id):
                look = looks[result.solver]
                axes.plot(*result.points.T, look.marker, color=look.colour, label=result.solver, **SMALL_RINGS)
            axes.set_title(id, fontsize="small")
            axes.set(xlim=(-0.05, 1.15), ylim=(-0.05, 1.15))
        for axes in panels[len(instances) :]:
            axes.set_visible(False)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(looks))
    return figure
