"""A support phase of a spatial biped sampled over time: its motion and the loads on motors and ground."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import (
    Array,
    Assembly,
    Grid,
    InstantPoint,
    NumericPoint,
    Parameter,
    Signals,
    make_vector_columns,
)
from nlp_gait.formulation.assembly import Point, RowsOverTime, Variable
from nlp_gait.formulation.display import SIMULATED
from nlp_gait.formulation.gait_problem import Start
from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.limits import REACH_MARGIN, Limit
from nlp_gait.gaits.biped.samples import BOTH_FEET, LEAST_DURATION, Instant, Loader, Planner, Samples, Trace
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import centre_of_mass, forward_kinematics
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth
from nlp_gait.symbolic.tape import simplify, tabulate_last_input
from nlp_gait.symbolic.trajectories import Motion

# Analytic ones, or differences of the sampled angles: central, one-sided at the ends of first order as in MATLAB's ``gradient``,
# the paper's environment, or of second order.
Derivatives = Literal["analytic", "finite-difference", "finite-difference-2"]

# Force of the ground on each sole, and its moment about the point under the ankle.
WRENCHES = {
    f"{foot}_{half}": make_vector_columns(unit)
    for foot in BOTH_FEET.values()
    for half, unit in (("force", "N"), ("moment", "Nm"))
}
COLUMNS = {
    "zmp": make_vector_columns("m", "xy"),
    **{name: make_vector_columns("m") for name in ("hip", "com", "left_foot", "right_foot")},
    **WRENCHES,
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Phase:
    """A support phase: how the robot moves, which loads that causes, what limits it and what it minimises."""

    body: Body
    variables: tuple[Variable, ...]  # of the motion, in the order of x
    duration: str  # variable that holds the phase's duration
    plan: Planner
    loads: Loader  # torques and ZMP
    grid: Grid  # its samples
    derivatives: Derivatives = "analytic"  # analytic ones, or finite differences of the sampled angles as in the paper
    limits: Sequence[Limit] = ()  # they add the rows
    goal: Goal = Goal()  # what it minimises
    state: tuple[Parameter, ...] = ()  # at the start, if it is measured
    kinks: tuple[float, ...] = ()  # phases at which the motion's formula changes: knots of splines
    start: Start | None = None  # start points; None for any within the bounds

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Of the goal and of all limits; pairs of bounds are last because there are many."""
        own = (self.goal.heat, *self.state, *(parameter for limit in self.limits for parameter in limit.parameters))
        return tuple(sorted(own, key=lambda parameter: parameter.name.endswith((".lower", ".upper"))))

    def assemble(self, at: Point, ops: Nonsmooth, samples: Samples | None = None) -> Assembly:
        """Return the rows of all limits, the goal, and the indexes of both; by default at all samples."""
        samples = self.sample(at, ops) if samples is None else samples
        added = [limit.add(at, samples, ops) for limit in self.limits]
        value, before, after = self.goal.evaluate(at, samples, ops)
        indexes = {name: index for _, own in added for name, index in own.items()}
        return Assembly(
            objective=value,
            constraints=tuple(row for rows, _ in added for row in rows),
            indexes={**before, **indexes, **after},
        )

    def sample(self, at: Point, ops: Nonsmooth, phases: MX | None = None) -> Samples:
        """Evaluate the phase at N + 1 equidistant samples, or with analytic derivatives at other phases (1, k); one map."""
        return self.sample_several([at], ops, phases)[0]

    def sample_several(self, ats: Sequence[Point], ops: Nonsmooth, phases: MX | None = None) -> list[Samples]:
        """Evaluate the phase at several points in one map, each as ``sample`` does; several need analytic derivatives."""
        traces, reads_wrenches = self._traces, self._reads_wrenches
        if self.derivatives == "analytic":
            reads_motion = self._reads_motion
            found = self._map_instant(ats, ops, phases)
        else:
            kinematics = self._write_kinematics(*self._symbolic_plan(ops), traces, self.moving)
            q, _, _, hip, planned, reach, world, _, *seen = self._map(kinematics, ats)
            n = self.grid.parts + 1
            qd, qdd = self._differences(q, ats[0])
            torque, moving, zmp = self._dynamics.map(n)(q, qd, qdd, hip, world)
            wrenches = list(self._ground.map(n)(q, qd, qdd, hip, world)) if reads_wrenches else []
            found = [planned, reach, torque, qd * moving, zmp, MX(0, n), *wrenches, q, qd, qdd, *seen]
            reads_motion = True
        columns = [[part] if len(ats) == 1 else ca.horzsplit(part, part.shape[1] // len(ats)) for part in found]
        counts = (len(BOTH_FEET) * reads_wrenches, 3 * reads_motion, len(traces))
        several = list[Samples]()
        for k, at in enumerate(ats):
            planned, reach, torque, power, zmp, miss, *rest = (part[k] for part in columns)
            pushes, moved, seen = ([rest.pop(0) for _ in range(count)] for count in counts)
            several.append(
                Samples(
                    joints=self.body.joints,
                    moving=self.moving,
                    per_interval=self.grid.samples_per_interval if phases is None else 1,
                    duration=at[self.duration],
                    planned=planned,
                    reach=reach,
                    torque=torque,
                    power=power,
                    zmp=zmp,
                    miss=miss,
                    wrenches=dict(zip(BOTH_FEET, pushes, strict=False)),
                    traces=dict(zip(traces, seen, strict=True)),
                    **dict(zip(("q", "qd", "qdd"), moved, strict=False)),
                )
            )
        return several

    def rows_over_time(self, name: str = "", begins: tuple[str, ...] = ()) -> tuple[RowsOverTime, ...]:
        """Return the phase as functions of time, after those of the durations ``begins``; nothing with finite differences."""
        if self.derivatives != "analytic":
            return ()

        def assemble(at: Point, phases: MX, ops: Nonsmooth) -> Assembly:
            return self.assemble(at, ops, self.sample(at, ops, phases))

        def times(values: Mapping[str, float]) -> tuple[float, float]:
            start = sum(max(values[earlier], LEAST_DURATION) for earlier in begins)
            return start, start + max(values[self.duration], LEAST_DURATION)

        intervals, means = self.grid.intervals, ("power_W", "paper_power_W", "dbm_x_mean_m", "dbm_y_mean_m")
        rows = RowsOverTime(
            name=name, assemble=assemble, times=times, intervals=intervals, means=means, kinks=self.kinks
        )
        return (rows,)

    def signals(self, at: NumericPoint) -> Signals:
        """Return time histories at a point of numbers."""
        q, qd, qdd, hip, _, _, world, attitude = self._map(self._exact_kinematics, [at])
        if self.derivatives != "analytic":
            qd, qdd = self._differences(q, at)
        n = self.grid.parts + 1
        rows = [self.body.joints.index(name) for name in self.moving]
        torque, zmp, *wrenches = self._signal_loads.map(n)(q[rows, :], qd[rows, :], qdd[rows, :], hip, world)
        com, left, right, *_ = (_to_array(part) for part in ca.vertsplit(world, 3))
        halves = (_to_array(half) for wrench in wrenches for half in ca.vertsplit(wrench, 3))
        arrays = {
            "t": _to_array(at[self.duration] * DM(np.linspace(0.0, 1.0, n)).T)[:, 0],
            "q": _to_array(q),
            "qd": _to_array(qd),
            "qdd": _to_array(qdd),
            "tau": _to_array(torque),
            "zmp": _to_array(zmp),
            "hip": _to_array(hip),
            "com": com,
            "left_foot": left,
            "right_foot": right,
            **dict(zip(WRENCHES, halves, strict=True)),
        }
        if attitude.shape[0]:
            arrays["attitude"] = _to_array(attitude)
        if self._exact_plan[1].yaw.shape[0]:
            yaw = _to_array(world)[:, -1]
            arrays["feet_yaw"] = np.stack([np.zeros(n), yaw], axis=1)
        columns = COLUMNS | {name: SIMULATED[name] for name in ("attitude", "feet_yaw") if name in arrays}
        return Signals(joints=self.body.joints, arrays=arrays, columns=columns)

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Joints whose angle changes over the phase."""
        joints = self._exact_plan[1].joints
        return tuple(name for name in self.body.joints if not joints[name].velocity.is_zero())

    @cached_property
    def _exact_kinematics(self) -> ca.Function:
        return self._write_kinematics(*self._exact_plan, {}, self.body.joints)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return tuple(variable.name for variable in self.variables)

    @cached_property
    def _exact_plan(self) -> tuple[list[SX], Instant, InstantPoint]:
        return self._symbolic_plan(Exact())

    @property
    def known(self) -> tuple[str, ...]:
        """Names of the parameters that the motion reads."""
        return (REACH_MARGIN, *(parameter.name for parameter in self.state))

    def _symbolic_plan(self, ops: Nonsmooth) -> tuple[list[SX], Instant, InstantPoint]:
        x, known, phase = SX.sym("x", len(self.variables)), SX.sym("margin", len(self.known)), SX.sym("phase")
        at = InstantPoint.of(x, known, self.names, self.known)
        return [x, known, phase], self.plan(at, phase, ops), at

    @property
    def _traces(self) -> dict[str, Trace]:
        return {name: trace for limit in self.limits for name, trace in limit.traces.items()}

    @property
    def _reads_wrenches(self) -> bool:
        return any(limit.reads_wrenches for limit in self.limits)

    @property
    def _reads_motion(self) -> bool:
        return self.goal.reads_motion or any(limit.reads_motion for limit in self.limits)

    @cached_property
    def _exact_instant(self) -> ca.Function:
        inputs, outputs = self._instant_outputs(Exact())
        return ca.Function("sample", inputs, simplify(outputs))

    def _map_instant(self, ats: Sequence[Point], ops: Nonsmooth, phases: MX | None) -> list[Any]:
        """Evaluate one instant at all samples, or at other phases; its open equations become rows of gradient solvers."""
        if ops.exact:  # the judge, the proofs and the start points share it
            return self._map(self._exact_instant, ats, phases=phases)
        inputs, outputs = self._instant_outputs(ops)
        roots = ops.open_roots()
        if roots is None:
            return self._map(ca.Function("sample", inputs, simplify(outputs)), ats, phases=phases)
        (start,) = self._map(ca.Function("start", inputs, simplify([roots.start])), ats, phases=phases)
        tied = ca.Function("sample", [roots.unknowns, *inputs], simplify([roots.residual, *outputs]))
        found: list[Any] = []

        def residual(unknowns: MX) -> MX:
            rows, *rest = self._map(tied, ats, unknowns, phases=phases)
            found.extend(rest)
            return rows

        ops.tie_roots(start, residual)
        return found

    def _instant_outputs(self, ops: Nonsmooth) -> tuple[list[SX], list[SX]]:
        """Return x, margin and phase of one instant, and its outputs for ``sample``, with analytic derivatives."""
        inputs, plan, at = self._exact_plan if ops.exact else self._symbolic_plan(ops)
        loads = self.loads(plan)
        power = ca.vertcat(*(plan.joints[name].velocity * loads.torques[name] for name in self.moving))
        planned = ca.vertcat(*(plan.joints[name].position for name in self.body.planned))
        torque = ca.vertcat(*(loads.torques[name] for name in self.body.joints))
        outputs = [planned, plan.reach, torque, power, loads.zmp, plan.miss]
        outputs += [loads.wrenches[side] for side in BOTH_FEET] if self._reads_wrenches else []
        outputs += _stack_motions(plan, self.moving) if self._reads_motion else []
        outputs += [trace(at, inputs[2]) for trace in self._traces.values()]
        return inputs, outputs

    def _write_kinematics(
        self, inputs: list[SX], plan: Instant, at: InstantPoint, traces: Mapping[str, Trace], joints: Sequence[str]
    ) -> ca.Function:
        """One sample: motion, hip, planned angles, reach, world (mass centre, feet, planned wrench, yaw), attitude, traces."""
        planned = ca.vertcat(*(plan.joints[name].position for name in self.body.planned))
        tree = make_tree(self.body.robot, self.body.robot.feet["left"].link)
        angles = {name: joint.position for name, joint in plan.joints.items()}
        com = centre_of_mass(tree, forward_kinematics(tree, angles, plan.ankles["L"]))
        soles = [
            plan.ankles[side] - SX([0, 0, self.body.robot.feet[foot].ankle_height_m])
            for side, foot in BOTH_FEET.items()
        ]
        world = ca.vertcat(com, *soles, plan.wrench, plan.yaw)
        seen = [trace(at, inputs[2]) for trace in traces.values()]
        known = [plan.hip, planned, plan.reach, world, plan.attitude]
        return ca.Function("kinematics", inputs, [*_stack_motions(plan, joints), *known, *seen])

    @cached_property
    def _dynamics(self) -> ca.Function:
        """One sample: torques, those of the moving joints, and ZMP."""
        inputs, loads = self._loads
        torque, moving = (
            ca.vertcat(*(loads.torques[name] for name in names)) for names in (self.body.joints, self.moving)
        )
        return ca.Function("dynamics", inputs, simplify([torque, moving, loads.zmp]))

    @cached_property
    def _ground(self) -> ca.Function:
        """One sample: wrenches (6,) on both soles."""
        inputs, loads = self._loads
        return ca.Function("ground", inputs, simplify([loads.wrenches[side] for side in BOTH_FEET]))

    @cached_property
    def _signal_loads(self) -> ca.Function:
        """One sample: torques, ZMP and wrenches; not simplified, which takes longer than evaluating it as often as signals do."""
        inputs, loads = self._loads
        torque = ca.vertcat(*(loads.torques[name] for name in self.body.joints))
        return ca.Function("loads", inputs, [torque, loads.zmp, *(loads.wrenches[side] for side in BOTH_FEET)])

    @cached_property
    def _loads(self) -> tuple[list[SX], Instant]:
        """Return angles, both derivatives, hip and world (see ``_write_kinematics``), and the loads as functions of these."""
        plan = self._exact_plan[1]
        parts = [SX.sym(name, len(self.moving)) for name in ("q", "qd", "qdd")]
        sizes = (3, 3, 3, plan.wrench.shape[0], plan.yaw.shape[0])
        hip, world = SX.sym("hip", 3), SX.sym("world", sum(sizes))
        _, left, right, wrench, yaw = ca.vertsplit(world, np.cumsum([0, *sizes]).tolist())
        moved = {name: Motion(*(part[i] for part in parts)) for i, name in enumerate(self.moving)}
        now = Instant(joints={**plan.joints, **moved}, hip=hip, ankles={"L": left, "R": right}, wrench=wrench, yaw=yaw)
        return [*parts, hip, world], self.loads(now)

    def _map(self, function: ca.Function, ats: Sequence[Point], *columns: MX, phases: MX | None = None) -> list[Any]:
        """Evaluate a function of columns and (x, margin, phase) at all samples, or at other phases (1, k), of each point.

        Columns are those of its inputs that differ from sample to sample.
        """
        n = self.grid.parts + 1 if phases is None else int(phases.shape[1])
        last: Any = phases
        if phases is None:
            function, last = tabulate_last_input(function, DM(np.linspace(0.0, 1.0, n)).T)
        points = [
            [
                ca.repmat(at.select(self.names).x, 1, n),
                ca.repmat(ca.vertcat(*(at[name] for name in self.known)), 1, n),
                last,
            ]
            for at in ats
        ]
        inputs = points[0] if len(ats) == 1 else [ca.horzcat(*parts) for parts in zip(*points, strict=True)]
        return list(function.map(n * len(ats)).call([*columns, *inputs]))

    def _differences(self, q: MX, at: Point) -> tuple[MX, MX]:
        """Differentiate sampled angles (m, N + 1) twice: central differences, one-sided at the ends.

        Source:
            Gupta, Pratihar, Deb (2023), section 3.1: "numerical differentiation as per the given time interval".
        """
        n = self.grid.parts + 1
        stencil = np.zeros((n, n))
        end = (-1.0, 1.0) if self.derivatives == "finite-difference" else (-1.5, 2.0, -0.5)
        stencil[0, : len(end)] = end
        stencil[-1, -len(end) :] = [-part for part in reversed(end)]
        for k in range(1, n - 1):
            stencil[k, k - 1], stencil[k, k + 1] = -0.5, 0.5
        rate = ca.sparsify(DM(stencil)).T * (self.grid.parts / ca.fmax(at[self.duration], LEAST_DURATION))
        qd = q @ rate
        return qd, qd @ rate


def _stack_motions(plan: Instant, joints: Sequence[str]) -> list[SX]:
    return [ca.vertcat(*(plan.joints[name][order] for name in joints)) for order in range(3)]


def _to_array(values: Any) -> Array:
    return np.ascontiguousarray(DM(values).full().T)  # in one order: sums over joints round as those of copies do
