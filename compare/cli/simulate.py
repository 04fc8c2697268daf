"""``nlp-gait simulate``."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from compare.analysis.units import format_millimetres, with_unit
from compare.cli.command import OUTPUT, OUTPUT_FILE, command
from compare.cli.endings import report_interrupts
from compare.cli.options import AsJson, StoredGait, parse_number
from compare.cli.outputs import check_output_file
from compare.cli.printing import print_json, print_table, print_written, show_progress, stdout
from nlp_gait.errors import InputError, unknown
from nlp_gait.files import make_writable_folder, replace_nan, write_json, write_text
from nlp_gait.simulation.video import Frame, check_frames, check_video_path, write_video

if TYPE_CHECKING:
    from nlp_gait.simulation.drive import Drive
    from nlp_gait.simulation.measurements import Measurements, Walk
    from nlp_gait.simulation.plan import Plan
    from nlp_gait.simulation.replay import Recording
    from nlp_gait.simulation.simulate import Conditions, Robustness, Simulation


@dataclass(frozen=True, kw_only=True)
class DriveOptions:
    """The drive of the simulated robot."""

    drive: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE.toml",
            help="feed-forward: set-points every 10 ms, linear between them, planned velocity and torque fed forward. held: "
            "each held for 40 ms, nothing fed forward. Or a file with settings of drive and feedback.",
        ),
    ] = "feed-forward"
    torque_limits: Annotated[
        str | None,
        typer.Option(
            help="urdf, stall or continuous: published limits differ; joints without motor data have the file's."
        ),
    ] = None
    feedback: Annotated[
        str | None,
        typer.Option(help="none, in open loop; torso-spring: balance by measured place and attitude of the torso."),
    ] = None

    def make(self) -> Drive:
        """Return the drive; raises UnknownNameError, and InputError for a setting that is not allowed."""
        from nlp_gait.simulation.drive import FEEDBACKS, load_drive

        drive = load_drive(self.drive)
        if self.torque_limits is not None:
            drive = replace(drive, torque_limits=self.torque_limits)
        if self.feedback is None:
            return drive
        if self.feedback not in FEEDBACKS:
            raise unknown("feedback", self.feedback, FEEDBACKS)
        return replace(drive, feedback=FEEDBACKS[self.feedback])


@dataclass(frozen=True, kw_only=True)
class ConditionOptions:
    """Differences of the simulated world and robot from the planned ones."""

    friction: Annotated[float | None, typer.Option(help="Coefficient of sliding friction (default: 0.7).")] = None
    slope_deg: Annotated[
        str,
        typer.Option(
            metavar="X,Y",
            help="Rise of the floor forward and to the left, added to the slope of a walk planned for one.",
        ),
    ] = "0,0"
    mass_factor: Annotated[float, typer.Option(help="On all masses; the gait was planned for 1.")] = 1.0
    stiffness_factor: Annotated[
        float, typer.Option(help="True stiffness of the joints over what their drive assumes.")
    ] = 1.0
    push: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y[,S]",
            help="Impulse on the torso, forward and to the left [N s], and its begin [s] (default: in the middle).",
        ),
    ] = None

    def make(self) -> Conditions:
        """Return the conditions; raises InputError for a value that is not allowed."""
        from nlp_gait.simulation.simulate import Conditions, Push

        slope_x, slope_y = _parse_numbers(self.slope_deg, "--slope-deg", "X,Y", (2,))
        push = None
        if self.push is not None:
            x, y, *start_s = _parse_numbers(self.push, "--push", "X,Y or X,Y,S", (2, 3))
            push = Push(impulse_Ns=(x, y), start_s=start_s[0] if start_s else None)
        conditions = Conditions(
            mass_factor=self.mass_factor,
            stiffness_factor=self.stiffness_factor,
            slope_rad=(math.radians(slope_x), math.radians(slope_y)),
            push=push,
        )
        return conditions if self.friction is None else replace(conditions, friction=self.friction)


def _parse_numbers(text: str, flag: str, form: str, counts: tuple[int, ...]) -> list[float]:
    parts = text.split(",")
    if len(parts) not in counts:
        raise InputError(f"{flag} takes {form}, got {text!r}")
    return [parse_number(name, part, flag) for name, part in zip("XYS", parts, strict=False)]


@command
def simulate(
    stored: StoredGait,
    *,
    steps: Annotated[int | None, typer.Option(help="Simulate this many steps of a gait that repeats.")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for report, time histories, model and figure."), OUTPUT
    ] = None,
    page: Annotated[
        Path | None, typer.Option(metavar="FILE.html", help="Page that plays the simulation in 3-D."), OUTPUT_FILE
    ] = None,
    video: Annotated[
        Path | None,
        typer.Option(help="Film it to this .gif file; needs OpenGL."),
        OUTPUT_FILE,
    ] = None,
    sole: Annotated[str, typer.Option(help="rectangle, as in the paper, or polygon, the true outline.")] = "rectangle",
    world: ConditionOptions,
    drive_options: DriveOptions,
    robustness: Annotated[
        bool, typer.Option("--robustness", help="Also sweep pushes, slopes, friction and mass (minutes).")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Simulate a gait in MuJoCo (extra `sim`), open loop or with feedback, and compare it with the model's predictions.

    Examples, after `nlp-gait solve nao-ssp --out best.json`: `nlp-gait simulate best.json --page walk.html`,
    `nlp-gait simulate best.json --push 0.5,0 --feedback torso-spring`, `nlp-gait simulate best.json --drive slow.toml` with

        period_s = 0.02               # feed_forward = "torque", interpolation = "linear", torque_limits = "urdf"

        [feedback]                    # leave it out for open loop
        delay_s = 0.02
    """
    from compare.drawing.robot_figures import plot_simulation
    from compare.report.interactive import animate_simulation
    from nlp_gait.export.formats import write_npz
    from nlp_gait.simulation.engine import load_mujoco
    from nlp_gait.simulation.mjcf import make_plan_model
    from nlp_gait.simulation.plan import make_plan
    from nlp_gait.simulation.replay import FRAMES_PER_S, make_skeleton, record_states
    from nlp_gait.simulation.simulate import SETTLE_TIME, measure_robustness, simulate_plan

    load_mujoco(pictures=video is not None)
    film = None if video is None else check_output_file(check_video_path(video))
    target = None if page is None else check_output_file(page)
    folder = None if out is None else make_writable_folder(out)
    drive, conditions, result = drive_options.make(), world.make(), stored.load()
    plan = make_plan(result, steps)
    if film is not None:
        check_frames(plan.duration_s + SETTLE_TIME, FRAMES_PER_S)
    player = partial(simulate_plan, plan, conditions, drive, sole)
    written = []
    if film is None and target is None:
        trace = player()
    else:
        recording = record_states(plan, player)
        trace = recording.simulation
        if target is not None:
            power = np.abs(trace.torque * trace.qd).sum(axis=1)[recording.steps]
            animate_simulation(make_skeleton(recording, sole, result.problem.title), power).write(target)
            written.append(target)
        if film is not None:
            _write_film(recording, film, FRAMES_PER_S)
            written.append(film)
    report, walk = _measure(plan, trace, drive)
    survival = None
    data = {"schema": 1, **_encode_walk(report, walk)}
    if folder is not None:
        written += [folder / name for name in ("report.json", "model.xml", "simulation.npz")]
        write_json(folder / "report.json", replace_nan(data))
        write_text(folder / "model.xml", make_plan_model(plan, drive, sole, conditions.friction))
        write_npz(folder / "simulation.npz", trace.signals(plan.joints))
        written += plot_simulation(plan, trace, drive, folder / "simulation")
    if robustness:
        lost = "nothing was written; name a folder with --out"
        where = lost if folder is None else f"the simulation is stored in {folder}"
        with report_interrupts(f"interrupted in the tests of robustness; {where}"):
            survival = measure_robustness(plan, drive)
        data["robustness"] = asdict(survival)
        if folder is not None:
            write_json(folder / "report.json", replace_nan(data))
    if as_json:
        print_json(data)
        return
    _print(report, survival)
    if walk is not None:
        _print_course(walk, open_loop=drive.feedback is None)
    print_written(*written)


def _write_film(recording: Recording, target: Path, frames_per_s: float) -> None:
    from nlp_gait.simulation.replay import draw_pictures

    def show_pictures() -> Iterator[Frame]:
        with show_progress("frames", len(recording.states)) as advance:
            for picture in draw_pictures(recording):
                yield picture
                advance("")

    write_video(target, show_pictures(), frames_per_s)


def _measure(plan: Plan, trace: Simulation, drive: Drive) -> tuple[Measurements, Walk | None]:
    from nlp_gait.simulation.measurements import measure, measure_walk

    if plan.steps is None:
        return measure(plan, trace, drive), None
    walk = measure_walk(plan, trace, drive, plan.steps)
    return walk.measurements, walk


def _encode_walk(report: Measurements, walk: Walk | None) -> dict[str, Any]:
    if walk is None:
        return asdict(report)
    whole = {"walked_m": walk.walked_m, "planned_m": walk.planned_m, "energy_J": walk.engine_J}
    return {**asdict(report), **whole, "walk": walk.course()}


def _print(report: Measurements, survival: Robustness | None) -> None:
    fate = "stays up" if report.fell_at_s is None else f"FALLS at {report.fell_at_s:.2f} s"
    stdout.print(f"The robot {fate}; largest tilt {report.largest_tilt_deg:.1f} degrees")
    powers = [
        (name, *(f"{part:z.3f}" for part in (power.mechanical_W, power.heat_W, power.total_W, power.signed_W)))
        for name, power in (("model", report.predicted), ("engine", report.measured))
    ]
    print_table("Mean power [W]", ("", "mechanical", "heat", "total", "net mechanical"), powers)
    lengths = {
        "centre of pressure to planned ZMP, RMS": report.pressure_rms_m,
        "- RMS in the middle 60 % of the phase": report.pressure_middle_rms_m,
        "slip of a supporting foot": report.slip_m,
        **{f"landing error, {side} foot": landing.error_m for side, landing in report.landings.items()},
    }
    rows = [(name, format_millimetres(value)) for name, value in lengths.items()]
    tracking = f"{report.tracking_rms_rad:.4f} rad RMS, {report.tracking_max_rad:.4f} rad largest"
    print_table("Compared with the plan", ("", "measured"), [*rows, ("tracking error of the joints", tracking)])
    if report.earliest_landing_s is not None and report.landing_speed_m_s is not None:
        early = 1000.0 * report.earliest_landing_s
        stdout.print(
            f"Feet land at most {abs(early):.0f} ms {'early' if early >= 0.0 else 'late'}, "
            f"at {report.landing_speed_m_s:.3f} m/s or less"
        )
    for joint, share in report.beyond_limit.items():
        stdout.print(f"{joint} needs up to {share:.2f} times its torque limit in the plan")
    for joint, share in report.saturated.items():
        stdout.print(f"{joint} is at its torque limit for {share:.2%} of the time")
    for joint in report.joint_limits:
        stdout.print(f"{joint} exceeds its mechanical range")
    if survival is not None:
        for title, unit, found in (("push", "N s", survival.push_Ns), ("slope", "degrees", survival.slope_deg)):
            values = ", ".join(f"{direction} {value:g}" for direction, value in found.items())
            stdout.print(f"Largest {title} survived [{unit}]: {values}", markup=False)
        for title, outcomes in (("friction", survival.friction), ("mass factor", survival.mass_factor)):
            values = ", ".join(f"{value:g} {'stays up' if up else 'falls'}" for value, up in outcomes.items())
            stdout.print(f"{title}: {values}")


def _print_course(walk: Walk, *, open_loop: bool) -> None:
    if walk.walked_m is None or walk.drift_m is None or walk.heading_deg is None:
        remedy = "; --feedback torso-spring, larger margins or a lower speed may keep it up" if open_loop else ""
        stdout.print(f"{walk.steps_done} of {walk.steps} steps completed before the fall{remedy}")
        return
    stdout.print(
        f"{walk.steps} steps: walked {format_millimetres(walk.walked_m, '.0f')} of {format_millimetres(walk.planned_m, '.0f')}, "
        f"{format_millimetres(walk.drift_m, '.0f')} to the left, heading {walk.heading_deg:z.1f} degrees to the left "
        f"(planned {walk.planned_heading_deg:z.1f}); "
        f"{with_unit(walk.engine_J_per_planned_m, 'J', '.1f')} per planned metre (model: {walk.model_J_per_m:.1f} J), "
        f"{with_unit(walk.engine_J_per_m, 'J', '.1f')} per walked metre"
    )
