"""The rest of a support phase of a disturbed robot: where the hip goes, and where and when the swinging foot lands.

The left foot stands at x = 0, as in a cycle. In single support the right foot swings on from where it is to a place that is
free; in double support it stands ahead. The hip moves on a cubic from its commanded state to a free one.

The robot is elsewhere: its divergent component of motion (DCM) misses the commanded one by e, which grows with rate w and is
reduced by a constant shift d of the ZMP: at the end of the phase, after T, e exp(w T) + d (1 - exp(w T)). The shifted ZMP
stays within a polygon of up to ``EDGES`` edges. What is minimised is the distance from the planned end of the phase; a
foothold that is moved by as much as the DCM misses then costs nothing, and in double support what is left of the miss costs.

Source:
    Khadiv, Herzog, Moosavian, Righetti (2020), "Walking control based on step timing adaptation": place and time of the next
    step and the offset of the DCM from it as variables, and the distances from the planned ones as cost; here with the whole
    body's ZMP and reach, and with a ZMP that may be anywhere within the sole.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import casadi as ca
from casadi import MX, SX

from nlp_gait.formulation import GaitProblem, Grid, InstantPoint, Objective, Parameter, Point
from nlp_gait.formulation.assembly import Variable, make_variables
from nlp_gait.gaits.biped import limits
from nlp_gait.gaits.biped.body import TIMES, Body, PhaseName, read_duration
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.load_sharing import make_divided_loads
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.phase_problem import make_phase_problem
from nlp_gait.gaits.biped.samples import Instant, Samples
from nlp_gait.gaits.biped.support_phases import make_single_support_loads
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, cubic, parabola_lift, stack

INTERVALS = 8
EDGES = 6  # of the hull of two soles that point forward
EDGE = ("x", "1", 1.0, "its normal's x"), ("y", "1", 0.0, "its normal's y"), ("m", "m", 1.0, "distance from the origin")
OUTSIDE, BEYOND = "zmp_outside_m", "beyond_reach"
MISS, MISS_END = ("dcm_miss_x_m", "dcm_miss_y_m"), ("dcm_miss_x_end_m", "dcm_miss_y_end_m")
RATE, RISE, REACH = "dcm_rate_per_s", ("floor_rise_x", "floor_rise_y"), "zmp_reach_m"
FOOT = ("foot_x_end_m", "foot_y_end_m")
HIP_PLACES = tuple(f"hip_{axis}_end_m" for axis in "xyz")
HIP_RATES = tuple(f"hip_v{axis}_end_m_s" for axis in "xyz")
# Distances from the planned end that cost 1: of the hip's place and velocity, of both along z, of the time, the foothold, and the
# DCM from what the foothold makes up for; and the shift of the ZMP.
UNITS = {
    "place": 0.01,
    "velocity": 0.06,
    "height": 0.01,
    "rise": 0.02,
    "time": 0.1,
    "foot": 0.3,
    "miss": 0.03,
    "shift": 0.2,
}
# A ZMP outside its polygon costs OUTSIDE_COST for each of these units.
OUTSIDE_UNIT, OUTSIDE_COST, BEYOND_COST = 0.001, 10.0, 3000.0


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedEnd(Goal):
    """Squared distance from the planned end of the phase, and the ZMP's from its polygon."""

    time: str = ""
    swings: bool = False

    def evaluate(self, at: Point, samples: Samples, ops: Nonsmooth) -> tuple[MX, Mapping[str, MX], Mapping[str, MX]]:
        """Return the objective; there are no other indexes."""

        def differ(name: str, unit: str) -> MX:
            return ((at[name] - at[f"{name}.planned"]) / UNITS[unit]) ** 2

        cost = differ(self.time, "time") + OUTSIDE_COST * at[OUTSIDE] / OUTSIDE_UNIT + BEYOND_COST * at[BEYOND]
        cost += differ(HIP_PLACES[2], "height") + differ(HIP_RATES[2], "rise")
        for place, rate, foot, left in zip(HIP_PLACES, HIP_RATES, FOOT, MISS_END, strict=False):
            cost += differ(place, "place") + differ(rate, "velocity")
            moved = at[foot] - at[f"{foot}.planned"] if self.swings else MX(0.0)
            cost += ((moved - at[left]) / UNITS["miss"]) ** 2 + (moved / UNITS["foot"]) ** 2
        return cost + ca.sumsqr(compute_shift(at, self.time) / UNITS["shift"]), {}, {}


def compute_shift(at: Point, time: str) -> MX:
    """Return the shift (2,) of the ZMP that changes the miss of the DCM to the one at the end of the phase [m]."""
    growth = ca.exp(at[RATE] * at[time])
    now, left = (ca.vertcat(*(at[name] for name in names)) for names in (MISS, MISS_END))
    return (now * growth - left) / (growth - 1.0)


class SoftReach(limits.Limit):
    """Joints within their limits and knees within reach, or beyond by a variable: a measured state may be there already."""

    def __init__(self, body: Body) -> None:
        self._hard = (limits.JointLimits(body.robot, body.planned), limits.Reach())
        self.parameters = tuple(parameter for limit in self._hard for parameter in limit.parameters)

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> limits.RowsAndIndexes:
        rows = []
        for row in (row for limit in self._hard for row in limit.add(at, samples, ops)[0]):
            assert row.lower is not None and row.upper is not None  # both limits have them
            for word, value in (("below", row.lower - row.value), ("above", row.value - row.upper)):
                rows.append(
                    replace(row, name=f"{row.name}_{word}", value=value - at[BEYOND], lower=None, upper=MX(0.0))
                )
        return rows, {}


class ZmpPolygon(limits.Limit):
    """ZMP, and its shifted weighted mean, on the inner side of each edge: normal (x, y) times it is at most a distance.

    That mean is also no further ahead of an ankle, or behind one, than the ankles' torques allow. A variable is how far
    both may be outside.
    """

    parameters = (
        Parameter(name=REACH, unit="m", default=1.0, description="of the shifted ZMP from an ankle, ahead and behind"),
        *(
            Parameter(
                name=f"edge_{k}_{what}", unit=unit, default=value, description=f"edge {k} of the polygon: {words}"
            )
            for k in range(EDGES)
            for what, unit, value, words in EDGE
        ),
    )

    def __init__(self, time: str, *, swings: bool) -> None:
        self._time, self._swings = time, swings

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> limits.RowsAndIndexes:
        # The sooner the ZMP is shifted, the more it counts for the DCM at the end.
        weights = ca.exp(-at[RATE] * samples.duration * ca.linspace(0.0, 1.0, samples.steps + 1))
        weights[[0, -1]] /= 2.0
        shifted = samples.zmp @ weights / ca.sum1(weights) + compute_shift(at, self._time)
        x, y = ca.vertsplit(ca.horzcat(samples.zmp, shifted))
        rows = [at[f"edge_{k}_x"] * x + at[f"edge_{k}_y"] * y - at[f"edge_{k}_m"] - at[OUTSIDE] for k in range(EDGES)]
        names = [f"edge_{k}" for k in range(EDGES)]
        ahead = shifted[0] - (MX(0.0) if self._swings else ca.fmax(at[FOOT[0]], 0.0))
        reach = ca.vertcat(ahead, -shifted[0]) - at[REACH] - at[OUTSIDE]
        return [
            limits.make_rows_at_samples("zmp", "m", ca.vertcat(*rows), names, None, MX(0.0)),
            limits.make_rows("ankles", "m", reach, None, MX(0.0), ("ahead", "behind")),
        ], {}


def make_rest_of_phase(body: Body, name: PhaseName) -> GaitProblem:
    """Return the problem of the rest of single (``ssp``) or double support (``dsp``) over the left foot."""
    swings, angles = name == "ssp", body.angle_names(name)
    _, right_height = body.ankle("R")
    left = body.standing_ankle("L")

    def read_foot(at: InstantPoint, s: SX) -> Motion:
        time = read_duration(at, name)
        if not swings:
            level = at[RISE[0]] * at[FOOT[0]] + at[RISE[1]] * (at[FOOT[1]] - body.feet_y[0])
            return Motion(ca.vertcat(at[FOOT[0]], at[FOOT[1]], right_height + level), SX(3, 1), SX(3, 1))
        begun, left_over = at["swing_share_start"], 1 - at["swing_share_start"]
        x, y = (
            cubic(at[f"foot_{axis}_start_m"], at[end], at[f"foot_v{axis}_start_m_s"], SX(0), time, s)
            for axis, end in zip("xy", FOOT, strict=True)
        )
        done = cubic(SX(0), SX(1), SX(0), SX(0), time / left_over, begun + left_over * s)
        rise = parabola_lift(done, 0.0, 1.0, at["swing_height_m"])
        level = at[RISE[0]] * x.position + at[RISE[1]] * (y.position - body.feet_y[0])
        return stack(x, y, rise._replace(position=rise.position + right_height + level * done.position))

    def plan(at: InstantPoint, s: SX, ops: Nonsmooth) -> Instant:
        time = read_duration(at, name)
        hip = stack(
            *(
                cubic(at[f"hip_{a}_start_m"], at[place], at[f"hip_v{a}_start_m_s"], at[rate], time, s)
                for a, place, rate in zip("xyz", HIP_PLACES, HIP_RATES, strict=True)
            )
        )
        arms = {
            each: cubic(
                at[f"{each}_start"], at[f"{each}_end"], at[f"{each}_start_rate"], at[f"{each}_end_rate"], time, s
            )
            for each in angles
        }
        return body.plan(hip, arms, {"L": left, "R": read_foot(at, s)}, at[limits.REACH_MARGIN], ops)

    phase = Phase(
        body=body,
        variables=_list_variables(body, name),
        duration=TIMES[name],
        plan=plan,
        loads=make_single_support_loads(body) if swings else make_divided_loads(body, "lever"),
        grid=Grid(intervals=INTERVALS, samples_per_interval=1, refined_by="samples_per_interval"),
        limits=(SoftReach(body), ZmpPolygon(TIMES[name], swings=swings)),
        goal=PlannedEnd(objective=Objective(name="deviation", unit="1"), time=TIMES[name], swings=swings),
        state=_list_state(body, name),
    )
    planned = (
        Parameter(name=f"{variable.name}.planned", unit=variable.unit, default=0.0, description="planned value")
        for variable in phase.variables
        if variable.name in (TIMES[name], *HIP_PLACES, *HIP_RATES, *FOOT)
    )
    problem = make_phase_problem(f"rest-of-{name}", "rest of a phase from a measured state", phase)
    return replace(problem, own_parameters=(*planned, *phase.parameters))


def _list_variables(body: Body, name: PhaseName) -> tuple[Variable, ...]:
    low, high = body.hip_height_m
    left_y, most = body.feet_y[0], body.leg_length_m
    foot = (
        ("foot_x_end_m", "m", -0.6 * most, 0.7 * most, "where the foot lands ahead"),
        ("foot_y_end_m", "m", left_y - 0.8 * most, left_y - 0.4 * most, "where the foot lands across"),
    )
    rows: list[tuple[str, str, float, float, str]] = [
        ("hip_x_end_m", "m", -most, most, "the hip's x at the end"),
        ("hip_y_end_m", "m", -most, most, "the hip's y at the end"),
        ("hip_z_end_m", "m", low, high, "the hip's height at the end"),
        *((rate, "m/s", -1.0, 1.0, "the hip's velocity at the end") for rate in HIP_RATES),
        *(foot if name == "ssp" else ()),
        (TIMES[name], "s", 0.005, 4.0, "left of the phase"),
        *((left, "m", -0.3, 0.3, "by which the DCM misses the commanded one at the end") for left in MISS_END),
        (OUTSIDE, "m", 0.0, 0.3, "of the ZMP beyond its polygon"),
        (BEYOND, "1", 0.0, 1.0, "of joints beyond their limits [rad] and cosines of knees beyond theirs"),
    ]
    return make_variables(*rows)


def _list_state(body: Body, name: PhaseName) -> tuple[Parameter, ...]:
    """Return what the motion reads besides the variables."""
    left_y, right_y = body.feet_y
    rows = [(f"hip_{a}_start_m", "m", v) for a, v in zip("xyz", (0.0, left_y / 2, body.hip_height_m[1]), strict=True)]
    rows += [(f"hip_v{axis}_start_m_s", "m/s", 0.0) for axis in "xyz"]
    for angle in body.angle_names(name):
        rows += [(f"{angle}_{end}", "rad", 0.0) for end in ("start", "end")]
        rows += [(f"{angle}_{end}_rate", "rad/s", 0.0) for end in ("start", "end")]
    if name == "ssp":
        rows += [("foot_x_start_m", "m", -body.step_length_m), ("foot_y_start_m", "m", right_y)]
        rows += [("foot_vx_start_m_s", "m/s", 0.0), ("foot_vy_start_m_s", "m/s", 0.0)]
        rows += [("swing_share_start", "1", 0.0), ("swing_height_m", "m", 0.015)]
    else:
        rows += [(FOOT[0], "m", body.step_length_m), (FOOT[1], "m", right_y)]
    rows += [(MISS[0], "m", 0.0), (MISS[1], "m", 0.0), (RATE, "1/s", 6.0), (RISE[0], "rad", 0.0), (RISE[1], "rad", 0.0)]
    return tuple(
        Parameter(name=each, unit=unit, default=value, description=each.replace("_", " ")) for each, unit, value in rows
    )
