"""What is understood of a robot, as rows of words: feet, legs, soles, posture, sizes and what follows from them."""

from __future__ import annotations

from nlp_gait.gaits.humanoid.body import Humanoid

SIDES = ("left", "right")


def understood_of(body: Humanoid) -> list[tuple[str, str]]:
    """Pairs of what and found."""
    biped = body.biped
    robot, legs = biped.full, biped.legs
    held = {name: angle for name, angle in biped.posture_rad.items() if angle}
    rows = [("root", robot.root), ("mass", f"{robot.mass_kg:.2f} kg, {biped.mass_scale:.2f} times NAO's (mu)")]
    for side in SIDES:
        leg, foot = legs[side], robot.feet[side]
        rows.append((f"{side} leg", ", ".join(leg.joints)))
        rows.append(
            (
                f"{side} sole",
                f"{1e3 * (foot.front_m + foot.back_m):.0f} mm by {1e3 * (foot.left_m + foot.right_m):.0f} mm, "
                f"{1e3 * foot.front_m:.0f} mm ahead of the joint of {foot.link}, {1e3 * foot.ankle_height_m:.0f} mm high",
            )
        )
    left = legs["left"]
    exact = (
        "in closed form"
        if not max(body.newton_steps.values())
        else f"by {max(body.newton_steps.values())} Newton steps"
    )
    rows += [
        ("leg length", f"{biped.leg_length_m:.4f} m, {biped.length_scale:.3f} times NAO's (lambda)"),
        (
            "straight knee",
            f"at {left.straight_rad:z.4f} rad, bends to {'larger' if left.bend > 0 else 'smaller'} angles",
        ),
        ("inverse kinematics", exact),
        ("held joints", f"{len(biped.posture_rad)}, at zero" + (" but " + _angles(held) if held else "")),
        ("heat constant K", f"{biped.heat_W_per_Nm2:.3g} W/(Nm)^2, {biped.heat_source}"),
        ("step length", f"{body.step_length_m:.3f} m by default"),
        ("time of a swing", f"{body.scale_time(0.4):.3g} to {body.scale_time(4.0):.3g} s"),
        ("torque may change", f"by {1.2 * biped.torque_scale:.3g} Nm over an interval"),
    ]
    return rows


def _angles(angles: dict[str, float]) -> str:
    return ", ".join(f"{name} {angle:+.3f} rad" for name, angle in angles.items())
