"""The tracked step as printed and as ours: each choice by itself, and a search at every instant (Algorithm 4)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, get_args

from compare.papers.claims import Check, Verdict, compare_levels, decide, require_change
from compare.papers.paper_runs import choose_best, get_point, make_computation, make_search_tasks
from compare.papers.stairs.stairs_choices import CHOICES, INSTANTS, OURS, PRINTED
from compare.papers.stairs.stairs_instants import Decides, Instants, track_by_instants
from compare.papers.stairs.stairs_paper import TABLE_4
from compare.papers.stairs.stairs_runs import ALGORITHMS, StairsFindings, make_track_spec
from compare.report.document import Rows, Value
from compare.study.record import RunRecord
from compare.study.store import Computation
from compare.study.task import ProblemSpec, Task
from nlp_gait.gaits.stairs.closed_loop import QUANTUM, ClosedLoop

ACO = "aco"  # the paper's search
BEST_CASE = 2  # of the paper
FOLLOWED_RAD = 0.1
# Rows of Table IV that a rollout has, and those in which case 2 is called best: name in the table, and in our results.
TABLE_4_ROWS = {
    "torso_pitch_rad": "torso_pitch_rad",
    "kp": "kp",
    "kd": "kd",
    "cost": "controller_cost",
    "peak_torque_Nm": "peak_torque_Nm",
}
LEAST_ROWS = {"cost": "controller_cost", "energy": "energy_J", "peak_torque_Nm": "peak_torque_Nm"}
EFFECTS = {  # of a choice: indexes of the best step, and their texts
    "controller_cost": "mean of (53) {}",
    "energy_J": "energy {} J",
    "peak_torque_Nm": "peak torque {} Nm",
    "zmp_margin_min_m": "ZMP margin {} m",
    "largest_error_rad": "largest error {} rad",
}


def make_choice_spec(findings: StairsFindings, case: int, name: str) -> ProblemSpec:
    """Return the tracked step of a case, as read by a choice."""
    choice = CHOICES[name]
    spec = make_track_spec(case, findings.plan(case, choice.plan))
    values = {**spec.values, **choice.values}
    return replace(spec, options=choice.options, values=values, label=f"track-{case}-{name}")


def make_tracking_tasks(findings: StairsFindings) -> Iterator[Task]:
    """Yield the paper's search for gains and torso pitch under every choice."""
    effort = findings.effort
    for case in effort.cases:
        for name in effort.choices:
            spec = make_choice_spec(findings, case, name)
            yield from make_search_tasks(spec, ACO, ALGORITHMS[ACO], effort.runs, effort.track_evaluations)


def make_tracking_computations(findings: StairsFindings) -> Iterator[Computation]:
    """Yield Algorithm 4 in each case, which decides gains or torques."""
    effort = findings.effort
    for case in effort.cases:
        for name, decides in INSTANTS:
            spec, plan = make_choice_spec(findings, case, name), findings.plan(case, CHOICES[name].plan)
            arguments = {
                "torso_rad": plan["torso_pitch_rad"],
                "decides": decides,
                "evaluations": effort.instant_evaluations,
            }
            title = f"instants-{name}-{decides}-{case}"
            yield make_computation(title, spec, partial(run_algorithm_4, spec), **arguments)


def run_algorithm_4(spec: ProblemSpec, torso_rad: float, decides: Decides, evaluations: int) -> dict[str, Any]:
    """Track a step by a search at every instant."""
    options = {name: spec.options[name] for name in ("base", "coordinates", "rates") if name in spec.options}
    problem = spec.load()
    quanta = round(problem.value("t3_s") / QUANTUM)
    loop = ClosedLoop(quanta=quanta, scheme="implicit", gains=1, **options)  # type: ignore[arg-type]
    instants = Instants(problem=problem, loop=loop, torso_rad=torso_rad, decides=decides)
    return track_by_instants(instants, ALGORITHMS[ACO], evaluations)


def get_best(findings: StairsFindings, case: int, name: str) -> RunRecord:
    """Return the best run of a choice in a case."""
    return choose_best(findings.runs[f"track-{case}-{name}", ACO])


def make_tracking_tables(findings: StairsFindings) -> dict[str, Rows]:
    """Return rows by name."""
    return {
        "choices": [_list_choice(findings, case, name) for case in findings.cases for name in findings.effort.choices],
        "instants": [_list_instants(findings, case, *how) for case in findings.cases for how in INSTANTS],
    }


def _list_choice(findings: StairsFindings, case: int, name: str) -> list[Value]:
    run = get_best(findings, case, name)
    verdict, own = run.verdict, run.verdict.indexes
    numbers = [own["controller_cost"], own["energy_J"], own["peak_torque_Nm"], 1e3 * own["zmp_margin_min_m"]]
    return [case, CHOICES[name].text, verdict.feasible, *numbers, own["largest_error_rad"], *get_point(run)]


def _list_instants(findings: StairsFindings, case: int, name: str, decides: Decides) -> list[Value]:
    found = findings.others[f"instants-{name}-{decides}-{case}"]
    constants = get_best(findings, case, name).verdict.indexes["controller_cost"]
    what = [case, CHOICES[name].text, decides, found["quanta"] * QUANTUM, found["cost"], constants]
    medians = [f"{low:.3g} to {high:.3g}" for low, _, high in found["decided"]] if decides == "gains" else [""] * 3
    return [*what, found["energy_J"], found["largest_error_rad"], found["outside_quanta"], *medians]


def compute_tracking_values(findings: StairsFindings) -> dict[str, Any]:
    """Return the effect of each choice, as text, for the table of differences."""
    return {"effect": {name: _describe_effect(findings, name) for name in CHOICES}}


def _describe_effect(findings: StairsFindings, name: str) -> str:
    if name not in findings.effort.choices:
        return "not computed"
    parts = []
    for index, text in EFFECTS.items():
        values = [[_read(get_best(findings, case, which), index) for case in findings.cases] for which in (name, OURS)]
        parts.append(text.format(" instead of ".join(map(_join, values))))
    feasible = sum(get_best(findings, case, name).verdict.feasible for case in findings.cases)
    cases = " / ".join(map(str, findings.cases))
    return f"case {cases}: {', '.join(parts)}; {feasible} of {len(findings.cases)} feasible"


def _read(run: RunRecord, index: str) -> float:
    return run.x[index] if index in run.x else run.verdict.indexes[index]


Checker = Callable[[StairsFindings], Check]


def _compare_with_table_4(quantity: str, index: str, name: str) -> Checker:
    """Return the check that a quantity of Table IV is ours, under a choice."""

    def check(findings: StairsFindings) -> Check:
        ours = [_read(get_best(findings, case, name), index) for case in findings.cases]
        return compare_levels(
            [float(getattr(TABLE_4[case], quantity)) for case in findings.cases], ours, found=_join(ours)
        )

    return check


def _require_least_in_case_2(index: str, name: str) -> Checker:
    """Return the check that case 2 has the least of a quantity, under a choice."""

    def check(findings: StairsFindings) -> Check:
        ours = {case: _read(get_best(findings, case, name), index) for case in findings.cases}
        others = [value for case, value in ours.items() if case != BEST_CASE]
        if not others:
            return decide(Verdict.NOT_SHOWN, found=_join(ours.values()))
        return require_change(100 * (min(others) / ours[BEST_CASE] - 1), found=_join(ours.values()))

    return check


def _limit(index: str, sign: float, limit: float, name: str) -> Checker:
    """Return the check that sign times a quantity is at most a limit in all cases, under a choice."""

    def check(findings: StairsFindings) -> Check:
        ours = [_read(get_best(findings, case, name), index) for case in findings.cases]
        return decide(all(sign * value <= limit for value in ours), found=_join(ours), limit=limit)

    return check


def _compare_with_constants(name: str, decides: Decides) -> Checker:
    """Return the check that Algorithm 4 costs no more than the best constants, under a choice."""

    def check(findings: StairsFindings) -> Check:
        found = [findings.others[f"instants-{name}-{decides}-{case}"] for case in findings.cases]
        constants = [_read(get_best(findings, case, name), "controller_cost") for case in findings.cases]
        costs, duration = [part["cost"] for part in found], [part["quanta"] * QUANTUM for part in found]
        holds = all(part["finite"] for part in found) and all(
            cost <= best for cost, best in zip(costs, constants, strict=True)
        )
        return decide(holds, found=_join(costs), constants=_join(constants), until=_join(duration))

    return check


def _join(values: Iterable[float]) -> str:
    return " / ".join(f"{value:.4g}" for value in values)


def _make_checks() -> Iterator[tuple[str, Checker]]:
    for name in (OURS, PRINTED):
        for quantity, index in TABLE_4_ROWS.items():
            yield f"track-{quantity}-{name}", _compare_with_table_4(quantity, index, name)
        for quantity, index in LEAST_ROWS.items():
            yield f"least-{quantity}-{name}", _require_least_in_case_2(index, name)
        yield f"balance-{name}", _limit("zmp_margin_min_m", -1.0, 0.0, name)
        yield f"follow-{name}", _limit("largest_error_rad", 1.0, FOLLOWED_RAD, name)
        for decides in get_args(Decides):
            yield f"instants-{decides}-{name}", _compare_with_constants(name, decides)


TRACKING_CHECKS = dict(_make_checks())
