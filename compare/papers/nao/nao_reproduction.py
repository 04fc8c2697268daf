"""Gupta, Pratihar, Deb (2023), reproduced: Tables 6 to 9, Figs. 9 to 20, the tests of section 5.3 and the paper's claims."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from compare.analysis.statistics.inference import a12
from compare.papers.nao import nao_runs as nao
from compare.papers.nao.nao_claims import CHECKS
from compare.papers.nao.nao_figures import draw_figures, read_swing_powers
from compare.papers.nao.nao_findings import NAMES, NaoFindings, PhaseFindings, Points, choose_sweep_values
from compare.papers.nao.nao_paper import PHASES, SWING_POWER_W, PrintedPhase
from compare.papers.nao.nao_runs import ALGORITHMS, NaoEffort, SweepPoint
from compare.papers.paper_runs import Runner, Runs, choose_best, compute_range
from compare.papers.reproduction import Reproduction
from compare.report.document import Rows, Value
from compare.study.record_files import locate_record
from compare.study.store import Computation, Store
from compare.study.task import IPOPT, Task
from nlp_gait.backends.solvers import ipopt


def run_nao(runner: Runner, effort: NaoEffort) -> NaoFindings:
    """Run searches and IPOPT on both phases, and sweep over their variables."""
    store, tasks = Store(runner.folder), nao.make_tasks(effort)
    searches = [task for task in tasks if task.is_search]
    for task in searches:
        if nao.load_points(store, task) is None:
            locate_record(runner.folder, task).unlink(missing_ok=True)  # only a run gives its points
    runs = runner.run_tasks(tasks, partial(nao.run_and_store_points, runner.folder))
    ssp, dsp = (_sweep_phase(runner, effort, phase, runs, _load_all_points(store, phase, searches)) for phase in PHASES)
    special = _solve_sweeps(runner, nao.make_special_sweeps(effort))
    swing, durations = special[nao.SWING_SWEEP], special[nao.DURATION_SWEEP]
    return NaoFindings(ssp=ssp, dsp=dsp, swing=swing, durations=durations, lever=runs[nao.LEVER, IPOPT])


def _load_all_points(store: Store, phase: PrintedPhase, searches: Sequence[Task]) -> dict[str, Points]:
    """Feasible solutions of all runs, by search."""
    points = {}
    for name in ALGORITHMS:
        tasks = [task for task in searches if (task.problem.title, task.title) == (phase.problem, name)]
        runs = [found for task in tasks if (found := nao.load_points(store, task)) is not None]
        x, power = (np.concatenate(arrays) for arrays in zip(*runs, strict=True))
        run = np.repeat(np.arange(len(runs), dtype=float), [len(power) for _, power in runs])
        points[name] = Points(x=x, power_W=power, run=run)
    return points


def _sweep_phase(
    runner: Runner, effort: NaoEffort, paper: PrintedPhase, runs: Runs, points: Mapping[str, Points]
) -> PhaseFindings:
    """Sweep by IPOPT over each variable's feasible range."""
    spec, starts = nao.make_spec(paper.problem, effort), runs[paper.problem, IPOPT]
    sweeps = []
    for i, optimum in enumerate(choose_best(starts).x.values()):
        values = choose_sweep_values(points, i, optimum, effort.sweep_points)
        sweeps.append(nao.make_sweep(f"{paper.problem}-sweep-x{i + 1}", spec, i, values, effort.sweep_starts))
    return PhaseFindings(
        paper=paper,
        problem=spec.load(),
        searches={name: runs[paper.problem, name] for name in ALGORITHMS},
        starts=starts,
        sweeps=dict(enumerate(_solve_sweeps(runner, sweeps).values())),
        points=points,
    )


def _solve_sweeps(runner: Runner, sweeps: Sequence[Computation]) -> dict[str, list[SweepPoint]]:
    results = runner.compute(sweeps, code=(nao, ipopt))
    return {name: [SweepPoint(**row) for row in rows] for name, rows in results.items()}


def compute_values(findings: NaoFindings) -> dict[str, Any]:
    """Return the values of the places in the report's text."""
    ssp, dsp = findings.phases
    runs = ssp.searches["pso"]
    solved = [start.verdict.objective for start in findings.lever if start.claimed]
    lever = f"{min(solved):.5f} W instead of {dsp.best:.5f} W" if solved else "no optimum"
    printed = [
        (optimum.power_W, phase.printed_here[name].objective, phase.printed_with_legs_twice[name])
        for phase in findings.phases
        for name, optimum in phase.paper.optima.items()
    ]
    return {
        "runs": len(runs),
        "generations": runs[0].iterations,
        "starts": len(ssp.starts),
        "robot": ssp.problem.options["robot"],
        "ssp": _compute_phase_values(ssp),
        "dsp": _compute_phase_values(dsp),
        "costs": compute_range(100 * (here.objective / dsp.best - 1) for here in dsp.printed_here.values()),
        "lever": f"{lever} ({len(solved)} of {len(findings.lever)} starts converged)",
        "gaps": compute_range(power - here for power, here, _ in printed),
        "misses": compute_range(100 * (twice / power - 1) for power, _, twice in printed),
    }


def _compute_phase_values(phase: PhaseFindings) -> dict[str, Any]:
    """Values of one phase; ``broken`` counts final solutions that violate a constraint between the paper's samples."""
    ends = [run.verdict for runs in phase.searches.values() for run in runs if run.verdict.feasible]
    optimum = phase.optimum.verdict
    return {
        "converged": phase.converged,
        "medians": ", ".join(f"{phase.median_run(name)} of {NAMES[name]}" for name in ALGORITHMS),
        "feasible": len(ends),
        "broken": sum(end.dense_feasible is False for end in ends),
        "optimum": "does not" if optimum.dense_feasible else f"violates {optimum.violated[0]}",
        "below": 100 * max(phase.share_below(i) for i in phase.sweeps),
    }


def make_tables(findings: NaoFindings) -> dict[str, Rows]:
    """Return rows by name; headings and formats are in the report's template."""
    tables = {
        nao.SWING_SWEEP: _list_swing_heights(findings),
        nao.DURATION_SWEEP: [(point.at, point.power_W) for point in findings.durations],
        "rank-sum-tests": [row for phase in findings.phases for row in _list_tests(phase)],
        "power-gap": [row for phase in findings.phases for row in _list_gaps(phase)],
    }
    for phase in findings.phases:
        variables, indexes = phase.paper.tables
        tables |= {
            f"runs-{phase.problem.name}": _list_runs(phase),
            f"table{variables}": _list_variables(phase),
            f"table{indexes}": _list_indexes(phase),
        }
    return tables


def _list_variables(phase: PhaseFindings) -> Rows:
    """Tables 6, 8: the optimal solutions; of PSO and GA the run of median power."""
    rows = []
    for i, variable in enumerate(phase.problem.variables):
        row: list[Value] = [f"x{i + 1} {variable.name} [{variable.unit}]"]
        for name in ALGORITHMS:
            row += [phase.paper.optima[name].x[i], phase.median(name).x[variable.name]]
        rows.append([*row, phase.optimum.x[variable.name]])
    return rows


def _list_indexes(phase: PhaseFindings) -> Rows:
    """Tables 7, 9: performance figures; the paper's also of its solutions as the judge finds them here."""
    rows = []
    for index, best in phase.optimum.verdict.indexes.items():
        row: list[Value] = [index]
        for name in ALGORITHMS:
            printed = phase.paper.optima[name]
            value = printed.power_W if index == "power_W" else printed.indexes[index]
            row += [value, phase.printed_here[name].indexes[index], phase.median(name).verdict.indexes[index]]
        rows.append([*row, best])
    return rows


def _list_swing_heights(findings: NaoFindings) -> Rows:
    """Table 7, rows 6 to 11: least power at a swing height; true optima, and what search histories show."""
    phase = findings.ssp
    read = [read_swing_powers(phase, name, run) for name in ALGORITHMS for run in (phase.median_run(name), None)]
    cheapest = findings.swing[0].power_W
    rows = []
    for k, held in enumerate(findings.swing):
        printed = [SWING_POWER_W[name][held.at] for name in ALGORITHMS]
        seen: list[Value] = ["none found" if math.isnan(column[k]) else column[k] for column in read]
        rows.append([held.at, *printed, *seen, held.power_W, 100 * (held.power_W / cheapest - 1)])
    return rows


def _list_runs(phase: PhaseFindings) -> Rows:
    """Power at the end of all runs and starts."""
    rows = []
    for name, runs in (*phase.searches.items(), ("ipopt", phase.starts)):
        powers = [run.verdict.objective for run in runs if run.verdict.feasible and run.claimed]
        spread: list[Value] = [None] * 4
        if powers:
            middle = float(np.median(powers))
            spread = [min(powers), middle, max(powers), 100 * (middle / phase.best - 1)]
        time_s = float(np.median([run.time_s.solve for run in runs]))
        rows.append([NAMES[name], len(runs), len(powers), *spread, time_s])
    return rows


def _list_tests(phase: PhaseFindings) -> Rows:
    """Section 5.3: Wilcoxon's rank-sum tests of PSO's powers against GA's, and the effect size."""
    effect = a12(phase.final_powers("pso"), phase.final_powers("ga"))
    rows: list[list[Value]] = []
    for name, test, share in (("paper", phase.paper.test, compute_implied_a12(phase)), ("here", phase.test, effect)):
        p_less: Value = "not given" if math.isnan(test.p_less) else test.p_less
        rows.append([phase.paper.title, name, test.rank_sum, test.z, test.p_two_sided, p_less, share])
    return rows


def compute_implied_a12(phase: PhaseFindings) -> float:
    """Return the effect size that follows from the paper's rank sum: the share of pairs of runs in which PSO's is better."""
    runs = len(phase.searches["pso"])
    return 1.0 - (phase.paper.test.rank_sum - runs * (runs + 1) / 2) / runs**2


def _list_gaps(phase: PhaseFindings) -> Rows:
    """The paper's solutions: power as printed, as found here, and with the legs' mechanical term counted twice."""
    rows = []
    for name in ALGORITHMS:
        printed, here = phase.paper.optima[name].power_W, phase.printed_here[name].objective
        twice = phase.printed_with_legs_twice[name]
        rows.append((f"{phase.paper.title}, {NAMES[name]}", printed, here, printed - here, twice))
    return rows


REPRODUCTION = Reproduction(
    name="nao",
    full=NaoEffort(),
    run=run_nao,
    values=compute_values,
    tables=make_tables,
    figures=draw_figures,
    checks=CHECKS,
)
