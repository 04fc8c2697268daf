"""``nlp-gait simulate``."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compare.analysis.units import format_millimetres, with_unit
from compare.cli.command import OUTPUT, command
from compare.cli.endings import fail, report_interrupts
from compare.cli.options import AsJson, StoredGait, parse_number
from compare.cli.outputs import check_output_file
from compare.cli.printing import print_json, print_table, print_written, show_progress, stdout
from nlp_gait.errors import InputError, unknown
from nlp_gait.files import make_writable_folder, replace_nan, write_json, write_text
from nlp_gait.formulation.result import load_result
from nlp_gait.simulation.film.video import Frame, check_frames, check_video_path, write_video

if TYPE_CHECKING:
    from nlp_gait.simulation.drive import Drive
    from nlp_gait.simulation.film.recording import Simulator
    from nlp_gait.simulation.measurements import Measurements, Walk
    from nlp_gait.simulation.plan import Plan
    from nlp_gait.simulation.simulate import Conditions, Robustness, Simulation


@dataclass(frozen=True, kw_only=True)
class DriveOptions:
    """The drive of the simulated robot, by name, and its settings."""

    drive: Annotated[
        str,
        typer.Option(
            help="feed-forward: set-points every 10 ms, linear between them, planned velocity and "
            "torque fed forward. held: each held for 40 ms, nothing fed forward."
        ),
    ] = "feed-forward"
    period_ms: Annotated[float | None, typer.Option(help="Time between set-points (default: the drive's).")] = None
    interpolation: Annotated[str | None, typer.Option(help="Between set-points: linear or held.")] = None
    feed_forward: Annotated[str | None, typer.Option(help="torque (and velocity), velocity, or none.")] = None
    torque_limits: Annotated[
        str | None,
        typer.Option(
            help="urdf (default), stall or continuous: published limits differ; joints without motor"
            " data have the limit of the robot file."
        ),
    ] = None
    feedback: Annotated[
        str,
        typer.Option(help="none, in open loop; torso-spring: balance by measured place and attitude of the torso."),
    ] = "none"
    feedback_delay_ms: Annotated[
        float | None, typer.Option(help="From measuring to acting (default: the feedback's).")
    ] = None
    feedback_noise: Annotated[float, typer.Option(help="Factor on the noise of its sensors; 0 for none.")] = 1.0
    feedback_seed: Annotated[int, typer.Option(min=0, help="Of this noise: same seed, same walk.")] = 0

    def make(self) -> Drive:
        """Return the drive; raises UnknownNameError, and InputError for a setting that is not allowed."""
        from nlp_gait.simulation.drive import DRIVES, FEEDBACKS

        for kind, name, known in (("drive", self.drive, DRIVES), ("feedback", self.feedback, FEEDBACKS)):
            if name not in known:
                raise unknown(kind, name, known)
        feedback = FEEDBACKS[self.feedback]
        if feedback is not None:
            delay_s = feedback.delay_s if self.feedback_delay_ms is None else self.feedback_delay_ms / 1000.0
            feedback = replace(feedback.with_noise(self.feedback_noise), delay_s=delay_s, seed=self.feedback_seed)
        period_s = None if self.period_ms is None else self.period_ms / 1000.0
        names = ("interpolation", "feed_forward", "torque_limits")
        settings = {"period_s": period_s, **{name: getattr(self, name) for name in names}}
        settings = {name: value for name, value in settings.items() if value is not None}
        return replace(DRIVES[self.drive], feedback=feedback, **settings)


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
    push: Annotated[str, typer.Option(metavar="X,Y", help="Impulse on the torso, forward and to the left [N s].")] = (
        "0,0"
    )
    push_at_s: Annotated[
        float | None, typer.Option(min=0.0, help="When it begins (default: in the middle of the motion).")
    ] = None

    def make(self) -> Conditions:
        """Return the conditions; raises InputError for a value that is not allowed."""
        from nlp_gait.simulation.simulate import Conditions, Push

        slope, impulse = (
            _parse_pair(text, flag) for text, flag in ((self.slope_deg, "--slope-deg"), (self.push, "--push"))
        )
        conditions = Conditions(
            mass_factor=self.mass_factor,
            stiffness_factor=self.stiffness_factor,
            slope_rad=(math.radians(slope[0]), math.radians(slope[1])),
            push=Push(impulse_Ns=impulse, start_s=self.push_at_s) if any(impulse) else None,
        )
        return conditions if self.friction is None else replace(conditions, friction=self.friction)


@dataclass(frozen=True, kw_only=True)
class FilmOptions:
    """A film of a simulated gait, and how it is made."""

    video: Annotated[
        Path | None, typer.Option(help="Film it to this .gif or .mp4 file, from the side, the front and above."), OUTPUT
    ] = None
    beside: Annotated[
        Path | None,
        typer.Option(metavar="OTHER.json", help="Simulate this gait as well, next to the other in the film."),
    ] = None
    size: Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="Of the film [pixels].")] = "1280x720"
    speed: Annotated[float, typer.Option(min=0.05, max=20.0, help="Speed of the film; 0.25 is slow motion.")] = 1.0
    frames_per_s: Annotated[float, typer.Option("--fps", min=0.1, max=50.0, help="Frames a second of the film.")] = 25.0


def _parse_pair(text: str, flag: str) -> tuple[float, float]:
    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(f"{flag} takes two numbers X,Y, got {text!r}")
    return parse_number("X", parts[0], flag), parse_number("Y", parts[1], flag)


@command
def simulate(
    stored: StoredGait,
    *,
    steps: Annotated[int | None, typer.Option(help="Simulate this many steps of a gait that repeats.")] = None,
    viewer: Annotated[bool, typer.Option("--viewer", help="Watch it in MuJoCo's window.")] = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder for report, time histories, model and figure."), OUTPUT
    ] = None,
    sole: Annotated[str, typer.Option(help="rectangle, as in the paper, or polygon, the true outline.")] = "rectangle",
    world: ConditionOptions,
    drive_options: DriveOptions,
    film: FilmOptions,
    robustness: Annotated[
        bool, typer.Option("--robustness", help="Also sweep pushes, slopes, friction and mass (minutes).")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Simulate a gait in MuJoCo, open loop or with feedback, and compare it with the model's predictions.

    Needs the extra `sim`, and imageio-ffmpeg for MP4. Examples, after `nlp-gait solve nao-ssp --out best.json`:
    `nlp-gait simulate best.json --video walk.mp4`,
    `nlp-gait simulate best.json --beside other.json --video both.gif --speed 0.25`
    """
    from compare.drawing.robot_figures import plot_simulation
    from nlp_gait.export.formats import write_npz
    from nlp_gait.simulation.engine import load_mujoco
    from nlp_gait.simulation.film.film import parse_picture_size
    from nlp_gait.simulation.film.recording import show_in_window
    from nlp_gait.simulation.mjcf import make_plan_model
    from nlp_gait.simulation.plan import make_plan
    from nlp_gait.simulation.simulate import SETTLE_TIME, measure_robustness, simulate_plan

    load_mujoco(pictures=film.video is not None)
    if viewer and film.video is not None:
        fail("--viewer and --video exclude each other; write the film in a second run")
    if film.beside is not None and film.video is None:
        fail("--beside adds a second gait to a film; name the film with --video FILE.mp4 or FILE.gif")
    size = parse_picture_size(film.size)
    target = None if film.video is None else check_output_file(check_video_path(film.video))
    folder = None if out is None else make_writable_folder(out)
    drive, conditions = drive_options.make(), world.make()
    gaits = [(stored.result, stored.load())]
    gaits += [] if film.beside is None else [(film.beside, load_result(film.beside))]
    plans = [make_plan(gait, steps) for _, gait in gaits]
    if film.video is not None:
        for each in plans:
            check_frames((each.duration_s + SETTLE_TIME) / film.speed, film.frames_per_s)
    plan, players = plans[0], [partial(simulate_plan, plan, conditions, drive, sole) for plan in plans]
    if target is not None:
        titles = [f"{path.name}: {gait.problem.title}" for path, gait in gaits]
        traces = _write_film(film, target, size, list(zip(titles, plans, players, strict=True)))
    else:
        traces = [show_in_window(players[0]) if viewer else players[0]()]
    measured = [_measure(plan, trace, drive) for plan, trace in zip(plans, traces, strict=True)]
    survival = None
    data = {"schema": 1, **_encode_walk(*measured[0])}
    if film.beside is not None:
        data["beside"] = _encode_walk(*measured[1])
    written = [] if target is None else [target]
    if folder is not None:
        written += [folder / name for name in ("report.json", "model.xml", "simulation.npz")]
        write_json(folder / "report.json", replace_nan(data))
        write_text(folder / "model.xml", make_plan_model(plan, drive, sole, conditions.friction))
        write_npz(folder / "simulation.npz", traces[0].signals(plan.joints))
        written += plot_simulation(plan, traces[0], drive, folder / "simulation")
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
    else:
        for i, ((path, _), (report, walk)) in enumerate(zip(gaits, measured, strict=True)):
            if len(gaits) > 1:
                stdout.print(f"{path}:")
            _print(report, survival if i == 0 else None)
            if walk is not None:
                _print_course(walk, open_loop=drive.feedback is None)
        print_written(*written)


def _write_film(
    film: FilmOptions, target: Path, size: tuple[int, int], gaits: Sequence[tuple[str, Plan, Simulator]]
) -> list[Simulation]:
    from nlp_gait.simulation.film.film import draw_pictures
    from nlp_gait.simulation.film.recording import record_film

    interval_s = film.speed / film.frames_per_s
    pace = "slow motion" if film.speed < 1.0 else "fast"
    note = "" if film.speed == 1.0 else f"{pace}: {film.speed:g} x real time"
    recordings = [record_film(title, plan, player, interval_s) for title, plan, player in gaits]

    def with_progress() -> Iterator[Frame]:
        with show_progress("frames", max(len(recording.t) for recording in recordings)) as advance:
            for picture in draw_pictures(recordings, size, note):
                yield picture
                advance("")

    write_video(target, with_progress(), film.frames_per_s)
    return [recording.simulation for recording in recordings]


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
        "- largest": report.pressure_max_m,
        "- RMS in the middle 60 % of the phase": report.pressure_middle_rms_m,
        "- RMS without averaging over a period": report.pressure_raw_rms_m,
        "- RMS, both relative to the feet": report.pressure_in_feet_rms_m,
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
