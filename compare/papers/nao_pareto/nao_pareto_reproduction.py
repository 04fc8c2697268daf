"""Gupta, Pratihar, Deb (2025), as far as the abstract says: four searches on power against stability, and its claims."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.analysis.units import join_words, make_axis_label
from compare.drawing.figures import COLOURS, add_legend_below, make_figure, use_log_axes
from compare.papers.claims import ClaimVerdict, bind_checks
from compare.papers.nao_pareto import nao_pareto_claims
from compare.papers.nao_pareto import nao_pareto_runs as runs
from compare.papers.nao_pareto.nao_pareto_claims import NAMES, NEAR, ParetoFindings, PhaseFronts
from compare.papers.nao_pareto.nao_pareto_runs import ALGORITHMS, CRITERION, ParetoEffort
from compare.papers.paper_runs import Runner
from compare.papers.reproduction import Reproduction
from compare.questions.pareto.pareto_front import SEARCH_COLOURS, ParetoFront
from compare.questions.pareto.searches import REFERENCE, Challenge, Scale, challenge_front, select_best
from compare.questions.question import Work, find
from compare.report.document import Rows, Value
from compare.study.store import Computation, Store
from metaheuristics.adapters import pymoo
from metaheuristics.multi_objective import constrained_moead, dynamic_nsga3
from nlp_gait.backends.identity import fingerprint
from nlp_gait.decoding import decode

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _run_pareto(runner: Runner, effort: ParetoEffort) -> ParetoFindings:
    """Solve for the true front of each phase, run the searches on it, and solve again from their best points."""
    return ParetoFindings(phases=tuple(_run_phase(runner, phase, effort) for phase in runs.PHASES), effort=effort)


def _run_phase(runner: Runner, phase: str, effort: ParetoEffort) -> PhaseFronts:
    work = Work(store=Store(runner.folder / phase, runner.progress), progress=runner.progress)
    problem = runs.make_spec(phase, effort).load()
    question = ParetoFront(problem=problem, objective=CRITERION, points=effort.points, starts=effort.starts)
    front, criterion = find(question, work).front, question.criterion
    problem = criterion.drop_demand(problem)
    searches = runs.make_searches(phase, front, effort)
    code = (runs, constrained_moead, dynamic_nsga3, pymoo)
    results = runner.compute([search for of_case in searches.values() for search in of_case], code)
    done = {case: [runs.make_run(results[search.name]) for search in of_case] for case, of_case in searches.items()}
    scale = Scale(front)
    ends = [run[-1] for of_case in done.values() for run in of_case]
    points = select_best((*scale.undo(end.F), end.X) for end in ends)
    solve = partial(challenge_front, problem, criterion, front, points, work.solver(), work.progress)
    given = {"front": [asdict(point) for point in front], "points": [asdict(point) for point in points]}
    inputs = {**fingerprint(problem), "criterion": CRITERION, **given}
    step = Computation(name=f"{phase}-challenge", inputs=inputs, function=lambda: asdict(solve()))
    answer = decode(Challenge, runner.compute([step], code=())[step.name])
    return PhaseFronts(problem=problem, criterion=criterion, first_front=front, answer=answer, runs=done)


def _compute_values(findings: ParetoFindings) -> dict[str, Any]:
    ssp, _ = findings.phases
    effort, verdicts = findings.effort, [claim.verdict for claim in REPRODUCTION.check_claims(findings).values()]
    return {
        "budgets": join_words(f"{budget:,}" for budget in effort.budgets),
        "largest": f"{effort.budgets[-1]:,}",
        "samples": effort.intervals + 1,
        "reference": REFERENCE,
        "even": nao_pareto_claims.EVEN_POINTS,
        "near": 100 * NEAR,
        "criterion": ssp.criterion.name,
        "claims": len(verdicts),
        "held": verdicts.count(ClaimVerdict.HOLDS),
        "robot": ssp.problem.options["robot"],
        "variables": [len(phase.problem.names) for phase in findings.phases],
    }


def _make_tables(findings: ParetoFindings) -> dict[str, Rows]:
    fronts: list[list[Value]] = []
    tables: dict[str, Rows] = {"fronts": fronts}
    for phase in findings.phases:
        ends = [value for end in (phase.front[0], phase.front[-1]) for value in (end.value, end.power_W)]
        answer, name = phase.answer, phase.problem.name
        solved = [answer.points, answer.solved, 100 * answer.least_gap, answer.moved]
        fronts.append([name, len(phase.front), *ends, len(phase.bends.knees), *solved])
        tables[f"ends-{name}"] = _make_ends(phase)
        tables[f"constraints-{name}"] = _make_constraints(phase)
        tables[f"running-{name}"] = _make_running(phase)
    return tables


def _make_ends(phase: PhaseFronts) -> Rows:
    rows: list[list[Value]] = []
    for (name, budget), m in phase.measures.items():
        ends = (100 * m.hypervolume[:, -1], m.igd[:, -1])
        spread = [float(value) for end in ends for value in (np.median(end), end.min(), end.max())]
        rows.append([NAMES[name], budget, len(m.time_s), *spread])
    return rows


def _make_constraints(phase: PhaseFronts) -> Rows:
    rows: list[list[Value]] = []
    for (name, budget), m in phase.measures.items():
        columns = (100 * m.feasible, m.first_feasible, m.until(NEAR), m.time_s, m.objective_time_s)
        medians = [float(np.median(column)) for column in columns]
        rows.append([NAMES[name], budget, int(np.sum(m.hypervolume[:, -1] > 0.0)), *medians])
    return rows


def _make_running(phase: PhaseFronts) -> Rows:
    chosen = [m for (_, budget), m in phase.measures.items() if budget == phase.budgets[-1]]
    columns = [chosen[0].evaluations]
    columns += [100 * np.median(m.hypervolume, axis=0) for m in chosen] + [np.median(m.igd, axis=0) for m in chosen]
    return np.column_stack(columns).tolist()


LINES = dict(zip(ALGORITHMS, ("-", "--", ":", "-."), strict=True))


def draw_figures(findings: ParetoFindings) -> dict[str, Figure]:
    """Return the figures by name."""
    running = {f"running-{phase.problem.name}": _draw_running(phase) for phase in findings.phases}
    return running | {f"fronts-{phase.problem.name}": _draw_fronts(phase) for phase in findings.phases}


def _draw_running(phase: PhaseFronts) -> Figure:
    """Hypervolume missing and distance over evaluations, with the largest budget: medians, and the range of all runs."""
    figure = make_figure(6.6, 3.0)
    left, right = figure.subplots(1, 2)
    for name in ALGORITHMS:
        m = phase.measures[name, phase.budgets[-1]]
        for axes, values in ((left, 100 * (1.0 - m.hypervolume)), (right, m.igd)):
            known = np.isfinite(values).all(axis=0)
            at, shown = m.evaluations[known], values[:, known]
            paint = {"color": SEARCH_COLOURS[name]}
            axes.fill_between(at, shown.min(axis=0), shown.max(axis=0), **paint, alpha=0.12, linewidth=0)
            axes.plot(at, np.median(shown, axis=0), LINES[name], **paint, label=NAMES[name])
    left.set_ylabel("hypervolume missing to the front's [%]")
    right.set_ylabel("inverted generational distance [1]")
    for axes in (left, right):
        axes.set_xlabel("evaluations")
        use_log_axes(axes, both=True)
    add_legend_below(figure)
    return figure


def _draw_fronts(phase: PhaseFronts) -> Figure:
    budget, criterion = phase.budgets[-1], phase.criterion
    line = np.array([(p.value, p.power_W) for p in phase.front])
    figure = make_figure(6.6, 4.6)
    for axes, name in zip(figure.subplots(2, 2, sharex=True, sharey=True).ravel(), ALGORITHMS, strict=True):
        values, powers = phase.points(name, budget)
        axes.plot(values, powers, ".", color=SEARCH_COLOURS[name], markersize=2.5, alpha=0.4, rasterized=True)
        axes.plot(*line.T, "-", color=COLOURS["ipopt"], linewidth=1.0, label="true front")
        knees = [(k.value, k.power_W) for k in phase.bends.knees]
        if knees:
            axes.plot(*zip(*knees, strict=True), "o", color="none", markeredgecolor=COLOURS["aco"], label="knee")
        axes.set_title(NAMES[name], loc="left")
        width, height = np.ptp(line[:, 0]), np.ptp(line[:, 1])
        axes.set_xlim(line[0, 0] - 0.05 * width, line[-1, 0] + 0.05 * width)
        axes.set_ylim(0.0, line[-1, 1] + 0.15 * height)
    for axes in figure.axes[2:]:
        axes.set_xlabel(make_axis_label(criterion.name, criterion.unit))
    for axes in figure.axes[::2]:
        axes.set_ylabel("power [W]")
    add_legend_below(figure)
    return figure


REPRODUCTION = Reproduction(
    name="nao_pareto",
    full=ParetoEffort(),
    run=_run_pareto,
    values=_compute_values,
    tables=_make_tables,
    figures=draw_figures,
    checks=bind_checks("nao_pareto/nao_pareto_claims.toml", vars(nao_pareto_claims)),
)
