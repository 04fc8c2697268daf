"""``nlp-gait plan``."""

from __future__ import annotations

from pathlib import Path

from compare.cli.command import command
from compare.cli.common import fail, print_json, print_written, say, stdout
from compare.cli.options import parse_values
from compare.cli.outputs import output_file


@command
def plan(
    *,
    robot: str = "nao-v5",
    steps: int | None = None,
    speed: float | None = None,
    distance: float | None = None,
    values: list[str] | None = None,
    starts: int = 3,
    out: Path | None = None,
    as_json: bool = False,
) -> None:
    """Plan a whole walk from standing to standing: weight shift, half step, steps, half step, weight shift.

    Examples: `nlp-gait plan --robot nao-v5 --steps 10 --speed 0.05 --out walk.json`, then `nlp-gait simulate walk.json` and
    `nlp-gait export walk.json --format csv --period-ms 1`
    """
    import nlp_gait
    from nlp_gait.files import replace_nan, write_json

    target = None if out is None else output_file(out)
    found = nlp_gait.plan_walk(
        robot,
        steps,
        speed_m_s=speed,
        distance_m=distance,
        values=parse_values(values, "--set"),
        starts=starts,
        progress=say,
    )
    data = replace_nan(found.to_json())
    if target is not None:
        write_json(target, data)
    if as_json:
        print_json(data)
    else:
        stdout.print(
            f"{found.steps} steps, {found.distance_m:.3f} m in {found.duration_s:.2f} s: {found.energy_J:.2f} J, "
            f"{found.energy_J / found.distance_m:.2f} J/m; inner steps of {found.solution.x['step_length_m']:.4f} m"
        )
        if target is not None:
            print_written(target)
    if not found.feasible:
        fail("no feasible walk was found. " + ". ".join(found.obstacles))
