"""A study in sentences: its answer for each problem or over many, also while it runs, and what is missing in it."""

import math
from collections import Counter
from collections.abc import Sequence
from statistics import median

from compare.analysis.best_known import compute_gap
from compare.analysis.comparison import FOUND, SMALLEST_GAP, Comparison, SolverRuns, index_solvers
from compare.analysis.overview import count_wins, list_user_solvers
from compare.analysis.record_statistics import find_best_known
from compare.analysis.units import format_number, format_percent, join_words, with_unit
from compare.study.record import RunRecord, group_by
from compare.study.references import describe_gap, find_reference
from nlp_gait.gaitbench.facts import SIX_DIGITS

PLACES = {"behind": -1, "before": 1}
MANY = 5  # problems, from which on there are statistics over problems, and one headline for all


def write_headlines(comparisons: Sequence[Comparison]) -> tuple[str, ...]:
    """Return one headline per problem; over many problems one for all."""
    if len(comparisons) >= MANY:
        return (write_overall_headline(comparisons),)
    return tuple(map(write_headline, comparisons))


def write_headline(comparison: Comparison) -> str:
    """Return the best objective, its proof, and how far above it the median runs end; of the user's solver first."""
    names = [solver.name for solver in comparison.solvers]
    if not math.isfinite(comparison.reference):
        return f"On {comparison.problem} no run is feasible: {join_words(names)}."
    best = with_unit(comparison.reference, comparison.objective.unit)
    optimum = f"is {best}, {_describe_proof(comparison)}"
    users = [solver for solver in comparison.solvers if solver.is_user_defined]
    if users:
        package_solvers = [solver for solver in comparison.solvers if solver not in users]
        subject = join_words(_describe_user_solver(comparison, solver) for solver in users)
        first = f"On {comparison.problem} {subject}, which {optimum}."
    else:
        package_solvers = list(comparison.solvers)
        first = f"On {comparison.problem} the best {comparison.objective.name} {optimum}."
    return " ".join(filter(None, (first, _describe_gaps(comparison, package_solvers), describe_better(comparison))))


def _describe_proof(comparison: Comparison) -> str:
    bound, unit = comparison.known.bound, comparison.objective.unit
    if comparison.known.objective is None:
        return comparison.known.source
    if bound is None:
        return "the best known value"
    if abs(bound - comparison.reference) <= SIX_DIGITS * (abs(comparison.reference) or 1.0):
        return "proven optimal to six digits"
    return (
        f"and none is better than {with_unit(bound, unit)} (proven, {describe_gap(bound, comparison.reference)} away)"
    )


def _describe_side(comparison: Comparison) -> str:
    return "above" if comparison.objective.sense == "minimise" else "below"


def _describe_user_solver(comparison: Comparison, solver: SolverRuns) -> str:
    """Return the gap of the median run, and the solvers that chance does not exclude to be equal or better."""
    if not math.isfinite(solver.median_cost):
        return f"{solver.name} ends infeasible in {_count_infeasible(solver)}"
    gap, best = comparison.gap(solver.median_cost), f"the best {comparison.objective.name}"
    side = _describe_side(comparison)
    end = f"reaches {best}" if gap <= FOUND else f"ends {_format_gap(comparison, gap)} {side} {best}"
    runs = f"{len(solver.records)} runs" if len(solver.records) != 1 else "1 run"
    results = comparison.compare_with_others(solver.name)
    places_of_solvers = {word: [other for other in results if results[other] == sign] for word, sign in PLACES.items()}
    places = [f"{word} {join_words(others)}" for word, others in places_of_solvers.items() if others]
    return f"{solver.name} {end} (median of {runs}{''.join(f', {place}' for place in places)})"


def _describe_gaps(comparison: Comparison, solvers: Sequence[SolverRuns]) -> str:
    """Return how far the median runs end from the best value, and which solvers reach it."""
    gaps = [(solver, comparison.gap(solver.median_cost)) for solver in solvers]
    above = [f"{solver.name} {_format_gap(comparison, gap)}" for solver, gap in gaps if FOUND < gap < math.inf]
    reached = [_describe_reached(comparison, solver) for solver, gap in gaps if gap <= FOUND]
    failed = [
        f"{solver.name} ends infeasible in {_count_infeasible(solver)}" for solver, gap in gaps if gap == math.inf
    ]
    parts = []
    if above:
        doubts = _list_doubts(comparison)
        words = "too few runs for a test" if comparison.power else ", ".join(doubts)
        doubt = f" ({words})" if doubts else ""
        parts.append(f"Median runs end {_describe_side(comparison)} it by {', '.join(above)}{doubt}")
    if reached:
        parts.append(", ".join([reached[0], *(text.replace(" reaches it", "", 1) for text in reached[1:])]))
    text = "; ".join([*parts, *failed])
    return f"{text}." if text else ""


def _describe_reached(comparison: Comparison, solver: SolverRuns) -> str:
    number, runs = comparison.count_reached(solver), "starts" if solver.is_gradient else "runs"
    time = median(record.time_s.solve for record in solver.records)
    seconds = "" if math.isnan(time) else f" ({time:.2g} s)"
    return f"{solver.name} reaches it in {number} of {len(solver.records)} {runs}{seconds}"


def _count_infeasible(solver: SolverRuns) -> str:
    return f"{len(solver.records) - len(solver.feasible)} of {len(solver.records)} runs"


def _list_doubts(comparison: Comparison) -> list[str]:
    """Return the neighbours by median whose difference chance does not exclude: ``pso before ga: p = 0.07``."""
    names = [solver.name for solver in comparison.solvers]
    gaps = {solver.name: comparison.gap(solver.median_cost) for solver in comparison.solvers}
    return [
        f"{pair.first} before {pair.second}: p = {pair.rank_sum:.2f}"
        for pair in comparison.pairs
        if names.index(pair.second) == names.index(pair.first) + 1
        and not pair.is_significant
        and FOUND < gaps[pair.second] < math.inf
    ]


def describe_better(comparison: Comparison) -> str:
    """Say that a run is better than the shipped best known value; empty if none is."""
    run = comparison.better
    if run is None:
        return ""
    value, gap = run.verdict.objective, compute_gap(run.verdict.objective, comparison.reference, comparison.objective)
    better = f"{with_unit(value, comparison.objective.unit)} by {run.solver}, run {run.run}"
    return f"This is a new best known value: {better}, {-100 * gap:.2g} % better than the shipped one."


def _format_gap(comparison: Comparison, gap: float) -> str:
    """Format a gap with two digits, in percent or, from a value near zero, in the objective's unit."""
    text = comparison.format_gap(gap)
    return f"{format_number(100 * gap, '.2g')} %" if text.endswith("%") and 5e-6 <= gap < 1.0 else text


def write_overall_headline(comparisons: Sequence[Comparison]) -> str:
    """Return the typical gaps over many problems, the number of best values reached, and the user's wins and losses."""
    by_name, names = index_solvers(comparisons)
    sentences = []
    for user in list_user_solvers(comparisons)[:1]:
        scores = [f"{s.wins}-{s.ties}-{s.losses} against {s.other}" for s in count_wins(comparisons, user)]
        sentences += [f"{user} wins, ties and loses on problems: {join_words(scores)}."] if scores else []
    gaps = {
        name: median(c.gap(solvers[name].median_cost) for c, solvers in zip(comparisons, by_name, strict=True))
        for name in names
    }
    typical = [
        f"{name} {format_percent(0.0 if gap <= FOUND else gap) if math.isfinite(gap) else 'mostly infeasible'}"
        for name, gap in sorted(gaps.items(), key=lambda item: item[1])
    ]
    if typical:
        sentences.append(f"The median over {len(comparisons)} problems of the median gap is: {join_words(typical)}.")
    reached = Counter(s.name for c in comparisons for s in c.solvers if s.feasible and c.gap(s.feasible[0]) <= FOUND)
    best = join_words(f"{name} on {number}" for name, number in reached.most_common())
    sentences.append(f"Best known values reached, of {len(comparisons)}: {best or 'none'}.")
    better = join_words(c.problem for c in comparisons if c.better is not None)
    return " ".join([*sentences, *([f"New best known values on {better}."] if better else [])])


def describe_unknown(comparison: Comparison) -> list[str]:
    """Return a sentence for each solver with runs whose evaluations are unknown."""
    unknown = {s.name: (sum(not r.evaluations for r in s.records), len(s.records)) for s in comparison.solvers}
    return [
        f"{name}: the number of evaluations of {count} of {runs} runs is unknown; all statistics of evaluations exclude {name}."
        for name, (count, runs) in unknown.items()
        if count
    ]


def describe_failures(comparison: Comparison) -> list[str]:
    """Return a sentence for each solver with runs that have no result."""
    sentences = []
    for solver in comparison.solvers:
        failed = [record for record in solver.records if not record.x]
        if failed:
            runs = f"{len(failed)} of {len(solver.records)} runs"
            first = failed[0].status
            sentences.append(f"{comparison.problem}, {solver.name}: {runs} have no result; the first {first}")
    return sentences


class LiveGaps:
    """Median gap of each solver's finished runs, by problem."""

    def __init__(self) -> None:
        self._records: list[RunRecord] = []
        self._known: dict[str, float | None] = {}  # best known objectives by problem

    def add(self, record: RunRecord) -> str:
        """Take a finished run, and return a line for each problem: ``nao-ssp: ipopt 0.0000 % (20), pso 0.33 % (7)``."""
        self._records.append(record)
        if record.problem not in self._known:
            self._known[record.problem] = find_reference(record.inputs.problem).objective
        groups = group_by(self._records, lambda run: run.problem).items()
        return "\n".join(f"{problem}: {_list_gaps(runs, self._known[problem])}" for problem, runs in groups)


def _list_gaps(records: Sequence[RunRecord], best: float | None) -> str:
    objective, runs = records[0].inputs.objective, group_by(records, lambda record: record.solver)
    reference = find_best_known(records) if best is None else best
    gaps = {
        solver: median(compute_gap(objective.sign * record.cost, reference, objective) for record in group)
        for solver, group in runs.items()
    }
    best_first = sorted(gaps, key=lambda solver: (gaps[solver], solver))
    percent = {solver: format_percent(gap if gap >= SMALLEST_GAP else 0.0) for solver, gap in gaps.items()}
    return ", ".join(f"{solver} {percent[solver]} ({len(runs[solver])})" for solver in best_first)
