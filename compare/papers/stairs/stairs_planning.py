"""Plans of the stairs paper: its choices one by one, the first step, the reverse double support, and what they cost."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache, partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from compare.papers.paper_runs import choose_best, get_point, make_computation, make_start_tasks
from compare.papers.stairs import stairs_runs
from compare.papers.stairs.stairs_paper import PLAN_CHOICES, TABLE_4
from compare.papers.stairs.stairs_runs import DRAWN_CASE, StairsFindings, fix, make_plan_spec, make_track_spec
from compare.report.document import Rows, Value
from compare.study.record import RunRecord
from compare.study.store import Computation
from compare.study.task import IPOPT, ProblemSpec, Task
from nlp_gait.formulation import Array, Result, Signals
from nlp_gait.formulation.display import LEFT, RIGHT
from nlp_gait.gaits.stairs.plan import ZMP_OF_STANDING
from nlp_gait.gaits.stairs.planar_biped import GRAVITY, load_toe_foot_biped

PLANS = {"jerk": "rad/s^3", "plan": "J"}  # of least jerk, of least energy; unit of what is least
INDEXES = {"jerk": "peak_jerk_rad_s3", "plan": "energy_J"}
CLIMBS = ("ideal", "plan", "jerk")  # simulated
STEPS = {
    "first": "first, from standing",
    "landing": "next, with reverse double support",
    "jerk": "next, flat stance foot",
}
DENSITY = 5  # samples of a drawn or judged plan, as a multiple of the problem's own
TORQUE_WEIGHT, ACCELERATION_WEIGHT = 0.01, 1e-3  # of the effort that ``stairs-ideal`` minimises


def make_choice_tasks(findings: StairsFindings) -> Iterator[Task]:
    """Yield plans under every choice, and in each case the paper's hip height, an upright torso, a reverse double support."""
    effort = findings.effort
    for name in effort.plan_choices:
        for what in PLANS:
            spec, best = _make_choice_spec(findings, what, name), findings.best(what, DRAWN_CASE)
            yield _make_task(spec, best, effort.plan_settings)
    for case in findings.cases:
        settings = effort.plan_settings
        yield from make_start_tasks(make_plan_spec(effort, case, "hip"), effort.hip_starts, settings=settings)
        yield _make_task(make_plan_spec(effort, case, "landing"), findings.best("jerk", case), settings)
        yield _make_task(make_plan_spec(effort, case, "upright"), findings.best("plan", case), settings)


def make_energy_tasks(findings: StairsFindings) -> Iterator[Task]:
    """Yield searches for plans of least energy under every choice that start from those of least jerk under it."""
    for name in findings.effort.plan_choices:
        best = choose_best(findings.runs[f"jerk-{DRAWN_CASE}-{name}", IPOPT])
        spec = _make_choice_spec(findings, "plan", name)
        yield replace(_make_task(spec, best, findings.effort.plan_settings), run=1)


def _make_choice_spec(findings: StairsFindings, what: str, name: str) -> ProblemSpec:
    spec, choice = make_plan_spec(findings.effort, DRAWN_CASE, what), PLAN_CHOICES[name]
    options, values = {**spec.options, **choice.options}, {**spec.values, **choice.values}
    return replace(spec, options=options, values=values, label=f"{what}-{DRAWN_CASE}-{name}")


def make_first_step_tasks(findings: StairsFindings) -> Iterator[Task]:
    """Yield first steps, which end where the steps with a reverse double support start, and those that end anywhere."""
    for case in findings.cases:
        spec = _make_first_spec(findings, case)
        settings = findings.effort.plan_settings
        random = make_start_tasks(spec, findings.effort.first_starts - 1, settings=settings)
        near = {**findings.best("landing", case).x, "zmp_start_m": ZMP_OF_STANDING, "zmp_end_m": ZMP_OF_STANDING}
        yield from (*random, Task(problem=spec, solver=IPOPT, settings=settings, start=near, run=len(random)))
        free = replace(make_plan_spec(findings.effort, case, "first"), label=f"free-{case}")
        yield Task(problem=free, solver=IPOPT, settings=settings, start=near)


def _make_task(spec: ProblemSpec, best: RunRecord, settings: Mapping[str, Any]) -> Task:
    problem = spec.load()
    start = {name: best.x[name] for name in problem.names}
    clipped = np.clip(list(start.values()), problem.lower, problem.upper)
    return Task(problem=spec, solver=IPOPT, settings=settings, start=dict(zip(start, map(float, clipped), strict=True)))


def _make_first_spec(findings: StairsFindings, case: int) -> ProblemSpec:
    spec, following = make_plan_spec(findings.effort, case, "first"), findings.best("landing", case).x
    ends = fix("hip_height_m", following["hip_height_m"]) | fix("hip_start_m", following["hip_start_m"])
    return replace(spec, values={**spec.values, **ends})


def load_spec(findings: StairsFindings, what: str, case: int) -> ProblemSpec:
    """Return the problem of a plan, ``plan``, ``jerk``, ``landing`` or ``first``, or of the ``ideal``."""
    if what == "ideal":
        return stairs_runs.make_ideal_spec(findings.effort, case)
    return _make_first_spec(findings, case) if what == "first" else make_plan_spec(findings.effort, case, what)


@lru_cache(maxsize=16)
def move(findings: StairsFindings, what: str, case: int) -> tuple[Signals, dict[str, Array]]:
    """Return the motion of a plan and its points by leg and sagittal coordinates: hip, knee, ankle, sole, toe (T, 5, 2)."""
    problem = load_spec(findings, what, case).load().dense(DENSITY)
    if problem is None or problem.display.skeleton is None:
        raise TypeError("the planner has samples and a skeleton")
    signals = problem.signals(get_point(findings.best(what, case)))
    drawn = problem.display.skeleton(signals, {q.name: problem.value(q.name) for q in problem.parameters})
    return signals, {limb.side: limb.points[:, :, [0, 2]] for limb in drawn.limbs if limb.side in (LEFT, RIGHT)}


def measure_hip_speeds(findings: StairsFindings, what: str, case: int) -> tuple[float, float]:
    """Return the forward speeds of the hip at the start and the end of a plan [m/s]."""
    arrays = move(findings, what, case)[0].arrays
    rates = np.diff(arrays["hip"][:, 0])[[0, -1]] / np.diff(arrays["t"])[[0, -1]]
    return float(rates[0]), float(rates[1])


def make_planning_computations(findings: StairsFindings) -> Iterator[Computation]:
    """Yield simulations of the ideal and of both plans."""
    for case in findings.cases:
        for what in CLIMBS:
            spec, x = load_spec(findings, what, case), get_point(findings.best(what, case))
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
    return (
        f"climbs, {found['engine_J']:.1f} J" if found["fell_at_s"] is None else f"falls at {found['fell_at_s']:.1f} s"
    )


def compute_effort(t: Array, torque: Array, acceleration: Array) -> float:
    """Return the effort of ``stairs-ideal``, by the trapezoidal rule, from histories of joint torques and link accelerations."""
    rate = TORQUE_WEIGHT * (torque**2).sum(axis=1) + ACCELERATION_WEIGHT * (acceleration**2).sum(axis=1)
    return float(np.trapezoid(rate, t))


def make_planning_tables(findings: StairsFindings) -> dict[str, Rows]:
    """Return rows by name."""
    return {
        "plan-choices": [_list_choice(findings, name) for name in ("", *findings.effort.plan_choices)],
        "steps": [_list_step(findings, case, what) for case in findings.cases for what in STEPS],
        "ideal": [_list_ideal(findings, case) for case in findings.cases],
    }


def get_choice(findings: StairsFindings, what: str, name: str) -> RunRecord:
    """Return the best known plan under a choice, of either goal, and ours if it only relaxes limits; ours without a name."""
    if not name:
        return findings.best(what, DRAWN_CASE)
    titles = [f"{other}-{DRAWN_CASE}-{name}" for other in PLANS]
    titles += [f"{other}-{DRAWN_CASE}" for other in PLANS if PLAN_CHOICES[name].relaxes]
    known = [run for title in titles for run in findings.runs[title, IPOPT] if run.verdict.feasible]
    own = choose_best(findings.runs[f"{what}-{DRAWN_CASE}-{name}", IPOPT])
    return min(known, key=lambda run: run.verdict.indexes[INDEXES[what]], default=own)


def _list_choice(findings: StairsFindings, name: str) -> list[Value]:
    jerk = get_choice(findings, "jerk", name)
    times = ", ".join(f"{jerk.x[time]:.2f}" for time in ("t1_s", "t2_s", "t_bc_s"))
    text = PLAN_CHOICES[name].text if name else "ours"
    return [text, *(describe_plan(findings, what, name) for what in PLANS), times]


def describe_plan(findings: StairsFindings, what: str, name: str) -> str:
    """Return what is least in a plan under a choice, as text."""
    run = get_choice(findings, what, name)
    if not run.verdict.feasible:
        return f"none ({', '.join(run.verdict.violated[:1])})"
    return f"{run.verdict.indexes[INDEXES[what]]:.1f}"


def _list_step(findings: StairsFindings, case: int, what: str) -> list[Value]:
    run = findings.best(what, case)
    indexes, verdict = run.verdict.indexes, run.verdict
    others = [indexes[name] for name in ("energy_J", "peak_jerk_rad_s3", "peak_torque_Nm")]
    margin = 1e3 * indexes["zmp_margin_min_m"]
    return [case, STEPS[what], verdict.feasible, margin, *others, *measure_hip_speeds(findings, what, case)]


def _list_ideal(findings: StairsFindings, case: int) -> list[Value]:
    runs = [findings.best(what, case) for what in CLIMBS]
    efforts, energies = [runs[0].verdict.objective], [run.verdict.indexes["energy_J"] for run in runs]
    for what in CLIMBS[1:]:
        arrays = move(findings, what, case)[0].arrays
        efforts.append(compute_effort(arrays["t"], arrays["tau"], arrays["link_qdd"]))
    step = findings.best_track(case)
    arrays = make_track_spec(case, findings.plan(case)).load().signals(get_point(step)).arrays
    acceleration = np.gradient(arrays["link_qd"][:, :7], arrays["t"], axis=0)
    efforts.append(compute_effort(arrays["t"], arrays["tau"], acceleration))
    weight = load_toe_foot_biped().mass_kg * GRAVITY * TABLE_4[case].step_m[1]
    climbs = [describe_climb(findings.others[f"climb-{what}-{case}"]) for what in CLIMBS]
    return [case, *efforts, weight, *energies, step.verdict.indexes["energy_J"], *climbs]
