"""Print how the simulation of the optima depends on what no data sheet gives: servo gains, set-points, soles, engine step.

    python benchmarks/drive_sensitivity.py

Under a minute; needs the extra ``sim``.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import nlp_gait
from nlp_gait.problem import Result
from nlp_gait.simulation import measurements, mjcf, playback
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import measure
from nlp_gait.simulation.plan import plan_of
from nlp_gait.simulation.playback import play

DEFAULT = Drive()
DRIVES = {
    "default": DEFAULT,
    **{f"stall torque at {error:g} rad": Drive(full_error_rad=error) for error in (0.16, 0.05, 0.04, 0.03)},
    **{f"damping / stiffness {time:g} s": Drive(time_constant_s=time) for time in (0.01, 0.03, 0.05)},
    **{f"set-points every {1000 * period:g} ms": Drive(period_s=period) for period in (0.02, 0.01, mjcf.TIME_STEP)},
    **{f"torque limits: {name}": Drive(torque_limits=name) for name in ("stall", "continuous")},
}


@contextmanager
def engine_step(step_s: float) -> Iterator[None]:
    """Another time step for all that simulates."""
    before = mjcf.TIME_STEP
    for module in (mjcf, playback, measurements):
        module.TIME_STEP = step_s
    try:
        yield
    finally:
        for module in (mjcf, playback, measurements):
            module.TIME_STEP = before


def main() -> None:
    """One Markdown table a phase."""
    for name in ("nao-ssp", "nao-dsp"):
        problem = nlp_gait.load(name)
        optimum = nlp_gait.solve(problem, starts=5, seed=0)
        plan = plan_of(Result(problem=problem, x=problem.check_x(list(optimum.x.values()))))
        print(f"\n### {name}: model {plan.mechanical_power_W:.3f} W mechanical, {plan.heat_power_W:.3f} W heat\n")
        print(
            "| variant | mechanical W | heat W | CoP to ZMP, RMS / middle mm | tracking max rad | tilt deg | landing mm | |"
        )
        print("|---|---|---|---|---|---|---|---|")

        def row(label: str, drive: Drive = DEFAULT, sole: str = "rectangle") -> None:
            m = measure(plan, play(plan, drive=drive, sole=sole), drive)  # noqa: B023 (called within the same turn)
            cells = [label, f"{m.measured.mechanical_W:.3f}", f"{m.measured.heat_W:.3f}"]
            pressure = (m.pressure_rms_m, m.pressure_middle_rms_m)
            cells.append(" / ".join("-" if value is None else f"{1000 * value:.1f}" for value in pressure))
            cells += [f"{m.tracking_max_rad:.3f}", f"{m.largest_tilt_deg:.1f}"]
            cells.append(", ".join(f"{1000 * landing.error_m:.1f}" for landing in m.landings.values()) or "-")
            cells.append("falls" if m.fallen else "stays up")
            print(f"| {' | '.join(cells)} |", flush=True)

        for label, drive in DRIVES.items():
            row(label, drive)
        row("true outline of the soles", sole="polygon")
        for step_s in (0.001, 0.00025, 0.0001):
            with engine_step(step_s):
                row(f"engine step {1000 * step_s:g} ms")


if __name__ == "__main__":
    main()
