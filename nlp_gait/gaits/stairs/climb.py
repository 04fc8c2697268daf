"""Climbing several stairs at least effort, from standing to standing: steps whose places and speeds are continuous."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.errors import check_count
from nlp_gait.formulation import Array, Display, GaitProblem, Grid, Signals, SolverHints, maker
from nlp_gait.formulation.assembly import Assembly, Constraint, NumericPoint, Objective, Point, Variable
from nlp_gait.formulation.display import SimulationModel, Tread
from nlp_gait.gaits.several_steps import join_steps
from nlp_gait.gaits.stairs import planar_biped as biped
from nlp_gait.gaits.stairs import stair
from nlp_gait.gaits.stairs.climb_step import PARAMETERS, ClimbStep, make_equal_rows, make_instant
from nlp_gait.gaits.stairs.display import make_rigid_bodies, make_signals, measure_stair
from nlp_gait.gaits.stairs.planar_biped import MOVING
from nlp_gait.symbolic.nonsmooth import Nonsmooth

# Reserves for the engine, in which drives follow the plan without feedback.
RESERVES = {"zmp_margin_m": 0.03, "least_stance_force_N": 60.0, "stance_friction": 0.6, "clearance_m": 0.03}
JOINTS_BETWEEN = (("first", "next"), ("next", "next"), ("next", "last"))


@maker
def stairs_climb(*, stairs: int = 4, intervals: int = 50) -> GaitProblem:
    """Return the trajectory optimisation of a climb from standing before the stairs to standing on the last one.

    The first step, a regular one that repeats, and a last one to the other foot's side are joined with continuous angles and
    speeds. Shanks and feet, as rods, stay outside the steps. Simulated feet are plates 15 mm thick, whose toes may hit a riser:
    ``nlp-gait simulate`` says when and how hard.

    Args:
        stairs: number of stairs, at least 2.
        intervals: equal parts of each step, at least 10.

    Source:
        Robot, stair and phases of Bhardwaj et al.; the formulation is this package's own.
    """
    climb = Climb(
        stairs=check_count("stairs", stairs, at_least=2), intervals=check_count("intervals", intervals, at_least=10)
    )
    defaults = [replace(p, default=RESERVES.get(p.name, p.default)) for p in PARAMETERS]
    model = SimulationModel(
        robot=make_rigid_bodies(),
        gravity=biped.GRAVITY,
        steps=stairs,
        motion=climb.compute_signals,
        ground=climb.list_treads,
        planar=True,
    )
    return GaitProblem(
        name="stairs-climb",
        title="Stairs, several steps from standing to standing: least effort",
        variables=climb.variables,
        own_parameters=tuple(defaults),
        objective=Objective(name="effort", unit="1"),
        assemble=climb.assemble,
        grid=Grid(intervals=intervals),
        display=Display(motion=climb.compute_signals, simulation_model=model),
        hints=SolverHints(start=climb.start, starts=1, searchable=False),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Climb:
    """A climb as a list of steps, of which each distinct one is computed once."""

    stairs: int
    intervals: int  # of each step

    @cached_property
    def steps(self) -> dict[str, ClimbStep]:
        """The distinct steps, with the number of steps by which the other foot is behind at the start and ahead at the end."""
        parts = (("first", 0, 1), ("next", 1, 1), ("last", 1, 0))
        return {name: ClimbStep(intervals=self.intervals, behind=behind, ahead=ahead) for name, behind, ahead in parts}

    @property
    def sequence(self) -> tuple[str, ...]:
        """Steps in the order of time."""
        return ("first", *["next"] * (self.stairs - 1), "last")

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Variables of all distinct steps."""
        return tuple(
            replace(variable, name=f"{name}_{variable.name}")
            for name, step in self.steps.items()
            for variable in step.layout.variables
        )

    def _split(self, x: MX | Array) -> dict[str, MX | Array]:
        """Return the steps' variables."""
        size = len(self.variables) // len(self.steps)
        return {name: x[i * size : (i + 1) * size] for i, name in enumerate(self.steps)}

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return the effort of the whole climb, and the rows of its distinct steps and of the joints between them."""
        blocks = {name: self.steps[name].layout.split(replace(point, x=x)) for name, x in self._split(point.x).items()}
        effort, energy, peak, rows = MX(0), MX(0), MX(0), list[Constraint]()
        for name, x in blocks.items():
            objective, limits, metrics = self.steps[name].assemble(x, point)
            occurs = self.sequence.count(name)
            effort += occurs * objective
            energy += occurs * metrics["energy_J"]
            peak = ca.fmax(peak, metrics["peak_torque_Nm"])
            rows += [replace(row, name=f"{name}_{row.name}") for row in limits]
        for before, after in JOINTS_BETWEEN:
            rows.append(self._join(before, after, blocks, point))
        return Assembly(objective=effort, constraints=tuple(rows), metrics={"energy_J": energy, "peak_torque_Nm": peak})

    def _join(self, before: str, after: str, blocks: Mapping[str, Mapping[str, MX]], point: Point) -> Constraint:
        """Return rows of equal places and speeds of hip and torso where a step meets the next one; the feet stand there."""
        size = ca.vertcat(*stair.read_stair(point))
        torso = MOVING.index("UH")
        (q0, v0), (q1, v1) = (
            (blocks[name]["angle"][:, k], blocks[name]["rate"][:, k])
            for name, k in ((before, self.intervals), (after, 0))
        )
        end, start = (make_instant("next")(q, v, size)[3] for q, v in ((q0, v0), (q1, v1)))
        jumps = ca.vertcat(start[:2] + size - end[:2], start[2:4] - end[2:4], q1[torso] - q0[torso])
        labels = ("hip x", "hip z", "hip speed x", "hip speed z", "torso")
        return make_equal_rows(f"{before}_meets_{after}", jumps, labels, (0,), "1", 0.1)

    def start(self, values: Mapping[str, float], rng: np.random.Generator) -> Array:
        """Return a smooth motion of hip and swing ankle with noise, and a part of the load on the rear foot."""
        tread = values["stair_length_m"] / 2
        size, duration = np.array([tread, values["rise_run_ratio"] * tread]), values["step_time_s"]
        return np.concatenate([step.start(size, duration, rng) for step in self.steps.values()])

    def compute_signals(self, point: NumericPoint) -> Signals:
        """Return the whole climb on a dense grid, with every second step mirrored."""
        blocks = self._split(point.x.full().ravel())
        motions = {
            name: make_signals(step.refine(step.layout.values(blocks[name]), float(point["step_time_s"])), 0.0)
            for name, step in self.steps.items()
        }
        tread, rise = measure_stair(point)
        places = np.outer(np.arange(len(self.sequence)), [tread, 0.0, rise, 0.0])
        return join_steps([motions[name] for name in self.sequence], make_rigid_bodies(), places)

    def list_treads(self, point: NumericPoint) -> tuple[Tread, ...]:
        """Return the stairs ahead of the stance ankle of the first step."""
        tread, rise = measure_stair(point)
        return tuple(Tread(edge_m=k * tread - stair.SETBACK, height_m=k * rise) for k in range(1, self.stairs + 1))
