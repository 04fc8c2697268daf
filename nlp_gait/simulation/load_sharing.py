"""Optimal division of the load in every double support of a given motion: the cheapest wrenches on both feet, by one convex QP.

The motion and the torques in single support stay. Between two instants of the controller, wrenches are linear in time.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX
from scipy import sparse

from nlp_gait.errors import InputError, MissingExtraError
from nlp_gait.formulation import Array, Signals
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import make_tree
from nlp_gait.simulation.engine import check_period
from nlp_gait.simulation.plan import SIDES, STANDING, Plan
from nlp_gait.symbolic.balance import SOLE_FRICTION, shift_down, shift_up, sole_limits
from nlp_gait.symbolic.dynamics import newton_euler, tilt_gravity

MOVED = ("q", "qd", "qdd")
WRENCH = 6  # its components


@dataclass(frozen=True, slots=True, kw_only=True)
class Sharing:
    """Limits of the load sharing."""

    friction: float = SOLE_FRICTION  # coefficient of both soles on the ground
    # fastest change of a foot's load, in weights per second, from zero at landing and to zero at lifting; infinite for
    # a load that may jump
    load_rate_1_s: float = math.inf
    period_s: float = 0.01  # between two instants with a chosen wrench; NAO's own controller has cycles of 10 ms

    def __post_init__(self) -> None:
        for name in ("friction", "load_rate_1_s", "period_s"):
            value = getattr(self, name)
            if not value > 0.0:  # NaN fails too
                raise InputError(f"{name} of a sharing of load must be > 0, got {value!r}")
        check_period("sharing of load", self.period_s)


class Support(NamedTuple):
    """Samples of one double support, including the last one, and the sides that land before and lift after it, if any."""

    first: int
    last: int
    landed: str | None
    lifting: str | None


class SharedLoads(NamedTuple):
    """Loads of n samples that are linear in the wrench w (6,) on the right sole: torque - gain w, left - carried w."""

    torque: Array  # (n, J) without it [Nm]
    gain: Array  # (n, J, 6)
    left: Array  # (n, 6) wrench on the left sole without it [N, Nm]
    carried: Array  # (n, 6, 6)


def share_loads(plan: Plan, sharing: Sharing | None = None) -> Plan:
    """Return the same motion with the torques in double support of least power, |torque rate| + K torque^2.

    Raises MissingExtraError without Clarabel, or InputError without a double support, or if its limits allow no division.
    """
    sharing, arrays = sharing or Sharing(), {name: array.copy() for name, array in plan.signals.arrays.items()}
    supports = list(find_double_supports(plan.signals))
    if not supports:
        raise InputError("this gait has no double support, so there is no load to share")
    for support in supports:
        samples = slice(support.first, support.last + 1)
        instants = compute_instants(plan, samples)
        right = _solve_cheapest(plan, support, instants, sharing)
        arrays["tau"][samples] = instants.torque - np.einsum("njk,nk->nj", instants.gain, right)
        left = instants.left - np.einsum("njk,nk->nj", instants.carried, right)
        for side, wrench in zip(SIDES, (left, right), strict=True):
            arrays[f"{side}_force"][samples], arrays[f"{side}_moment"][samples] = wrench[:, :3], wrench[:, 3:]
    return replace(plan, signals=replace(plan.signals, arrays=arrays))


def find_double_supports(signals: Signals) -> Iterator[Support]:
    """Yield the supports with both soles at rest; the sample at which a foot lands still belongs to the phase before."""
    moves = {side: np.abs(np.diff(signals.arrays[f"{side}_foot"], axis=0)).max(axis=1) > STANDING for side in SIDES}
    still = ~np.any(list(moves.values()), axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    for start, end in edges.reshape(-1, 2).tolist():
        landed = next((side for side in SIDES if start > 0 and moves[side][start - 1]), None)
        lifting = next((side for side in SIDES if end < len(still) and moves[side][end]), None)
        if end - start > 1:
            yield Support(start + (landed is not None), end, landed, lifting)


@lock_casadi
def compute_instants(plan: Plan, samples: slice) -> SharedLoads:
    """Compute the loads of some of a plan's samples."""
    arrays, joints, feet = plan.signals.arrays, plan.joints, plan.robot.feet
    symbols = [SX.sym(name, len(joints)) for name in MOVED]
    wrench = SX.sym("wrench", WRENCH)
    q, qd, qdd = (dict(zip(joints, ca.vertsplit(symbol), strict=True)) for symbol in symbols)
    pushes = {feet["right"].link: shift_up(wrench, feet["right"].ankle_height_m)}
    tree = make_tree(plan.robot, feet["left"].link)
    torques, at_ankle = newton_euler(tree, q, qd, qdd, tilt_gravity(plan.gravity, plan.slope_rad), pushes=pushes)
    loads = ca.vertcat(*(torques[name] for name in joints)), shift_down(at_ankle, feet["left"].ankle_height_m)
    parts = [part for value in loads for part in (value, -ca.jacobian(value, wrench))]
    function = ca.Function("loads", symbols, ca.substitute(parts, [wrench], [SX.zeros(WRENCH)]))
    values = [arrays[name][samples] for name in MOVED]
    n = len(values[0])
    torque, gain, left, carried = (np.array(part) for part in function.map(n)(*(value.T for value in values)))
    return SharedLoads(
        torque.T,
        gain.reshape(len(joints), n, WRENCH).transpose(1, 0, 2),
        left.T,
        carried.reshape(WRENCH, n, WRENCH).transpose(1, 0, 2),
    )


@lock_casadi
def make_sole_rows(robot: Robot, friction: float) -> Mapping[str, Array]:
    """Return matrices (16, 6) by side; their products with a wrench on the sole must be >= 0."""
    wrench, found = SX.sym("wrench", WRENCH), {}
    for side in SIDES:
        foot = robot.feet[side]
        limits = sole_limits(wrench, (-foot.back_m, foot.front_m), (-foot.right_m, foot.left_m), SX(friction))
        found[side] = np.array(ca.evalf(ca.jacobian(ca.vertcat(*limits), wrench)))
    return found


def _solve_cheapest(plan: Plan, support: Support, instants: SharedLoads, sharing: Sharing) -> Array:
    samples = slice(support.first, support.last + 1)
    t, rate = plan.signals.arrays["t"][samples], plan.signals.arrays["qd"][samples]
    n, knots = len(t), max(2, math.ceil((t[-1] - t[0]) / sharing.period_s) + 1)
    # Wrench of sample i = blend[i] @ knots: hat functions.
    place = (t - t[0]) / (t[-1] - t[0]) * (knots - 1)
    before = np.minimum(place.astype(int), knots - 2)
    share = place - before
    row = np.arange(n)
    entries = (np.r_[1 - share, share], (np.r_[row, row], np.r_[before, before + 1]))
    wrenches = sparse.kron(sparse.csr_matrix(entries, (n, knots)), sparse.identity(WRENCH), format="csr")
    weights = np.gradient(t) / (t[-1] - t[0])
    driven = np.flatnonzero(np.abs(instants.gain).max(axis=(0, 2)) > 0.0)  # joints between both feet
    gain = sparse.block_diag(list(instants.gain[:, driven]), format="csr") @ wrenches
    torque, speed = instants.torque[:, driven].ravel(), sparse.diags(rate[:, driven].ravel())
    weight = np.repeat(weights, len(driven))
    # min weight.(s + K tau^2) over knots and s >= |rate tau|, tau = torque - gain knots
    heat = 2.0 * plan.heat_loss * sparse.diags(weight)
    quadratic = sparse.block_diag([gain.T @ heat @ gain, sparse.csc_matrix((len(weight), len(weight)))], format="csc")
    linear = np.concatenate([-(gain.T @ (heat @ torque)), weight])
    bound, power = sparse.identity(len(weight)), speed @ torque
    limits = [
        *_limit_soles(plan, instants, sharing, wrenches),
        *_limit_rates(plan, support, instants, sharing, t, knots, place),
    ]
    rows = sparse.vstack([left for left, _ in limits])
    matrix = sparse.bmat([[-(speed @ gain), -bound], [speed @ gain, -bound], [rows, None]], format="csc")
    right = np.concatenate([-power, power, *(limit for _, limit in limits)])
    solution = _solve_qp(quadratic, linear, matrix, right)
    if solution is None:
        raise InputError(
            f"no division of the load keeps both soles flat between {t[0]:.3f} and {t[-1]:.3f} s with a friction of "
            f"{sharing.friction:g} and a load rate of {sharing.load_rate_1_s:g} weights per second; increase either, or "
            "plan with torso_share=free"
        )
    return np.asarray((wrenches @ solution[: knots * WRENCH]).reshape(n, WRENCH))


Limit = tuple[Any, Array]  # rows of a sparse matrix, to be multiplied with all knots, and their upper bounds


def _limit_soles(plan: Plan, instants: SharedLoads, sharing: Sharing, wrenches: Any) -> Iterator[Limit]:
    """Yield the limits of both soles at every sample."""
    rows = make_sole_rows(plan.robot, sharing.friction)
    n = len(instants.left)
    left = sparse.block_diag(list(rows["left"] @ instants.carried), format="csr") @ wrenches
    right = sparse.kron(sparse.identity(n), rows["right"], format="csr") @ wrenches
    yield left, (instants.left @ rows["left"].T).ravel()
    yield -right, np.zeros(n * len(rows["right"]))


def _limit_rates(
    plan: Plan, support: Support, instants: SharedLoads, sharing: Sharing, t: Array, knots: int, place: Array
) -> Iterator[Limit]:
    """Yield the limits of the change of each foot's load between knots, and from zero at landing and to zero at lifting."""
    if not math.isfinite(sharing.load_rate_1_s):
        return
    most = sharing.load_rate_1_s * plan.robot.mass_kg * plan.gravity * (t[-1] - t[0]) / (knots - 1)
    pick = sparse.csr_matrix(
        (np.ones(knots), (np.arange(knots), WRENCH * np.arange(knots) + 2)), (knots, WRENCH * knots)
    )
    total = np.interp(np.arange(knots), place, instants.left[:, 2])  # of both feet, at each knot
    steps = sparse.diags([-np.ones(knots - 1), np.ones(knots - 1)], [0, 1], (knots - 1, knots))
    loads = {"right": (pick, np.zeros(knots)), "left": (-pick, total)}  # matrix @ knots + constant
    for matrix, rest in loads.values():
        change, own = steps @ matrix, steps @ rest
        for sign in (1.0, -1.0):
            yield sign * change, most - sign * own
    for side, knot in ((support.landed, 0), (support.lifting, knots - 1)):
        if side is not None:
            matrix, rest = loads[side]
            yield matrix[knot], np.array([most - rest[knot]])


def _solve_qp(quadratic: Any, linear: Array, matrix: Any, most: Array) -> Array | None:
    """Minimise x'Qx/2 + c'x subject to matrix x <= most; None if that is infeasible. Raises MissingExtraError."""
    try:
        import clarabel
    except ImportError as error:
        raise MissingExtraError(
            f"load sharing requires Clarabel ({error}); install it with pip install 'nlp-gait[qp]'"
        ) from error
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cones = [clarabel.NonnegativeConeT(len(most))]
    found = clarabel.DefaultSolver(sparse.triu(quadratic, format="csc"), linear, matrix, most, cones, settings).solve()
    return np.array(found.x) if str(found.status) in ("Solved", "AlmostSolved") else None
