"""Load in double support: divided between the feet by a rule of the paper, or planned freely.

Two standing feet make a closed chain: the motion fixes only the sum of both wrenches, and how they share it is the controller's
choice. The paper's rules give each leg a share of the torso's mass. A planned load is the wrench on the right sole as polynomials
of the phase whose coefficients are variables; the wrench on the left sole and the torques of both legs follow, and flat soles on
a rough floor limit both.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, InstantPoint, Point, Start, Variable
from nlp_gait.formulation.assembly import make_parameters as table
from nlp_gait.formulation.assembly import make_variables
from nlp_gait.formulation.blocks import make_labels
from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.biped.limits import Limit, RowsAndIndexes, make_rows, make_rows_at_samples
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.biped.samples import BOTH_FEET, Instant, Loader, Planner, Samples
from nlp_gait.robots import Foot
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic import balance
from nlp_gait.symbolic.dynamics import Wrench, newton_euler
from nlp_gait.symbolic.nonsmooth import Nonsmooth

COMPONENTS = {f"{half}_{axis}": unit for half, unit in (("force", "N"), ("moment", "Nm")) for axis in "xyz"}
LARGEST_DEGREE = 12
# Part of the phase, at either end, in which load passes to or from a foot: a low polynomial alone cannot begin at zero
# and be elsewhere soon after.
RAMP_SHARE = 0.05
RAMPS = 2
# Coefficients start near a load that passes evenly from foot to foot, within this share of their bounds.
START_SHARE = 0.02
CORNERS = ("+x", "-x", "+y", "-y")
TURNS = tuple(f"{sense}{first}{second}" for sense in "+-" for first in "+-" for second in "+-")

TorsoShare = Literal["printed", "lever", "free"]
LOAD_DEGREE = 4


class LoadSharing:
    """Load that follows from the motion; a subclass has variables and limits of its own, which are added to the motion's."""

    variables: tuple[Variable, ...] = ()
    limits: tuple[Limit, ...] = ()

    def __init__(self, loads: Loader) -> None:
        self.loads = loads

    def add_to(self, plan: Planner) -> Planner:
        """Return a plan with the load's own part."""
        return plan

    def start(self, names: Sequence[str], motion_start: Start | None) -> Start | None:
        """Return a function that draws start points of variables by name; None: uniform within the bounds."""
        return motion_start


def share_load(body: Body, rule: TorsoShare, degree: int = LOAD_DEGREE) -> LoadSharing:
    """Return how the feet share the load: by a rule, see ``share_torso``, or ``"free"``, see ``PlannedLoad``."""
    return PlannedLoad(body, degree) if rule == "free" else LoadSharing(make_divided_loads(body, rule))


class PlannedLoad(LoadSharing):
    """Wrench of the ground on the right sole, about the point under its ankle: polynomials in Bernstein form, and ramps.

    Raises InputError for a degree of the polynomials that is not allowed.
    """

    def __init__(self, body: Body, degree: int) -> None:
        if not 1 <= degree <= LARGEST_DEGREE:
            raise InputError(f"load_degree must be within [1, {LARGEST_DEGREE}], got {degree}")
        self._degree, self._weight = degree, body.weight
        self._count = degree + 1 + RAMPS  # coefficients of each component
        self.loads = make_planned_loads(body)
        self.limits = (FootLimits(body),)
        # Component by component, with wide bounds: coefficients may lie beyond what the curve reaches.
        weight, foot = self._weight, body.robot.feet["right"]
        along, across = max(foot.front_m, foot.back_m), max(foot.left_m, foot.right_m)
        most = dict(zip(COMPONENTS, (0.5, 0.5, 2.0, across, along, across), strict=True))
        rows: list[tuple[str, str, float, float, str]] = []
        for component, unit in COMPONENTS.items():
            upper = round(most[component] * weight, 3)
            text = f"of the ground's {component.replace('_', ' along ')} on the right sole"
            lower = -weight if component == "force_z" else -upper
            for k in range(self._count):
                rows.append((f"right_{component}_{unit}[{k}]", unit, lower, upper, f"coefficient {k} {text}"))
        self.variables = make_variables(*rows)

    def add_to(self, plan: Planner) -> Planner:
        names = [variable.name for variable in self.variables]

        def plan_with_load(point: InstantPoint, phase: SX, ops: Nonsmooth) -> Instant:
            instant, s = plan(point, phase, ops), SX.sym("s")
            values = ca.reshape(ca.vertcat(*(point[name] for name in names)), self._count, len(COMPONENTS))
            basis = load_basis(self._degree, s)
            shapes = ca.Function("shapes", [s], [basis, ca.jacobian(basis, s)])
            load, slope = (values.T @ shape for shape in shapes(phase))
            normal = slope[list(COMPONENTS).index("force_z")]
            return instant._replace(wrench=load, quantities={**instant.quantities, "load_slope": normal})

        return plan_with_load

    def start(self, names: Sequence[str], motion_start: Start | None) -> Start:
        """Start near a load that passes evenly to the right foot."""
        coefficients = [variable.name for variable in self.variables]
        places = [names.index(name) for name in coefficients]
        middle = np.zeros((len(COMPONENTS), self._count))
        middle[list(COMPONENTS).index("force_z"), :-RAMPS] = np.linspace(0.0, self._weight, self._degree + 1)

        def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
            lower, upper = (np.array([parameters[f"{name}.{end}"] for name in names]) for end in ("lower", "upper"))
            x = rng.uniform(lower, upper) if motion_start is None else motion_start(parameters, rng)
            width = START_SHARE * (upper - lower)[places] / 2
            x[places] = middle.ravel() + rng.uniform(-width, width)
            return x

        return start


def load_basis(degree: int, phase: SX) -> SX:
    """Return (degree + 3,) Bernstein polynomials of the phase, and cubic ramps down from its start and up to its end."""
    ramps = (ca.fmax(0, 1 - far / RAMP_SHARE) ** 3 for far in (phase, 1 - phase))
    return ca.vertcat(
        *(math.comb(degree, k) * phase**k * (1 - phase) ** (degree - k) for k in range(degree + 1)), *ramps
    )


def make_planned_loads(body: Body) -> Loader:
    """Return a function of the torques from the left foot with the planned wrench on the right one, and the ZMP of both feet."""
    left, right = body.robot.feet["left"], body.robot.feet["right"]
    tree = make_tree(body.robot, left.link)

    def loads(now: Instant) -> Instant:
        q, qd, qdd = ({name: motion[order] for name, motion in now.joints.items()} for order in range(3))
        feet, wrench = {side: ankle[:2] for side, ankle in now.ankles.items()}, now.wrench
        pushes = {right.link: balance.shift_up(wrench, right.ankle_height_m)}
        torques, at_ankle = newton_euler(tree, q, qd, qdd, body.gravity_vector, upright=body.upright, pushes=pushes)
        left_wrench = balance.shift_down(at_ankle, left.ankle_height_m)
        arm = ca.vertcat(feet["R"] - feet["L"], 0)
        both = left_wrench + wrench + ca.vertcat(SX(3, 1), ca.cross(arm, wrench[:3]))
        offset = balance.zmp_of_wrench(Wrench(both[:3], both[3:]), 0.0, body.weight)
        return now._replace(torques=torques, zmp=feet["L"] + offset, wrenches={"L": left_wrench, "R": wrench})

    return loads


SWITCH_LOAD = (
    "largest load, in weights, of the foot that has just landed and of the one about to lift; no limit by default"
)


class FootLimits(Limit):
    """What both soles can bear at every sample, and how fast load may pass.

    It reads ``load_slope``, the derivative of the load on the right sole with respect to the phase [N].
    """

    parameters = table(
        ("friction_coefficient", "1", balance.SOLE_FRICTION, "of both soles on the ground", 0.0, math.inf),
        ("load_rate_limit_1_s", "1/s", 12.5, "fastest change of a foot's load, in weights per second", 0.0, math.inf),
        ("switch_load_limit", "1", 1.0, SWITCH_LOAD, 0.0, math.inf),
    )

    def __init__(self, body: Body) -> None:
        self._feet, self._weight = body.robot.feet, body.weight

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
        n, mu = samples.steps + 1, point["friction_coefficient"]
        rows, loads = [], {}
        for side, foot in BOTH_FEET.items():
            kinds = _make_bearing_function(self._feet[foot]).map(n)(samples.wrench(side), ca.repmat(mu, 1, n))
            for (name, unit, names), values in zip(ROWS, kinds, strict=True):
                rows.append(make_rows_at_samples(f"{foot}_{name}", unit, values, names, MX(0.0)))
            loads[foot] = samples.wrench(side)[2, :] / self._weight
        # The right foot's load is known with its slope, the left one has the rest of a total that changes slowly.
        right = samples.read("load_slope") / (samples.step_s * samples.steps * self._weight)
        total = loads["left"] + loads["right"]
        changes = (total[1:] - total[:-1]) / samples.step_s
        rates = {"left": ca.horzcat(changes[0], (changes[:-1] + changes[1:]) / 2, changes[-1]) - right, "right": right}
        limit, names = point["load_rate_limit_1_s"], make_labels(tuple(rates), range(n))
        ends = ca.vertcat(loads["right"][0], loads["left"][-1])
        feet = ("right, landed", "left, lifting")
        return (
            *rows,
            make_rows("load_rate", "1/s", ca.vec(ca.vertcat(*rates.values())), -limit, limit, names, "samples"),
            make_rows("switch_load", "1", ends, None, point["switch_load_limit"], feet, over="once"),
        ), {"load_rate_1_s": ca.mmax(ca.fabs(ca.vertcat(*rates.values()))), "switch_load": ca.mmax(ends)}


ROWS = (("friction", "N", CORNERS), ("pressure", "Nm", CORNERS), ("turning", "Nm", TURNS))


def _make_bearing_function(foot: Foot) -> ca.Function:
    wrench, mu = SX.sym("wrench", 6), SX.sym("mu")
    limits = balance.sole_limits(wrench, (-foot.back_m, foot.front_m), (-foot.right_m, foot.left_m), mu)
    return ca.Function("bearing", [wrench, mu], list(limits))
