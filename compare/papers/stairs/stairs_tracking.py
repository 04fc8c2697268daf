"""The tracked step as printed and as ours: each choice by itself, and a search at every instant (Algorithm 4)."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, get_args

import numpy as np

from compare.judge import evaluate
from compare.papers.claims import Check, ClaimVerdict, Series, decide, require_change, require_feasible
from compare.papers.paper_runs import choose_best, get_point, list_infeasible, make_computation, make_search_tasks
from compare.papers.stairs import stairs_runs
from compare.papers.stairs.stairs_instants import Decides, Quanta, track_by_instants
from compare.papers.stairs.stairs_paper import ANTS, CHOICES, ITERATIONS, OURS, PAPER, PRINTED, TABLE_3, TABLE_4
from compare.papers.stairs.stairs_runs import ACO, ALGORITHMS, POWERLESS, StairsFindings, make_track_spec
from compare.report.document import Rows, Value
from compare.study.record import RunRecord
from compare.study.store import Computation
from compare.study.task import ProblemSpec, Task
from nlp_gait.gaits.stairs.closed_loop import QUANTUM, ClosedLoop
from nlp_gait.gaits.stairs.display import make_rigid_bodies
from nlp_gait.gaits.stairs.planar_biped import LINKS

FOLLOWED_RAD = 0.1
READINGS = (OURS, "jerk", PRINTED)  # that claims compare
NEXT = tuple(name for name in CHOICES if name != "first")  # readings of the next step
UNLIMITED = ("unlimited", "jerk-unlimited", PRINTED)  # whose searches do not limit the errors
# Quantities of Table IV whose least values the paper tells, and ours.
LEAST_ROWS = {"cost": "controller_cost", "energy": "energy_J", "peak_torque_Nm": "peak_torque_Nm"}
TABLE_4_ROWS = {"torso_pitch_rad": "torso_pitch_rad", "kp": "kp", "kd": "kd", **LEAST_ROWS}  # that a rollout has
READ: Mapping[str, Sequence[str]] = {  # what claims tell of readings
    **dict.fromkeys(TABLE_4_ROWS.values(), READINGS),
    "zmp_margin_min_m": READINGS,
    "largest_error_rad": (*UNLIMITED, OURS),
}
PRINTED_GAINS = ("implicit", "compensated", "printed")  # ways to follow our plans with them
FOLLOWED = {"plan": OURS, "jerk": "jerk"}  # reading of the tracked step that follows a plan


def make_choice_spec(findings: StairsFindings, case: int, name: str) -> ProblemSpec:
    """Return the tracked step of a case, as read by a choice."""
    choice = CHOICES[name]
    spec = make_track_spec(case, findings.plan(case, choice.plan))
    values, label = {**spec.values, **choice.values}, f"track-{case}-{name}"
    return replace(spec, options=choice.options, values=values, label=label)


def make_tracking_tasks(findings: StairsFindings) -> Iterator[Task]:
    """Yield the paper's search for gains and torso pitch under every choice."""
    effort = findings.effort
    for case in effort.cases:
        for name in effort.choices:
            spec = make_choice_spec(findings, case, name)
            yield from make_search_tasks(spec, {ACO: ALGORITHMS[ACO]}, effort.runs, effort.track_evaluations)


def make_tracking_computations(findings: StairsFindings) -> Iterator[Computation]:
    """Yield in each case gains without the power, and Algorithm 4, which decides gains or torques."""
    effort = findings.effort
    for case in effort.cases:
        for name in POWERLESS:
            spec = make_choice_spec(findings, case, name)
            function = partial(stairs_runs.track_without_power, spec)
            yield make_computation(f"powerless-{name}-{case}", spec, function, evaluations=effort.track_evaluations)
        for name, decides in effort.instant_searches:
            spec, plan = make_choice_spec(findings, case, name), findings.plan(case, CHOICES[name].plan)
            title = f"instants-{name}-{decides}-{case}"
            function = partial(_run_algorithm_4, spec)
            settings = {"torso_rad": plan["torso_pitch_rad"], "evaluations": effort.instant_evaluations}
            yield make_computation(title, spec, function, decides=decides, **settings)


def _run_algorithm_4(spec: ProblemSpec, torso_rad: float, decides: Decides, evaluations: int) -> dict[str, Any]:
    options = {name: spec.options[name] for name in ("coordinates", "rates") if name in spec.options}
    problem = spec.load()
    quanta = round(problem.value("t3_s") / QUANTUM)
    loop = ClosedLoop(quanta=quanta, **options)  # type: ignore[arg-type]
    instants = Quanta(problem=problem, loop=loop, torso_rad=torso_rad, decides=decides)
    return track_by_instants(instants, ALGORITHMS[ACO], evaluations)


def get_best(findings: StairsFindings, case: int, name: str) -> RunRecord:
    """Return the best run of a choice in a case, or of one with the same objective that it contains."""
    names = (name, *(other for other in CHOICES[name].contains if other in findings.effort.choices))
    return choose_best(run for one in names for run in findings.runs[f"track-{case}-{one}", ACO])


def measure_spread(findings: StairsFindings, name: str) -> float:
    """Return by how much the objectives of a reading's own runs are above its best one, at most over all cases [%]."""
    return max(
        100 * (run.verdict.objective / get_best(findings, case, name).verdict.objective - 1)
        for case in findings.cases
        for run in findings.runs[f"track-{case}-{name}", ACO]
    )


def make_tracking_tables(findings: StairsFindings) -> dict[str, Rows]:
    """Return rows by name."""
    cases, choices, searches = findings.cases, findings.effort.choices, findings.effort.instant_searches
    return {
        "choices": [_list_choice(findings, case, name) for case in cases for name in choices],
        "instants": [_list_instants(findings, case, *how) for case in cases for how in searches],
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
    medians = [f"{low:.3g} to {high:.3g}" for low, high in found["decided"]] if decides == "gains" else [""] * 3
    return [*what, found["energy_J"], found["largest_error_rad"], found["outside_quanta"], *medians]


def compute_tracking_values(findings: StairsFindings) -> dict[str, Any]:
    """Return numbers of tracked steps, and the effects of choices, for claims and differences."""
    return {
        "effect": {name: _describe_effect(findings, name) for name in CHOICES},
        "jerk_effect": _describe_effect(findings, "jerk-unlimited", "jerk"),
        "instants": {decides: _describe_instants(findings, decides) for decides in get_args(Decides)},
        "reading": {index: _describe(_collect(findings, index, names)) for index, names in READ.items()},
        "gains": {name: findings.collect("printed", name) for name in findings.others[f"printed-{findings.cases[0]}"]},
        "over": {index: _describe_range(findings, index) for index in LEAST_ROWS.values()},
        "instant_ms": _describe_instant_times(findings),
        "powerless": _describe({name: findings.collect(f"powerless-{name}", "energy_J") for name in POWERLESS}),
        "torque_limits": Series(sorted({joint.torque_limit_Nm for joint in make_rigid_bodies().joints.values()})),
    }


def _describe_effect(findings: StairsFindings, name: str, base: str = OURS) -> str:
    if name not in findings.effort.choices:
        return "not computed"
    parts = []
    for index, text in PAPER.effects.items():
        values = [f"{row}" for row in _collect(findings, index, (name, base)).values()]
        if values[0] != values[-1]:
            parts.append(text.format(" instead of ".join(values)))
    feasible = sum(get_best(findings, case, name).verdict.feasible for case in findings.cases)
    what = ", ".join(parts) or "no change"
    return f"case {Series(findings.cases)}: {what}; {feasible} of {len(findings.cases)} feasible"


def read_index(run: RunRecord, index: str) -> float:
    """Return a tuned value or an index of a tracked step."""
    return run.x[index] if index in run.x else run.verdict.indexes[index]


def _describe(values: Mapping[str, Series]) -> str:
    return "; ".join(f"{CHOICES[name].text}: {row}" for name, row in values.items())


def _collect(findings: StairsFindings, index: str, names: Iterable[str] = READINGS) -> dict[str, Series]:
    run = [name for name in names if name in findings.effort.choices]
    return {name: Series(read_index(get_best(findings, case, name), index) for case in findings.cases) for name in run}


def _describe_range(findings: StairsFindings, index: str) -> str:
    """Return the ratios of cases 1 and 3 to case 2 over all readings of the next step."""
    rows = np.array([*_collect(findings, index, NEXT).values()])
    if rows.shape[1] < len(TABLE_4):
        return f"{len(rows)} readings, one case"
    low, high = (Series(end(rows[:, [0, 2]] / rows[:, [1]], axis=0)) for end in (np.min, np.max))
    return f"{len(rows)} readings: cases 1 / 3 by case 2 at least {low}, at most {high}"


def _require_steps(findings: StairsFindings, check: Check, names: Iterable[str]) -> Check:
    runs = (get_best(findings, case, name) for name in names for case in findings.cases)
    return require_feasible(check, list_infeasible(runs))


def _check_ratios(findings: StairsFindings, quantity: str, least: bool = False) -> Check:
    """Check a quantity of Table IV in cases 1 and 3 divided by that in case 2.

    It shows them, or says whether case 2 has the least value, by more than the runs of a reading differ [%].
    """
    ours = _collect(findings, LEAST_ROWS[quantity], NEXT)
    if len(findings.cases) < len(TABLE_4):
        return decide(ClaimVerdict.NOT_SHOWN, ratios="one case only")
    ratios = [np.array(row)[[0, 2]] / row[1] for row in ours.values()]
    shown = dict(zip(ours, map(Series, ratios), strict=True))
    texts = _describe({name: row for name, row in shown.items() if name in READINGS})
    spreads = np.array([[measure_spread(findings, name)] for name in ours])
    leads = 100 * (np.array(ratios) - 1) - spreads
    check = require_change(leads, ratios=texts) if least else decide(ClaimVerdict.UNTESTABLE, ratios=texts)
    return _require_steps(findings, check, ours)


def _check_balance(findings: StairsFindings) -> Check:
    ours = _collect(findings, "zmp_margin_min_m", READ["zmp_margin_min_m"])
    held = [min(row) >= 0 for row in ours.values()]
    held += [not any(part["outside_quanta"] for part in parts) for parts in _get_instants(findings, "gains").values()]
    held += [min(findings.collect("printed", f"{name}_zmp_margin_min_m")) >= 0 for name in PRINTED_GAINS]
    return _require_steps(findings, decide(held), ours)


def _check_following(findings: StairsFindings) -> Check:
    errors = _collect(findings, "largest_error_rad", UNLIMITED)
    return decide([max(row) <= FOLLOWED_RAD for row in errors.values()], limit=FOLLOWED_RAD)


def _get_instants(findings: StairsFindings, decides: Decides) -> dict[str, list[dict[str, Any]]]:
    others, cases = findings.others, findings.cases
    return {name: [others[f"instants-{name}-{decides}-{case}"] for case in cases] for name in findings.effort.instants}


def _describe_instants(findings: StairsFindings, decides: Decides) -> str:
    texts = []
    for name, parts in _get_instants(findings, decides).items():
        until, outside, cost = (Series(part[key] for part in parts) for key in ("quanta", "outside_quanta", "cost"))
        constants = _collect(findings, "controller_cost", [name])[name]
        what = f"{until} quanta, ZMP outside in {outside}, mean of (53) {cost}, with constants {constants}"
        texts.append(f"{CHOICES[name].text}: {what}")
    return "; ".join(texts)


def _check_instants(findings: StairsFindings, decides: Decides) -> Check:
    found = _get_instants(findings, decides).values()
    held = [all(part["finite"] and not part["outside_quanta"] for part in parts) for parts in found]
    enough = findings.effort.instant_evaluations >= ANTS * ITERATIONS or all(held)
    return decide(held if enough else ClaimVerdict.NOT_SHOWN)


def _describe_instant_times(findings: StairsFindings) -> str:
    """Return the mean time of an instant's search for gains [ms], by reading."""
    found = _get_instants(findings, "gains").items()
    return _describe({name: Series(1e3 * part["time_s"] / part["quanta"] for part in parts) for name, parts in found})


def _check_cost_against_energy(_: StairsFindings) -> Check:
    """(53) contains the power, so that its mean is at least the mean power; of one instant's (53) nothing follows."""
    cost, energy, torque = np.array([[row.cost, row.energy, row.peak_torque_Nm] for row in TABLE_4.values()]).T
    power = energy / TABLE_3["t3_s"]  # of an energy in J
    rates, least = power / torque / len(LINKS), power * QUANTUM  # the latter of a sum over quanta
    held = [bool((cost >= power).all()), bool((cost >= least).all()), True]
    return decide(held, power=Series(power), least=Series(least), rates=Series(rates))


def _check_power(findings: StairsFindings) -> Check:
    with_power = [sum(row) for row in _collect(findings, "energy_J", POWERLESS).values()]
    without = [sum(findings.collect(f"powerless-{name}", "energy_J")) for name in POWERLESS]
    return require_change(100 * (np.divide(without, with_power) - 1)[:, None])


def _check_torso(findings: StairsFindings, index: str) -> Check:
    """Check whether the tuned torso pitch saves energy [%] or adds ZMP margin [mm] to an upright one, on average.

    Under each reading with the same plan and gains; and for our plan of least energy against one that was made for an upright
    torso. A step whose ZMP leaves the polygon upright is no comparison of energies.
    """
    tuned, own = _collect(findings, index), findings.collect("printed", f"upright_{index}")
    upright = {}
    for name in tuned:  # the best gains of a reading with an upright torso
        best = [(make_choice_spec(findings, case, name), get_best(findings, case, name)) for case in findings.cases]
        upright[name] = [evaluate(s.load(), [*get_point(run)[:2], np.pi / 2]).indexes for s, run in best]
    values = {name: Series(row[index] for row in rows) for name, rows in upright.items()}
    stays = [name for name, rows in upright.items() if min(row["zmp_margin_min_m"] for row in rows) >= 0]
    names = stays if index == "energy_J" else tuned
    pairs = [*((tuned[name], values[name]) for name in names), (tuned[OURS], own)]
    better, worse = np.array([[sum(row) for row in pair] for pair in pairs]).T
    found = "; ".join(f"{CHOICES[name].text}: {row} against {values[name]}" for name, row in tuned.items())
    changes = 100 * (1 - better / worse) if index == "energy_J" else 1e3 * (better - worse) / len(own)
    return require_change(changes[:, None], found=found, own=own)
