"""Tables 6 to 9 and section 5.3 of the NAO paper: as printed, and as found here by PSO, GA and IPOPT."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from compare.analysis.statistics.tests import a12
from compare.papers.nao.figures import read_swing_powers
from compare.papers.nao.findings import ALGORITHMS, NAMES, Findings, PhaseFindings
from compare.papers.nao.paper import SWING_POWER_W
from compare.papers.tables import Cell, write_table


def variables_table(folder: Path, phase: PhaseFindings) -> str:
    """Tables 6, 8: the optimal solutions; of PSO and GA the run of median power."""
    columns = {"variable": ""}
    for name in ALGORITHMS:
        columns |= {f"paper {NAMES[name]}": ".4f", f"our {NAMES[name]}": ".5f"}
    columns["IPOPT"] = ".5f"
    rows: list[list[Cell]] = []
    for i, variable in enumerate(phase.problem.variables):
        pairs = [(phase.paper.optima[name].x[i], phase.median(name)["x"][i]) for name in ALGORITHMS]
        symbol = f"x{i + 1} {variable.name} [{variable.unit}]"
        rows.append([symbol, *(value for pair in pairs for value in pair), phase.optimum["x"][i]])
    return write_table(folder / f"table{phase.paper.tables[0]}", columns, rows)


def indexes_table(folder: Path, phase: PhaseFindings) -> str:
    """Tables 7, 9: performance figures; the paper's also of its solutions as the judge finds them here."""
    columns = {"index": ""}
    for name in ALGORITHMS:
        title = NAMES[name]
        columns |= {f"paper {title}": ".4f", f"paper's {title} solution here": ".4f", f"our {title}": ".4f"}
    columns["IPOPT"] = ".4f"
    rows: list[list[Cell]] = []
    for index in phase.optimum["indexes"]:
        row: list[Cell] = [index]
        for name in ALGORITHMS:
            printed = phase.paper.optima[name]
            value = printed.power_W if index == "power_W" else printed.indexes[index]
            row += [value, phase.printed_here[name]["indexes"][index], phase.median(name)["indexes"][index]]
        rows.append([*row, phase.optimum["indexes"][index]])
    return write_table(folder / f"table{phase.paper.tables[1]}", columns, rows)


def swing_table(folder: Path, findings: Findings) -> str:
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
    cheapest = findings.swing[0]["power_W"]
    rows: list[list[Cell]] = []
    for k, point in enumerate(findings.swing):
        height, power = point["at"], point["power_W"]
        printed = [SWING_POWER_W[name][height] for name in ALGORITHMS]
        seen: list[Cell] = ["none found" if np.isnan(column[k]) else column[k] for column in read]
        rows.append([height, *printed, *seen, power, 100 * (power / cheapest - 1)])
    return write_table(folder / "table7-swing-heights", columns, rows)


def durations_table(folder: Path, findings: Findings) -> str:
    """Least power of single support over its duration."""
    columns = {"single support time [s]": ".1f", "IPOPT [W]": ".4f"}
    rows: list[list[Cell]] = [[point["at"], point["power_W"]] for point in findings.durations]
    return write_table(folder / "durations", columns, rows)


def runs_table(folder: Path, phase: PhaseFindings) -> str:
    """Power at the end of all runs and starts."""
    columns = {"solver": "", "runs": "d", "feasible": "d", "best [W]": ".6f", "median [W]": ".6f", "worst [W]": ".6f"}
    columns |= {"median gap to IPOPT [%]": ".4f", "time of a run [s]": ".2f"}
    rows: list[list[Cell]] = []
    for name, runs in (*phase.searches.items(), ("ipopt", phase.starts)):
        powers = np.sort([run["power_W"] for run in runs if run["feasible"] and run.get("success", True)])
        if not len(powers):
            rows.append([NAMES[name], len(runs), 0, *["-"] * 4, float(np.median([run["time_s"] for run in runs]))])
            continue
        middle = float(np.median(powers))
        spread = [float(powers[0]), middle, float(powers[-1]), 100 * (middle / phase.best - 1)]
        rows.append([NAMES[name], len(runs), len(powers), *spread, float(np.median([run["time_s"] for run in runs]))])
    return write_table(folder / f"runs-{phase.problem.name}", columns, rows)


def tests_table(folder: Path, findings: Findings) -> str:
    """Section 5.3: Wilcoxon's rank-sum tests of PSO's 11 powers against GA's, and the effect size."""
    columns = {
        "phase": "",
        "by": "",
        "rank sum of PSO": ".0f",
        "z": ".4f",
        "p two-sided": ".3g",
        "p left-tailed": ".3g",
    }
    columns |= {"A12": ".3f"}
    rows: list[list[Cell]] = []
    for phase in findings.phases:
        printed, found = phase.paper.test, phase.test
        p_less = "not given" if printed.p_less is None else printed.p_less
        rows.append(
            [phase.paper.title, "paper", printed.rank_sum, printed.z, printed.p_two_sided, p_less, implied_a12(phase)]
        )
        effect = a12(phase.final_powers("pso"), phase.final_powers("ga"))
        rows.append([phase.paper.title, "here", found.rank_sum, found.z, found.p_two_sided, found.p_less, effect])
    return write_table(folder / "rank-sum-tests", columns, rows)


def implied_a12(phase: PhaseFindings) -> float:
    """Effect size that follows from the paper's rank sum: share of pairs of runs in which PSO's is better."""
    runs = len(phase.searches["pso"])
    return 1.0 - (phase.paper.test.rank_sum - runs * (runs + 1) / 2) / runs**2


def gap_table(folder: Path, findings: Findings) -> str:
    """The paper's solutions: power as printed, as found here, and with the legs' mechanical term counted twice."""
    columns = {
        "solution": "",
        "paper [W]": ".4f",
        "here [W]": ".4f",
        "paper - here [W]": ".3f",
        "legs twice [W]": ".3f",
    }
    rows: list[list[Cell]] = []
    for phase in findings.phases:
        for name in ALGORITHMS:
            printed, here = phase.paper.optima[name].power_W, phase.printed_here[name]["power_W"]
            twice = phase.printed_with_legs_twice[name]
            rows.append([f"{phase.paper.title}, {NAMES[name]}", printed, here, printed - here, twice])
    return write_table(folder / "power-gap", columns, rows)
