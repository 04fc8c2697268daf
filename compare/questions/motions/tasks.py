"""What is solved to compare motions: orders of the plan, free joints, a coarse grid and other objectives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from compare.study.task import ProblemSpec
from nlp_gait.errors import InputError
from nlp_gait.gaits.biped.curves import SPANS

PHASES = ("nao-ssp", "nao-dsp")
ORDERS = tuple(SPANS)[:-1]
FREE_ORDERS = ("spline-2", "spline-4", "spline-8", "spline-16")
# Samples in each interval, so that no motion bends between them: with 4, free joints on 16 spans hide a tenth of their power.
SAMPLES, FREE_SAMPLES = 4, 8
SMOOTH_ORDER = "spline-4"
SMOOTH = ("jerk", "torque-smoothness")
# A grid with as many samples as the papers', on which a spline can hide.
COARSE = 1
PLANNED, COARSE_KIND, SMOOTHED, FREED = "planned", "coarse", "smooth", "free"


@dataclass(frozen=True, kw_only=True)
class MotionTask:
    """One problem of the study.

    Attributes:
        kind: ``"planned"``, the same ``"coarse"`` with the papers' number of samples, ``"smooth"``, or ``"free"``.
        problem: name.
        options: what it is built with.
        starts: random starts beside the one from a simpler motion's optimum.
    """

    kind: str
    problem: str
    options: Mapping[str, Any]
    starts: int

    @property
    def spec(self) -> ProblemSpec:
        """The problem as plain data."""
        return ProblemSpec(name=self.problem, options=self.options)

    @property
    def trajectory(self) -> str:
        """Order of its curves."""
        return str(self.options["trajectory"])

    @property
    def label(self) -> str:
        """File name without ending."""
        return "-".join(str(part) for part in (self.kind, self.trajectory, self.options.get("objective", "power")))


def tasks(
    phase: str,
    *,
    orders: Sequence[str] = ORDERS,
    free_orders: Sequence[str] = FREE_ORDERS,
    robot: str = "nao-v5",
    starts: int = 1,
) -> list[MotionTask]:
    """The study of one phase, in an order in which each task can start from an earlier one.

    Raises:
        InputError: another phase, or orders that do not rise.
    """
    if phase not in PHASES:
        raise InputError(f"motions are compared for {' and '.join(PHASES)}, got {phase!r}")
    for given in (orders, free_orders):
        if list(given) != [order for order in SPANS if order in given]:
            raise InputError(f"orders must rise and be among {', '.join(SPANS)}, got {', '.join(given)}")
    if not orders:
        raise InputError("there must be at least one order")

    def task(kind: str, trajectory: str, problem: str = phase, starts: int = 0, **more: Any) -> MotionTask:
        options = {"robot": robot, "trajectory": trajectory, "samples_per_interval": SAMPLES, **more}
        return MotionTask(kind=kind, problem=problem, options=options, starts=starts)

    planned = [task(PLANNED, order, starts=starts) for order in orders]
    coarse = [task(COARSE_KIND, orders[-1], samples_per_interval=COARSE)]
    smooth = [task(SMOOTHED, SMOOTH_ORDER, objective=name) for name in SMOOTH if SMOOTH_ORDER in orders]
    free = [task(FREED, order, f"{phase}-free", samples_per_interval=FREE_SAMPLES) for order in free_orders]
    return [*planned, *coarse, *smooth, *free]
