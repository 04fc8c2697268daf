"""Bhardwaj, Mishra, Sukavanam, Balasubramanian, reproduced: Tables III and IV, Figs. 3, 6 to 29, next to IPOPT and searches."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from compare.papers.claims import bind_checks
from compare.papers.paper_runs import Runner, choose_best, get_point, list_objectives
from compare.papers.reproduction import Reproduction
from compare.papers.stairs import stairs_instants
from compare.papers.stairs import stairs_plan_claims as plan_claims
from compare.papers.stairs import stairs_planning as planning
from compare.papers.stairs import stairs_runs as runs
from compare.papers.stairs import stairs_tracking as tracking
from compare.papers.stairs.stairs_figures import draw_figures
from compare.papers.stairs.stairs_paper import EVAPORATION, PAPER, TABLE_3, TABLE_4
from compare.papers.stairs.stairs_runs import ALGORITHMS, StairsEffort, StairsFindings
from compare.report.document import Rows, Value
from compare.study.task import IPOPT
from metaheuristics import AntColony
from nlp_gait.gaits.stairs.closed_loop import QUANTUM
from nlp_gait.gaits.stairs.stair import GOVERNING_VARIABLES

MATCH = 1e-3  # relative: a start that ends this close to the best has found it
# Headings and formats of columns for each case, by their places in the text.
CASE_COLUMNS = {
    "papers": "paper {}",
    "jerks": "least jerk {}",
    "energies": "least energy {}",
    "cases_4f": ".4f",
    "cases_6g": ".6g",
}


def _run_stairs(runner: Runner, effort: StairsEffort) -> StairsFindings:
    """Run plans and ideals, then track the best plans, then compute what follows from them."""
    findings = StairsFindings(effort=effort, runs=runner.run_tasks(runs.make_first_tasks(effort)))
    findings.runs.update(runner.run_tasks(planning.make_choice_tasks(findings)))
    if effort.from_jerk:
        for key, found in runner.run_tasks(planning.make_energy_tasks(findings)).items():
            findings.runs[key].extend(found)
    findings.runs.update(runner.run_tasks(planning.make_first_step_tasks(findings)))
    findings.runs.update(runner.run_tasks([*runs.make_track_tasks(findings), *tracking.make_tracking_tasks(findings)]))
    computations = [
        *runs.make_computations(findings),
        *planning.make_planning_computations(findings),
        *tracking.make_tracking_computations(findings),
    ]
    return replace(findings, others=runner.compute(computations, (runs, planning, stairs_instants)))


def _compute_values(findings: StairsFindings) -> dict[str, Any]:
    effort = findings.effort
    (end_rate,) = [variable for variable in GOVERNING_VARIABLES if variable.name == "end_rate_rad_s"]
    return {
        **{name: " | ".join(words.format(case) for case in effort.cases) for name, words in CASE_COLUMNS.items()},
        "evaporation": EVAPORATION,
        "usual_spread": AntColony().spread,
        "quantum_s": QUANTUM,
        "adam": runs.RULES["adam"][0],
        "end_rate": end_rate,
        **plan_claims.compute_planning_values(findings),
        **tracking.compute_tracking_values(findings),
        **plan_claims.compute_effects(findings),
    }


def _make_tables(findings: StairsFindings) -> dict[str, Rows]:
    return {
        "table3": _list_table_3(findings),
        "plans": [row for case in findings.cases for row in _list_plans(findings, case)],
        "table4": _list_table_4(findings),
        "tracks": [row for case in findings.cases for row in _list_tracks(findings, case)],
        **planning.make_planning_tables(findings),
        "other-stairs": _list_other_stairs(findings),
        "network": _list_network(findings.others["network"]),
        "printed-gains": [row[:4] for row in _list_results(findings, "printed")],
        "learned": _list_results(findings, "learned"),
        **tracking.make_tracking_tables(findings),
    }


def _list_results(findings: StairsFindings, name: str) -> Rows:
    return [[case, *findings.others[f"{name}-{case}"].values()] for case in findings.cases]


def _list_table_3(findings: StairsFindings) -> Rows:
    plans = {f"{what} {case}": findings.plan(case, what) for what in planning.PLANS for case in findings.cases}
    rows: list[Sequence[Value]] = []
    for variable in GOVERNING_VARIABLES:
        name, low, high = variable.name, variable.lower, variable.upper
        values = {key.replace("plan", "energy"): plan[name] for key, plan in plans.items()}
        at = [key for key, value in values.items() if min(abs(value - low), abs(value - high)) < MATCH * (high - low)]
        paper = f"{TABLE_3[name]:g}" if name in TABLE_3 else None
        rows.append([name, paper, *values.values(), f"{low:g} to {high:g}", ", ".join(at)])
    return rows


def _list_plans(findings: StairsFindings, case: int) -> Rows:
    rows: list[Sequence[Value]] = []
    for what, solver in product(planning.PLANS, (IPOPT, *ALGORITHMS)):
        found, verdict = findings.runs[f"{what}-{case}", solver], findings.best(what, case, solver).verdict
        every = ", ".join(f"{value:.2f}" for value in list_objectives(found))
        if solver == IPOPT:
            ends = list_objectives(run for run in found if run.claimed)
            hits = sum(value <= verdict.objective * (1 + MATCH) for value in ends)
            every = f"{hits} of {len(found)} starts, {len(ends)} converged"
        between = "feasible" if verdict.dense_feasible else ", ".join(verdict.violated[:1])
        quantity = f"{'jerk' if what == 'jerk' else 'energy'} [{planning.PLANS[what]}]"
        time_s = float(np.mean([run.time_s.solve for run in found]))
        rows.append([case, quantity, solver, verdict.objective, every, verdict.feasible, between, time_s])
    return rows


def _list_table_4(findings: StairsFindings) -> Rows:
    """The paper's quantities in each case, then ours on both plans: of the desired angles, and of the paper's search."""
    found: dict[str, list[float]] = {name: [] for name in PAPER.rows}
    for what in planning.PLANS:
        choice = tracking.FOLLOWED[what]
        for case in findings.cases:
            run = tracking.get_best(findings, case, choice)
            tracked = {name: tracking.read_index(run, index) for name, index in tracking.TABLE_4_ROWS.items()}
            for name, value in {**findings.others[f"differences-{what}-{case}"][runs.KINDS[0]], **tracked}.items():
                found[name].append(value)
    printed = {name: [float(getattr(TABLE_4[case], name)) for case in findings.cases] for name in PAPER.rows}
    return [[words, *printed[name], *found[name]] for name, words in PAPER.rows.items()]


def _list_tracks(findings: StairsFindings, case: int) -> Rows:
    rows: list[Sequence[Value]] = []
    for solver in findings.track_solvers:
        run = findings.best("track", case, solver)
        verdict, own = run.verdict, run.verdict.indexes
        others = [own["energy_J"], own["zmp_margin_min_m"], own["largest_error_rad"], *get_point(run)]
        rows.append([case, solver, verdict.objective, verdict.feasible, *others])
    return rows


def _list_other_stairs(findings: StairsFindings) -> Rows:
    rows: list[Sequence[Value]] = []
    for size in findings.effort.other_stairs:
        run = choose_best(findings.runs[runs.make_other_spec(findings.effort, *size).title, IPOPT])
        none = f"none; violated: {', '.join(run.verdict.violated[:3])}"
        rows.append([*size, f"{run.verdict.objective:.3f} J" if run.claimed else none])
    return rows


def _list_network(network: Mapping[str, Any]) -> Rows:
    return [
        [
            rule,
            f"{found['converged']} of {found['poses']}",
            float(np.mean(found["iterations"])),
            1e3 * found["time_s"][0],
            1e3 * float(np.mean(found["time_s"][1:])),
            found["largest_angle_error_rad"],
            found["mean_angle_error_rad"],
            found["bent_otherwise"],
        ]
        for rule, found in network.items()
    ]


REPRODUCTION = Reproduction(
    name="stairs",
    full=StairsEffort(),
    run=_run_stairs,
    values=_compute_values,
    tables=_make_tables,
    figures=draw_figures,
    checks=bind_checks("stairs/stairs_claims.toml", {**vars(plan_claims), **vars(tracking)}),
)
