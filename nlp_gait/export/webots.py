"""Writer of Webots `.motion` files.

The grammar is that of Webots' own parser (`src/controller/c/motion.c`): a header ``#WEBOTS_MOTION,V1.0,<motor>,...``; then rows
``MM:SS:mmm,<pose name>,<radians>,...`` with one value a motor; lines shorter than 4,096 characters. Webots interpolates linearly.
"""

from pathlib import Path

from nlp_gait.errors import InputError
from nlp_gait.export.set_points import SetPoints
from nlp_gait.files import write_text

LONGEST_LINE = 4095  # characters with the line's end: size of the parser's buffer


def write_motion(path: Path, points: SetPoints) -> None:
    """Write set-points as a `.motion` file; raises OutputError, and as ``format_motion``."""
    write_text(path, format_motion(points))


def format_motion(points: SetPoints) -> str:
    """Return the content of a `.motion` file; raises InputError if the format cannot express the joints' names or number."""
    lines = [",".join(("#WEBOTS_MOTION", "V1.0", *points.joints))]
    if lines[0].count(",") != len(points.joints) + 1:
        raise InputError("joints of a .motion file must have names without commas; rename them in the robot's file")
    for number, (time, row) in enumerate(zip(points.times_ms, points.angles.tolist(), strict=True), start=1):
        seconds, milliseconds = divmod(time, 1000)
        values = ",".join(f"{value:.9f}" for value in row)
        lines.append(f"{seconds // 60:02d}:{seconds % 60:02d}:{milliseconds:03d},Pose{number},{values}")
    longest = max(map(len, lines))
    if longest >= LONGEST_LINE:
        raise InputError(
            f"a line of the .motion file has {longest} characters for {len(points.joints)} joints; Webots' parser needs fewer "
            f"than {LONGEST_LINE}: export as csv"
        )
    return "\n".join(lines) + "\n"
