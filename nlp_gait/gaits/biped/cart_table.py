"""A walking cycle by the textbook: the ZMP is planned first, and the centre of mass follows by preview control.

The robot is modelled as a cart on a table: its mass moves at a constant height, and the table stands as long as the cart's ZMP is
under its foot. No motion is optimised; the hip's height is chosen by the caller.

Source:
    Kajita, Kanehiro, Kaneko, Fujiwara, Harada, Yokoi, Hirukawa (2003), "Biped walking pattern generation by using preview control
    of zero-moment point", ICRA, pages 1620 to 1626: the cart-table model (eqs. 5 and 6), the controller (eqs. 13 to 22) with the
    weights and the preview of its example, and a second pass with the error of the whole body's ZMP (section 5).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX
from scipy.interpolate import PPoly
from scipy.linalg import solve_discrete_are

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result, sample_finely
from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.biped.limits import CLOSURE_M
from nlp_gait.gaits.biped.recorded_cycle import RecordedCycles
from nlp_gait.gaits.biped.samples import BOTH_FEET
from nlp_gait.gaits.biped.support_phases import swing_foot
from nlp_gait.symbolic.nonsmooth import LEAST_REACH_MARGIN, Exact
from nlp_gait.symbolic.trajectories import Motion

PREVIEW_S = 1.6
ERROR_WEIGHT, JERK_WEIGHT = 1.0, 1e-6


def count_preview(sample_s: float) -> int:
    """Return the number of previewed samples."""
    return math.ceil(PREVIEW_S / sample_s)


def follow_zmp(reference: Array, sample_s: float, height_m: float, gravity: float) -> PPoly:
    """Return the motion of a cart from rest, with constant jerk between samples, whose ZMP follows a reference (eqs. 13 to 22).

    The ZMP's reference (T + preview,) [m] is known in advance: it is longer than the motion by ``count_preview`` samples.
    """
    t, preview = sample_s, count_preview(sample_s)
    a = np.array([[1.0, t, t**2 / 2], [0.0, 1.0, t], [0.0, 0.0, 1.0]])
    b, c = np.array([t**3 / 6, t**2 / 2, t]), np.array([1.0, 0.0, -height_m / gravity])  # (eq. 6)
    # Optimal gains on the summed error, on the state (3,), and on the next references (preview,).
    whole_b, unit, rest = np.concatenate([[c @ b], b])[:, None], np.eye(4)[:, :1], np.vstack([c @ a, a])
    whole_a = np.hstack([unit, rest])
    p = solve_discrete_are(whole_a, whole_b, np.diag([ERROR_WEIGHT, 0.0, 0.0, 0.0]), np.array([[JERK_WEIGHT]]))
    scaled = whole_b.T / (JERK_WEIGHT + whole_b.T @ p @ whole_b)
    closed = (whole_a - whole_b @ (scaled @ p @ whole_a)).T
    integral_gain, state_gain = (scaled @ p @ unit).item(), (scaled @ p @ rest).ravel()
    previews, effect = np.zeros(preview), -p @ unit
    for k in range(preview):
        previews[k], effect = (scaled @ effect).item(), closed @ effect
    steps = len(reference) - preview
    states, jerks = np.zeros((steps, 3)), np.zeros(steps)
    state, error = np.array([reference[0], 0.0, 0.0]), 0.0
    for k in range(steps):
        error += c @ state - reference[k]
        ahead = previews @ reference[k + 1 : k + 1 + preview]
        states[k], jerks[k] = state, -integral_gain * error - state_gain @ state - ahead
        state = a @ state + b * jerks[k]
    position, velocity, acceleration = states.T
    return PPoly(np.stack([jerks / 6, acceleration / 2, velocity, position]), t * np.arange(steps + 1))


SAMPLE_S = 0.005  # as in the source
SETTLING_S = 10.0  # after which the walk repeats


@dataclass(frozen=True, kw_only=True)
class Footsteps:
    """Input of the planner."""

    step_m: float  # length from foot to foot [m]
    single_s: float  # time of single support [s]
    double_s: float  # time of double support [s]
    hip_height_m: float  # of what the planned cycle calls the hip, constant [m]
    lift_m: float  # highest point of the swing foot [m]

    def __post_init__(self) -> None:
        """Check that all are finite and positive."""
        for name, value in vars(self).items():
            if not (isinstance(value, (int, float)) and math.isfinite(value) and value > 0.0):
                raise InputError(f"{name} must be a finite number > 0, got {value!r}")

    @property
    def period_s(self) -> float:
        """Duration of one step [s]."""
        return self.single_s + self.double_s


@dataclass(frozen=True, kw_only=True, eq=False)
class Walker:
    """Planner of one robot's walk: from the hip's path over the floor to the joints."""

    cycles: RecordedCycles  # the robot, and the limits by which its cycles are judged
    footsteps: Footsteps  # places and times

    @property
    def body(self) -> Body:
        """The robot."""
        return self.cycles.body

    @property
    def sample_s(self) -> float:
        """Sampling time of the controller: about ``SAMPLE_S``, so that a step is a whole number of samples [s]."""
        return self.footsteps.period_s / math.ceil(self.footsteps.period_s / SAMPLE_S)

    @property
    def cycle_step(self) -> int:
        """Number of the step that is the cycle: the first on the left foot after settling."""
        return 2 * math.ceil(SETTLING_S / self.footsteps.period_s / 2)

    @property
    def times(self) -> Array:
        """Instants of the cycle: about ``SAMPLE_S`` apart in each phase, with both switches among them [s]."""
        single, double = self.footsteps.single_s, self.footsteps.double_s
        first, second = (math.ceil(duration / SAMPLE_S) + 1 for duration in (single, double))
        return np.concatenate([np.linspace(0.0, single, first), np.linspace(single, single + double, second)[1:]])

    def plan_zmp(self, t: Array) -> Array:
        """Return the planned ZMP (2, k) at times (k,): the middle of the supporting sole, then straight to the next [m]."""
        left, right = (np.array(self._middle(side)) for side in BOTH_FEET)
        ahead = right + (self.footsteps.step_m, 0.0)
        share = np.clip((t - self.footsteps.single_s) / self.footsteps.double_s, 0.0, 1.0)
        return np.asarray(left[:, None] + share * (ahead - left)[:, None])

    def follow(
        self, zmp: Callable[[Array], Array], height_m: float, *, advances: bool = True
    ) -> Callable[[Array], Array]:
        """Return the path (2, k) [m] of a cart whose ZMP follows a repeating, mirrored one, perhaps a step ahead each time."""
        period, begins = self.footsteps.period_s, self.cycle_step * self.footsteps.period_s
        t = np.arange(math.ceil((begins + period + PREVIEW_S) / self.sample_s) + 2) * self.sample_s
        step = np.floor(t / period + 1e-9)
        x, y = zmp(t - step * period)
        distance = self.footsteps.step_m * advances
        along, across = (
            follow_zmp(reference, self.sample_s, height_m, self.body.gravity)
            for reference in (x + step * distance, np.where(step % 2 == 0, y, -y))
        )

        def path(t: Array) -> Array:
            return np.stack([along(begins + t) - self.cycle_step * distance, across(begins + t)])

        return path

    def make_gait(self, hip_path: Callable[[Array], Array]) -> Result:
        """Return the cycle in which the hip follows a path (2, k) over the floor; raises InputError if a foot is out of reach."""
        t, steps = self.times, self.footsteps
        hip = np.vstack([hip_path(t), np.full(len(t), steps.hip_height_m)])
        angles, reach, miss = (
            np.asarray(part.full().T) for part in self._legs.map(len(t))(np.minimum(t / steps.single_s, 1.0), hip)
        )
        for violation, what, remedy in (
            (reach - 1.0, "ankle is too far", "lower the hip, or shorten the step"),
            (miss - CLOSURE_M, "leg misses its foot", "choose another height of the hip"),
        ):
            if violation.size and violation.max() > 0.0:
                worst, leg = np.unravel_index(int(np.argmax(violation)), violation.shape)
                raise InputError(
                    f"a hip {steps.hip_height_m:g} m high reaches no step of {steps.step_m:g} m: at {t[worst]:.3f} s the "
                    f"{('left', 'right')[leg]} {what}; {remedy}"
                )
        return self.cycles.judge(t, angles, steps.single_s)

    @cached_property
    def _legs(self) -> ca.Function:
        """From the share of single support and the hip (3,) to all angles, the cosines of the knees, and the legs' misses."""
        share, hip, still = SX.sym("share"), SX.sym("hip", 3), SX(3, 1)
        right_y, right_z = self.body.ankle("R")
        step = SX(self.footsteps.step_m)
        swing = swing_foot(-step, step, right_y, right_z, SX(self.footsteps.lift_m), SX(self.footsteps.single_s), share)
        ankles = {"L": self.body.standing_ankle("L"), "R": swing}
        plan = self.body.plan(Motion(hip, still, still), {}, ankles, SX(LEAST_REACH_MARGIN), Exact())
        angles = ca.vertcat(*(plan.joints[name].position for name in self.body.joints))
        return ca.Function("legs", [share, hip], [angles, plan.reach, plan.miss])

    def _middle(self, side: str) -> tuple[float, float]:
        """Middle of the sole whose ankle is at x = 0 [m]."""
        foot, (y, _) = self.body.robot.feet[BOTH_FEET[side]], self.body.ankle(side)
        return (foot.front_m - foot.back_m) / 2, y + (foot.left_m - foot.right_m) / 2


def plan_cart_table_walk(cycles: RecordedCycles, footsteps: Footsteps) -> Result:
    """Plan a walking cycle from footsteps and the hip's height alone, judged by the limits of a planned one.

    The first pass models the robot as a cart; the second one moves the hip so that a cart would remove the distance of the whole
    body's ZMP from the planned one. Raises InputError if a foot is out of reach of the hip.
    """
    walker = Walker(cycles=cycles, footsteps=footsteps)
    planned = walker.plan_zmp
    # A first gait with the cart at the hip gives the place of the mass; the cart is then moved there.
    hip = walker.follow(planned, footsteps.hip_height_m)
    first = sample_finely(walker.make_gait(hip)).arrays
    mass = (first["com"] - first["hip"]).mean(axis=0) - np.array(cycles.body.hip_m)
    ahead, _, height = mass + (0.0, 0.0, footsteps.hip_height_m)
    cart = walker.follow(planned, height)

    def path(t: Array) -> Array:
        return cart(t) - np.array([[ahead], [0.0]])

    arrays = sample_finely(walker.make_gait(path)).arrays

    def zmp_error(t: Array) -> Array:
        return planned(t) - np.stack([np.interp(t, arrays["t"], arrays["zmp"][:, k]) for k in range(2)])

    correction = walker.follow(zmp_error, height, advances=False)
    return walker.make_gait(lambda t: path(t) + correction(t))
