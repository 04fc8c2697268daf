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
    unite_readings,
)
from compare.papers.paper_runs import (
    choose_best,
    get_point,
    list_infeasible,
    make_computation,
    make_search_tasks,
)
from compare.papers.stairs.stairs_choices import CHOICES, INSTANTS, OURS, PRINTED
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


def _describe(values: Mapping[str, Iterable[float]]) -> str:
    return "; ".join(f"{CHOICES[name].text}: {_join(row)}" for name, row in values.items())


def _collect(findings: StairsFindings, index: str, names: Iterable[str] = READINGS) -> dict[str, list[float]]:
    """Return a quantity in all cases under those of the named choices that were run."""
    run = [name for name in names if name in findings.effort.choices]
    return {name: [_read(get_best(findings, case, name), index) for case in findings.cases] for name in run}


def _find_infeasible(findings: StairsFindings, names: Iterable[str]) -> list[str]:
    """Return for each choice and case without a feasible step the constraint that its best one violates most."""
    return list_infeasible(
        {
            f"{CHOICES[name].text}, case {case}": get_best(findings, case, name)
            for name in names
            for case in findings.cases
        }
    )


def _show(index: str) -> Checker:
    """Return the check of a value of Table IV that depends on what the paper does not give."""
    return lambda findings: decide(Verdict.UNTESTABLE, found=_describe(_collect(findings, index)))


def _compare_cases(quantity: str, index: str, compare: Callable[[Array, Array], Check]) -> Checker:
    """Return the check of a quantity of Table IV in the others of all cases divided by that in case 2."""

    def check(findings: StairsFindings) -> Check:
        ours = _collect(findings, index)
        found = _describe(ours)
        if len(findings.cases) < len(TABLE_4):
            return decide(Verdict.NOT_SHOWN, found=found, ratios=f"case {_join(findings.cases)} only")
        printed = [[float(getattr(row, quantity)) for row in TABLE_4.values()]]
        theirs, rows = (np.array(part)[:, [0, 2]] / np.array(part)[:, [1]] for part in (printed, list(ours.values())))
        ratios = _describe(dict(zip(ours, rows, strict=True)))
        check = replace(compare(theirs[0], rows), values={"found": found, "ratios": ratios})
        return require_feasible(check, _find_infeasible(findings, ours))

    return check


def _check_balance(findings: StairsFindings) -> Check:
    ours = _collect(findings, "zmp_margin_min_m", (*READINGS, "penalty"))
    held = decide(all(min(row) >= 0 for row in ours.values()), found=_describe(ours))
    return require_feasible(held, _find_infeasible(findings, ours))


def _check_following(findings: StairsFindings) -> Check:
    ours = _collect(findings, "largest_error_rad", UNLIMITED)
    errors = np.array(list(ours.values()))
    check = Check(lambda _: unite_readings((errors <= FOLLOWED_RAD).all(axis=1)), {})
    limited = _collect(findings, "largest_error_rad", [OURS])
    return replace(check, values={"found": _describe(ours), "ours": _describe(limited), "limit": FOLLOWED_RAD})


def _check_printed_gains(findings: StairsFindings) -> Check:
    """The printed gains and torso pitch, under several readings."""
    found = {case: findings.others[f"printed-{case}"] for case in findings.cases}
    names = ("implicit", "compensated", "hip")
    errors = [[part[f"{name}_largest_error_rad"] for part in found.values()] for name in names]
    texts = dict(zip(names, map(_join, errors), strict=True))
    needed = _join(row.peak_torque_Nm / row.kp for row in TABLE_4.values())
    held = (np.array(errors) <= FOLLOWED_RAD).all(axis=1)
    return Check(lambda _: unite_readings(held), {**texts, "limit": FOLLOWED_RAD, "needed": needed})


def _check_instants(decides: Decides) -> Checker:
    """Return the check that Algorithm 4 finishes the step with the ZMP in the polygon."""

    def check(findings: StairsFindings) -> Check:
        found = {
            name: [findings.others[f"instants-{name}-{decides}-{case}"] for case in findings.cases]
            for name, how in INSTANTS
            if how == decides
        }
        texts = "; ".join(
            f"{CHOICES[name].text}: until {_join(part['quanta'] * QUANTUM for part in parts)} s, outside in "
            f"{_join(part['outside_quanta'] for part in parts)} quanta, cost {_join(part['cost'] for part in parts)}, with "
            f"constants {_join(_read(get_best(findings, case, name), 'controller_cost') for case in findings.cases)}"
            for name, parts in found.items()
        )
        count = findings.effort.instant_evaluations
        limits = _join(sorted({joint.torque_limit_Nm for joint in rigid_bodies().joints.values()}))
        values = {"found": texts, "evaluations": count, "limits": limits}
        held = [all(part["finite"] and not part["outside_quanta"] for part in parts) for parts in found.values()]
        if count < ANTS * ITERATIONS and not all(held):
            return decide(Verdict.NOT_SHOWN, **values)
        return Check(lambda _: unite_readings(held), values)

    return check


def _check_online(findings: StairsFindings) -> Check:
    count = findings.effort.instant_evaluations
    found = [findings.others[f"instants-{OURS}-gains-{case}"] for case in findings.cases]
    times = [part["time_s"] / part["quanta"] for part in found]
    scaled = [time * ANTS * ITERATIONS / count for time in times]
    texts = {name: _join(1e3 * time for time in part) for name, part in (("found", times), ("scaled", scaled))}
    return decide(max(scaled) <= QUANTUM, evaluations=count, **texts)


def _check_cost_against_energy(_: StairsFindings) -> Check:
    """(53) contains the power, so that its mean is at least the mean power."""
    rows, duration = TABLE_4.values(), TABLE_3["t3_s"]
    power = [row.energy / duration for row in rows]  # of an energy in J
    least = [row.energy / (duration / QUANTUM) for row in rows]  # of one that is a sum over quanta
    rates = [watt / row.peak_torque_Nm / len(LINKS) for watt, row in zip(power, rows, strict=True)]
    holds = all(row.cost >= watt for watt, row in zip(least, rows, strict=True))
    return decide(holds, power=_join(power), least=_join(least), rates=_join(rates))


def _check_torso(findings: StairsFindings) -> Check:
    """The tuned torso pitch against an upright one, with the same gains."""
    tuned = [findings.best_track(case).verdict.indexes for case in findings.cases]
    upright = [findings.others[f"printed-{case}"] for case in findings.cases]
    margins = [
        [1e3 * own["zmp_margin_min_m"] for own in tuned],
        [1e3 * other["upright_zmp_margin_min_m"] for other in upright],
    ]
    energies = [[own["energy_J"] for own in tuned], [other["upright_energy_J"] for other in upright]]
    gains = [100 * (other / own - 1) for own, other in zip(*energies, strict=True)]
    wider = [own - other for own, other in zip(*margins, strict=True)]
    texts = {
        "margins": " against ".join(map(_join, margins)),
        "energies": " against ".join(map(_join, energies)),
        "torso": _join(findings.best_track(case).x["torso_pitch_rad"] for case in findings.cases),
    }
    return require_change([*gains, *wider], **texts)


def _join(values: Iterable[float]) -> str:
    return " / ".join(f"{value:.4g}" for value in values)


TRACKING_CHECKS: dict[str, Checker] = {
    **{f"track-{quantity}": _show(index) for quantity, index in TABLE_4_ROWS.items()},
    "cost-energy": _check_cost_against_energy,
    **{
        f"least-{quantity}": _compare_cases(
            quantity, TABLE_4_ROWS[quantity], lambda _, ours: require_change(100 * (ours - 1))
        )
        for quantity in LEAST_ROWS
    },
    **{
        f"ratios-{quantity}": _compare_cases(quantity, TABLE_4_ROWS[quantity], compare_readings)
        for quantity in LEAST_ROWS
    },
    "balance": _check_balance,
    "follow": _check_following,
    "printed-gains": _check_printed_gains,
    "torso": _check_torso,
    "online": _check_online,
    **{f"instants-{decides}": _check_instants(decides) for decides in get_args(Decides)},
}
