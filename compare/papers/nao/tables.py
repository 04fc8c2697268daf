"""Tables 6 to 9 and section 5.3 of the NAO paper: as printed, and as found here by PSO, GA and IPOPT."""

from __future__ import annotations

import math

import numpy as np

from compare.analysis.statistics.tests import a12
from compare.papers.nao.claims import claims
from compare.papers.nao.figures import read_swing_powers
from compare.papers.nao.findings import NAMES, Findings, PhaseFindings
from compare.papers.nao.paper import SWING_POWER_W
from compare.papers.nao.runs import ALGORITHMS, DURATION_SWEEP, SWING_SWEEP
from compare.report.document import Table, Value

Rows = list[list[Value]]


def all_tables(findings: Findings) -> dict[str, Table]:
    """By the name of their place in the report."""
    tables = {
        "claims": _claims(findings),
        "swing": _swing(findings),
        "durations": _durations(findings),
        "tests": _tests(findings),
        "gap": _gap(findings),
    }
    for short, phase in zip(("ssp", "dsp"), findings.phases, strict=True):
        tables |= {
            f"{short}_runs": _runs(phase),
            f"{short}_variables": _variables(phase),
            f"{short}_indexes": _indexes(phase),
        }
    return tables


def _claims(findings: Findings) -> Table:
    rows = [(claim.section, claim.text, claim.verdict, claim.evidence) for claim in claims(findings)]
    columns = dict.fromkeys(("section", "claim", "verdict", "evidence"), "")
    return Table(name="claims", columns=columns, rows=rows, prose=True)


def _variables(phase: PhaseFindings) -> Table:
    """Tables 6, 8: the optimal solutions; of PSO and GA the run of median power."""
    columns = {"variable": ""}
    for name in ALGORITHMS:
        columns |= {f"paper {NAMES[name]}": ".4f", f"our {NAMES[name]}": ".5f"}
    columns["IPOPT"] = ".5f"
    rows: Rows = []
    for i, variable in enumerate(phase.problem.variables):
        row: list[Value] = [f"x{i + 1} {variable.name} [{variable.unit}]"]
        for name in ALGORITHMS:
            row += [phase.paper.optima[name].x[i], phase.median(name).x[variable.name]]
        rows.append([*row, phase.optimum.x[variable.name]])
    return Table(name=f"table{phase.paper.tables[0]}", columns=columns, rows=rows)


def _indexes(phase: PhaseFindings) -> Table:
    """Tables 7, 9: performance figures; the paper's also of its solutions as the judge finds them here."""
    columns = {"index": ""}
    for name in ALGORITHMS:
        title = NAMES[name]
        columns |= {f"paper {title}": ".4f", f"paper's {title} solution here": ".4f", f"our {title}": ".4f"}
    columns["IPOPT"] = ".4f"
    rows: Rows = []
    for index, best in phase.optimum.verdict.indexes.items():
        row: list[Value] = [index]
        for name in ALGORITHMS:
            printed = phase.paper.optima[name]
            value = printed.power_W if index == "power_W" else printed.indexes[index]
            row += [value, phase.printed_here[name].indexes[index], phase.median(name).verdict.indexes[index]]
        rows.append([*row, best])
    return Table(name=f"table{phase.paper.tables[1]}", columns=columns, rows=rows)


def _swing(findings: Findings) -> Table:
    """Table 7, rows 6 to 11: least power at a swing height; true optima, and what search histories show."""
    phase = findings.ssp
    columns = {"swing height [m]": ".3f"} | {f"paper {NAMES[name]} [W]": ".3f" for name in ALGORITHMS}
    read = []
    for name in ALGORITHMS:
        columns |= {
            f"{NAMES[name]} history of the median run [W]": ".4f",
            f"{NAMES[name]} histories of all runs [W]": ".4f",
        }
        read += [read_swing_powers(phase, name, run) for run in (phase.median_run(name), None)]
    columns |= {"IPOPT [W]": ".5f", "true price [%]": ".2f"}
    cheapest = findings.swing[0].power_W
    rows: Rows = []
    for k, held in enumerate(findings.swing):
        printed = [SWING_POWER_W[name][held.at] for name in ALGORITHMS]
        seen: list[Value] = ["none found" if math.isnan(column[k]) else column[k] for column in read]
        rows.append([held.at, *printed, *seen, held.power_W, 100 * (held.power_W / cheapest - 1)])
    return Table(name=SWING_SWEEP, columns=columns, rows=rows)


def _durations(findings: Findings) -> Table:
    """Least power of single support over its duration."""
    columns = {"single support time [s]": ".1f", "IPOPT [W]": ".4f"}
    return Table(name=DURATION_SWEEP, columns=columns, rows=[[held.at, held.power_W] for held in findings.durations])


def _runs(phase: PhaseFindings) -> Table:
    """Power at the end of all runs and starts."""
    columns = {"solver": "", "runs": "d", "feasible": "d", "best [W]": ".6f", "median [W]": ".6f", "worst [W]": ".6f"}
    columns |= {"median gap to IPOPT [%]": ".4f", "time of a run [s]": ".2f"}
    rows: Rows = []
    for name, runs in (*phase.searches.items(), ("ipopt", phase.starts)):
        powers = [run.verdict.objective for run in runs if run.verdict.feasible and run.success]
        spread: list[Value] = [None] * 4
        if powers:
            middle = float(np.median(powers))
            spread = [min(powers), middle, max(powers), 100 * (middle / phase.best - 1)]
        time_s = float(np.median([run.time_s.solve for run in runs]))
        rows.append([NAMES[name], len(runs), len(powers), *spread, time_s])
    return Table(name=f"runs-{phase.problem.name}", columns=columns, rows=rows)


def _tests(findings: Findings) -> Table:
    """Section 5.3: Wilcoxon's rank-sum tests of PSO's powers against GA's, and the effect size."""
    columns = {
        "phase": "",
        "by": "",
        "rank sum of PSO": ".0f",
        "z": ".4f",
        "p two-sided": ".3g",
        "p left-tailed": ".3g",
        "A12": ".3f",
    }
    rows: Rows = []
    for phase in findings.phases:
        printed, found = phase.paper.test, phase.test
        p_less = "not given" if printed.p_less is None else printed.p_less
        effect = a12(phase.final_powers("pso"), phase.final_powers("ga"))
        rows += [
            [phase.paper.title, "paper", printed.rank_sum, printed.z, printed.p_two_sided, p_less, implied_a12(phase)],
            [phase.paper.title, "here", found.rank_sum, found.z, found.p_two_sided, found.p_less, effect],
        ]
    return Table(name="rank-sum-tests", columns=columns, rows=rows)


def implied_a12(phase: PhaseFindings) -> float:
    """Effect size that follows from the paper's rank sum: share of pairs of runs in which PSO's is better."""
    runs = len(phase.searches["pso"])
    return 1.0 - (phase.paper.test.rank_sum - runs * (runs + 1) / 2) / runs**2


def _gap(findings: Findings) -> Table:
    """The paper's solutions: power as printed, as found here, and with the legs' mechanical term counted twice."""
    columns = {
        "solution": "",
        "paper [W]": ".4f",
        "here [W]": ".4f",
        "paper - here [W]": ".3f",
        "legs twice [W]": ".3f",
    }
    rows: Rows = []
    for phase in findings.phases:
        for name in ALGORITHMS:
            printed, here = phase.paper.optima[name].power_W, phase.printed_here[name].objective
            twice = phase.printed_with_legs_twice[name]
            rows.append([f"{phase.paper.title}, {NAMES[name]}", printed, here, printed - here, twice])
    return Table(name="power-gap", columns=columns, rows=rows)
