"""Where the rigid model stops being true: prediction against engine for random feasible gaits, from slow to fast.

    python benchmarks/calibration.py

Prints a table for each phase. About a minute; needs the extra ``sim``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

import nlp_gait
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.errors import InputError
from nlp_gait.problem import GaitProblem, Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Measurements, measure
from nlp_gait.simulation.mjcf import TIME_STEP
from nlp_gait.simulation.plan import plan_of
from nlp_gait.simulation.playback import play

SHORTEST_S = {"nao-ssp": 0.4, "nao-dsp": 0.28}  # double support: below 0.28 s hardly any random gait is feasible
TOLERANCE = 0.15  # of the total power
DRAWS, BATCH = 50, 2_000  # candidates drawn for one feasible gait: at most DRAWS batches


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """One random gait.

    Attributes:
        duration_s: of the phase.
        result: the gait.
        measurements: played with the drive's own period between set-points.
        smooth: played with a set-point at every step of the engine: what remains is not the drive's coarseness.
    """

    duration_s: float
    result: Result
    measurements: Measurements
    smooth: Measurements


def random_gait(problem: GaitProblem, duration: str, duration_s: float, rng: np.random.Generator) -> Result:
    """Uniformly drawn feasible gait of a given duration.

    Raises:
        InputError: none was found.
    """
    fixed = problem.fix(**{duration: duration_s})
    objective = compile_objective(fixed)
    for _ in range(DRAWS):
        candidates = rng.uniform(fixed.lower, fixed.upper, (BATCH, len(fixed.names)))
        _, violation = objective(candidates)
        feasible = np.flatnonzero(violation == 0.0)
        if feasible.size:
            return Result(problem=fixed, x=candidates[feasible[0]])
    raise InputError(
        f"none of {DRAWS * BATCH} random gaits of {problem.name!r} with {duration} = {duration_s:g} is feasible"
    )


def calibrate(
    problem: GaitProblem, shortest_s: float, count: int = 20, seed: int = 0, drive: Drive | None = None
) -> Iterator[Case]:
    """Random feasible gaits with durations from the variable's upper bound down to the shortest, equal ratios apart."""
    drive = drive or Drive()
    (duration,) = problem.durations
    longest = float(problem.upper[problem.variable_index(duration)])
    rng = np.random.default_rng(seed)
    for value in np.geomspace(longest, shortest_s, count).tolist():
        result = random_gait(problem, duration, min(value, longest), rng)
        plan = plan_of(result)
        coarse, smooth = (
            measure(plan, play(plan, drive=each), each) for each in (drive, replace(drive, period_s=TIME_STEP))
        )
        yield Case(duration_s=value, result=result, measurements=coarse, smooth=smooth)


def shortest_true_s(runs: Iterable[tuple[float, Measurements]], tolerance: float) -> float | None:
    """Duration down to which the model holds: no gait that is as slow or slower falls or misses the power by more.

    Args:
        runs: duration [s] and measurements of every gait.
        tolerance: largest relative error of the total power.

    Returns:
        The shortest such duration [s]; None if even the slowest gait does not hold.
    """
    shortest = None
    for duration, m in sorted(runs, key=lambda run: -run[0]):
        if m.fallen or abs(m.power_error) > tolerance:
            break
        shortest = duration
    return shortest


def main() -> None:
    """One Markdown table a phase."""
    for name, shortest in SHORTEST_S.items():
        print(f"\n### {name}\n")
        print(
            "| time s | model W | engine W | error | CoP RMS mm | engine W, smooth set-points | error | CoP RMS mm | |"
        )
        print("|---|---|---|---|---|---|---|---|---|")
        cases = []
        for case in calibrate(nlp_gait.load(name), shortest):
            cases.append(case)
            cells = [f"{case.duration_s:.2f}", f"{case.measurements.predicted.total_W:.3f}"]
            for m in (case.measurements, case.smooth):
                pressure = "-" if m.pressure_rms_m is None else f"{1e3 * m.pressure_rms_m:.1f}"
                cells += [f"{m.measured.total_W:.3f}", f"{m.power_error:+.0%}", pressure]
            fallen = [label for label, m in (("40 ms", case.measurements), ("smooth", case.smooth)) if m.fallen]
            cells.append(f"falls ({', '.join(fallen)})" if fallen else "stays up")
            print(f"| {' | '.join(cells)} |", flush=True)
        for label, attribute in (("40 ms", "measurements"), ("smooth", "smooth")):
            held = shortest_true_s([(case.duration_s, getattr(case, attribute)) for case in cases], TOLERANCE)
            found = "not even for the slowest gait" if held is None else f"down to {held:.2f} s"
            print(f"\nSet-points {label}: power within {TOLERANCE:.0%} {found}.")


if __name__ == "__main__":
    main()
