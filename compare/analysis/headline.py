"""A study in sentences: its answer for each problem or over many, also while it runs, and what is missing in it."""

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from statistics import median

from compare.analysis.comparison import Comparison, SolverRuns, count_wins, index_solvers, list_user_solvers
from compare.analysis.units import FOUND, compute_gap, format_gap, is_zero, join_words, name_solver, with_unit
from compare.study.record import RunRecord, find_best
from compare.study.references import describe_gap, find_reference
from nlp_gait.gaitbench.facts import SIX_DIGITS

MANY = 5  # problems, from which on there are statistics over problems, and one headline for all
NAMED = 4  # solvers of a sentence; the table has the others


def write_headlines(comparisons: Sequence[Comparison]) -> tuple[str, ...]:
    """Return one headline per problem with its name; over many problems one for all."""
    if len(comparisons) >= MANY:
        return (write_overall_headline(comparisons),)
    return tuple(f"{comparison.problem}: {write_headline(comparison)}" for comparison in comparisons)


def write_headline(comparison: Comparison) -> str:
    """Return who ends how far from which value, in at most two sentences."""
    if not any(solver.feasible for solver in comparison.solvers):
        return _describe_infeasible_study(comparison)
    if len(comparison.records) == 1 and comparison.known.objective is None:
        value = with_unit(comparison.reference, comparison.objective.unit)
        return f"The only {comparison.solvers[0].title} run ends at {value}; no best known value is shipped."
    gaps = [(solver, comparison.gap(solver.median_cost)) for solver in _choose_named(comparison)]
    away = [(solver, gap) for solver, gap in gaps if FOUND < gap < math.inf or gap < 0.0]
    reaching = [solver for solver, gap in gaps if 0.0 <= gap <= FOUND]
    clauses = [_describe_failing(solver) for solver, gap in gaps if gap == math.inf]
    if reaching:
        runs = join_words(_count_reaching(comparison, solver) for solver in reaching)
        verb = "reach" if max(len(reaching), len(reaching[0].records)) > 1 else "reaches"
        runs = runs if away else runs[:1].upper() + runs[1:]
        clauses.insert(0, f"{runs} {verb} {'it' if away else _name_reference(comparison)}")
    if away:
        clauses.insert(0, _describe_away(comparison, away))
    if not (away or reaching):
        clauses.append(_describe_best_run(comparison))
    more = len(comparison.solvers) - len(gaps)
    sentence = "; ".join(clauses) + (f", and {more} more: see the table." if more else ".")
    return " ".join(filter(None, (sentence, _write_second(comparison))))


def _choose_named(comparison: Comparison) -> list[SolverRuns]:
    """Return the user's solvers and the best of the others, best median first."""
    users = [solver for solver in comparison.solvers if solver.is_user_defined]
    others = [solver for solver in comparison.solvers if not solver.is_user_defined]
    return [s for s in comparison.solvers if s in [*users, *others][:NAMED]]


def _describe_infeasible_study(comparison: Comparison) -> str:
    """Return whose runs are all infeasible, and how many failed."""
    names = [solver.title for solver in comparison.solvers[:NAMED]]
    more = len(comparison.solvers) - len(names)
    solvers = join_words([*names, f"{more} more"] if more else names)
    failed, runs = sum(not record.x for record in comparison.records), len(comparison.records)
    of_them = "" if not failed else f", and {failed} of them failed" if failed < runs else ": each failed"
    if runs == 1:
        return f"The only run, of {solvers}, {'failed' if failed else 'is infeasible'}."
    return f"None of the {runs} runs of {solvers} is feasible{of_them}."


def _name_reference(comparison: Comparison) -> str:
    """Return the value from which gaps are measured, and what is proven."""
    known, value = comparison.known, with_unit(comparison.reference, comparison.objective.unit)
    if known.objective is None:
        return f"the best value found ({value})"
    if known.bound is None:
        return f"the best known value {value}"
    if abs(known.bound - comparison.reference) <= SIX_DIGITS * (abs(comparison.reference) or 1.0):
        return f"the proven optimum {value}"
    return f"the best known value {value} (proven within {describe_gap(known.bound, comparison.reference)})"


def _format_distance(comparison: Comparison, gap: float) -> str:
    """Return for example ``0.33 % above``."""
    is_above = (gap > 0.0) == (comparison.objective.sense == "minimise")
    return f"{comparison.format_gap(abs(gap))} {'above' if is_above else 'below'}"


def _describe_away(comparison: Comparison, away: Sequence[tuple[SolverRuns, float]]) -> str:
    """Return how far the medians are from the best value; the order of neighbours that a test does not find is uncertain."""
    (first, gap), *others = away
    which = "median" if len(first.records) > 1 else "only"
    distance = f"{_format_distance(comparison, gap)} {_name_reference(comparison)}"
    words = [f"{first.title}'s {which} run ends {distance}"]
    doubts = _list_doubts(comparison, [solver for solver, _ in away])
    words += [f"{solver.title}'s {comparison.format_gap(abs(gap))}" for solver, gap in others]
    marks = [" (order uncertain)" if a and not b else "" for a, b in itertools.pairwise([False, *doubts, False])]
    return ", ".join(f"{word}{mark}" for word, mark in zip(words, marks, strict=True))


def _list_doubts(comparison: Comparison, solvers: Sequence[SolverRuns]) -> list[bool]:
    """Return for each neighbour of a solver whether a test finds no difference between them."""
    pairs = itertools.pairwise(solvers)
    return [comparison.compare_with_others(a.name).get(b.name) == 0 for a, b in pairs]


def _describe_best_run(comparison: Comparison) -> str:
    """Return where the best run ends if no solver's median run is feasible."""
    gap = comparison.gap(min(min(solver.costs) for solver in comparison.solvers))
    if comparison.known.objective is None:
        return f"the best run ends at {with_unit(comparison.reference, comparison.objective.unit)}"
    end = "reaches" if gap <= FOUND else f"ends {_format_distance(comparison, gap)}"
    return f"the best run {end} {_name_reference(comparison)}"


def _count_reaching(comparison: Comparison, solver: SolverRuns) -> str:
    """Return for example ``all 20 IPOPT starts``."""
    reached, runs = comparison.count_reached(solver), len(solver.records)
    noun = "start" if solver.is_gradient else "run"
    if runs == 1:
        return f"the only {solver.title} {noun}"
    count = f"{reached} of {runs}" if reached < runs else "both" if runs == 2 else f"all {runs}"
    return f"{count} {solver.title} {noun}s"


def _describe_failing(solver: SolverRuns) -> str:
    """Return in how many runs a solver failed or found no feasible point, if half of them or more."""
    runs, failed = len(solver.records), sum(not record.x for record in solver.records)
    infeasible = runs - failed - len(solver.feasible)
    ends = [("fails", failed), ("ends infeasible", infeasible)]
    return f"{solver.title} " + join_words(f"{end} in {_count_runs(n, runs)}" for end, n in ends if n)


def _count_runs(count: int, runs: int) -> str:
    """Return for example ``all 5 runs``."""
    if runs == 1:
        return "its only run"
    return f"{count} of {runs} runs" if count < runs else "both runs" if runs == 2 else f"all {runs} runs"


def _write_second(comparison: Comparison) -> str:
    """Return what else matters: a new best value, or from which solvers the user's differs."""
    if comparison.better is not None:
        return describe_better(comparison)
    feasible = {solver.name for solver in comparison.solvers if solver.feasible}
    for solver in comparison.solvers:
        results = comparison.compare_with_others(solver.name) if solver.is_user_defined else {}
        places = [
            f"{word} {join_words(map(name_solver, others[:NAMED]))}"
            for word, sign in (("better than", 1), ("worse than", -1), ("not distinguishable from", 0))
            if (others := [other for other, result in results.items() if result == sign and other in feasible])
        ]
        if places and solver.name in feasible and not comparison.power:
            return f"By rank-sum tests {solver.title} is {join_words(places)}."
    return ""


def describe_better(comparison: Comparison) -> str:
    """Say that a run is better than the shipped best known value; empty if none is."""
    run = comparison.better
    if run is None:
        return ""
    value, objective = run.objective, comparison.objective
    better = comparison.format_gap(abs(compute_gap(value, comparison.reference, objective)))
    shown = with_unit(value, objective.unit)
    return f"{name_solver(run.solver)}, run {run.run}, found a new best value, {shown}: {better} better."


def write_overall_headline(comparisons: Sequence[Comparison]) -> str:
    """Return the typical gaps over many problems, the number of best values reached, and the user's wins and losses."""
    by_name, names = index_solvers(comparisons)
    sentences = []
    for user in list_user_solvers(comparisons)[:1]:
        scores = [f"{s.wins}-{s.ties}-{s.losses} against {name_solver(s.other)}" for s in count_wins(comparisons, user)]
        sentences += [f"{user} wins, ties and loses on problems: {join_words(scores)}."] if scores else []
    gaps = {
        name: median(c.gap(solvers[name].median_cost) for c, solvers in zip(comparisons, by_name, strict=True))
        for name in names
    }
    if any(is_zero(comparison.reference) for comparison in comparisons):
        gaps = {}  # in percent of some, and in units of others
    typical = [
        f"{name_solver(name)} {format_gap(gap)}"
        for name, gap in sorted(gaps.items(), key=lambda item: item[1])
        if math.isfinite(gap)
    ]
    if typical:
        more = f" and {len(typical) - NAMED} more: see the table" if len(typical) > NAMED else ""
        first = ", ".join(typical[:NAMED]) if more else join_words(typical)
        sentences.append(f"Over {len(comparisons)} problems, the median of the median gaps is {first}{more}.")
    failing = [name_solver(name) for name, gap in gaps.items() if not math.isfinite(gap)]
    if failing:
        verb = "finds" if len(failing) == 1 else "find"
        sentences.append(
            f"On most of the {len(comparisons)} problems {join_words(failing)} mostly {verb} no feasible point."
        )
    reached = Counter(s.title for c in comparisons for s in c.solvers if s.feasible and c.gap(s.feasible[0]) <= FOUND)
    best = join_words(f"{name} on {number}" for name, number in reached.most_common(NAMED))
    if best:
        values = (
            "Best known values" if any(c.known.objective is not None for c in comparisons) else "The best values found"
        )
        sentences.append(f"{values} are reached by {best}.")
    elif typical:
        sentences.append("No best known value is reached.")
    better = join_words(c.problem for c in comparisons if c.better is not None)
    return " ".join([*sentences, *([f"New best known values on {better}."] if better else [])])


def describe_unknown(comparison: Comparison) -> list[str]:
    """Return a sentence for each solver with runs whose evaluations are unknown."""
    unknown = {s.title: (sum(not r.counts for r in s.records), len(s.records)) for s in comparison.solvers}
    return [
        f"{name}: the number of evaluations of {_count_runs(count, runs)} is unknown; statistics of evaluations exclude {name}."
        for name, (count, runs) in unknown.items()
        if count
    ]


def describe_failures(comparison: Comparison) -> list[str]:
    """Return a sentence for each solver with runs that have no result."""
    sentences = []
    for solver in comparison.solvers:
        failed = [record for record in solver.records if not record.x]
        if failed:
            runs, verb = _count_runs(len(failed), len(solver.records)), "has" if len(solver.records) == 1 else "have"
            sentences.append(
                f"{comparison.problem}, {solver.title}: {runs} {verb} no result (run {failed[0].run} {failed[0].status})"
            )
    return sentences


class LiveGaps:
    """Best gap of the finished runs of each problem, for a line of progress."""

    def __init__(self) -> None:
        self._best: dict[str, RunRecord] = {}
        self._known: dict[str, float | None] = {}  # best known objectives by problem

    def add(self, record: RunRecord) -> str:
        """Take a finished run, and return ``best gap 0.0046 % (nao-ssp, ACO)``, or the best value if none is known."""
        name = record.problem
        if name not in self._known:
            self._known[name] = find_reference(record.inputs.problem).objective
        best = find_best([record, *filter(None, [self._best.get(name)])])
        if best is None:
            return f"no feasible point yet ({name})"
        self._best[name] = best
        value, known, objective = best.objective, self._known[name], best.inputs.objective
        shown = f"best {with_unit(value, objective.unit, '.6g')}"
        if known is not None and not is_zero(known):
            shown = f"best gap {format_gap(max(compute_gap(value, known, objective), 0.0))}"
        return f"{shown} ({name}, {name_solver(best.solver)})"
