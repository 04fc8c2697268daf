"""``nlp-gait simulate``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.analysis.units import millimetres, with_unit
from compare.cli.command import command
from compare.cli.common import end_interrupted, fail, output_file, print_json, print_table, stdout
from compare.cli.options import AsJson, DriveOptions, StoredGait
from nlp_gait.simulation.mjcf import FRICTION

if TYPE_CHECKING:
    from nlp_gait.simulation.measurements import Measurements
    from nlp_gait.simulation.robustness import Robustness
    from nlp_gait.simulation.walking import Walk


@command
def simulate(
    stored: StoredGait,
    *,
    steps: Annotated[
        int | None, typer.Option(help="Play this many steps of a nao-cycle, every second one mirrored.")
    ] = None,
    viewer: Annotated[bool, typer.Option("--viewer", help="Watch it in MuJoCo's window.")] = False,
    video: Annotated[Path | None, typer.Option(help="Film it to this .gif or .mp4 file.")] = None,
    frames_per_s: Annotated[
        float, typer.Option("--fps", min=0.1, max=50.0, help="Frames a second of the film.")
    ] = 25.0,
    out: Annotated[Path | None, typer.Option(help="Folder for report, time histories, model and picture.")] = None,
    sole: Annotated[str, typer.Option(help="rectangle, as in the paper, or polygon, the true outline.")] = "rectangle",
    friction: Annotated[float, typer.Option(help="Coefficient of sliding friction.")] = FRICTION,
    servos: DriveOptions,
    robustness: Annotated[
        bool, typer.Option("--robustness", help="Also sweep pushes, slopes, friction and mass (minutes).")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Play a NAO gait in MuJoCo, open loop, and compare it with the model's predictions.

    Needs the extra `sim`. Example: `nlp-gait simulate best.json --video walk.gif` after `nlp-gait solve nao-ssp --out best.json`
    """
    from compare.drawing.playback_figure import plot_playback
    from nlp_gait.export.tables import write_npz
    from nlp_gait.files import without_nan, writable_folder, write_json, write_text
    from nlp_gait.simulation.camera import filmed, shown
    from nlp_gait.simulation.conditions import Conditions
    from nlp_gait.simulation.engine import mujoco
    from nlp_gait.simulation.measurements import measure
    from nlp_gait.simulation.mjcf import free_model
    from nlp_gait.simulation.plan import plan_of
    from nlp_gait.simulation.playback import play
    from nlp_gait.simulation.robustness import robustness as sweep
    from nlp_gait.simulation.video import check_video_path, write_video
    from nlp_gait.simulation.walking import measure_walk

    mujoco(pictures=video is not None)
    if viewer and video is not None:
        fail("--viewer and --video exclude each other; film it in a second run")
    target = None if video is None else output_file(check_video_path(video))
    folder = None if out is None else writable_folder(out)
    plan = plan_of(stored.load(), steps)
    drive, conditions = servos.chosen(), Conditions(friction=friction)
    if target is not None:
        trace, frames = filmed(plan, conditions, drive, sole, frames_per_s)
        write_video(target, frames, frames_per_s)
    else:
        trace = (shown if viewer else play)(plan, conditions, drive, sole)
    walk = None if steps is None else measure_walk(plan, trace, drive, steps)
    report = measure(plan, trace, drive) if walk is None else walk.measurements
    survival = None
    data = {"schema": 1, **asdict(report), **({} if walk is None else {"walk": walk.course()})}
    if folder is not None:
        write_json(folder / "report.json", without_nan(data))
        write_text(folder / "model.xml", free_model(plan.robot, plan.shapes(sole), drive, plan.gravity, friction))
        write_npz(folder / "playback.npz", trace.signals(plan.joints))
        plot_playback(plan, trace, drive, folder / "playback")
    if robustness:
        try:
            survival = sweep(plan, drive)
        except KeyboardInterrupt:
            lost = "nothing was written; name a folder with --out"
            kept = lost if folder is None else f"the playback is kept in {folder}"
            end_interrupted(f"interrupted in the tests of robustness; {kept}")
        data["robustness"] = asdict(survival)
        if folder is not None:
            write_json(folder / "report.json", without_nan(data))
    if as_json:
        print_json(data)
    else:
        _print(report, survival)
        if walk is not None:
            _print_course(walk)


def _print(report: Measurements, survival: Robustness | None) -> None:
    fate = "stays up" if report.fell_at_s is None else f"FALLS at {report.fell_at_s:.2f} s"
    stdout.print(f"The robot {fate}; largest tilt {report.largest_tilt_deg:.1f} degrees")
    powers = [
        (name, *(f"{part:.3f}" for part in (power.mechanical_W, power.heat_W, power.total_W, power.signed_W)))
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
    rows = [(name, millimetres(value)) for name, value in lengths.items()]
    tracking = f"{report.tracking_rms_rad:.4f} rad RMS, {report.tracking_max_rad:.4f} rad largest"
    print_table("Against the plan", ("", "measured"), [*rows, ("tracking error of the joints", tracking)])
    if report.earliest_landing_s is not None and report.landing_speed_m_s is not None:
        early = 1000.0 * report.earliest_landing_s
        stdout.print(
            f"Feet land at most {abs(early):.0f} ms {'early' if early >= 0.0 else 'late'}, "
            f"at {report.landing_speed_m_s:.3f} m/s or less"
        )
    for joint, share in report.beyond_limit.items():
        stdout.print(f"{joint} is planned to give up to {share:.2f} times its torque limit")
    for joint, share in report.saturated.items():
        stdout.print(f"{joint} is at its torque limit for {share:.2%} of the time")
    for joint in report.joint_limits:
        stdout.print(f"{joint} goes beyond its mechanical range")
    if survival is not None:
        for title, unit, found in (("push", "N s", survival.push_Ns), ("slope", "degrees", survival.slope_deg)):
            listed = ", ".join(f"{direction} {value:g}" for direction, value in found.items())
            stdout.print(f"Largest {title} survived [{unit}]: {listed}", markup=False)
        for title, outcomes in (("friction", survival.friction), ("mass factor", survival.mass_factor)):
            listed = ", ".join(f"{value:g} {'stays up' if up else 'falls'}" for value, up in outcomes.items())
            stdout.print(f"{title}: {listed}")


def _print_course(walk: Walk) -> None:
    if walk.walked_m is None or walk.drift_m is None or walk.heading_deg is None:
        stdout.print(f"{walk.steps_done} of {walk.steps} steps done before it fell")
        return
    stdout.print(
        f"{walk.steps} steps: walked {millimetres(walk.walked_m, '.0f')} of {millimetres(walk.planned_m, '.0f')}, "
        f"{millimetres(walk.drift_m, '.0f')} to the left, heading {walk.heading_deg:.1f} degrees to the left; "
        f"{with_unit(walk.engine_J_per_planned_m, 'J', '.1f')} per planned metre (model: {walk.model_J_per_m:.1f} J), "
        f"{with_unit(walk.engine_J_per_m, 'J', '.1f')} per walked metre"
    )
