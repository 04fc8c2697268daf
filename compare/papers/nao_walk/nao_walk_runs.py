"""Runs for the claims: gaits, the energy of each joint in them, softer drives, other heights and heat constants."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np
from scipy.integrate import trapezoid

from compare.papers.paper_runs import Effort, make_computation
from compare.questions.question import find
from compare.questions.sweep import Axis
from compare.questions.walk.walk import CheapestWalk
from compare.study.store import Computation
from compare.study.task import ProblemSpec
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result, sample_finely
from nlp_gait.gaits.biped.cart_table import Footsteps, plan_cart_table_walk
from nlp_gait.gaits.nao.joints import YAW_PITCHES
from nlp_gait.gaits.nao.problems import make_nao_cycles
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import measure_planned_distance, measure_walked_distance
from nlp_gait.simulation.plan import Plan, make_plan
from nlp_gait.simulation.simulate import Conditions, Push, Simulation, simulate_plan

# The walk that the maker documents, by the sources of ``nao_walk_claims.toml``; without another source, by Aldebaran's
# documentation of NAOqi: omni-directional walk, locomotion control (read: beginnings of the pages of several versions; the
# default height of a step only in programs that set it).
SPEED_M_S = 0.0952  # the source of ``speed``
STEP_M = 0.040
DOUBLE_SHARE = 1.0 / 3.0  # of a step's time
TORSO_M = 0.315
LIFT_M = 0.020
BATTERY_WH, ACTIVE_MIN = 62.5, 60.0  # the source of ``battery``
STRETCHED_M = 0.334  # greatest height of the hip, with stretched legs: Gupta, Pratihar, Deb (2023), section 4.1
CYCLE = "nao-cycle"
SPECS = {  # by source of the heat constant K
    "paper": ProblemSpec(name=CYCLE, options={"objective": "power"}),
    "sheet": ProblemSpec(name=CYCLE, options={"objective": "power", "motors": "heat"}),
}
HEIGHTS = ("hip_z_lift_off_m", "hip_z_touch_down_m")  # variables
ARMS = "arms"
KINDS = {  # of joints, in words
    **{"KneePitch": "knees", "HipPitch": "hip pitch", "HipRoll": "hip roll", "HipYawPitch": "hip yaw-pitch"},
    **{"AnklePitch": "ankle pitch", "AnkleRoll": "ankle roll", ARMS: ARMS},
}
DIRECTIONS = ((1, 0), (-1, 0), (0, 1), (0, -1))
PUSHES_NS, SLOPES_DEG, FRICTIONS, MASS_FACTORS = (0.5, 1.0), (6.0,), (0.3,), (0.9, 1.1)
FEED_FORWARD = ("none", "torque")


@dataclass(frozen=True, kw_only=True)
class NaoWalkEffort(Effort):
    """Effort of checking the claims about NAO's walk."""

    starts: int = 2  # of IPOPT
    speeds_m_s: tuple[float, ...] = (0.03, 0.06, 0.08, SPEED_M_S, 0.12, 0.15)  # of the curve, the default one included
    torsos_m: tuple[float, ...] = (0.28, 0.30, 0.31, 0.315, 0.32, 0.325, 0.33)  # heights in the robot's own walk
    heats: tuple[float, ...] = (0.025, 0.1, 0.5)  # K for the claim about straighter knees [W/(Nm)^2]
    stiffnesses: tuple[float, ...] = (1.0, 0.7, 0.5)  # of the drives; the first one is full
    steps_m: tuple[float, ...] = (0.04, 0.06, 0.08)  # lengths of a step to find the fastest walk, ascending
    walked: int = 6  # simulated steps
    disturbed: bool = True  # whether disturbed walks are simulated too

    @property
    def steps(self) -> int:
        """Curves, heights, heat constants and the data sheet's, four gaits, drives twice, and the report."""
        return 2 + 1 + len(self.heats) + 1 + 4 + 2 * len(self.stiffnesses) + 1


def make_gait_computations(effort: NaoWalkEffort) -> list[Computation]:
    """Return optimal gaits over speed, the robot's own walk at other heights, and optima whose legs may stretch."""
    heats = {f"{heat:g}": replace(SPECS["paper"], values={"heat_loss_W_per_Nm2": heat}) for heat in effort.heats}
    speeds, starts = effort.speeds_m_s, effort.starts
    found = []
    for name, spec in SPECS.items():
        solve_curve = partial(solve_over_speed, spec)
        found.append(make_computation(f"speeds-{name}", spec, solve_curve, speeds=speeds, starts=starts))
    found.append(make_computation("torsos", SPECS["paper"], compute_heights, heights=effort.torsos_m))
    for name, spec in {**heats, "sheet": SPECS["sheet"]}.items():
        found.append(make_computation(f"straighter-{name}", spec, partial(solve_free_height, spec), starts=starts))
    return found


def make_walk_computations(effort: NaoWalkEffort, optima: Mapping[str, Mapping[str, float]]) -> list[Computation]:
    """Return the energy of the joints in the robot's own walk and in optima, and that walk on softer drives."""
    gaits: dict[str, dict[str, Any]] = {
        "own": {"feed_forward": "torque", "heat": "", "x": {}},
        "own-plain": {"feed_forward": "none", "heat": "", "x": {}},
        **{f"optimum-{heat}": {"feed_forward": "torque", "heat": heat, "x": dict(x)} for heat, x in optima.items()},
    }
    make = partial(make_computation, spec=SPECS["paper"], steps=effort.walked)
    found = [make(f"joints-{name}", function=simulate_joints, **how) for name, how in gaits.items()]
    make = partial(make, function=simulate_drives, lengths=effort.steps_m, disturbed=effort.disturbed)
    for fed, share in product(FEED_FORWARD, effort.stiffnesses):
        found.append(make(f"drives-{fed}-{share:g}", feed_forward=fed, stiffness=share))
    return found


def solve_over_speed(spec: ProblemSpec, speeds: Sequence[float], starts: int) -> list[dict[str, Any]]:
    """Return the cheapest gait at each speed."""
    axis = Axis(name="speed_m_s", values=tuple(speeds))
    names = ("cost_of_transport", "energy_J_per_m")
    return [
        {"speed_m_s": gait.at, "feasible": gait.point.feasible, "x": dict(gait.point.x)}
        | {name: gait.indexes[name] for name in names}
        for gait in find(CheapestWalk(problem=spec.load(), axis=axis, starts=starts)).gaits
    ]


def compute_heights(heights: Sequence[float]) -> list[dict[str, float]]:
    """Return the robot's own walk with other heights of its torso; heights that the legs cannot reach are left out."""
    found = []
    for height in heights:
        try:
            walk = plan_own_walk(make_footsteps(torso_m=height))
        except InputError:
            continue
        kinds = _sum_planned(make_plan(walk)).values()
        energies = {f"{heat}_J_per_m": sum_energy(kinds, heat) for heat in SPECS}
        found.append({"torso_m": height, **energies, "knee_deg": _compute_knee_deg(walk)})
    return found


def solve_free_height(spec: ProblemSpec, starts: int) -> dict[str, Any]:
    """Return the cheapest gait at the default speed with the hip free up to stretched legs, and within the paper's bounds."""
    found: dict[str, Any] = {}
    for name, bounds in (("free", {f"{variable}.upper": STRETCHED_M for variable in HEIGHTS}), ("paper", {})):
        problem = spec.load().with_values(speed_m_s=SPEED_M_S, **bounds)
        solution = solve(problem, starts=starts, seed=0)
        result = Result(problem=problem, x=problem.check_x(solution.x))
        found[name] = {
            "power_W": solution.objective,
            "hip_m": float(sample_finely(result).arrays["hip"][:, 2].mean()),
            "knee_deg": _compute_knee_deg(result),
        }
    return found


def simulate_joints(feed_forward: str, heat: str, x: Mapping[str, float], steps: int) -> dict[str, Any]:
    """Return the energy per metre of each kind of joint, in the model and in the engine, with both heat constants [J/m].

    The gait is the optimum x with the heat constant of a key of ``SPECS``; without a key it is the robot's own walk.
    """
    if heat:
        problem = SPECS[heat].load().with_values(speed_m_s=SPEED_M_S)
        result = Result(problem=problem, x=problem.check_x(x))
    else:
        result = plan_own_walk(make_footsteps())
    plan = make_plan(result, steps)
    trace = simulate_plan(plan, drive=Drive(feed_forward=feed_forward))
    walk = {"fell_at_s": trace.fell_at_s, "walked_m": measure_walked_distance(trace)[0], "duration_s": plan.duration_s}
    return {**walk, "model": _sum_planned(plan), "engine": _sum_simulated(plan, trace)}


def simulate_drives(
    feed_forward: str, stiffness: float, steps: int, lengths: Sequence[float], disturbed: bool
) -> dict[str, Any]:
    """Simulate the robot's own walk on some drives: energy, distance, falls when disturbed, fastest walk without a fall."""
    plan = make_plan(plan_own_walk(make_footsteps()), steps)
    drive = Drive(full_error_rad=Drive().full_error_rad / stiffness, feed_forward=feed_forward)
    trace = simulate_plan(plan, drive=drive)
    during, fell = trace.t <= plan.duration_s, trace.fell_at_s is not None
    energy = _sum_simulated(plan, trace).values()
    disturbances = _make_disturbances() if disturbed else []
    falls = sum(simulate_plan(plan, disturbance, drive).fell_at_s is not None for disturbance in disturbances)
    fastest = 0.0
    for length in lengths:
        longer = make_plan(plan_own_walk(make_footsteps(step_m=length)), steps)
        tried = simulate_plan(longer, drive=drive)
        if tried.fell_at_s is None:
            fastest = max(fastest, measure_walked_distance(tried)[0] / longer.duration_s)
    return {
        "fell": fell,
        "walked_share": None if fell else measure_walked_distance(trace)[0] / measure_planned_distance(plan),
        **{f"{heat}_J_per_m": None if fell else sum_energy(energy, heat) for heat in SPECS},
        "tracking_rad": float(np.abs(plan.at("q", trace.t[during]) - trace.q[during]).max()),
        "falls": falls,
        "disturbances": len(disturbances),
        "fastest_m_s": fastest,
    }


def make_footsteps(step_m: float = STEP_M, torso_m: float = TORSO_M) -> Footsteps:
    """Return the footsteps of the robot's own walk, which plans the ZMP of an inverted pendulum."""
    double_s = DOUBLE_SHARE * STEP_M / SPEED_M_S
    single_s = (1.0 - DOUBLE_SHARE) * STEP_M / SPEED_M_S
    return Footsteps(step_m=step_m, single_s=single_s, double_s=double_s, hip_height_m=torso_m, lift_m=LIFT_M)


@cache
def plan_own_walk(footsteps: Footsteps) -> Result:
    """Return the robot's own walk: preview control of a cart on a table over footsteps."""
    return plan_cart_table_walk(make_nao_cycles(), footsteps)


def _compute_knee_deg(result: Result) -> float:
    signals = sample_finely(result)
    t, q = signals.arrays["t"], signals.arrays["q"]
    knees = [column for column, joint in enumerate(signals.joints) if joint.endswith("KneePitch")]
    return math.degrees(float(trapezoid(q[:, knees].mean(axis=1), t) / (t[-1] - t[0])))


def _sum_planned(plan: Plan) -> dict[str, dict[str, float]]:
    """Return the energies of the model, see ``_sum_by_kind``."""
    arrays = plan.signals.arrays
    return _sum_by_kind(plan, arrays["tau"], arrays["qd"], arrays["t"], measure_planned_distance(plan))


def _sum_simulated(plan: Plan, trace: Simulation) -> dict[str, dict[str, float]]:
    """Return the energies of a simulated walk while its plan lasts, see ``_sum_by_kind``."""
    during, (walked, _) = trace.t <= plan.duration_s, measure_walked_distance(trace)
    return _sum_by_kind(plan, trace.torque[during], trace.qd[during], trace.t[during], walked)


def _sum_by_kind(plan: Plan, torque: Array, rate: Array, t: Array, distance_m: float) -> dict[str, dict[str, float]]:
    """By kind of joint: mechanical energy, and heat with the paper's constant and those of the data sheet [J/m]."""
    sum_by_motor = torque.copy()
    first, second = (plan.joints.index(joint) for joint in YAW_PITCHES)  # one motor turns both
    sum_by_motor[:, first], sum_by_motor[:, second] = torque[:, first] + torque[:, second], 0.0
    motors = (plan.robot.joint(joint).motor for joint in plan.joints)
    K = np.array([motor.heat_W_per_Nm2 for motor in motors if motor is not None])
    rates = {"mechanical": np.abs(torque * rate), "paper": plan.heat_loss * torque**2, "sheet": K * sum_by_motor**2}
    energies = {name: trapezoid(rate, t, axis=0) / distance_m for name, rate in rates.items()}
    found = {kind: dict.fromkeys(rates, 0.0) for kind in KINDS}
    for column, joint in enumerate(plan.joints):
        for name, energy in energies.items():
            found[joint[1:] if joint[1:] in KINDS else ARMS][name] += float(energy[column])
    return found


def sum_energy(kinds: Iterable[Mapping[str, float]], heat: str) -> float:
    """Return the energy of all kinds of joints [J/m]; ``heat`` is ``paper`` or ``sheet``."""
    return sum(parts["mechanical"] + parts[heat] for parts in kinds)


def _make_disturbances() -> list[Conditions]:
    slopes = [math.radians(slope) for slope in SLOPES_DEG]
    return [
        *(Conditions(push=Push(impulse_Ns=(x * size, y * size))) for size in PUSHES_NS for x, y in DIRECTIONS),
        *(Conditions(slope_rad=(x * slope, y * slope)) for slope in slopes for x, y in DIRECTIONS),
        *(Conditions(friction=friction) for friction in FRICTIONS),
        *(Conditions(mass_factor=factor) for factor in MASS_FACTORS),
    ]
