"""Effects of the assumptions, and disturbances that a gait survives."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from benchmarks.engine.agreement import STEPS, format_energies, simulate_walk
from benchmarks.engine.gaits import PAPER, optimal_cycles, optimum
from benchmarks.engine.markdown import cells, header
from nlp_gait.simulation import measurements, mjcf, simulate
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import measure
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import simulate_plan

SPEED = 0.05  # [m/s]
VARIANTS = {
    "default": Drive(),
    **{f"stall torque at {error:g} rad": Drive(full_error_rad=error) for error in (0.16, 0.05, 0.04, 0.03)},
    **{f"damping / stiffness {seconds:g} s": Drive(time_constant_s=seconds) for seconds in (0.01, 0.03, 0.05)},
    **{f"set-points every {1e3 * seconds:g} ms": Drive(period_s=seconds) for seconds in (0.04, 0.02, mjcf.TIME_STEP)},
    **{f"torque limits: {name}": Drive(torque_limits=name) for name in ("stall", "continuous")},
}


@contextmanager
def engine_step(step_s: float) -> Iterator[None]:
    """Another time step for all that simulates."""
    before = mjcf.TIME_STEP
    for module in (mjcf, measurements, simulate):
        module.TIME_STEP = step_s
    try:
        yield
    finally:
        for module in (mjcf, measurements, simulate):
            module.TIME_STEP = before


def gains() -> Iterator[str]:
    """How the optima fare with other gains, limits, periods, and steps of the engine."""
    yield header(
        "variant",
        "nao-ssp W",
        "nao-dsp W",
        f"nao-cycle at {SPEED:g} m/s: J per planned m",
        "model",
        "per walked m",
        "distance",
    )
    cycle = optimal_cycles()[SPEED]
    plans = [make_plan(optimum(name)) for name in PAPER]

    def row(label: str, drive: Drive) -> str:
        powers = [measure(plan, simulate_plan(plan, drive=drive), drive) for plan in plans]
        phases = [f"{m.measured.total_W:.4f}{', falls' if m.fallen else ''}" for m in powers]
        return cells(label, *phases, *format_energies(simulate_walk(cycle, STEPS, drive)))

    for label, drive in VARIANTS.items():
        yield row(label, drive)
    for step_s in (0.001, 0.00025, 0.0001):
        with engine_step(step_s):
            yield row(f"engine step {1e3 * step_s:g} ms", Drive())
