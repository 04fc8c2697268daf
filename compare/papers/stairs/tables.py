"""Findings of the stairs reproduction, and its tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.papers.runs import Runs, best, objectives, point
from compare.papers.stairs.paper import TABLE_3, TABLE_4
from compare.papers.stairs.runs import ALGORITHMS, Effort, best_track, other_spec, plan_of
from compare.report.document import Table, Value
from compare.study.record import RunRecord, Verdict
from compare.study.task import IPOPT
from nlp_gait.problems.stairs.governing import GOVERNING_VARIABLES

MATCH = 1e-3  # a start that ends within this of the best is counted as having found it (relative)
SOLVERS = (IPOPT, *ALGORITHMS)
Rows = list[list[Value]]


@dataclass(frozen=True, kw_only=True)
class Findings:
    """All results.

    Attributes:
        effort: what was computed.
        runs: by title of the problem and solver.
        steps: results of the other steps by name.
    """

    effort: Effort
    runs: Runs
    steps: Mapping[str, Any]

    @property
    def cases(self) -> Sequence[int]:
        """Cases of Table IV."""
        return self.effort.cases

    def best(self, what: str, case: int, solver: str = IPOPT) -> RunRecord:
        """Best run of a solver on the ``plan``, ``jerk``, ``ideal`` or ``track`` of a case."""
        return best(self.runs[f"{what}-{case}", solver])

    def plan(self, case: int) -> dict[str, float]:
        """Plan of least energy."""
        return plan_of(self.runs, case)

    def best_track(self, case: int) -> RunRecord:
        """Best run of any solver on the track."""
        return best_track(self.runs, case)


def all_tables(findings: Findings) -> dict[str, Table]:
    """By the name of their place in the report."""
    return {
        "table_3": _table_3(findings),
        "plans": _plans(findings),
        "table_4": _table_4(findings),
        "tracks": _tracks(findings),
        "ideal": _ideal(findings),
        "jerk": _jerk(findings),
        "other": _other(findings),
        "network": _network(findings),
        "differences": _differences(findings),
        "printed": _of_step(
            findings,
            "printed-scheme",
            "printed",
            {
                "explicit_quanta": ("explicit: quanta of 0.01 s before divergence", ".0f"),
                "implicit_largest_error_rad": ("implicit: largest error [rad]", ".3f"),
                "compensated_largest_error_rad": ("implicit, gravity compensated [rad]", ".3f"),
            },
        ),
        "replay": _of_step(
            findings,
            "replay",
            "replay",
            {
                "feedback_end_rad": ("with feedback: error at the end [rad]", ".1e"),
                "open_loop_t1_rad": ("without: until t1 = 0.5 s [rad]", ".1e"),
                "open_loop_t2_rad": ("until t2 = 1.4 s [rad]", ".1e"),
                "open_loop_lost_s": ("beyond 0.1 rad at [s]", ".2f"),
                "open_loop_end_rad": ("at the end [rad]", ".0f"),
            },
        ),
        "learned": _of_step(
            findings,
            "learned",
            "learned",
            {
                "closed-form cost": ("cost, closed form", ".4f"),
                "network cost": ("cost, network", ".4f"),
                "largest_angle_error_rad": ("largest angle error [rad]", ".4f"),
                "mean_angle_error_rad": ("mean [rad]", ".4f"),
            },
        ),
    }


def _of_step(findings: Findings, name: str, step: str, columns: Mapping[str, tuple[str, str]]) -> Table:
    """Results of a step in each case; columns by key of the result: heading and format."""

    def row(case: int) -> list[Value]:
        return [findings.steps[f"{step}-{case}"][key] for key in columns]

    return _by_case(findings, name, dict(columns.values()), row)


def _by_case(findings: Findings, name: str, columns: Mapping[str, str], row: Callable[[int], Sequence[Value]]) -> Table:
    """Table of one row for each case; ``columns`` without the first, the case."""
    return Table(name=name, columns={"case": "d", **columns}, rows=[[case, *row(case)] for case in findings.cases])


def _table_3(findings: Findings) -> Table:
    rows: Rows = []
    for variable in GOVERNING_VARIABLES:
        printed = TABLE_3.get(variable.name)
        rows.append(
            [variable.name, "-" if printed is None else f"{printed:g}"]
            + [findings.plan(case)[variable.name] for case in findings.cases]
        )
    columns = {"parameter": "", "paper": "", **{f"case {case}": ".4f" for case in findings.cases}}
    return Table(name="table3", columns=columns, rows=rows)


def _plans(findings: Findings) -> Table:
    columns = {
        "case": "d",
        "solver": "",
        "best [J]": ".3f",
        "all runs [J]": "",
        "feasible": "",
        "dense grid": "",
        "time a run [s]": ".2f",
    }
    rows: Rows = []
    for case in findings.cases:
        for solver in SOLVERS:
            runs, verdict = findings.runs[f"plan-{case}", solver], findings.best("plan", case, solver).verdict
            every = ", ".join(f"{value:.2f}" for value in objectives(runs))
            if solver == IPOPT:
                ends = objectives(run for run in runs if run.success)
                hits = sum(value <= verdict.objective * (1 + MATCH) for value in ends)
                every = f"{hits} of {len(runs)} starts, {len(ends)} converged"
            rows.append([case, solver, verdict.objective, every, verdict.feasible, _between(verdict), _time_s(runs)])
    return Table(name="plans", columns=columns, rows=rows)


def _between(verdict: Verdict) -> str:
    """The worst violation, if the dense grid shows any."""
    return "feasible" if verdict.dense_feasible else verdict.violated[0]


def _time_s(runs: Sequence[RunRecord]) -> float:
    return float(np.mean([run.time_s.solve for run in runs]))


def _table_4(findings: Findings) -> Table:
    cases = findings.cases
    columns = {
        "quantity": "",
        **{f"paper {case}": ".6g" for case in cases},
        **{f"ours {case}": ".4f" for case in cases},
    }
    best_tracks = [findings.best_track(case) for case in cases]
    apart = [findings.steps[f"differences-energy-{case}"] for case in cases]
    ours: dict[tuple[str, str], list[float]] = {
        ("largest joint acceleration [rad/s^2]", "acceleration"): [found["acceleration"] for found in apart],
        ("largest joint jerk [rad/s^3]", "jerk"): [found["jerk"] for found in apart],
        ("torso pitch [rad]", "torso_pitch_rad"): [run.x["torso_pitch_rad"] for run in best_tracks],
        ("K_p", "kp"): [run.x["kp"] for run in best_tracks],
        ("K_d", "kd"): [run.x["kd"] for run in best_tracks],
        ("cost", "cost"): objectives(best_tracks),
        ("energy (paper: no unit; ours: J)", "energy"): [run.verdict.indexes["energy_J"] for run in best_tracks],
        ("peak torque [N m]", "peak_torque_Nm"): [run.verdict.indexes["peak_torque_Nm"] for run in best_tracks],
    }
    rows: Rows = [
        [words, *(float(getattr(TABLE_4[case], field)) for case in cases), *found]
        for (words, field), found in ours.items()
    ]
    return Table(name="table4", columns=columns, rows=rows)


def _tracks(findings: Findings) -> Table:
    columns = {
        "case": "d",
        "solver": "",
        "cost": ".6f",
        "feasible": "",
        "energy [J]": ".2f",
        "ideal's energy [J]": ".2f",
        "gap [J]": ".2f",
        "ZMP margin [m]": ".4f",
        "largest error [rad]": ".4f",
        "K_p [N m/rad]": ".3f",
        "K_d [N m s/rad]": ".3f",
        "torso [rad]": ".4f",
    }
    rows: Rows = []
    for case in findings.cases:
        ideal = findings.best("ideal", case).verdict.indexes["energy_J"]
        for solver in (*ALGORITHMS, IPOPT):
            run = findings.best("track", case, solver)
            verdict, own = run.verdict, run.verdict.indexes
            energies = [own["energy_J"], ideal, own["energy_J"] - ideal]
            others = [own["zmp_margin_min_m"], own["largest_error_rad"], *point(run)]
            rows.append([case, solver, verdict.objective, verdict.feasible, *energies, *others])
    return Table(name="tracks", columns=columns, rows=rows)


def _ideal(findings: Findings) -> Table:
    """Full trajectory optimisation."""
    columns = {
        "effort": ".4f",
        "all starts": "",
        "energy [J]": ".2f",
        "plan's energy [J]": ".2f",
        "peak torque [N m]": ".2f",
        "torso [rad]": ".4f",
        "time a start [s]": ".1f",
    }

    def row(case: int) -> list[Value]:
        runs, verdict = findings.runs[f"ideal-{case}", IPOPT], findings.best("ideal", case).verdict
        every = ", ".join(f"{run.verdict.objective:.3f}" if run.success else "failed" for run in runs)
        energies = [verdict.indexes["energy_J"], findings.best("plan", case).verdict.objective]
        others = [verdict.indexes["peak_torque_Nm"], verdict.indexes["torso_pitch_rad"]]
        return [verdict.objective, every, *energies, *others, _time_s(runs)]

    return _by_case(findings, "ideal", columns, row)


def _jerk(findings: Findings) -> Table:
    """Plans of least peak jerk."""
    columns = {"paper [rad/s^3]": ".1f", "least peak jerk [rad/s^3]": ".1f", "at energy [J]": ".1f"}

    def row(case: int) -> list[Value]:
        verdict = findings.best("jerk", case).verdict
        return [TABLE_4[case].jerk, verdict.objective, verdict.indexes["energy_J"]]

    return _by_case(findings, "jerk", columns, row)


def _differences(findings: Findings) -> Table:
    """Largest acceleration and jerk by differences over 0.01 s."""
    kinds = {"acceleration": ("[rad/s^2]", ".2f"), "jerk": ("[rad/s^3]", ".1f")}
    columns: dict[str, str] = {}
    for kind, (unit, form) in kinds.items():
        columns |= {f"{kind}, paper {unit}": form}
        columns |= {f"plan of least {least} {unit}": form for least in ("energy", "jerk")}

    def row(case: int) -> list[Value]:
        ours = [findings.steps[f"differences-{least}-{case}"] for least in ("energy", "jerk")]
        return [value for kind in kinds for value in (getattr(TABLE_4[case], kind), *(plan[kind] for plan in ours))]

    return _by_case(findings, "differences", columns, row)


def _other(findings: Findings) -> Table:
    """Stairs that the paper did not try."""
    columns = {"tread [m]": ".3f", "rise [m]": ".3f", "plan": "", "ideal": ""}
    rows: Rows = []
    for tread, rise in findings.effort.other_stairs:
        cells: list[Value] = [tread, rise]
        for name, unit in (("stairs-plan", " J"), ("stairs-ideal", "")):
            run = best(findings.runs[other_spec(findings.effort, name, tread, rise).title, IPOPT])
            worst = ", ".join(run.verdict.violated[:3])
            cells.append(f"{run.verdict.objective:.3f}{unit}" if run.success else f"none; in the way: {worst}")
        rows.append(cells)
    return Table(name="other-stairs", columns=columns, rows=rows)


def _network(findings: Findings) -> Table:
    columns = {
        "rule and rate": "",
        "poses to 1e-6 m^2": "",
        "mean iterations": ".1f",
        "first pose [ms]": ".2f",
        "other poses [ms]": ".3f",
        "largest angle error [rad]": ".4f",
        "mean [rad]": ".4f",
    }
    rows: Rows = [
        [
            rule,
            f"{found['converged']} of {found['poses']}",
            float(np.mean(found["iterations"])),
            1e3 * found["time_s"][0],
            1e3 * float(np.mean(found["time_s"][1:])),
            found["largest_angle_error_rad"],
            found["mean_angle_error_rad"],
        ]
        for rule, found in findings.steps["network"].items()
    ]
    return Table(name="network", columns=columns, rows=rows)
