"""Agreement of the engine with the model."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial

import numpy as np

import nlp_gait
from benchmarks.engine.gaits import PAPER, optimal_cycles, phase_gaits, random_gaits
from benchmarks.engine.markdown import cells, header
from nlp_gait.formulation import Result
from nlp_gait.simulation.drive import DRIVES, Drive
from nlp_gait.simulation.measurements import Measurements, Walk, measure, measure_walk
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import simulate_plan

STEPS = 10
RANDOM = 30
held = partial(Drive, feed_forward="none")
# From simple to complete drives.
WATERFALL = {
    "held for 40 ms, no feed-forward": DRIVES["held"],
    "held for 10 ms": held(interpolation="held"),
    "linear, 40 ms": held(period_s=0.04),
    "linear, 10 ms": held(),
    "held for 40 ms, velocity and torque": Drive(period_s=0.04, interpolation="held"),
    "linear, 40 ms, velocity and torque": Drive(period_s=0.04),
    "linear, 10 ms, velocity": Drive(feed_forward="velocity"),
    "linear, 10 ms, velocity and torque": Drive(),
}

RANKED = {
    "feed-forward": DRIVES["feed-forward"],
    "feed-forward, limits of the motors at stall": Drive(torque_limits="stall"),
    "held": DRIVES["held"],
}

KINDS: dict[str, dict[str, str]] = {
    "nao-cycle": {},
    "nao-ssp": {},
    "nao-dsp": {},
    "nao-dsp, lever rule": {"torso_share": "lever"},
}


def simulate_walk(result: Result, steps: int, drive: Drive | None = None) -> Walk:
    """Simulate several steps of a cycle and measure them."""
    drive, plan = drive or Drive(), make_plan(result, steps)
    return measure_walk(plan, simulate_plan(plan, drive=drive), drive, steps)


def waterfall() -> Iterator[str]:
    """Drives from simple to complete: cheapest cycles at .05 and .08 m/s, ten steps."""
    yield header(
        "set-points and feed-forward",
        "m/s",
        "J per planned m",
        "model",
        "J per walked m",
        "distance",
        "early ms",
        "mm/s",
    )
    for label, drive in WATERFALL.items():
        for speed in (0.05, 0.08):
            walk = simulate_walk(optimal_cycles()[speed], STEPS, drive)
            m = walk.measurements
            yield cells(
                label,
                f"{speed:g}",
                *format_energies(walk),
                f"{1e3 * (m.earliest_landing_s or 0.0):.0f}",
                f"{1e3 * (m.landing_speed_m_s or 0.0):.0f}",
            )


def format_energies(walk: Walk) -> tuple[str, ...]:
    """Format joules per planned metre of engine and model, joules per walked metre, and the share of the distance."""
    if walk.engine_J_per_planned_m is None or walk.walked_m is None:
        return (f"falls in step {walk.steps_done + 1}", f"{walk.model_J_per_m:.2f}", "-", "-")
    per_walked = "-" if walk.engine_J_per_m is None else f"{walk.engine_J_per_m:.2f}"
    share = f"{walk.walked_m / walk.planned_m:.4f}"
    return (f"{walk.engine_J_per_planned_m:.2f}", f"{walk.model_J_per_m:.2f}", per_walked, share)


def speeds() -> Iterator[str]:
    """Cheapest cycles at nine speeds, ten steps, and how fast they are simulated."""
    yield header(
        "m/s",
        "J per planned m",
        "model",
        "J per walked m",
        "distance",
        "error",
        "net W, model",
        "CoP mm",
        "tilt deg",
        "s/s",
    )
    for speed, result in optimal_cycles().items():
        began = time.perf_counter()
        walk = simulate_walk(result, STEPS)
        m, took = walk.measurements, time.perf_counter() - began
        simulated = STEPS * sum(
            result.x[result.problem.variable_index(name)] for name in result.problem.display.durations
        )
        error = (walk.engine_J_per_planned_m or np.nan) / walk.model_J_per_m - 1.0
        yield cells(
            f"{speed:g}",
            *format_energies(walk),
            f"{error:+.1%}",
            f"{m.measured.signed_W:.3f}, {m.predicted.signed_W:.3f}",
            f"{1e3 * (m.pressure_rms_m or np.nan):.1f}",
            f"{m.largest_tilt_deg:.1f}",
            f"{simulated / took:.1f}",
        )


def ranking() -> Iterator[str]:
    """Thirty random feasible gaits of the cycle and of each phase: does the engine rank them as the model does?

    The papers have no torque limits, and a random gait may need more than a drive's limit: "beyond limit".
    """
    from scipy.stats import spearmanr  # costs a second to import

    yield header(
        "problem", "drive", "beyond limit", "fall", "Spearman", "error, mean", "largest", "model W, least to most"
    )
    for label, options in KINDS.items():
        problem = nlp_gait.load(label.split(",")[0], **options)
        gaits = random_gaits(problem, RANDOM)
        for name, drive in RANKED.items():
            found = [_simulate(gait, drive) for gait in gaits]
            up = [m for m in found if not m.fallen]
            model, engine = (np.array([getattr(m, which).total_W for m in up]) for which in ("predicted", "measured"))
            errors = engine / model - 1.0
            yield cells(
                label,
                name,
                f"{sum(bool(m.beyond_limit) for m in found)}",
                f"{len(found) - len(up)}",
                f"{spearmanr(model, engine).statistic:.4f}",
                f"{errors.mean():+.1%}",
                f"{errors[np.abs(errors).argmax()]:+.1%}",
                f"{model.min():.2f} to {model.max():.2f}",
            )


def published() -> Iterator[str]:
    """Optima and the paper's gaits: model and engine, in watts."""
    yield header(
        "gait", "model W", "engine W", "held drive W", "net W, model", "CoP mm", "middle", "slip mm", "landing mm"
    )
    for name in PAPER:
        for label, gait in phase_gaits(name).items():
            m, old = _simulate(gait, Drive()), _simulate(gait, DRIVES["held"])
            landing = ", ".join(f"{1e3 * error:.1f}" for error in m.landing_errors_m.values()) or "-"
            yield cells(
                f"{name}, {label}{', **falls**' if m.fallen else ''}",
                *(f"{p.total_W:.4f} ({p.mechanical_W:.4f})" for p in (m.predicted, m.measured)),
                f"{old.measured.total_W:.4f}",
                f"{m.measured.signed_W:+.4f}, {m.predicted.signed_W:+.4f}",
                *("-" if v is None else f"{1e3 * v:.1f}" for v in (m.pressure_rms_m, m.pressure_middle_rms_m)),
                f"{1e3 * m.slip_m:.1f}",
                landing,
            )


def _simulate(result: Result, drive: Drive) -> Measurements:
    plan = make_plan(result)
    return measure(plan, simulate_plan(plan, drive=drive), drive)
