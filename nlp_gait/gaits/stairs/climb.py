"""Climbing several stairs at least effort, from standing to standing: steps whose places and speeds are continuous."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.errors import check_count
from nlp_gait.formulation import Array, Display, GaitProblem, Grid, Signals, SolverHints, maker
from nlp_gait.formulation.assembly import Assembly, Constraint, NumericPoint, Objective, Point, Variable
from nlp_gait.formulation.display import SimulationModel, Tread
from nlp_gait.gaits.several_steps import join_steps
from nlp_gait.gaits.stairs import planar_biped as biped
from nlp_gait.gaits.stairs import stair
from nlp_gait.gaits.stairs.climb_step import AXES, NOISE, PARAMETERS, ClimbStep, make_climb_step, make_equal_rows
from nlp_gait.gaits.stairs.display import make_rigid_bodies, make_signals, measure_stair
from nlp_gait.gaits.stairs.planar_biped import MOVING
from nlp_gait.gaits.stairs.planned_motion import Stair, StepKind, compute_heights, compute_shank_gaps
from nlp_gait.symbolic.nonsmooth import Nonsmooth

EDGE_RESERVE = 0.01  # by which edges are nearer than the steps' [m]; they are rounded over ``stair.EDGE_WIDTH``
RAMP = 0.1  # share of the swing over which the clearance grows, and falls again
# Reserves for the engine, in which drives follow the plan without feedback.
RESERVES = {"zmp_margin_m": 0.03, "least_stance_force_N": 60.0, "stance_friction": 0.6, "clearance_m": 0.03}
# A start point: hip ahead of the rear ankle and above it where two steps meet, and above the ankles of the standing robot [m];
# the torso's pitch [rad]; height of the swing above the higher step [m].
HIP_BETWEEN, HIP_STANDING, TORSO, LIFT = (0.10, 0.68), (0.06, 0.70), 1.35, 0.06


class ClimbPart(NamedTuple):
    """A step of the climb; steps of one kind are equal."""

    name: str  # before the names of its variables and rows
    behind: int  # steps by which the rear foot is behind at the start
    ahead: int  # and ahead at the end

    @property
    def stair_kind(self) -> StepKind:
        """Which ground it passes."""
        return "next" if self.behind else "first"


FIRST, NEXT, LAST = ClimbPart("first", 0, 1), ClimbPart("next", 1, 1), ClimbPart("last", 1, 0)
PARTS = (FIRST, NEXT, LAST)
JOINTS_BETWEEN = ((FIRST, NEXT), (NEXT, NEXT), (NEXT, LAST))


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
    def steps(self) -> dict[ClimbPart, ClimbStep]:
        """The distinct steps."""
        return {stride: make_climb_step(self.intervals, stride.behind, stride.ahead) for stride in PARTS}

    @property
    def sequence(self) -> tuple[ClimbPart, ...]:
        """Steps in the order of time."""
        return (FIRST, *[NEXT] * (self.stairs - 1), LAST)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Variables of all distinct steps."""
        return tuple(
            replace(variable, name=f"{stride.name}_{variable.name}")
            for stride, step in self.steps.items()
            for variable in step.layout.variables
        )

    def _split(self, x: MX | Array) -> dict[ClimbPart, MX | Array]:
        """Return the steps' variables."""
        size = len(self.variables) // len(PARTS)
        return {stride: x[i * size : (i + 1) * size] for i, stride in enumerate(PARTS)}

    def assemble(self, point: Point, ops: Nonsmooth) -> Assembly:
        """Return the effort of the whole climb, and the rows of its distinct steps and of the joints between them."""
        blocks = {
            stride: self.steps[stride].layout.split(replace(point, x=x)) for stride, x in self._split(point.x).items()
        }
        effort, energy, peak, rows = MX(0), MX(0), MX(0), list[Constraint]()
        for stride, x in blocks.items():
            objective, loads, indexes = self.steps[stride].load(x, point)
            occurs = self.sequence.count(stride)
            effort += occurs * objective
            energy += occurs * indexes["energy_J"]
            peak = ca.fmax(peak, indexes["peak_torque_Nm"])
            limits = (*self._limit_step(stride, x, point), *loads)
            rows += [replace(row, name=f"{stride.name}_{row.name}") for row in limits]
        for before, after in JOINTS_BETWEEN:
            rows.append(self._join(before, after, blocks, point))
        return Assembly(objective=effort, constraints=tuple(rows), indexes={"energy_J": energy, "peak_torque_Nm": peak})

    def _limit_step(self, stride: ClimbPart, x: Mapping[str, MX], point: Point) -> tuple[Constraint, ...]:
        """Return rows of a step's motion, feet, shanks and standing ends."""
        step, n = self.steps[stride], self.intervals
        q, v = x["angle"], x["rate"]
        size = ca.repmat(ca.vertcat(*stair.read_stair(point)), 1, n + 1)
        heights, gaps, centre, ends = _make_instant(stride.stair_kind).map(n + 1)(q, v, size)
        lift, swing = step.toe_off, range(step.toe_off + 1, n + 1)
        # The clearance grows and falls with the swing.
        share = np.array([min(k - lift, n - k) / (n - lift) / RAMP for k in swing]).clip(0.0, 1.0)
        least = ca.repmat(point["clearance_m"] * DM(share[None, :]), 3, 1)
        rounding = 2e-3  # height of a rounded edge below a foot that stands before it
        feet_still = v[[MOVING.index(link) for link in ("UH", "AS", "ST")], :][:, [0, n]]
        torso = v[MOVING.index("UH"), 1:n]
        rows = [
            *step.limit_motion(x, point),
            *step.place_feet(x, point),
            make_equal_rows("torso_still", torso, ("UH",), range(1, n), "rad/s", 1.0),
            make_equal_rows("foot_still", feet_still, ("UH", "AS", "ST"), (0, n), "rad/s", 1.0),
            make_equal_rows("ankle_still", ends[4:6, [0, n]], AXES, (0, n), "m/s", 0.1),
            stair.make_rows("clearance_in_support", heights[1:, :lift], ("sole", "ankle"), "m", 0.01, lower=-rounding),
            stair.make_rows(
                "clearance_in_swing",
                heights[:, lift + 1 :],
                ("toe", "sole", "ankle"),
                "m",
                0.01,
                lower=ca.vec(least) - rounding,
                columns=swing,
            ),
            stair.limit_shanks(gaps, stride.stair_kind),
        ]
        for instant, stands in ((0, not stride.behind), (n, not stride.ahead)):
            if stands:
                at_rest = make_equal_rows("rest", ends[2:4, instant], AXES, (instant,), "m/s", 0.1)
                rows += [at_rest, replace(stair.limit_stance_zmp(point, centre[:, instant]), name="standing")]
        return tuple(rows)

    def _join(
        self, before: ClimbPart, after: ClimbPart, blocks: Mapping[ClimbPart, Mapping[str, MX]], point: Point
    ) -> Constraint:
        """Return rows of equal places and speeds of hip and torso where a step meets the next one; the feet stand there."""
        size = ca.vertcat(*stair.read_stair(point))
        torso = MOVING.index("UH")
        (q0, v0), (q1, v1) = (
            (blocks[stride]["angle"][:, k], blocks[stride]["rate"][:, k])
            for stride, k in ((before, self.intervals), (after, 0))
        )
        end, start = (_make_instant("next")(q, v, size)[3] for q, v in ((q0, v0), (q1, v1)))
        jumps = ca.vertcat(start[:2] + size - end[:2], start[2:4] - end[2:4], q1[torso] - q0[torso])
        labels = ("hip x", "hip z", "hip speed x", "hip speed z", "torso")
        return make_equal_rows(f"{before.name}_meets_{after.name}", jumps, labels, (0,), "1", 0.1)

    def start(self, values: Mapping[str, float], rng: np.random.Generator) -> Array:
        """Return a smooth motion of hip and swing ankle with noise, and a part of the load on the rear foot."""
        tread = values["stair_length_m"] / 2
        size, duration = np.array([tread, values["rise_run_ratio"] * tread]), values["step_time_s"]
        return np.concatenate([self._start_step(stride, size, duration, rng) for stride in PARTS])

    def _start_step(self, stride: ClimbPart, size: Array, duration: float, rng: np.random.Generator) -> Array:
        step, n = self.steps[stride], self.intervals
        s = np.linspace(0.0, 1.0, n + 1)[:, None]
        smooth = s**2 * (3 - 2 * s)
        between = np.array(HIP_BETWEEN)
        first, last = (between - size if stride.behind else HIP_STANDING), (between if stride.ahead else HIP_STANDING)
        hip = first + smooth * (np.array(last) - first)
        swing = np.clip((s[:, 0] - step.toe_off / n) / (1 - step.toe_off / n), 0.0, 1.0)
        way = (stride.behind + stride.ahead) * size
        late, early = (np.interp(swing, ends, (0.0, 1.0)) for ends in ((0.25, 1.0), (0.0, 0.6)))
        late, early = (share**2 * (3 - 2 * share) for share in (late, early))
        ankle = np.column_stack([late * way[0], early * way[1] + LIFT * np.sin(np.pi * swing)]) - stride.behind * size
        still = np.zeros(n + 1)
        legs = [*_reach(ankle - hip), *_reach(-hip)]
        angle = np.stack([*legs, still + TORSO, still, still])
        angle += NOISE * rng.standard_normal(angle.shape)
        return step.join_start(angle, duration)

    def compute_signals(self, point: NumericPoint) -> Signals:
        """Return the whole climb on a dense grid, with every second step mirrored."""
        blocks = self._split(point.x.full().ravel())
        motions = {
            stride: make_signals(step.refine(step.layout.values(blocks[stride]), float(point["step_time_s"])), 0.0)
            for stride, step in self.steps.items()
        }
        tread, rise = measure_stair(point)
        places = np.outer(np.arange(len(self.sequence)), [tread, 0.0, rise, 0.0])
        return join_steps([motions[stride] for stride in self.sequence], make_rigid_bodies(), places)

    def list_treads(self, point: NumericPoint) -> tuple[Tread, ...]:
        """Return the stairs ahead of the stance ankle of the first step."""
        tread, rise = measure_stair(point)
        return tuple(Tread(edge_m=k * tread - stair.SETBACK, height_m=k * rise) for k in range(1, self.stairs + 1))


def _make_instant(kind: StepKind) -> ca.Function:
    """Return the function (angles, rates (7,), tread and rise (2,)) of an instant.

    Its outputs are heights (3,) of swing toe, sole and ankle above the stair, the shanks' gaps, the centre of mass ahead of the
    stance ankle [m], and place and velocity of the hip and velocity of the swing ankle (6,).
    """
    q, v, size = SX.sym("q", len(MOVING)), SX.sym("v", len(MOVING)), SX.sym("size", 2)
    points = biped.locate_points(biped.link_angles(q), SX(2, 1))
    steps, setback = Stair(size[0], size[1]), stair.SETBACK + EDGE_RESERVE
    heights = compute_heights(points, steps, setback, stair.EDGE_WIDTH, kind)
    robot = biped.load_toe_foot_biped()
    centres = biped.locate_centres(points)
    centre = sum((biped.get_rod(link).mass_kg * place[0] for link, place in centres.items()), SX(0)) / robot.mass_kg
    ends = [points["H"], *(ca.jtimes(points[name], q, v) for name in "HA")]
    gaps = compute_shank_gaps(points, steps, stair.SETBACK, kind)
    return ca.Function("instant", [q, v, size], ca.cse([heights, gaps, centre, ca.vertcat(*ends)]))


def _reach(ankle: Array) -> tuple[Array, Array]:
    """Return the angles (T,) of thigh and shank that bring the ankle to a place (T, 2) from the hip, the knee bent forward."""
    length = biped.get_rod("HK").length_m
    half = np.arccos(np.clip(np.hypot(*ankle.T) / (2 * length), 0.0, 0.99))
    direction = np.arctan2(-ankle[:, 1], ankle[:, 0])
    return direction - half, direction + half
