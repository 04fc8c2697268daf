"""The tracked step as printed and as ours: each choice by itself, and a search at every instant (Algorithm 4)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, get_args

import numpy as np

from compare.papers.claims import (
    Check,
    Verdict,
    compare_readings,
    decide,
    require_change,
    require_feasible,
)
from compare.papers.paper_runs import (
    choose_best,
    get_point,
    list_infeasible,
    make_computation,
    make_search_tasks,
)
from compare.papers.stairs.stairs_choices import CHOICES, OURS, PRINTED
from compare.papers.stairs.stairs_instants import Decides, Instants, track_by_instants
from compare.papers.stairs.stairs_paper import ANTS, ITERATIONS, TABLE_3, TABLE_4
from compare.papers.stairs.stairs_runs import ALGORITHMS, StairsFindings, make_track_spec
from compare.report.document import Rows, Value
from compare.study.record import RunRecord
from compare.study.store import Computation
from compare.study.task import ProblemSpec, Task
from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.bodies import rigid_bodies
from nlp_gait.gaits.stairs.closed_loop import QUANTUM, ClosedLoop
from nlp_gait.gaits.stairs.planar_biped import LINKS

ACO = "aco"  # the paper's search
FOLLOWED_RAD = 0.1
READINGS = (OURS, "jerk", PRINTED, "printed-b10000")  # that claims compare
UNLIMITED = ("unlimited", "jerk-unlimited", PRINTED, "printed-b10000")  # whose searches do not limit the errors
# Rows of Table IV that a rollout has: name in the table, and in our results; and those in which case 2 is called best.
TABLE_4_ROWS = {
    "torso_pitch_rad": "torso_pitch_rad",
    "kp": "kp",
    "kd": "kd",
    "cost": "controller_cost",
    "energy": "energy_J",
    "peak_torque_Nm": "peak_torque_Nm",
}
LEAST_ROWS = ("cost", "energy", "peak_torque_Nm")
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
        for name, decides in effort.instant_searches:
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
        "instants": [
            _list_instants(findings, case, *how) for case in findings.cases for how in findings.effort.instant_searches
        ],
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
    """Return the effects of each choice and of Algorithm 4, as text, for the table of differences."""
    instants = {decides: _describe_instants(findings, decides)[0] for decides in get_args(Decides)}
    return {"effect": {name: _describe_effect(findings, name) for name in CHOICES}, "instants": instants}


def _describe_effect(findings: StairsFindings, name: str) -> str:
    if name not in findings.effort.choices:
        return "not computed"
    parts = []
    for index, text in EFFECTS.items():
        values = [
            _join(read_index(get_best(findings, case, which), index) for case in findings.cases)
            for which in (name, OURS)
        ]
        if values[0] != values[1]:
            parts.append(text.format(" instead of ".join(values)))
    feasible = sum(get_best(findings, case, name).verdict.feasible for case in findings.cases)
    cases = " / ".join(map(str, findings.cases))
    return f"case {cases}: {', '.join(parts) or 'no change'}; {feasible} of {len(findings.cases)} feasible"


def read_index(run: RunRecord, index: str) -> float:
    """Return a tuned value or an index of a tracked step."""
    return run.x[index] if index in run.x else run.verdict.indexes[index]


Checker = Callable[[StairsFindings], Check]


def _describe(values: Mapping[str, Iterable[float]]) -> str:
    return "; ".join(f"{CHOICES[name].text}: {_join(row)}" for name, row in values.items())


def _collect(findings: StairsFindings, index: str, names: Iterable[str] = READINGS) -> dict[str, list[float]]:
    """Return a quantity in all cases under those of the named choices that were run."""
    run = [name for name in names if name in findings.effort.choices]
    return {name: [read_index(get_best(findings, case, name), index) for case in findings.cases] for name in run}


def _require_steps(findings: StairsFindings, check: Check, names: Iterable[str]) -> Check:
    runs = (get_best(findings, case, name) for name in names for case in findings.cases)
    return require_feasible(check, list_infeasible(runs))


def _show(index: str) -> Checker:
    """Return the check of a value of Table IV that depends on what the paper does not give."""
    return lambda findings: decide(Verdict.UNTESTABLE, readings=_describe(_collect(findings, index)))


def _compare_cases(quantity: str, compare: Callable[[Array, Array], Check]) -> Checker:
    """Return the check of a quantity of Table IV in cases 1 and 3 divided by that in case 2."""

    def check(findings: StairsFindings) -> Check:
        ours = _collect(findings, TABLE_4_ROWS[quantity])
        texts = {"readings": _describe(ours), "ratios": "one case only"}
        if len(findings.cases) < len(TABLE_4):
            return decide(Verdict.NOT_SHOWN, **texts)
        printed = [float(getattr(row, quantity)) for row in TABLE_4.values()]
        theirs, *ratios = (np.array(row)[[0, 2]] / row[1] for row in (printed, *ours.values()))
        texts["ratios"] = _describe(dict(zip(ours, ratios, strict=True)))
        return _require_steps(findings, replace(compare(theirs, np.array(ratios)), values=texts), ours)

    return check


def _check_balance(findings: StairsFindings) -> Check:
    ours = _collect(findings, "zmp_margin_min_m", (*READINGS, "penalty"))
    held = decide(all(min(row) >= 0 for row in ours.values()), readings=_describe(ours))
    return _require_steps(findings, held, ours)


def _check_following(findings: StairsFindings) -> Check:
    ours, limited = (_collect(findings, "largest_error_rad", names) for names in (UNLIMITED, [OURS]))
    held = [max(errors) <= FOLLOWED_RAD for errors in ours.values()]
    texts = {"readings": _describe(ours), "limited": _join(limited[OURS]), "limit": FOLLOWED_RAD}
    return decide(held, **texts)


def _collect_printed(findings: StairsFindings, name: str) -> list[float]:
    """Return a result of the printed gains in all cases."""
    return [findings.others[f"printed-{case}"][name] for case in findings.cases]


def _check_printed_gains(findings: StairsFindings) -> Check:
    names = ("implicit", "compensated", "hip")
    errors = {name: _collect_printed(findings, f"{name}_largest_error_rad") for name in names}
    held = [max(row) <= FOLLOWED_RAD for row in errors.values()]
    needed = _join(row.peak_torque_Nm / row.kp for row in TABLE_4.values())
    texts = {name: _join(row) for name, row in errors.items()}
    return decide(held, **texts, limit=FOLLOWED_RAD, needed=needed)


def _get_instants(findings: StairsFindings, decides: Decides) -> dict[str, list[dict[str, Any]]]:
    """Return what Algorithm 4 finds in all cases, by reading."""
    others, cases = findings.others, findings.cases
    return {name: [others[f"instants-{name}-{decides}-{case}"] for case in cases] for name in findings.effort.instants}


def _describe_instants(findings: StairsFindings, decides: Decides) -> list[str]:
    texts = []
    for name, parts in _get_instants(findings, decides).items():
        until, outside, cost = ([part[key] for part in parts] for key in ("quanta", "outside_quanta", "cost"))
        constants = _join(_collect(findings, "controller_cost", [name])[name])
        texts.append(
            f"{CHOICES[name].text}: {_join(until)} quanta, ZMP outside in {_join(outside)}, mean of (53) {_join(cost)}, with "
            f"constants {constants}"
        )
    return texts


def _check_instants(decides: Decides) -> Checker:
    """Return the check that Algorithm 4 finishes the step with the ZMP in the polygon."""

    def check(findings: StairsFindings) -> Check:
        found, evaluations = _get_instants(findings, decides), findings.effort.instant_evaluations
        held = [all(part["finite"] and not part["outside_quanta"] for part in parts) for parts in found.values()]
        limits = _join(sorted({joint.torque_limit_Nm for joint in rigid_bodies().joints.values()}))
        texts = {
            "found": "; ".join(_describe_instants(findings, decides)),
            "evaluations": evaluations,
            "limits": limits,
        }
        enough = evaluations >= ANTS * ITERATIONS or all(held)
        return decide(held if enough else Verdict.NOT_SHOWN, **texts)

    return check


def _check_online(findings: StairsFindings) -> Check:
    parts, evaluations = _get_instants(findings, "gains")[OURS], findings.effort.instant_evaluations
    times = np.array([1e3 * part["time_s"] / part["quanta"] for part in parts])
    scaled = times * ANTS * ITERATIONS / evaluations
    values = {"evaluations": evaluations, "found": _join(times), "scaled": _join(scaled)}
    return decide(bool(max(scaled) <= 1e3 * QUANTUM), **values)


def _check_cost_against_energy(_: StairsFindings) -> Check:
    """(53) contains the power, so that its mean is at least the mean power."""
    cost, energy, torque = np.array([[row.cost, row.energy, row.peak_torque_Nm] for row in TABLE_4.values()]).T
    power = energy / TABLE_3["t3_s"]  # of an energy in J
    rates, least = power / torque / len(LINKS), power * QUANTUM  # the latter of a sum over quanta
    return decide(bool((cost >= least).all()), power=_join(power), least=_join(least), rates=_join(rates))


def _check_torso(index: str, sign: float) -> Checker:
    """Return the check that the tuned torso pitch improves a quantity from that of an upright one with the same gains [%]."""

    def check(findings: StairsFindings) -> Check:
        best = [findings.best_track(case) for case in findings.cases]
        tuned, upright = [run.verdict.indexes[index] for run in best], _collect_printed(findings, f"upright_{index}")
        changes = 100 * sign * (np.array(tuned) - upright) / np.abs(upright)
        torso = _join(run.x["torso_pitch_rad"] for run in best)
        return require_change(changes, torso=torso, tuned=_join(tuned), upright=_join(upright))

    return check


def _join(values: Iterable[float]) -> str:
    return " / ".join(f"{value:.4g}" for value in values)


TRACKING_CHECKS: dict[str, Checker] = {
    **{f"track-{quantity}": _show(index) for quantity, index in TABLE_4_ROWS.items()},
    "cost-energy": _check_cost_against_energy,
    **{f"least-{name}": _compare_cases(name, lambda _, ours: require_change(100 * (ours - 1))) for name in LEAST_ROWS},
    **{f"ratios-{name}": _compare_cases(name, compare_readings) for name in LEAST_ROWS},
    "balance": _check_balance,
    "follow": _check_following,
    "printed-gains": _check_printed_gains,
    "torso-margin": _check_torso("zmp_margin_min_m", 1.0),
    "torso-energy": _check_torso("energy_J", -1.0),
    "online": _check_online,
    **{f"instants-{decides}": _check_instants(decides) for decides in get_args(Decides)},
}
