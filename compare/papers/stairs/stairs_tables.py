"""Findings and tables of the stairs reproduction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.papers.paper_runs import Runs, choose_best, get_point, list_objectives
from compare.papers.stairs.stairs_paper import TABLE_3, TABLE_4
from compare.papers.stairs.stairs_runs import ALGORITHMS, StairsEffort, choose_best_track, choose_plan, make_other_spec
from compare.report.document import Rows, Value
from compare.study.record import RunRecord
from compare.study.task import IPOPT
from nlp_gait.gaits.stairs.stair import GOVERNING_VARIABLES

MATCH = 1e-3  # relative: a start that ends this close to the best has found it
# Name of a table of one step's results in each case: the step, and keys of its result.
PICKED = {
    "printed-scheme": (
        "printed",
        ("explicit_quanta", "implicit_largest_error_rad", "compensated_largest_error_rad"),
    ),
    "replay": (
        "replay",
        ("feedback_end_rad", "open_loop_t1_rad", "open_loop_t2_rad", "open_loop_lost_s", "open_loop_end_rad"),
    ),
    "learned": (
        "learned",
        ("closed-form cost", "network cost", "largest_angle_error_rad", "mean_angle_error_rad"),
    ),
}
# Rows of Table IV: words, name in the paper's table and in our result, and where in our results.
QUANTITIES = (
    ("largest joint acceleration [rad/s^2]", "acceleration", "differences"),
    ("largest joint jerk [rad/s^3]", "jerk", "differences"),
    ("torso pitch [rad]", "torso_pitch_rad", "x"),
    ("K_p", "kp", "x"),
    ("K_d", "kd", "x"),
    ("cost", "cost", "verdict"),
    ("energy (paper: no unit; ours: J)", "energy_J", "verdict"),
    ("peak torque [N m]", "peak_torque_Nm", "verdict"),
)


@dataclass(frozen=True, kw_only=True)
class StairsFindings:
    """All results of the reproduction.

    Attributes:
        effort: what was computed.
        runs: by title of the problem and solver.
        steps: results of the other steps by name.
    """

    effort: StairsEffort
    runs: Runs
    steps: Mapping[str, Any]

    @property
    def cases(self) -> Sequence[int]:
        """Cases of Table IV."""
        return self.effort.cases

    def best(self, what: str, case: int, solver: str = IPOPT) -> RunRecord:
        """Return the best run of a solver on the ``plan``, ``jerk``, ``ideal`` or ``track`` of a case."""
        return choose_best(self.runs[f"{what}-{case}", solver])

    def plan(self, case: int) -> dict[str, float]:
        """Return the plan of least energy."""
        return choose_plan(self.runs, case)

    def best_track(self, case: int) -> RunRecord:
        """Return the best run of any solver on the track."""
        return choose_best_track(self.runs, case)


def make_tables(findings: StairsFindings) -> dict[str, Rows]:
    """Return rows by name; headings and formats are in the report's template."""
    return {
        "table3": _table_3(findings),
        "plans": [row for case in findings.cases for row in _plans(findings, case)],
        "table4": _table_4(findings),
        "tracks": [row for case in findings.cases for row in _tracks(findings, case)],
        "fixed-hip": [_fixed_hip(findings, case) for case in findings.cases],
        "ideal": [_ideal(findings, case) for case in findings.cases],
        "jerk": [_jerk(findings, case) for case in findings.cases],
        "other-stairs": _other(findings),
        "network": _network(findings.steps["network"]),
        "differences": [_differences(findings, case) for case in findings.cases],
        **{name: _of_step(findings, *picked) for name, picked in PICKED.items()},
    }


def _of_step(findings: StairsFindings, step: str, keys: Sequence[str]) -> Rows:
    """Results of a step in each case."""
    return [[case, *(findings.steps[f"{step}-{case}"][key] for key in keys)] for case in findings.cases]


def _table_3(findings: StairsFindings) -> Rows:
    plans = [findings.plan(case) for case in findings.cases]
    rows = []
    for name in [variable.name for variable in GOVERNING_VARIABLES]:
        printed = f"{TABLE_3[name]:g}" if name in TABLE_3 else None
        rows.append([name, printed, *(plan[name] for plan in plans)])
    return rows


def _plans(findings: StairsFindings, case: int) -> Rows:
    """Best plan of each solver, with the ends of all its runs."""
    rows: list[Sequence[Value]] = []
    for solver in (IPOPT, *ALGORITHMS):
        runs, verdict = findings.runs[f"plan-{case}", solver], findings.best("plan", case, solver).verdict
        every = ", ".join(f"{value:.2f}" for value in list_objectives(runs))
        if solver == IPOPT:
            ends = list_objectives(run for run in runs if run.claimed)
            hits = sum(value <= verdict.objective * (1 + MATCH) for value in ends)
            every = f"{hits} of {len(runs)} starts, {len(ends)} converged"
        between = "feasible" if verdict.dense_feasible else verdict.violated[0]
        rows.append([case, solver, verdict.objective, every, verdict.feasible, between, _time_s(runs)])
    return rows


def _time_s(runs: Sequence[RunRecord]) -> float:
    return float(np.mean([run.time_s.solve for run in runs]))


def _table_4(findings: StairsFindings) -> Rows:
    """The paper's quantities in each case, then ours: of the desired angles, and of the best tracked step."""
    rows = []
    for words, name, where in QUANTITIES:
        ours = []
        for case in findings.cases:
            track = findings.best_track(case)
            places = {
                "differences": findings.steps[f"differences-energy-{case}"],
                "x": track.x,
                "verdict": {"cost": track.verdict.objective, **track.verdict.indexes},
            }
            ours.append(places[where][name])
        printed = [float(getattr(TABLE_4[case], name.removesuffix("_J"))) for case in findings.cases]
        rows.append([words, *printed, *ours])
    return rows


def _tracks(findings: StairsFindings, case: int) -> Rows:
    """Best run of each solver beside the ideal."""
    ideal = findings.best("ideal", case).verdict.indexes["energy_J"]
    rows: list[Sequence[Value]] = []
    for solver in (*ALGORITHMS, IPOPT):
        run = findings.best("track", case, solver)
        verdict, own = run.verdict, run.verdict.indexes
        energies = [own["energy_J"], ideal, own["energy_J"] - ideal]
        others = [own["zmp_margin_min_m"], own["largest_error_rad"], *get_point(run)]
        rows.append([case, solver, verdict.objective, verdict.feasible, *energies, *others])
    return rows


def _ideal(findings: StairsFindings, case: int) -> Sequence[Value]:
    """Full trajectory optimisation."""
    runs, verdict = findings.runs[f"ideal-{case}", IPOPT], findings.best("ideal", case).verdict
    every = ", ".join(f"{run.verdict.objective:.3f}" if run.claimed else "failed" for run in runs)
    energies = [verdict.indexes["energy_J"], findings.best("plan", case).verdict.objective]
    others = [verdict.indexes["peak_torque_Nm"], verdict.indexes["torso_pitch_rad"]]
    return [case, verdict.objective, every, *energies, *others, _time_s(runs)]


def _jerk(findings: StairsFindings, case: int) -> Sequence[Value]:
    """Plan of least peak jerk."""
    verdict = findings.best("jerk", case).verdict
    return [case, TABLE_4[case].jerk, verdict.objective, verdict.indexes["energy_J"]]


def _fixed_hip(findings: StairsFindings, case: int) -> Sequence[Value]:
    """Plans with the paper's hip height."""
    runs, verdict = findings.runs[f"hip-{case}", IPOPT], findings.best("hip", case).verdict
    feasible = sum(run.verdict.feasible for run in runs)
    return [case, f"{feasible} of {len(runs)}", "; ".join(verdict.violated[:3]) or "nothing"]


def _differences(findings: StairsFindings, case: int) -> Sequence[Value]:
    """Largest acceleration and jerk by differences over 0.01 s: the paper's, and those of both plans."""
    plans = [findings.steps[f"differences-{least}-{case}"] for least in ("energy", "jerk")]
    of_kind = [(getattr(TABLE_4[case], kind), *(plan[kind] for plan in plans)) for kind in ("acceleration", "jerk")]
    return [case, *of_kind[0], *of_kind[1]]


def _other(findings: StairsFindings) -> Rows:
    """Stairs that the paper did not try."""
    rows = []
    for tread, rise in findings.effort.other_stairs:
        cells: list[Value] = [tread, rise]
        for name, unit in (("stairs-plan", " J"), ("stairs-ideal", "")):
            run = choose_best(findings.runs[make_other_spec(findings.effort, name, tread, rise).title, IPOPT])
            worst = ", ".join(run.verdict.violated[:3])
            cells.append(f"{run.verdict.objective:.3f}{unit}" if run.claimed else f"none; violated: {worst}")
        rows.append(cells)
    return rows


def _network(network: Mapping[str, Any]) -> Rows:
    return [
        [
            rule,
            f"{found['converged']} of {found['poses']}",
            float(np.mean(found["iterations"])),
            1e3 * found["time_s"][0],
            1e3 * float(np.mean(found["time_s"][1:])),
            found["largest_angle_error_rad"],
            found["mean_angle_error_rad"],
        ]
        for rule, found in network.items()
    ]
