"""The engine as objective: candidates of a cycle or walk, simulated and scored by the energy of the drives per metre."""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from nlp_gait.errors import GaitError
from nlp_gait.formulation import Array, GaitProblem, Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Walk, measure_walk
from nlp_gait.simulation.plan import Plan, make_plan
from nlp_gait.simulation.simulate import Conditions, Simulation, SimulationRun, prepare

# Limits of a gait: the largest value, the excess that counts as a whole violation, and a message with its factor.
ALLOWED = {
    "off": (0.05, 0.2, "its end is {:.1f} % of the distance away from the planned one", 100.0),
    "saturated": (0.02, 0.2, "a drive is at its torque limit for {:.1f} % of the time", 100.0),
    "slip_m": (0.005, 0.05, "a foot slips by {:.1f} mm", 1000.0),
    "outside_rad": (0.02, 0.2, "a joint is {:.1f} degrees beyond its range", math.degrees(1.0)),
}
MORE_STEPS = 4  # of the walk for whose ground the world is made


@dataclass(frozen=True, slots=True, kw_only=True)
class GaitScore:
    """One candidate in one world."""

    J_per_m: float  #: energy of the drives per metre walked; per planned metre, until the fall, if it fell
    #: 0 for a gait that does what it may; up to 1 for excesses; from 1, for a fall at the end, to 2, for one at the start
    violation: float
    fell_at_s: float | None
    off: float  #: distance of the end from the planned end, as a share of the way
    saturated: float  #: largest share of the time that a joint is at its torque limit
    slip_m: float
    outside_rad: float  #: largest angle beyond a joint's mechanical range

    def list_violations(self) -> list[str]:
        """Return a message for each limit of ``ALLOWED`` that is violated."""
        return [
            message.format(factor * getattr(self, name))
            for name, (most, _, message, factor) in ALLOWED.items()
            if getattr(self, name) > most
        ]


NO_MOTION = GaitScore(
    J_per_m=math.inf, violation=math.inf, fell_at_s=0.0, off=1.0, saturated=1.0, slip_m=0.0, outside_rad=0.0
)


class Arena:
    """A world for candidates of a problem, compiled once: robot, drive, ground and disturbance."""

    def __init__(
        self,
        problem: GaitProblem,
        *,
        drive: Drive | None = None,
        conditions: Conditions | None = None,
        steps: int | None = 4,
        settle_s: float = 0.3,
    ) -> None:
        """Compile the world, whose ground has its bumps under a somewhat longer walk of a start point of the problem.

        A cycle is simulated for ``steps`` steps, a whole walk with None; then the robot must stand for a while.
        """
        self.problem, self._drive, self._conditions = problem, drive or Drive(), conditions or Conditions()
        self._steps, self._settle_s = steps, settle_s
        point = Result(problem=problem, x=problem.start_point(np.random.default_rng(0)))
        plan = make_plan(point, None if steps is None else steps + MORE_STEPS)
        self._model = prepare(plan, self._conditions, self._drive)[0]

    def simulate(self, x: Array) -> tuple[Plan, Simulation, Walk]:
        """Return the plan of a candidate (n,), its simulation, and both in numbers; raises GaitError if it has no motion."""
        plan = make_plan(Result(problem=self.problem, x=x), self._steps)
        run = SimulationRun(plan, self._conditions, self._drive, settle_s=self._settle_s, model=self._model)
        simulation = run.finish()
        return plan, simulation, measure_walk(plan, simulation, self._drive, plan.steps or 1)

    def score(self, x: Array) -> GaitScore:
        """Return the score of a candidate (n,), infinite if it has no motion."""
        try:
            plan, simulation, walk = self.simulate(x)
        except GaitError:
            return NO_MOTION
        m, planned = walk.measurements, walk.planned_m
        low, high = np.array([plan.robot.joint(name).limits_rad for name in plan.joints]).T
        outside = np.maximum(low - simulation.q, simulation.q - high)
        off = 1.0 if walk.walked_m is None else math.hypot(walk.walked_m - planned, walk.drift_m or 0.0) / planned
        found = {
            "off": off,
            "saturated": max(m.saturated.values(), default=0.0),
            "slip_m": m.slip_m,
            "outside_rad": max(0.0, float(outside.max())),
        }
        excess = sum(min(1.0, max(0.0, found[name] - most) / full) for name, (most, full, *_) in ALLOWED.items())
        violation = excess / len(ALLOWED)
        if m.fell_at_s is not None:
            violation = 2.0 - m.fell_at_s / (plan.duration_s + self._settle_s)
        energy = walk.engine_J_per_m or m.measured.total_W * float(simulation.plan_t[-1]) / planned
        return GaitScore(J_per_m=energy, violation=violation, fell_at_s=m.fell_at_s, **found)


class EngineObjective:
    """Mean energy per metre over worlds, as an objective of searches: names, lower, upper, and a call."""

    def __init__(self, arenas: Sequence[Arena], threads: int = 1) -> None:
        problem = arenas[0].problem
        self.names, self.lower, self.upper = problem.names, problem.lower, problem.upper
        self._arenas, self._threads = tuple(arenas), threads

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Return the mean energies per metre and the mean violations (P,) of candidates (P, n)."""
        jobs = [(arena, x) for x in X for arena in self._arenas]
        with ThreadPoolExecutor(self._threads) as pool:
            scores = list(pool.map(lambda job: job[0].score(job[1]), jobs))
        table = np.array([(score.J_per_m, score.violation) for score in scores]).reshape(len(X), -1, 2)
        f, violation = table.mean(axis=1).T
        return f, violation
