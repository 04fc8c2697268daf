"""Plans of the stairs paper: its choices one by one, the first step, the reverse double support, and what they cost."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from compare.papers.claims import Check, Verdict, compare_changes, compare_levels, decide, require_change
from compare.papers.paper_runs import choose_best, get_point, make_computation, make_start_tasks
from compare.papers.stairs.stairs_choices import PLAN_CHOICES
from compare.papers.stairs.stairs_paper import TABLE_3, TABLE_4
from compare.papers.stairs.stairs_printed import measure_printed_equations
from compare.papers.stairs.stairs_runs import (
    DRAWN_CASE,
    StairsFindings,
    make_ideal_spec,
    make_plan_spec,
    make_track_spec,
)
from compare.report.document import Rows, Value
from compare.study.record import RunRecord
from compare.study.store import Computation
from compare.study.task import IPOPT, ProblemSpec, Task
from nlp_gait.formulation import Array, Result, Signals
from nlp_gait.formulation.display import LEFT, RIGHT
from nlp_gait.gaits.stairs.leg_network import ONLINE
from nlp_gait.gaits.stairs.plan import ZMP_OF_STANDING
from nlp_gait.gaits.stairs.robot import toe_foot_biped
from nlp_gait.gaits.stairs.stair import GRAVITY, SETBACK

PLANS = {"jerk": "rad/s^3", "plan": "J"}  # of least jerk, of least energy; unit of what is least
INDEXES = {"jerk": "peak_jerk_rad_s3", "plan": "energy_J"}
DENSITY = 5  # samples of a drawn or judged plan, as a multiple of the problem's own
TORQUE_WEIGHT, ACCELERATION_WEIGHT = 0.01, 1e-3  # of the effort that ``stairs-ideal`` minimises


def make_choice_tasks(findings: StairsFindings) -> Iterator[Task]:
    """Yield plans under every choice, from our best plans; steps with the reverse double support; floors of the effort."""
    effort = findings.effort
    for name in effort.plan_choices:
        choice = PLAN_CHOICES[name]
        for what in list_choice_plans(name):
            spec = make_plan_spec(effort, DRAWN_CASE, what)
            yield _make_task(
                replace(
                    spec,
                    options={**spec.options, **choice.options},
                    values={**spec.values, **choice.values},
                    label=f"{what}-{DRAWN_CASE}-{name}",
                ),
                findings.best(what, DRAWN_CASE),
                effort.plan_settings,
            )
    for case in findings.cases:
        yield _make_task(make_plan_spec(effort, case, "landing"), findings.best("jerk", case), effort.plan_settings)
        yield from make_start_tasks(_make_floor_spec(findings, case), 1, settings=effort.plan_settings)


def make_first_step_tasks(findings: StairsFindings) -> Iterator[Task]:
    """Yield first steps, which end where the steps with a reverse double support start."""
    for case in findings.cases:
        spec, settings = make_first_spec(findings, case), findings.effort.plan_settings
        random = make_start_tasks(spec, findings.effort.first_starts - 1, settings=settings)
        near = {**findings.best("landing", case).x, "zmp_start_m": ZMP_OF_STANDING, "zmp_end_m": ZMP_OF_STANDING}
        yield from (*random, Task(problem=spec, solver=IPOPT, settings=settings, start=near, run=len(random)))


def _make_task(spec: ProblemSpec, best: RunRecord, settings: Mapping[str, Any]) -> Task:
    problem = spec.load()
    start = {name: best.x[name] for name in problem.names}
    clipped = np.clip(list(start.values()), problem.lower, problem.upper)
    return Task(problem=spec, solver=IPOPT, settings=settings, start=dict(zip(start, map(float, clipped), strict=True)))


def make_first_spec(findings: StairsFindings, case: int) -> ProblemSpec:
    """Return the planner of the first step before the step with a reverse double support."""
    spec, following = make_plan_spec(findings.effort, case, "first"), findings.best("landing", case).x
    ends = {f"{name}.{end}": following[name] for name in ("hip_height_m", "hip_start_m") for end in ("lower", "upper")}
    return replace(spec, values={**spec.values, **ends})


def _make_floor_spec(findings: StairsFindings, case: int) -> ProblemSpec:
    """Return the ideal whose ends move and whose rear foot lifts when that of the plan does."""
    times = findings.best("plan", case).x
    spec = make_ideal_spec(findings.effort, case).with_options(
        ends="moving", sole_off_s=round(times["t1_s"], 2), toe_off_s=round(times["t2_s"], 2)
    )
    return replace(spec, label=f"floor-{case}")


def load_spec(findings: StairsFindings, what: str, case: int) -> ProblemSpec:
    """Return the problem of a plan: ``plan``, ``jerk``, ``landing`` or ``first``."""
    return make_first_spec(findings, case) if what == "first" else make_plan_spec(findings.effort, case, what)


def move(findings: StairsFindings, what: str, case: int) -> tuple[Signals, dict[str, Array]]:
    """Return the motion of a plan and its points by leg and sagittal coordinates: hip, knee, ankle, sole, toe (T, 5, 2)."""
    problem = load_spec(findings, what, case).load().dense(DENSITY)
    if problem is None or problem.display.skeleton is None:
        raise TypeError("the planner has samples and a skeleton")
    signals = problem.signals(get_point(findings.best(what, case)))
    drawn = problem.display.skeleton(signals, {q.name: problem.value(q.name) for q in problem.parameters})
    return signals, {limb.side: limb.points[:, :, [0, 2]] for limb in drawn.limbs if limb.side in (LEFT, RIGHT)}


def make_planning_computations(findings: StairsFindings) -> Iterator[Computation]:
    """Yield simulations of the ideal and of both plans."""
    for case in findings.cases:
        for what in ("ideal", *PLANS):
            spec = make_ideal_spec(findings.effort, case) if what == "ideal" else load_spec(findings, what, case)
            x = get_point(findings.best(what, case))
            yield make_computation(f"climb-{what}-{case}", spec, partial(simulate_climb, spec), x=x)


def simulate_climb(spec: ProblemSpec, x: list[float]) -> dict[str, float | None]:
    """Return when the robot falls in the engine [s], None if it does not, and the energies of model and engine [J]."""
    if find_spec("mujoco") is None:
        return {}
    from nlp_gait.simulation.drive import Drive
    from nlp_gait.simulation.measurements import measure
    from nlp_gait.simulation.plan import make_plan
    from nlp_gait.simulation.simulate import simulate_plan

    plan = make_plan(Result(problem=spec.load(), x=np.array(x)))
    found = measure(plan, simulate_plan(plan), Drive())
    return {"fell_at_s": found.fell_at_s, "engine_J": found.measured.mechanical_W * plan.duration_s}


def describe_climb(found: Mapping[str, float | None]) -> str:
    """Return the result of a simulation in words."""
    if not found:
        return "not simulated: MuJoCo is not installed"
    fell = found["fell_at_s"]
    return f"climbs, {found['engine_J']:.1f} J" if fell is None else f"falls at {fell:.1f} s"


def compute_effort(t: Array, torque: Array, acceleration: Array) -> float:
    """Return the effort of ``stairs-ideal``, by the trapezoidal rule, from histories of joint torques and link accelerations."""
    rate = TORQUE_WEIGHT * (torque**2).sum(axis=1) + ACCELERATION_WEIGHT * (acceleration**2).sum(axis=1)
    return float(np.trapezoid(rate, t))


def make_planning_tables(findings: StairsFindings) -> dict[str, Rows]:
    """Return rows by name."""
    return {
        "plan-choices": [_list_choice(findings, name) for name in ("", *findings.effort.plan_choices)],
        "steps": [_list_step(findings, case, what) for case in findings.cases for what in ("first", "landing", "jerk")],
        "ideal": [_list_ideal(findings, case) for case in findings.cases],
        "energies": [_list_energies(findings, case) for case in findings.cases],
    }


def get_choice(findings: StairsFindings, what: str, name: str) -> RunRecord:
    """Return the plan under a choice, or the best one without a name."""
    title = f"{what}-{DRAWN_CASE}" + (f"-{name}" if name else "")
    return choose_best(findings.runs[title, IPOPT])


def _list_choice(findings: StairsFindings, name: str) -> list[Value]:
    jerk = get_choice(findings, "jerk", name)
    times = ", ".join(f"{jerk.x[time]:.2f}" for time in ("t1_s", "t2_s", "t_bc_s"))
    energy = _describe_plan(findings, "plan", name) if "plan" in list_choice_plans(name) else ""
    text = PLAN_CHOICES[name].text if name else "ours"
    return [text, _describe_plan(findings, "jerk", name), energy, times, jerk.verdict.indexes["knot_jerk_rad_s3"]]


def list_choice_plans(name: str) -> list[str]:
    """Return the plans that a choice has: both, or one if the choice is what is minimised."""
    return ["jerk"] if name and "minimise" in PLAN_CHOICES[name].options else list(PLANS)


def _describe_plan(findings: StairsFindings, what: str, name: str) -> str:
    run = get_choice(findings, what, name)
    if not run.verdict.feasible:
        return f"none ({', '.join(run.verdict.violated[:1])})"
    return f"{run.verdict.indexes[INDEXES[what]]:.1f}"


def _list_step(findings: StairsFindings, case: int, what: str) -> list[Value]:
    run = findings.best(what, case)
    indexes, verdict = run.verdict.indexes, run.verdict
    names = {
        "first": "first, from standing",
        "landing": "next, with reverse double support",
        "jerk": "next, flat stance foot",
    }
    arrays = move(findings, what, case)[0].arrays
    speeds = [
        float((arrays["hip"][i + 1, 0] - arrays["hip"][i, 0]) / (arrays["t"][i + 1] - arrays["t"][i])) for i in (0, -2)
    ]
    others = [
        1e3 * indexes["zmp_margin_min_m"],
        indexes["energy_J"],
        indexes["peak_jerk_rad_s3"],
        indexes["peak_torque_Nm"],
    ]
    return [case, names[what], verdict.feasible, *others, *speeds]


def _list_ideal(findings: StairsFindings, case: int) -> list[Value]:
    found, ideal, floor = (
        findings.runs[f"ideal-{case}", IPOPT],
        findings.best("ideal", case),
        findings.best("floor", case),
    )
    every = ", ".join(f"{run.verdict.objective:.3f}" if run.claimed else "failed" for run in found)
    floor_effort = floor.verdict.objective if floor.claimed else None
    return [case, ideal.verdict.objective, every, floor_effort, *_efforts(findings, case).values()]


def _efforts(findings: StairsFindings, case: int) -> dict[str, float]:
    """Efforts of both plans and of the best tracked step."""
    found = {}
    for what in ("plan", "jerk"):
        arrays = move(findings, what, case)[0].arrays
        found[what] = compute_effort(arrays["t"], arrays["tau"], arrays["link_qdd"])
    track = make_track_spec(case, findings.plan(case)).load()
    arrays = track.signals(get_point(findings.best_track(case))).arrays
    acceleration = np.gradient(arrays["link_qd"][:, :7], arrays["t"], axis=0)
    return {**found, "track": compute_effort(arrays["t"], arrays["tau"], acceleration)}


def _list_energies(findings: StairsFindings, case: int) -> list[Value]:
    weight = toe_foot_biped().mass_kg * GRAVITY * TABLE_4[case].step_m[1]
    runs = [findings.best(what, case) for what in ("plan", "jerk", "ideal")]
    energies = [run.verdict.indexes["energy_J"] for run in runs]
    track = findings.best_track(case).verdict.indexes["energy_J"]
    climbs = [describe_climb(findings.others[f"climb-{what}-{case}"]) for what in ("plan", "jerk", "ideal")]
    return [case, weight, *energies, track, *climbs]


def compute_planning_values(findings: StairsFindings) -> dict[str, Any]:
    """Return the effects of choices and of printed equations, for the table of differences."""
    best, arrays = findings.best("jerk", DRAWN_CASE), move(findings, "jerk", DRAWN_CASE)[0].arrays
    swing = arrays["ankle"][arrays["t"] > best.x["t2_s"]]
    landing = [findings.best("landing", case).verdict.objective for case in findings.cases]
    flat = [findings.best("jerk", case).verdict.objective for case in findings.cases]
    return {
        "plan_effect": {name: _describe_effect(findings, name) for name in PLAN_CHOICES},
        "eq": measure_printed_equations(TABLE_4[DRAWN_CASE], swing),
        "landing_jerk": _join(landing),
        "flat_jerk": _join(flat),
        "drawn_case": DRAWN_CASE,
        "of": _name_cases(findings),
        "least_ratio": min(row.rise_run_ratio for row in TABLE_4.values()),
        "fixed_hip": _join(_count_feasible_hips(findings)),
        "fixed_hip_worst": _describe_worst_hips(findings),
        "shank_depth": _measure_shank_depths(findings),
        "instants": {
            **{
                how: _join(findings.others[f"instants-ours-{how}-{case}"]["cost"] for case in findings.cases)
                for how in ("gains", "torques")
            },
            "ours": _join(
                choose_best(findings.runs[f"track-{case}-ours", "aco"]).verdict.indexes["controller_cost"]
                for case in findings.cases
            ),
        },
        "online": ONLINE,
        "explicit_quanta": _join(findings.others[f"printed-{case}"]["explicit_quanta"] for case in findings.cases),
        **{
            f"network_{name}": found["converged"]
            for name, found in zip(("adam", "printed"), _networks(findings), strict=True)
        },
        "network_poses": _networks(findings)[0]["poses"],
        "aco": _join(_track_costs(findings, "aco")),
        "aco_grid": _join(_track_costs(findings, "aco-grid")),
        "energy_factor": _join(
            TABLE_4[case].energy / findings.best_track(case).verdict.indexes["energy_J"] for case in findings.cases
        ),
        "ideal_climbs": "; ".join(describe_climb(findings.others[f"climb-ideal-{case}"]) for case in findings.cases),
    }


def _networks(findings: StairsFindings) -> list[Mapping[str, Any]]:
    """Return what the network learned by Adam, and as printed."""
    network = findings.others["network"]
    return [network["adam"], next(found for rule, found in network.items() if "printed" in rule)]


def _track_costs(findings: StairsFindings, solver: str) -> list[float]:
    return [findings.best("track", case, solver).verdict.objective for case in findings.cases]


def _describe_effect(findings: StairsFindings, name: str) -> str:
    if name not in findings.effort.plan_choices:
        return "not computed"
    parts = []
    for what in list_choice_plans(name):
        least = f"least {'jerk' if what == 'jerk' else 'energy'} [{PLANS[what]}]"
        values = (_describe_plan(findings, what, choice) for choice in (name, ""))
        parts.append(f"{least} {' instead of '.join(values)}")
    return f"case {DRAWN_CASE}: {', '.join(parts)}"


def _join(values: Any) -> str:
    return " / ".join(f"{value:.4g}" for value in values)


def _name_cases(findings: StairsFindings) -> str:
    return f"case{'s' if len(findings.cases) > 1 else ''} {' / '.join(map(str, findings.cases))}"


Checker = Callable[[StairsFindings], Check]


def _compare_time(name: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        ours, other = ([findings.best(what, case).x[name] for case in findings.cases] for what in PLANS)
        return compare_levels(np.full(len(ours), TABLE_3[name]), ours, found=_join(ours), other=_join(other))

    return check


def _get_peaks(findings: StairsFindings, quantity: str, what: str = "jerk") -> dict[int, float]:
    return {case: findings.others[f"differences-{what}-{case}"][quantity] for case in findings.cases}


def _compare_peaks(quantity: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        ours, other = (_get_peaks(findings, quantity, what) for what in ("jerk", "plan"))
        printed = [float(getattr(TABLE_4[case], quantity)) for case in findings.cases]
        return compare_levels(printed, list(ours.values()), found=_join(ours.values()), other=_join(other.values()))

    return check


def _require_least_peak(quantity: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        ours, other = (_get_peaks(findings, quantity, what) for what in ("jerk", "plan"))
        texts = {"found": _join(ours.values()), "other": _join(other.values())}
        if len(ours) < len(TABLE_4):
            return decide(Verdict.NOT_SHOWN, **texts)
        rest = min(value for case, value in ours.items() if case != DRAWN_CASE)
        return require_change(100 * (rest / ours[DRAWN_CASE] - 1), **texts)

    return check


def _compare_jerk_changes(findings: StairsFindings) -> Check:
    ours = _get_peaks(findings, "jerk")
    ratio = get_choice(findings, "jerk", "ratio").verdict.indexes["peak_jerk_rad_s3"]
    own = get_choice(findings, "jerk", "").verdict.indexes["peak_jerk_rad_s3"]
    texts: dict[str, Any] = {"found": _join(ours.values()), "ratio": ratio, "own": own}
    if len(ours) < len(TABLE_4):
        return decide(Verdict.NOT_SHOWN, **texts, changes="")
    printed = {case: row.jerk for case, row in TABLE_4.items()}
    theirs, changes = ([100 * (peak[b] / peak[a] - 1) for a, b in ((1, 2), (2, 3))] for peak in (printed, ours))
    return compare_changes(theirs, changes, **texts, changes=_join(changes))


def _count_feasible_hips(findings: StairsFindings) -> list[int]:
    return [sum(run.verdict.feasible for run in findings.runs[f"hip-{case}", IPOPT]) for case in findings.cases]


def _describe_worst_hips(findings: StairsFindings) -> str:
    return "; ".join(", ".join(findings.best("hip", case).verdict.violated[:1]) or "nothing" for case in findings.cases)


def _check_hip_height(findings: StairsFindings) -> Check:
    feasible, worst = _count_feasible_hips(findings), _describe_worst_hips(findings)
    best = _join(findings.best("jerk", case).x["hip_height_m"] for case in findings.cases)
    return decide(all(feasible), feasible=_join(feasible), starts=findings.effort.hip_starts, worst=worst, best=best)


def _check_step(what: str) -> Checker:
    def check(findings: StairsFindings) -> Check:
        runs = [findings.best(what, case).verdict for case in findings.cases]
        margins = [1e3 * run.indexes["zmp_margin_min_m"] for run in runs]
        return decide(all(run.feasible for run in runs) and min(margins) >= 0, found=_join(margins))

    return check


def measure_shank_depth(findings: StairsFindings, what: str, case: int) -> float:
    """Return how far the shanks of a plan are below an edge of the stairs [mm]; negative if they are all above."""
    (tread, rise), depth = TABLE_4[case].step_m, -np.inf
    _, legs = move(findings, what, case)
    edges = [(tread - SETBACK, rise), (-SETBACK, 0.0)] if what != "first" else [(tread - SETBACK, rise)]
    for points in legs.values():
        (x0, z0), (x1, z1) = (points[:, i].T for i in (2, 1))  # ankle and knee
        for x, z in edges:
            share = (x - x0) / np.where(np.abs(x1 - x0) > 1e-9, x1 - x0, np.inf)
            below = z - (z0 + share * (z1 - z0))
            depth = max(depth, float(np.max(np.where((share > 0) & (share < 1), below, -np.inf))))
    return 1e3 * depth


def _measure_shank_depths(findings: StairsFindings) -> dict[str, str]:
    return {
        what: _join(measure_shank_depth(findings, what, case) for case in findings.cases)
        for what in ("jerk", "plan", "first")
    }


def _check_collisions(findings: StairsFindings) -> Check:
    depths = [
        measure_shank_depth(findings, what, case) for what in ("jerk", "plan", "first") for case in findings.cases
    ]
    return decide(max(depths) <= 0, **_measure_shank_depths(findings))


def _check_easier(findings: StairsFindings) -> Check:
    indexes = [[findings.best(what, case).verdict.indexes for case in findings.cases] for what in ("first", "landing")]
    names = ("peak_torque_Nm", "energy_J", "peak_jerk_rad_s3")
    found = {name: [[own[name] for own in step] for step in indexes] for name in names}
    savings = [100 * (1 - one / two) for pair in found.values() for one, two in zip(*pair, strict=True)]
    texts = {name: f"{_join(first)} against {_join(landing)}" for name, (first, landing) in found.items()}
    return require_change(savings, **texts)


def _check_network(findings: StairsFindings) -> Check:
    adam, printed = _networks(findings)
    return decide(printed["converged"] == printed["poses"], adam=adam, printed=printed)


def _check_warm_network(findings: StairsFindings) -> Check:
    iterations = findings.others["network"]["adam"]["iterations"]
    later = float(np.mean(iterations[1:]))
    return require_change(100 * (1 - later / iterations[0]), first=iterations[0], later=later)


def _check_cycloid_end(findings: StairsFindings) -> Check:
    rates = [findings.best("jerk", case).x["end_rate_rad_s"] for case in findings.cases]
    ours = [rate**2 * TABLE_4[case].step_m[1] for rate, case in zip(rates, findings.cases, strict=True)]
    return compare_levels(np.zeros(len(ours) + 1), [GRAVITY, *ours], found=_join(ours), printed_m_s2=GRAVITY)


PLANNING_CHECKS: dict[str, Checker] = {
    **{f"jerk-{name}": _compare_time(name) for name in ("t1_s", "t2_s", "t_bc_s")},
    "hip-height": _check_hip_height,
    **{f"peak-{quantity}": _compare_peaks(quantity) for quantity in ("acceleration", "jerk")},
    **{f"least-{quantity}": _require_least_peak(quantity) for quantity in ("acceleration", "jerk")},
    "jerk-changes": _compare_jerk_changes,
    "first-step": _check_step("first"),
    "reverse-support": _check_step("landing"),
    "collisions": _check_collisions,
    "easier": _check_easier,
    "network": _check_network,
    "warm-network": _check_warm_network,
    "cycloid-end": _check_cycloid_end,
}
