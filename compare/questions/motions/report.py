"""The comparison of motions as an answer: tables, sentences and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.drawing.figures import COLOURS, add_legend_below, new_figure, style
from compare.questions.answer import Answer, all_digits, table_of
from compare.questions.motions.study import Motion, limit
from compare.questions.motions.tasks import COARSE_KIND, FREED, PLANNED, SMOOTHED
from compare.report.document import Figure, Table
from nlp_gait.formulation import Signals

KIND_WORDS = {PLANNED: "", COARSE_KIND: "11 samples: ", SMOOTHED: "least ", FREED: "free joints, "}
LOOKS = {PLANNED: (COLOURS["pso"], "o-", "hip, foot and arms"), FREED: (COLOURS["ga"], "s-", "free joints")}
DRAWN = 20  # samples of a drawn path for each of the problem's own


def title(motion: Motion) -> str:
    """What was solved, in words."""
    if motion.task.kind == SMOOTHED:
        return f"{KIND_WORDS[SMOOTHED]}{motion.task.options['objective']}, {motion.task.trajectory}"
    return KIND_WORDS[motion.task.kind] + motion.task.trajectory


def motions_answer(found: Sequence[Motion], problem: str) -> Answer:
    """What richer motions save.

    Args:
        found: the first is the one to compare with.
        problem: name of the phase.
    """
    stem, base = f"{problem}-motions", found[0].power_W
    over = (
        "Least power over the coefficients beyond the paper's cubics, with the value that the richest motions point to."
    )
    along = "Paths of the hip, and of the swing foot if it moves."
    return Answer(
        stem=stem,
        title=f"{problem}: richer motions",
        verdict=sentences(found),
        parts=(
            table_of(
                "Optima",
                found,
                {
                    "motion": title,
                    "variables": lambda m: str(m.variables),
                    "power [W]": lambda m: f"{m.power_W:.6f}",
                    "saved [%]": lambda m: f"{100 * (1 - m.power_W / base):z.2f}",
                    "IPOPT [s]": lambda m: f"{m.time_s:.1f}",
                    "iterations": lambda m: str(m.iterations),
                    "starts": lambda m: f"{m.converged}/{m.attempts}",
                    "dense power [W]": lambda m: f"{m.dense_power_W:.6f}",
                    "dense violation": lambda m: m.worst or "none",
                },
            ),
            Figure(name=stem, caption=over, drawing=power_figure(found)),
            Figure(name=f"{stem}-paths", caption=along, drawing=path_figure(found)),
            _numbers(stem, found),
        ),
        data={"problem": problem, "motions": [asdict(m) for m in found]},
    )


def _numbers(stem: str, found: Sequence[Motion]) -> Table:
    header = (
        "kind problem trajectory objective samples_per_interval variables power_W dense_power_W worst_dense_violation "
        "converged starts iterations time_s joint_jerk_rad2_s6 torque_rate_Nm2_s2 status"
    ).split()
    rows = [
        [m.task.kind, m.task.problem, m.task.trajectory, m.task.options.get("objective", "power")]
        + [m.task.options["samples_per_interval"], m.variables, m.power_W, m.dense_power_W, m.worst, m.converged]
        + [m.attempts, m.iterations, f"{m.time_s:.3f}", *(m.objectives.values() or (None, None)), m.status]
        for m in found
    ]
    return all_digits(stem, header, rows)


def sentences(found: Sequence[Motion]) -> list[str]:
    """What the table says: where the orders lead, what hides between 11 samples, the price of smoothness."""
    said = []
    for kind, (_, _, words) in LOOKS.items():
        powers = [m.power_W for m in found if m.task.kind == kind]
        rising = [b - a for a, b in zip(powers, powers[1:], strict=False) if b > a]
        if len(powers) > 1:
            order = f"rises by up to {max(rising):.2g} W" if rising else "never rises"
            towards = limit(powers)
            goal = f"; its last three values point to {towards:.3f} W" if towards is not None else ""
            said.append(f"{words}: power {order} from order to order, {powers[0]:.4f} W to {powers[-1]:.4f} W{goal}")
    for m in found:
        if m.task.kind == COARSE_KIND:
            said.append(
                f"on the paper's 11 samples {m.task.trajectory} seems to need {m.power_W:.4f} W; "
                f"between them it needs {m.dense_power_W:.4f} W" + (f" and breaks {m.worst}" if m.worst else "")
            )
    cheapest = {m.task.trajectory: m for m in found if m.task.kind == PLANNED}
    for m in found:
        if m.task.kind == SMOOTHED:
            least = cheapest[m.task.trajectory]
            gains = ", ".join(
                f"{name} {least.objectives[name]:.3g} to {value:.3g}" for name, value in m.objectives.items()
            )
            said.append(f"{title(m)} costs {100 * (m.power_W / least.power_W - 1):z.1f} % more power: {gains}")
    return said


def power_figure(found: Sequence[Motion]) -> Drawing:
    """Power against the number of free coefficients, with the floor that the richest motions point to."""
    with style():
        figure = new_figure(4.6, 3.0)
        axes = figure.subplots()
        for kind, (colour, line, words) in LOOKS.items():
            drawn = [m for m in found if m.task.kind == kind]
            if not drawn:
                continue
            axes.plot([m.coefficients for m in drawn], [m.power_W for m in drawn], line, color=colour, label=words)
            for m in drawn:
                word = m.task.trajectory.removeprefix("spline-")  # numbers of spans above the line, words below
                offset, side = ((3, 4), "left") if word.isdigit() else ((0, -11), "center")
                at = (m.coefficients, m.power_W)
                axes.annotate(word, at, offset, textcoords="offset points", fontsize=7, ha=side)
            towards = limit([m.power_W for m in drawn])
            if towards is not None:
                axes.axhline(towards, color=colour, ls=":", lw=1.0, label=f"extrapolated, {towards:.3f} W")
        axes.set_xscale("symlog", linthresh=10)
        ticks = (0, 10, 20, 50, 100, 200, 500)
        axes.set_xticks(ticks, [str(tick) for tick in ticks])
        axes.set_xlim(-1, 1.3 * max(m.coefficients for m in found) + 5)
        axes.set_xlabel("coefficients beyond the paper's cubics")
        axes.set_ylabel("least mean power [W]")
        axes.set_ylim(bottom=0.0)
        add_legend_below(figure)
    return figure


def path_figure(found: Sequence[Motion]) -> Drawing:
    """Paths of the paper's cubics, of the richest planned motion and of the richest one with free joints.

    The hip from above and from the side, and the swing foot from the side if it moves.
    """
    richest = {m.task.kind: m for m in found if m.task.kind in LOOKS}
    drawn = [found[0], *(m for m in richest.values() if m is not found[0])]
    arrays = [_signals(m).arrays for m in drawn]
    swings = bool(np.ptp(arrays[0]["right_foot"][:, 0]) > 0.0)
    colours = (COLOURS["ipopt"], *(colour for colour, _, _ in LOOKS.values()))
    with style():
        figure = new_figure(6.3 if swings else 4.6, 2.4)
        panels: Sequence[Axes] = figure.subplots(1, 3 if swings else 2)
        for motion, path, colour, line in zip(drawn, arrays, colours, ("--", "-", "-"), strict=False):
            x, y, z = 1e3 * path["hip"].T
            panels[0].plot(x, y, line, color=colour, label=title(motion))
            panels[1].plot(x, z, line, color=colour)
            if swings:
                foot = 1e3 * path["right_foot"]
                panels[2].plot(foot[:, 0], foot[:, 2], line, color=colour)
        names = [("hip x [mm]", "hip y [mm]"), ("hip x [mm]", "hip height [mm]"), ("foot x [mm]", "foot height [mm]")]
        for axes, (along, up) in zip(panels, names, strict=False):
            axes.set(xlabel=along, ylabel=up)
        add_legend_below(figure)
    return figure


def _signals(motion: Motion) -> Signals:
    """Time histories that are dense enough to be drawn."""
    problem = motion.task.spec.load().dense(DRAWN)
    assert problem is not None  # a phase has one; for the type checker
    return problem.signals(motion.x)
