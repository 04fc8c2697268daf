"""Tables 6 to 9 and section 5.3 of the NAO paper: as printed, and as found here by PSO, GA and IPOPT."""

from __future__ import annotations

import math

import numpy as np

from compare.analysis.statistics.inference import a12
from compare.papers.nao.nao_figures import read_swing_powers
from compare.papers.nao.nao_findings import NAMES, NaoFindings, PhaseFindings
from compare.papers.nao.nao_paper import SWING_POWER_W
from compare.papers.nao.nao_runs import ALGORITHMS, DURATION_SWEEP, SWING_SWEEP
from compare.report.document import Rows, Value


def make_tables(findings: NaoFindings) -> dict[str, Rows]:
    """Return rows by name; headings and formats are in the report's template."""
    tables = {
        SWING_SWEEP: _swing(findings),
        DURATION_SWEEP: [(point.at, point.power_W) for point in findings.durations],
        "rank-sum-tests": [row for phase in findings.phases for row in _tests(phase)],
        "power-gap": [row for phase in findings.phases for row in _gap(phase)],
    }
    for phase in findings.phases:
        variables, indexes = phase.paper.tables
        tables |= {
            f"runs-{phase.problem.name}": _runs(phase),
            f"table{variables}": _variables(phase),
            f"table{indexes}": _indexes(phase),
        }
    return tables


def _variables(phase: PhaseFindings) -> Rows:
    """Tables 6, 8: the optimal solutions; of PSO and GA the run of median power."""
    rows = []
    for i, variable in enumerate(phase.problem.variables):
        row: list[Value] = [f"x{i + 1} {variable.name} [{variable.unit}]"]
        for name in ALGORITHMS:
            row += [phase.paper.optima[name].x[i], phase.median(name).x[variable.name]]
        rows.append([*row, phase.optimum.x[variable.name]])
    return rows


def _indexes(phase: PhaseFindings) -> Rows:
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


def _swing(findings: NaoFindings) -> Rows:
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


def _runs(phase: PhaseFindings) -> Rows:
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


def _tests(phase: PhaseFindings) -> Rows:
    """Section 5.3: Wilcoxon's rank-sum tests of PSO's powers against GA's, and the effect size."""
    printed, found = phase.paper.test, phase.test
    p_less = "not given" if printed.p_less is None else printed.p_less
    effect = a12(phase.final_powers("pso"), phase.final_powers("ga"))
    return [
        (
            phase.paper.title,
            "paper",
            printed.rank_sum,
            printed.z,
            printed.p_two_sided,
            p_less,
            compute_implied_a12(phase),
        ),
        (phase.paper.title, "here", found.rank_sum, found.z, found.p_two_sided, found.p_less, effect),
    ]


def compute_implied_a12(phase: PhaseFindings) -> float:
    """Return the effect size that follows from the paper's rank sum: the share of pairs of runs in which PSO's is better."""
    runs = len(phase.searches["pso"])
    return 1.0 - (phase.paper.test.rank_sum - runs * (runs + 1) / 2) / runs**2


def _gap(phase: PhaseFindings) -> Rows:
    """The paper's solutions: power as printed, as found here, and with the legs' mechanical term counted twice."""
    rows = []
    for name in ALGORITHMS:
        printed, here = phase.paper.optima[name].power_W, phase.printed_here[name].objective
        twice = phase.printed_with_legs_twice[name]
        rows.append((f"{phase.paper.title}, {NAMES[name]}", printed, here, printed - here, twice))
    return rows
