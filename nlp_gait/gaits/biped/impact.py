"""Inelastic impact of the landing foot: momentum, energy and rates at touch-down.

The left sole stands, the right one lands with a velocity and stays on the ground at once: it neither slips nor rebounds, and the
standing sole is not lifted. Positions do not change. Afterwards the robot moves as double support plans it, by velocities v of
hip and planned angles, both soles at rest, so that the rates of all joints are qd+ = D v. The drives that keep the robot to this
plan do no work on such motions, and the momentum along each of them is kept (Gauss's principle, as for any inelastic impact):

    D' M(q) (qd+ - qd-) = 0,        loss of energy = (qd+ - qd-)' M(q) (qd+ - qd-) / 2        (Carnot's theorem)
"""

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
from casadi import MX, SX

from nlp_gait.formulation import Constraint, InstantPoint, Point, Variable
from nlp_gait.gaits.biped.body import Body, Support
from nlp_gait.gaits.biped.limits import make_rows
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.gaits.biped.switch import Switch, SwitchState, make_state_variables, read_rates
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.dynamics import newton_euler
from nlp_gait.symbolic.nonsmooth import Nonsmooth

LANDING, LANDING_M_S = "foot_vx_touch_down_m_s", 0.5  # variable; its greatest value, of NAO
AFTER = "after_touch_down"  # in names of the variables of the velocities after it


@dataclass(frozen=True, kw_only=True)
class Impact(Switch):
    """A touch-down at which the landing foot stops at once, and all joints go on with other rates, which are variables."""

    def make_variables(self, body: Body) -> list[Variable]:
        """Return the velocities right after it, of the hip and of every coordinate, and that of the landing foot before it."""
        fastest, words = body.scale_time(LANDING_M_S * body.swing_speed), "forward velocity of the landing foot"
        speed = Variable(name=LANDING, unit="m/s", lower=0.0, upper=fastest, description=words)
        return [*make_rate_variables(body), speed]

    def read_landing_speed(self, point: InstantPoint) -> SX:
        """Return the forward velocity at which the swinging foot lands [m/s]."""
        return point[LANDING]

    def change_state(self, body: Body, point: InstantPoint, before: SwitchState) -> SwitchState:
        """Return the state after it: positions are those before it."""
        velocity, rates = read_rates(point, AFTER, body.coordinates)
        return before._replace(hip_velocity=velocity, angle_rates=rates)

    def change_start(self, start: Mapping[str, float], parameters: Mapping[str, float]) -> Mapping[str, float]:
        """Return a start point with the softest landing, at which no velocity jumps."""
        continuous = {name: start[name.replace(AFTER, "touch_down")] for name in start if AFTER in name}
        return {**start, **continuous, LANDING: parameters[f"{LANDING}.lower"]}

    def join(
        self, phases: Mapping[Support, Phase], point: Point, before: Samples, after: Samples, ops: Nonsmooth
    ) -> tuple[list[Constraint], dict[str, MX]]:
        """Return the rows and indexes of any switch, and of the impact: momentum [N s], energy [J], rates [rad/s]."""
        rows, indexes = super().join(phases, point, before, after, ops)
        single, double = phases[Support.SINGLE], phases[Support.DOUBLE]
        body = single.body
        landing = single.sample(point, ops, MX(1.0)).all_qd[:, 0]
        variables = make_rate_variables(body)
        names = [variable.name for variable in variables]
        # The rates of joints are linear in the planned velocities: one instant for each unit velocity.
        units = [point.with_values({name: MX(float(name == unit)) for name in names}) for unit in names]
        instants = double.sample_several(units, ops, MX(0.0))
        directions = ca.horzcat(*(instant.all_qd for instant in instants))
        jump = directions @ ca.vertcat(*(point[name] for name in names)) - landing
        impulses, force = make_impulses(body)(instants[0].all_q, jump)
        for variable, change in zip(variables, ca.vertsplit(directions.T @ impulses), strict=True):
            unit = "N s" if variable.unit == "m/s" else "Nm s"
            name = f"{self.name}_momentum_{variable.name.split(AFTER)[0].removesuffix('_')}"
            rows.append(make_rows(name, unit, change, MX(0.0), MX(0.0), over="once", size=body.torque_scale))
        return rows, indexes | {
            f"{self.name}_energy_loss_J": ca.dot(jump, impulses) / 2,
            f"{self.name}_impulse_Ns": ca.norm_2(force),
            f"{self.name}_rate_jump_rad_s": ca.norm_inf(jump),
        }


def make_rate_variables(body: Body) -> list[Variable]:
    """Return the variables of the velocities right after an impact, of the hip and of every coordinate."""
    return [v for v in make_state_variables(body, AFTER, "touch_down") if v.unit in ("m/s", "rad/s")]


def make_impulses(body: Body) -> ca.Function:
    """Return the function of angles and jumps of rates (J, 1) to M(q) times the jumps [Nm s] and the ground's impulse (3,) [N s].

    The robot stands on its left sole. They are the torques and the force of inverse dynamics without gravity and velocities, in
    which the jumps take the place of accelerations.
    """
    q, jump = (SX.sym(name, len(body.joints)) for name in ("q", "jump"))
    tree = make_tree(body.robot, body.robot.feet["left"].link, body.joints)
    angles, accelerations = (dict(zip(body.joints, ca.vertsplit(vector), strict=True)) for vector in (q, jump))
    torques, wrench = newton_euler(tree, angles, dict.fromkeys(body.joints, SX(0)), accelerations, (0.0, 0.0, 0.0))
    return ca.Function("impulses", [q, jump], [ca.vertcat(*(torques[name] for name in body.joints)), wrench.force])
