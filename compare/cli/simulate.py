"""``nlp-gait simulate``."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from typer import Argument, Option

from compare.analysis.units import format_millimetres, with_unit
from compare.cli.command import OUTPUT, OUTPUT_FILE, Output, Rows, command
from compare.cli.options import Code, name_all, parse_numbers
from compare.judge import find_faults
from compare.study.record import load_result_or_record
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder, replace_nan, write_json, write_text

if TYPE_CHECKING:
    from nlp_gait.formulation import Signals
    from nlp_gait.formulation.display import Skeleton
    from nlp_gait.simulation.drive import Drive
    from nlp_gait.simulation.measurements import ClimbMeasurements, Measurements, Walk
    from nlp_gait.simulation.plan import Plan
    from nlp_gait.simulation.simulate import Conditions, Simulation


@dataclass(frozen=True, kw_only=True)
class DriveOptions:
    """The drive of the simulated robot."""

    drive: Annotated[str, Option(metavar="NAME|FILE.toml")] = "feed-forward"
    torque_limits: str | None = None
    feedback: str | None = None

    def make(self, plan: Plan) -> Drive:
        """Return the drive for a plan; raises UnknownNameError, and InputError for a setting that is not allowed."""
        from nlp_gait.simulation.balance.drives import choose_feedback, load_drive

        drive = load_drive(self.drive)
        if self.torque_limits is not None:
            drive = replace(drive, torque_limits=self.torque_limits)
        if self.feedback is not None:
            return choose_feedback(drive, self.feedback)
        return choose_feedback(drive, "balance") if plan.from_rest_to_rest and drive.controller is None else drive


@dataclass(frozen=True, kw_only=True)
class ConditionOptions:
    """Differences of the simulated world and robot from the planned ones."""

    friction: Annotated[float | None, Option(min=0.001, max=1000.0)] = None
    slope_deg: Annotated[str, Option(metavar="X,Y")] = "0,0"
    mass_factor: Annotated[float, Option(min=0.001, max=1000.0)] = 1.0
    stiffness_factor: Annotated[float, Option(min=0.001, max=1000.0)] = 1.0
    push: Annotated[str | None, Option(metavar="X,Y[,S]")] = None
    bumps_mm: Annotated[float | None, Option(min=0.001, max=1000.0)] = None

    def make(self) -> Conditions:
        """Return the conditions; raises InputError for a value that is not allowed."""
        from nlp_gait.simulation.mjcf import Bumps
        from nlp_gait.simulation.simulate import Conditions, Push

        slope = parse_numbers("a slope", self.slope_deg, "--slope-deg", least=-45.0, most=45.0)
        if len(slope) != 2:
            raise InputError(f"--slope-deg takes X,Y, got {self.slope_deg!r}")
        push = None
        if self.push is not None:
            impulse = parse_numbers("an impulse or its begin", self.push, "--push")
            if len(impulse) not in (2, 3):
                raise InputError(f"--push takes X,Y or X,Y,S, got {self.push!r}")
            push = Push(impulse_Ns=(impulse[0], impulse[1]), start_s=impulse[2] if len(impulse) == 3 else None)
        conditions = Conditions(
            mass_factor=self.mass_factor,
            stiffness_factor=self.stiffness_factor,
            slope_rad=(math.radians(slope[0]), math.radians(slope[1])),
            push=push,
            bumps=None if self.bumps_mm is None else Bumps(height_m=1e-3 * self.bumps_mm),
        )
        return conditions if self.friction is None else replace(conditions, friction=self.friction)


@command
def simulate(
    result: Annotated[Path, Argument(metavar="RESULT.json")],
    *,
    code: Code = None,
    steps: Annotated[int | None, Option(min=1, max=1000)] = None,
    out: Annotated[Path | None, OUTPUT] = None,
    page: Annotated[Path | None, Option(metavar="FILE.html"), OUTPUT_FILE] = None,
    world: ConditionOptions,
    drive_options: DriveOptions,
) -> Output:
    """Simulate a gait in MuJoCo (extra `sim`) and compare it with the model's predictions; whole walks have balance feedback.

    Examples, after `nlp-gait solve nao-ssp --out best.json`: `nlp-gait simulate best.json --page walk.html`,
    `nlp-gait simulate best.json --push 0.5,0 --feedback balance`, `nlp-gait simulate best.json --drive slow.toml` with

        period_s = 0.02               # feed_forward = "torque", interpolation = "linear", torque_limits = "urdf"

        [balance]                     # of walks, or with --feedback balance
        delay_s = 0.004

    A table `[controller]` with `kp`, `kd` and `gravity_compensation` instead is a PD controller with equal gains of all joints.
    """
    from compare.drawing.robot_figures import plot_simulation
    from nlp_gait.robots.loading import hold_robots
    from nlp_gait.simulation.engine import load_mujoco
    from nlp_gait.simulation.mjcf import make_plan_model
    from nlp_gait.simulation.plan import make_plan
    from nlp_gait.simulation.replay import make_skeleton
    from nlp_gait.simulation.simulate import SimulationRun

    load_mujoco()
    folder = None if out is None else make_writable_folder(out)
    name_all(code)
    conditions = world.make()
    with hold_robots():
        gait = load_result_or_record(result)
        plan = make_plan(gait, steps)
        drive = drive_options.make(plan)
        faults = find_faults(gait, result)
    run = SimulationRun(plan, conditions, drive)
    trace = run.finish()
    written = [] if page is None else [page]
    data, parts = _report(plan, trace, drive)
    data["faults"], parts = faults, [*faults, *parts]
    if page is not None:
        _write_page(page, make_skeleton(plan, trace, run.model, gait.problem.title), trace)
    if folder is not None:
        xml = make_plan_model(plan, drive, conditions.friction, conditions.bumps)
        written += _write_report(folder, data, xml, trace.signals(plan.joints))
        written.append(plot_simulation(plan, trace, drive, folder / "simulation.png"))
    return Output(data=data, parts=parts, written=written)


def _write_page(page: Path, skeleton: Skeleton, trace: Simulation) -> None:
    """Write the page that plays a simulation, with the mechanical power of all joints."""
    from compare.report.interactive import animate_simulation
    from nlp_gait.simulation.replay import list_frames

    power = np.abs(trace.torque * trace.qd).sum(axis=1)[list_frames(trace)]
    animate_simulation(skeleton, power).write(page)


def _write_report(folder: Path, data: dict[str, Any], model: str, histories: Signals) -> list[Path]:
    """Write report, model and time histories of a simulation; return the files."""
    from nlp_gait.export.formats import write_npz

    report, xml, arrays = (folder / name for name in ("report.json", "model.xml", "simulation.npz"))
    write_json(report, replace_nan(data))
    write_text(xml, model)
    write_npz(arrays, histories)
    return [report, xml, arrays]


def _report(plan: Plan, trace: Simulation, drive: Drive) -> tuple[dict[str, Any], list[str | Rows]]:
    """Return what is measured in a simulation, as data and in words."""
    from nlp_gait.simulation.measurements import measure, measure_climb, measure_walk

    walk = None if plan.steps is None else measure_walk(plan, trace, drive, plan.steps)
    report = measure(plan, trace, drive) if walk is None else walk.measurements
    mode = "in open loop" if drive.feedback is None else "with balance feedback"
    data = {"schema": 1, **asdict(report), "mode": mode}
    parts = [*_describe(report, mode)]
    if walk is not None:
        data |= {"walked_m": walk.walked_m, "planned_m": walk.planned_m, "energy_J": walk.engine_J}
        data["walk"] = walk.course()
        parts.append(_describe_course(walk, drive.feedback is None))
    if plan.ground:
        climb = measure_climb(plan, trace)
        data["climb"] = asdict(climb)
        parts.append(_describe_climb(climb))
        parts += [
            f"The swinging {hit.side} foot hits a riser at {hit.at_s:.2f} s: up to {hit.force_N:.0f} N, "
            f"{1e3 * hit.contact_s:.0f} ms, {hit.impulse_Ns:.2f} N s"
            for hit in climb.riser_hits
        ]
    return data, parts


def _describe(report: Measurements, mode: str) -> Iterator[str | Rows]:
    fate = "stays up" if report.fell_at_s is None else f"FALLS at {report.fell_at_s:.2f} s"
    if report.stepped_at_s is not None:
        fate = f"steps at {report.stepped_at_s:.2f} s and {fate}"
    yield f"The robot {fate} {mode}; largest tilt {report.largest_tilt_deg:.1f} degrees"
    powers = [
        (name, *(f"{watts:z.3f}" for watts in (power.mechanical_W, power.heat_W, power.total_W, power.signed_W)))
        for name, power in (("model", report.predicted), ("engine", report.measured))
    ]
    yield Rows("Mean power [W]", ("", "mechanical", "heat", "total", "net mechanical"), powers)
    lengths = {
        "centre of pressure to planned ZMP, RMS": report.pressure_rms_m,
        "- RMS in the middle 60 % of the phase": report.pressure_middle_rms_m,
        "slip of a supporting foot": report.slip_m,
        **{f"landing error, {side} foot": error for side, error in report.landing_errors_m.items()},
    }
    rows = [(name, format_millimetres(value)) for name, value in lengths.items()]
    tracking = f"{report.tracking_rms_rad:.4f} rad RMS, {report.tracking_max_rad:.4f} rad largest"
    yield Rows("Compared with the plan", ("", "measured"), [*rows, ("tracking error of the joints", tracking)])
    if report.earliest_landing_s is not None and report.landing_speed_m_s is not None:
        ms = 1000.0 * report.earliest_landing_s
        when = f"{abs(ms):.0f} ms {'early' if ms >= 0.0 else 'late'}"
        yield f"Feet land at most {when}, at {report.landing_speed_m_s:.3f} m/s or less"
    for joint, share in report.beyond_limit.items():
        yield f"{joint} needs up to {share:.2f} times its torque limit in the plan"
    for joint, share in report.saturated.items():
        yield f"{joint} is at its torque limit for {share:.2%} of the time"
    for joint in report.joint_limits:
        yield f"{joint} exceeds its mechanical range"


def _describe_climb(climb: ClimbMeasurements) -> str:
    errors, rises, planned = (
        ", ".join(f"{1e3 * length:z.1f}" for length in lengths)
        for lengths in (climb.landing_errors_m, climb.hip_rises_m, climb.planned_rises_m)
    )
    stairs = f"{climb.climbed} of {climb.stairs}" if climb.climbed < climb.stairs else f"{climb.stairs}"
    return (
        f"Climbs {stairs} stairs; landing errors [mm] {errors} (less than half a tread, {1e3 * climb.half_tread_m:.0f}, "
        f"counts); the hip rises by [mm] {rises} (planned {planned})"
    )


def _describe_course(walk: Walk, open_loop: bool) -> str:
    if walk.walked_m is None or walk.drift_m is None or walk.heading_deg is None:
        remedy = "; --feedback balance, larger margins or a lower speed may keep it up" if open_loop else ""
        return f"{walk.steps_done} of {walk.steps} steps completed before the fall{remedy}"
    walked, planned, drift = (format_millimetres(m, ".0f") for m in (walk.walked_m, walk.planned_m, walk.drift_m))
    return (
        f"{walk.steps} steps: walked {walked} of {planned}, {drift} to the left, heading {walk.heading_deg:z.1f} degrees to the "
        f"left (planned {walk.planned_heading_deg:z.1f}); {with_unit(walk.engine_J_per_planned_m, 'J', '.1f')} per planned "
        f"metre (model: {walk.model_J_per_m:.1f} J), {with_unit(walk.engine_J_per_m, 'J', '.1f')} per walked metre"
    )
