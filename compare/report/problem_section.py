"""The section of a report on one problem: tables, figures, gaits, the engine, tests, constraints, failures."""

import math
from collections.abc import Sequence

from compare.analysis.comparison import Comparison
from compare.analysis.record_statistics import TARGETS
from compare.analysis.simulated_gaits import GAIT_HEADER, describe_drive, make_engine_rows, measure_agreement
from compare.analysis.solver_table import HEADER, SolverSummary, count, describe_unknown, format_cells, summarise
from compare.analysis.units import BY_UNIT, format_seconds, make_heading
from compare.analysis.verdict import compare_pairs, describe_best_known
from compare.drawing.comparison_figures import SMALLEST_GAP, plot_convergence, plot_ecdf, plot_final_gaps
from compare.drawing.gait_figure import plot_gaits, prepare_gait
from compare.report.document import Figure, Part, Prose, Section, make_table_section, make_text_table
from compare.report.interactive import describe_gaits, describe_runs
from compare.study.record import RunRecord, load_gait
from compare.study.simulations import SimulatedGait
from nlp_gait.errors import GaitError
from nlp_gait.files import make_file_name
from nlp_gait.formulation.solution import ActiveConstraint

SHOWN_CONSTRAINTS = 15
# Figures of a problem by name: the function that draws it, and its captions on a page and in a paper.
FIGURES = {
    "convergence": (
        plot_convergence,
        "Best so far: bands from best to worst run, lines are medians; a gradient run is a point at its end. Gaps below "
        f"{100 * SMALLEST_GAP:g} % are drawn at that value: the solvers' tolerances end near it.",
        "Gap to the best known value over equivalent evaluations, median and range of the runs",
    ),
    "runtime": (
        plot_ecdf,
        "Share of pairs of run and target solved within a cost; 31 targets, 100 % to 1e-4 % above the best known.",
        "Share of pairs of run and target solved, 31 targets from 100 % to 1e-4 % above the best known value",
    ),
    "final": (plot_final_gaps, "Gap of every run at its end.", "Gap of every run at its end; bars: medians"),
}
HOW = Prose(
    "The best gaits of this study have not been simulated in a physics engine. `nlp-gait report DIR --engine` simulates those "
    "that can be (extra `sim`) and adds their energy, fate and rank to this report."
)
CAPTION = (
    "Best gait of each solver, left blue, right orange. In the drawing the best of all, six poses at equidistant times, later "
    "ones darker, and the others beside it. The deviation is the largest distance of a joint from its place in the best gait "
    "after the same share of the time. Mechanical power is the sum of |torque x rate| over the joints. The balance margin is the "
    "distance of the zero-moment point from the nearest edge of the support polygon, negative outside of it."
)


def make_problem_section(comparison: Comparison, simulated: Sequence[SimulatedGait] = ()) -> Section:
    """Return the section on one problem: tables, figures, lists, and its best gaits in the engine if simulated."""
    summaries = summarise(comparison)
    objective = comparison.objective
    stem = make_file_name(comparison.problem)
    figures = [
        Figure(
            name=f"{stem}-{name}",
            caption=caption,
            drawing=plot(comparison),
            data=describe_runs(comparison) if name == "convergence" else {"kind": name, "of": f"{stem}-convergence"},
        )
        for name, (plot, caption, _) in FIGURES.items()
    ]
    gaits = make_gaits_part(comparison)
    return Section(
        title=f"{comparison.problem}: {make_heading(objective.name, objective.unit)}, to {objective.sense}",
        parts=(
            "Claimed is what the solvers report. Everything else is what the judge finds with the exact functions at "
            "the reported point and the problem's samples.",
            describe_reference(comparison),
            make_text_table(HEADER, [format_cells(s, comparison) for s in summaries], "Solvers, best median first"),
            *(() if gaits is None else (gaits,)),
            *figures,
            _make_costs(comparison, summaries),
            *make_engine_section(simulated),
            *_make_tests(comparison),
            *_list_active(comparison),
            *_list_failures(comparison),
            *_list_violated_between(comparison),
        ),
    )


def describe_reference(comparison: Comparison) -> str:
    """Return the value that gaps are relative to, its source and proof, and whether a run is better."""
    file = f"better-{make_file_name(comparison.problem)}.json"
    offer = f" The file {file} has its point, judged again: please contribute it." if comparison.better else ""
    return f"Gaps are relative to the best known value: {describe_best_known(comparison)}.{offer}"


def _make_costs(comparison: Comparison, summaries: list[SolverSummary]) -> Section:
    targets = [f"{100 * target:g} %" for target in TARGETS]
    unit = comparison.objective.unit
    runtime = make_text_table(
        ("solver", *(f"to {t}" for t in targets), *(f"seconds to {t}" for t in targets)),
        [
            (s.solver, *(count(v) for v in s.expected_evaluations), *(_format_cost(v) for v in s.expected_s))
            for s in summaries
        ],
        "Expected running time to targets: cost of all runs until then, divided by the number that reached it",
    )
    times = make_text_table(
        ("solver", "feasible between samples", "95 % interval of the median", "build", "compile", "solve, median"),
        [
            (
                s.solver,
                "-" if s.dense_feasible is None else f"{s.dense_feasible}/{s.runs}",
                "-" if s.median_interval is None else f"{s.median_interval[0]:.6f} to {s.median_interval[1]:.6f}",
                format_seconds(s.build_s, ".2f"),
                format_seconds(s.compile_s, ".2f"),
                format_seconds(s.time_s),
            )
            for s in summaries
        ],
        f"Uncertainty of the median [{unit}] (feasible runs, bootstrap), and times; build and compile are "
        "the longest, needed once per process",
    )
    return Section(title="Costs", parts=(*describe_unknown(comparison), runtime, times))


def _make_tests(comparison: Comparison) -> tuple[Section, ...]:
    rows = [
        (
            f"{pair.first} < {pair.second}",
            _format_p(pair.rank_sum),
            "-" if pair.signed_rank is None else _format_p(pair.signed_rank),
            str(pair.paired_runs),
            f"{pair.a12:.3f}",
        )
        for pair in compare_pairs(comparison)
    ]
    return make_table_section(
        "Significance of differences",
        ("better median < other", "rank-sum p", "signed-rank p", "pairs of runs", "A12"),
        rows,
        "Two-sided p-values on the final objectives, Holm-corrected over all pairs: rank-sum over all runs, signed-rank over "
        "runs with equal starting points. A12 is the probability that a run of the first solver ends better (0.5: no "
        "difference; above 0.71: large).",
    )


def _list_active(comparison: Comparison) -> tuple[Section, ...]:
    priced = [
        (cost, record)
        for solver in comparison.solvers
        for cost, record in zip(solver.costs, solver.records, strict=True)
        if record.active_constraints and record.verdict.feasible
    ]
    if not priced:
        return ()
    record = min(priced, key=lambda item: item[0])[1]
    rows = [
        (
            a.name,
            a.side,
            f"{a.bound:g} {a.unit}",
            f"{a.price:.4g} {a.price_unit}",
            _describe_step(a, comparison.objective.unit),
        )
        for a in record.active_constraints[:SHOWN_CONSTRAINTS]
    ]
    left_out = len(record.active_constraints) - len(rows)
    note = f" {left_out} lower ones are omitted." if left_out else ""
    return make_table_section(
        "Active constraints at the optimum",
        ("constraint", "side", "at", "price", "for a step"),
        rows,
        f"At the best optimum of {record.solver} (run {record.run}). The price is the change of the optimal "
        f"{comparison.objective.name} per unit by which the bound is raised, highest first.{note}",
    )


def _describe_step(active: ActiveConstraint, unit: str) -> str:
    """Return for example ``+0.0237 W for 1 mm``."""
    step = BY_UNIT.get(active.unit)
    if step is None:
        return "-"
    return f"{active.price * step.size:+z.4f}{'' if unit == '1' else f' {unit}'} for {step.words}"


def _list_failures(comparison: Comparison) -> tuple[Section, ...]:
    rows = [
        (r.solver, str(r.run), str(r.seed), r.status, "; ".join(r.verdict.violated[:5]) or "-")
        for r in comparison.records
        if not r.verdict.feasible
    ]
    header = ("solver", "run", "seed", "status", "violated, worst first")
    return make_table_section("Runs that ended infeasible or failed", header, rows, prose=True)


def _list_violated_between(comparison: Comparison) -> tuple[Section, ...]:
    rows = [
        (r.solver, str(r.run), "; ".join(r.verdict.violated[:3]) or "-", _describe_proof(r))
        for r in comparison.records
        if r.verdict.feasible and (r.verdict.dense_feasible is False or _describe_proof(r) != "-")
    ]
    header = ("solver", "run", "violated on a dense grid, worst first", "proven at all times")
    return make_table_section("Feasible at the samples, not at all times", header, rows, prose=True)


def _describe_proof(record: RunRecord) -> str:
    """Return what is violated between the samples, or not proven to be satisfied."""
    found = record.verdict.guaranteed
    return "-" if found is None or found.satisfied or found.reason else str(found)


def _format_p(value: float) -> str:
    return f"{value:.4f}" if value >= 1e-4 else f"{value:.1e}"


def _format_cost(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "-"


def make_engine_section(simulated: Sequence[SimulatedGait]) -> tuple[Section, ...]:
    """Return the section on every solver's best gait in the engine, for each drive; none without simulations."""
    if not simulated:
        return ()
    parts: list[Part] = []
    for drive in dict.fromkeys(gait.drive for gait in simulated):
        alike = [gait for gait in simulated if gait.drive == drive]
        parts.append(make_text_table(GAIT_HEADER, make_engine_rows(alike), f"Best gaits; {describe_drive(drive)}"))
        parts.append(measure_agreement(alike).describe())
    steps = simulated[0].steps
    figure = (
        "mean power over the phase"
        if steps is None
        else f"energy for each planned metre over {steps} steps, every second one mirrored"
    )
    introduction = (
        f"Every solver's best gait, simulated open loop in MuJoCo. Model and engine: {figure}, mechanical and heat. The "
        "model's value and rank refer to the planned motion on a dense grid. Ranks use the printed digits; a gait "
        "that falls has none. For a cycle that does not fall, the walked share of the planned distance is given."
    )
    return (Section(title="In the physics engine", parts=(introduction, *parts)),)


def make_gaits_part(comparison: Comparison) -> Figure | str | None:
    """Return the best gait of each solver as a figure, a sentence if they cannot be drawn, or None without any gait."""
    best = [comparison.best, *(solver.best for solver in comparison.solvers)]
    records = [record for record in best if record is not None]
    if not records:
        return None
    try:
        loaded = {record.solver: load_gait(record) for record in records}
        gaits = {name: prepare_gait(gait) for name, gait in loaded.items() if gait.problem.display.motion is not None}
    except GaitError as error:
        return f"The gaits are not drawn: {error}."
    if not any(gait.skeleton is not None or gait.power is not None for gait in gaits.values()):
        return None
    return Figure(
        name=f"{make_file_name(comparison.problem)}-gaits",
        caption=CAPTION,
        drawing=plot_gaits(gaits),
        data=describe_gaits(gaits),
    )
