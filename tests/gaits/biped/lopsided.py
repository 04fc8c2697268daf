"""A body whose soles are wider to one side."""

from dataclasses import replace

from nlp_gait.gaits.biped.body import Body

WIDTHS = {"left": {"left_m": 0.06, "right_m": 0.02}, "right": {"left_m": 0.03, "right_m": 0.05}}


def make_lopsided(body: Body) -> Body:
    """Return the body with soles that reach farther outward than inward, each by another amount."""
    feet = {side: replace(foot, **WIDTHS[side]) for side, foot in body.robot.feet.items()}
    return replace(body, motors=replace(body.motors, robot=replace(body.robot, feet=feet)))
