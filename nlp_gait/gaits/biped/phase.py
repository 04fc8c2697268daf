"""A support phase of a spatial biped sampled over time: its motion and the loads on motors and ground."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, Literal, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import (
    Array,
    Assembly,
    Grid,
    InstantPoint,
    NumericPoint,
    Objective,
    Parameter,
    Signals,
    make_vector_columns,
)
from nlp_gait.formulation.assembly import Point, RowsOverTime, Variable
from nlp_gait.formulation.display import SIMULATED
from nlp_gait.formulation.gait_problem import Start
from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.biped.limits import GOALS, REACH_MARGIN, Goal, Limit
from nlp_gait.gaits.biped.samples import (
    BOTH_FEET,
    LEAST_DURATION,
    USUAL,
    Instant,
    Loader,
    Planner,
    Quantity,
    SampledMotion,
    Samples,
)
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


# Time histories by name.
HISTORIES = {
    "q": Samples.all_q,
    "qd": Samples.all_qd,
    "qdd": Samples.all_qdd,
    "tau": Samples.torque,
    "zmp": Samples.zmp,
    "hip": Samples.hip,
    "com": Samples.com,
    "left_foot": Samples.left_foot,
    "right_foot": Samples.right_foot,
}
IN_TIME = (*HISTORIES.values(), Samples.wrench_left, Samples.wrench_right, Samples.attitude, Samples.yaw)
ALL_JOINTS = (Samples.all_q, Samples.all_qd, Samples.all_qdd)


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
    goal: Goal = GOALS["power"]  # what it minimises
    standing: tuple[str, ...] = ("L", "R")  # sides of the feet on the ground
    kinks: tuple[float, ...] = ()  # phases at which the motion's formula changes: knots of splines
    start: Start | None = None  # start points; None for any within the bounds

    @property
    def decisions(self) -> tuple[Variable, ...]:
        """Variables of the problem, in the order of x."""
        return self.variables

    @property
    def objective(self) -> Objective:
        """What is minimised."""
        return self.goal.objective

    @property
    def durations(self) -> tuple[str, ...]:
        """Variables of the durations, in the order of time."""
        return (self.duration,)

    @property
    def every_limit(self) -> tuple[Limit, ...]:
        """The phase's limits, and those that the user has added."""
        return (*self.limits, *self.body.added_limits.select(self.standing))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Of the goal and of all limits; pairs of bounds are last because there are many."""
        unique: dict[str, Parameter] = {}
        of_limits = (parameter for limit in self.every_limit for parameter in limit.parameters)
        for parameter in (self.body.heat, *of_limits):
            unique.setdefault(parameter.name, parameter)
        return tuple(sorted(unique.values(), key=lambda parameter: parameter.name.endswith((".lower", ".upper"))))

    def assemble(self, point: Point, ops: Nonsmooth, samples: Samples | None = None) -> Assembly:
        """Return the rows of all limits, the goal, and the metrics of both; by default at all samples."""
        samples = self.sample(point, ops) if samples is None else samples
        added = [limit.add(point, samples, ops) for limit in self.every_limit]
        value, metrics = self.goal.evaluate(point, samples, ops)
        return Assembly(
            objective=value,
            constraints=tuple(row for rows, _ in added for row in rows),
            metrics={**metrics, **{name: metric for _, of_limit in added for name, metric in of_limit.items()}},
        )

    def sample(self, point: Point, ops: Nonsmooth, phases: MX | None = None) -> Samples:
        """Evaluate the phase at N + 1 equidistant samples, or with analytic derivatives at other phases (1, k); one map."""
        return self.sample_several([point], ops, phases)[0]

    def sample_several(self, points: Sequence[Point], ops: Nonsmooth, phases: MX | None = None) -> list[Samples]:
        """Evaluate the phase at several points in one map, each as ``sample`` does; several need analytic derivatives."""
        motion = self._evaluate(points, ops, phases)
        return [
            Samples(
                joints=self.body.joints,
                moving=self.moving,
                standing=self.standing,
                grid=self.grid if phases is None else Grid(intervals=max(int(phases.shape[1]) - 1, 1)),
                duration=point[self.duration],
                progress=self.grid.progress if phases is None else phases,
                evaluate=partial(motion.read, k),
            )
            for k, point in enumerate(points)
        ]

    @property
    def usual(self) -> tuple[Quantity, ...]:
        """Quantities that are evaluated together: those of every phase, and what its limits are likely to read besides."""
        reads = (
            *self.goal.reads,
            *(quantity for limit in self.every_limit for quantity in getattr(limit, "reads", ())),
        )
        return tuple(dict.fromkeys((*USUAL, *reads)))

    def _evaluate(self, points: Sequence[Point], ops: Nonsmooth, phases: MX | None) -> SampledMotion:
        """Return the motion at each point, of which the usual quantities are evaluated."""
        if self.derivatives != "analytic":
            planned = self._symbolic_plan(ops)

            def evaluate(quantities: Sequence[Quantity]) -> Sequence[MX]:
                stages = self._make_stages(planned, quantities)
                columns = [self._evaluate_stages(stages, point) for point in points]
                return [ca.horzcat(*(values[quantity] for values in columns)) for quantity in quantities]

            motion = SampledMotion(evaluate, len(points))
        else:
            motion = self._map_instant(points, ops, phases)
            if not ops.exact:
                return motion
        motion.store(self.usual, motion.evaluate(self.usual))
        return motion

    def rows_over_time(self, name: str = "", begins: tuple[str, ...] = ()) -> tuple[RowsOverTime, ...]:
        """Return the phase as functions of time, after those of the durations ``begins``; nothing with finite differences."""
        if self.derivatives != "analytic":
            return ()

        def assemble(point: Point, phases: MX, ops: Nonsmooth) -> Assembly:
            return self.assemble(point, ops, self.sample(point, ops, phases))

        def times(values: Mapping[str, float]) -> tuple[float, float]:
            start = sum(max(values[earlier], LEAST_DURATION) for earlier in begins)
            return start, start + max(values[self.duration], LEAST_DURATION)

        intervals, means = self.grid.intervals, ("power_W", "dbm_x_mean_m", "dbm_y_mean_m")
        rows = RowsOverTime(
            name=name, assemble=assemble, times=times, intervals=intervals, means=means, kinks=self.kinks
        )
        return (rows,)

    def signals(self, point: NumericPoint) -> Signals:
        """Return time histories at a point of numbers."""
        n = self.grid.parts + 1
        phases = DM(np.linspace(0.0, 1.0, n)).T
        evaluated = self._evaluate_histories(point, phases)
        histories = {quantity: _to_array(values) for quantity, values in evaluated.items()}
        arrays = {
            "t": _to_array(point[self.duration] * phases)[:, 0],
            **{name: histories[quantity] for name, quantity in HISTORIES.items()},
            **{
                f"{foot}_{half}": rows
                for foot, wrench in (("left", Samples.wrench_left), ("right", Samples.wrench_right))
                for half, rows in zip(("force", "moment"), np.hsplit(histories[wrench], 2), strict=True)
            },
        }
        if histories[Samples.attitude].size:
            arrays["attitude"] = histories[Samples.attitude]
        if histories[Samples.yaw].size:
            arrays["feet_yaw"] = np.column_stack([np.zeros(n), histories[Samples.yaw]])
        columns = COLUMNS | {name: SIMULATED[name] for name in ("attitude", "feet_yaw") if name in arrays}
        return Signals(joints=self.body.joints, arrays=arrays, columns=columns)

    def _evaluate_histories(self, point: NumericPoint, phases: DM) -> dict[Quantity, Any]:
        return self._evaluate_stages(self._history_stages, point, phases)

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Joints whose angle changes over the phase."""
        joints = self._exact_plan[1].joints
        return tuple(name for name in self.body.joints if not joints[name].velocity.is_zero())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return tuple(variable.name for variable in self.variables)

    @cached_property
    def _exact_plan(self) -> tuple[list[SX], Instant]:
        return self._symbolic_plan(Exact())

    def _symbolic_plan(self, ops: Nonsmooth) -> tuple[list[SX], Instant]:
        x, margin, phase = SX.sym("x", len(self.variables)), SX.sym("margin"), SX.sym("phase")
        point = InstantPoint.of(x, margin, self.names, (REACH_MARGIN,))
        return [x, margin, phase], self.plan(point, phase, ops)

    @cached_property
    def _exact_now(self) -> Instant:
        return self.loads(self._exact_plan[1])

    @cached_property
    def _exact_functions(self) -> dict[tuple[Quantity, ...], ca.Function]:
        return {}

    def _make_exact_function(self, quantities: Sequence[Quantity]) -> ca.Function:
        """Return the function of one instant to quantities, made once: the judge, the proofs and the start points share it."""
        key, inputs = tuple(quantities), self._exact_plan[0]
        if key not in self._exact_functions:
            outputs = [quantity.measure(self, self._exact_now) for quantity in quantities]
            self._exact_functions[key] = ca.Function("sample", inputs, simplify(outputs))
        return self._exact_functions[key]

    def _map_instant(self, points: Sequence[Point], ops: Nonsmooth, phases: MX | None) -> SampledMotion:
        """Return one instant at all samples, or at other phases; its open equations become rows of gradient solvers."""
        if ops.exact:
            return SampledMotion(
                lambda quantities: self._map(self._make_exact_function(quantities), points, phases=phases), len(points)
            )
        inputs, plan = self._symbolic_plan(ops)
        now = self.loads(plan)
        implicit = ops.collect_implicit_variables()
        unknowns: list[MX] = []  # columns of the open equations' unknowns, if there are any
        symbols = [] if implicit is None else [implicit.unknowns]

        def evaluate(quantities: Sequence[Quantity], *first: SX) -> list[MX]:
            outputs = [*first, *(quantity.measure(self, now) for quantity in quantities)]
            return self._map(
                ca.Function("sample", [*symbols, *inputs], simplify(outputs)), points, *unknowns, phases=phases
            )

        motion = SampledMotion(evaluate, len(points))
        if implicit is None:
            motion.store(self.usual, evaluate(self.usual))
            return motion
        (start,) = self._map(ca.Function("start", inputs, simplify([implicit.start])), points, phases=phases)

        def residual(columns: MX) -> MX:
            unknowns.append(columns)
            rows, *values = evaluate(self.usual, implicit.residual)
            motion.store(self.usual, values)
            return rows

        ops.add_implicit_variables(start, residual)
        return motion

    def _make_stages(self, planned: tuple[list[SX], Instant], quantities: Sequence[Quantity]) -> "Stages":
        """Return the evaluation of quantities in two stages: the motion, then the loads that it causes."""
        inputs, plan = planned
        of_motion = [quantity for quantity in quantities if quantity.of_motion]
        of_loads = [quantity for quantity in quantities if quantity not in {*of_motion, *ALL_JOINTS}]
        world = [plan.hip, *plan.ankles.values(), plan.yaw]
        outputs = [*(quantity.measure(self, plan) for quantity in ALL_JOINTS), ca.vertcat(*world)]
        outputs += [quantity.measure(self, plan) for quantity in of_motion]
        motion = ca.Function("motion", inputs, outputs)
        orders = [SX.sym(name, len(self.moving)) for name in ("q", "qd", "qdd")]
        given = SX.sym("world", ca.vertcat(*world).shape[0])
        ends = np.cumsum([0, *(vector.shape[0] for vector in world)]).tolist()
        hip, left, right, yaw = ca.vertsplit(given, ends)
        moved = {name: Motion(*(order[i] for order in orders)) for i, name in enumerate(self.moving)}
        joints = {**self._exact_plan[1].joints, **moved}
        now = self.loads(Instant(joints=joints, hip=hip, ankles={"L": left, "R": right}, yaw=yaw))
        loads = ca.Function("loads", [*orders, given], [q.measure(self, now) for q in of_loads])
        return Stages(motion, loads, of_motion, of_loads)

    def _evaluate_stages(self, stages: "Stages", point: Point, phases: DM | None = None) -> dict[Quantity, Any]:
        """Evaluate quantities at all samples; derivatives may be finite differences."""
        q, qd, qdd, world, *of_motion = self._map(stages.motion, [point], phases=phases)
        if self.derivatives != "analytic":
            qd, qdd = self._differences(q, point)
        rows = [self.body.joints.index(name) for name in self.moving]
        loads = stages.loads.map(self.grid.parts + 1).call([q[rows, :], qd[rows, :], qdd[rows, :], world])
        values = dict(zip(stages.of_motion, of_motion, strict=True)) | dict(zip(stages.of_loads, loads, strict=True))
        return values | dict(zip(ALL_JOINTS, (q, qd, qdd), strict=True))

    @cached_property
    def _history_stages(self) -> "Stages":
        return self._make_stages(self._exact_plan, IN_TIME)

    def _map(self, function: ca.Function, points: Sequence[Point], *columns: MX, phases: MX | None = None) -> list[Any]:
        """Evaluate a function of columns and (x, margin, phase) at all samples, or at other phases (1, k), of each point.

        Columns are those of its inputs that differ from sample to sample.
        """
        n = self.grid.parts + 1 if phases is None else int(phases.shape[1])
        last: Any = phases
        if phases is None:
            function, last = tabulate_last_input(function, DM(np.linspace(0.0, 1.0, n)).T)
        blocks = [
            [
                ca.repmat(point.select(self.names).x, 1, n),
                ca.repmat(point[REACH_MARGIN], 1, n),
                last,
            ]
            for point in points
        ]
        inputs = [ca.horzcat(*rows) for rows in zip(*blocks, strict=True)]
        return list(function.map(n * len(points)).call([*columns, *inputs]))

    def _differences(self, q: MX, point: Point) -> tuple[MX, MX]:
        """Differentiate sampled angles (m, N + 1) twice: central differences, one-sided at the ends.

        Source:
            Gupta, Pratihar, Deb (2023), section 3.1: "numerical differentiation as per the given time interval".
        """
        n = self.grid.parts + 1
        stencil = np.zeros((n, n))
        end = (-1.0, 1.0) if self.derivatives == "finite-difference" else (-1.5, 2.0, -0.5)
        stencil[0, : len(end)] = end
        stencil[-1, -len(end) :] = [-weight for weight in reversed(end)]
        for k in range(1, n - 1):
            stencil[k, k - 1], stencil[k, k + 1] = -0.5, 0.5
        rate = ca.sparsify(DM(stencil)).T * (self.grid.parts / ca.fmax(point[self.duration], LEAST_DURATION))
        qd = q @ rate
        return qd, qd @ rate


class Stages(NamedTuple):
    """Functions of the motion and of the loads that it causes at one instant, and their outputs."""

    motion: ca.Function
    loads: ca.Function
    of_motion: Sequence[Quantity]
    of_loads: Sequence[Quantity]


def _to_array(values: Any) -> Array:
    return np.ascontiguousarray(DM(values).full().T)  # in one order: sums over joints round as those of copies do
