"""A study in sentences: its answer for each problem or over many, also while it runs, and what is missing in it."""

import math
from collections import Counter
from collections.abc import Sequence
from statistics import median

from compare.analysis.best_known import compute_gap, is_zero
from compare.analysis.comparison import Comparison, SolverRuns, index_solvers
from compare.analysis.overview import count_wins, list_user_solvers
from compare.analysis.units import FOUND, format_gap, join_words, name_solver, with_unit
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
    if len(comparison.records) == 1:
        return _describe_single_run(comparison)
    gaps = [(solver, comparison.gap(solver.median_cost)) for solver in _choose_named(comparison)]
    away = [(solver, gap) for solver, gap in gaps if FOUND < gap < math.inf or gap < 0.0]
    reaching = [solver for solver, gap in gaps if 0.0 <= gap <= FOUND]
    clauses = [_describe_failing(solver) for solver, gap in gaps if gap == math.inf]
    if reaching:
        best = "it" if away else _name_reference(comparison)
        clauses.insert(0, ", ".join(_describe_reaching(comparison, k, best) for k in _mark_first(reaching)))
    if away:
        clauses.insert(0, _describe_away(comparison, away))
    others = len(comparison.solvers) - len(gaps)
    if others:
        clauses.append(f"and {others} more: see the table")
    sentence = "; ".join(clauses[:-1] if others else clauses) + (f", {clauses[-1]}" if others else "")
    return " ".join(filter(None, (f"{sentence[:1].upper()}{sentence[1:]}.", _write_second(comparison))))


def _choose_named(comparison: Comparison) -> list[SolverRuns]:
    """Return the user's solvers and the best of the others, best median first."""
    users = [solver for solver in comparison.solvers if solver.is_user_defined]
    others = [solver for solver in comparison.solvers if not solver.is_user_defined]
    return [s for s in comparison.solvers if s in [*users, *others][:NAMED]]


def _describe_infeasible_study(comparison: Comparison) -> str:
    """Return why no run of any solver has a feasible point."""
    names = [solver.title for solver in comparison.solvers[:NAMED]]
    more = len(comparison.solvers) - len(names)
    solvers = f"{', '.join(names)} and {more} more" if more else join_words(names)
    failed = sum(not record.x for record in comparison.records)
    runs = len(comparison.records)
    of_them = "" if not failed else f", and {failed} of them failed" if failed < runs else ": each failed"
    count = "The only run" if runs == 1 else f"None of the {runs} runs"
    verb = "is not feasible" if runs == 1 else "is feasible"
    known = f" The {_name_value(comparison)}." if comparison.known.objective is not None else ""
    return f"{count} of {solvers} {verb}{of_them}.{known}"


def _describe_single_run(comparison: Comparison) -> str:
    """Return the value of the only run, and its distance from the best known one if that is shipped."""
    (solver,) = comparison.solvers
    value = with_unit(comparison.value(solver.costs[0]), comparison.objective.unit)
    if comparison.known.objective is None:
        return f"The only {solver.title} run ends at {value}; no best known value is shipped to compare it with."
    gap = comparison.gap(solver.costs[0])
    where = "reaches" if 0.0 <= gap <= FOUND else f"ends {_format_distance(comparison, gap)}"
    text = f"The only {solver.title} run {where} {_name_reference(comparison)}."
    return " ".join(filter(None, (text, describe_better(comparison))))


def _name_value(comparison: Comparison) -> str:
    kind, value = _split_reference(comparison)
    return f"{kind} is {value}"


def _name_reference(comparison: Comparison) -> str:
    kind, value = _split_reference(comparison)
    return f"the {kind} ({value})" if comparison.known.objective is None else f"the {kind} of {value}"


def _split_reference(comparison: Comparison) -> tuple[str, str]:
    """Return what the value is from which gaps are measured, and the value."""
    known, unit = comparison.known, comparison.objective.unit
    value = with_unit(comparison.reference, unit)
    if known.objective is None:
        return "best value found", value
    if known.bound is None:
        return "best known value", value
    if abs(known.bound - comparison.reference) <= SIX_DIGITS * (abs(comparison.reference) or 1.0):
        return "proven optimum", value
    return "best known value", f"{value} (proven within {describe_gap(known.bound, comparison.reference)})"


def _format_distance(comparison: Comparison, gap: float) -> str:
    """Return for example ``0.33 % above``."""
    is_above = (gap > 0.0) == (comparison.objective.sense == "minimise")
    return f"{comparison.format_gap(abs(gap))} {'above' if is_above else 'below'}"


def _mark_first(solvers: Sequence[SolverRuns]) -> list[tuple[SolverRuns, bool]]:
    return [(solver, k == 0) for k, solver in enumerate(solvers)]


def _describe_away(comparison: Comparison, away: Sequence[tuple[SolverRuns, float]]) -> str:
    """Return how far the medians are from the best value; the order of neighbours that a test does not find is uncertain."""
    (first, gap), *others = away
    run = f"the median {first.title} run" if len(first.records) > 1 else f"the only {first.title} run"
    words = [f"{run} ends {_format_distance(comparison, gap)} {_name_reference(comparison)}"]
    before = first
    for solver, gap in others:
        word = f"{solver.title} {comparison.format_gap(abs(gap))}"
        same = comparison.compare_with_others(before.name).get(solver.name) == 0
        words.append(f"{word} (order uncertain)" if same else word)
        before = solver
    return ", ".join(words)


def _describe_reaching(comparison: Comparison, solver_and_first: tuple[SolverRuns, bool], best: str) -> str:
    solver, is_first = solver_and_first
    reached, runs = comparison.count_reached(solver), len(solver.records)
    noun = "start" if solver.is_gradient else "run"
    if runs == 1:
        how = f"in its only {noun}"
    else:
        count = f"{reached} of {runs}" if reached < runs else "both" if runs == 2 else f"all {runs}"
        how = f"{'from' if solver.is_gradient else 'in'} {count} {noun}s"
    return f"{solver.title} {f'reaches {best} ' if is_first else ''}{how}"


def _describe_failing(solver: SolverRuns) -> str:
    """Return how many runs of a solver are infeasible or failed, if half of them or more are."""
    runs, feasible = len(solver.records), len(solver.feasible)
    if not any(record.x for record in solver.records):
        return f"{solver.title} fails in {'its only run' if runs == 1 else f'all {runs} runs'}"
    if not feasible:
        return f"{solver.title} finds no feasible point in {'its only run' if runs == 1 else f'{runs} runs'}"
    return f"{solver.title} is infeasible in {runs - feasible} of {runs} runs"


def _write_second(comparison: Comparison) -> str:
    """Return what else matters: a new best value, or from which solvers the user's differs."""
    if comparison.better is not None:
        return describe_better(comparison)
    for solver in comparison.solvers:
        results = comparison.compare_with_others(solver.name) if solver.is_user_defined else {}
        places = [
            f"{word} {join_words(map(name_solver, others[:NAMED]))}"
            for word, sign in (("better than", 1), ("worse than", -1), ("not distinguishable from", 0))
            if (others := [other for other, result in results.items() if result == sign])
        ]
        if places and not comparison.power:
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
        f"{name_solver(name)} {format_gap(gap) if math.isfinite(gap) else 'mostly infeasible'}"
        for name, gap in sorted(gaps.items(), key=lambda item: item[1])
    ]
    if typical:
        more = f" and {len(typical) - NAMED} more: see the table" if len(typical) > NAMED else ""
        first = ", ".join(typical[:NAMED]) if more else join_words(typical)
        sentences.append(f"Over {len(comparisons)} problems, the median of the median gaps is {first}{more}.")
    reached = Counter(s.title for c in comparisons for s in c.solvers if s.feasible and c.gap(s.feasible[0]) <= FOUND)
    best = join_words(f"{name} on {number}" for name, number in reached.most_common(NAMED))
    if best:
        sentences.append(f"Best known values are reached by {best}.")
    else:
        sentences.append("No best known value is reached.")
    better = join_words(c.problem for c in comparisons if c.better is not None)
    return " ".join([*sentences, *([f"New best known values on {better}."] if better else [])])


def describe_unknown(comparison: Comparison) -> list[str]:
    """Return a sentence for each solver with runs whose evaluations are unknown."""
    unknown = {s.title: (sum(not r.counts for r in s.records), len(s.records)) for s in comparison.solvers}
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
            runs = (
                "its only run has" if len(solver.records) == 1 else f"{len(failed)} of {len(solver.records)} runs have"
            )
            sentences.append(
                f"{comparison.problem}, {solver.title}: {runs} no result (run {failed[0].run} {failed[0].status})"
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
