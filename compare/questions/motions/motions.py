"""What the papers' cubics cost: optima of richer and richer motions, compared in tables, sentences and figures."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.drawing.figures import COLOURS, add_legend_below, make_axes, make_figure, use_style
from compare.questions.motions.motion import (
    COARSE_KIND,
    FREE_ORDERS,
    FREED,
    ORDERS,
    PLANNED,
    SMOOTHED,
    MotionTask,
    SolvedMotion,
    extrapolate,
    make_tasks,
    solve_motion,
)
from compare.questions.question import Answer, Question, Work, make_csv_table, make_table
from compare.report.document import Figure, Table
from nlp_gait.formulation import Array

KIND_WORDS = {PLANNED: "", SMOOTHED: "least ", FREED: "free joints, "}
LOOKS = {PLANNED: (COLOURS["pso"], "o-", "hip, foot and arms"), FREED: (COLOURS["ga"], "s-", "free joints")}
DRAWN = 20  # samples of a drawn path for each of the problem's own


@dataclass(frozen=True, kw_only=True, eq=False)
class Motions(Question[tuple[SolvedMotion, ...]]):
    """How much power do richer motions of a NAO phase save?"""

    name: ClassVar[str] = "motions"
    counts: ClassVar[str] = "motions"

    orders: Sequence[str] = ORDERS  #: motions of hip, foot and arms, rising
    free_orders: Sequence[str] = FREE_ORDERS  #: motions of free joints, rising
    starts: int = 1  #: random starts for each order, next to the simpler optimum
    seed: int = 0  #: of the random starts

    @cached_property
    def tasks(self) -> list[MotionTask]:
        """The problems to solve."""
        options = self.problem.options
        return make_tasks(
            self.problem.name,
            orders=self.orders,
            free_orders=self.free_orders,
            robot=str(options["robot"]),
            intervals=int(options["intervals"]),
            starts=self.starts,
        )

    @property
    def total(self) -> int:
        return len(self.tasks)

    def find(self, work: Work) -> Iterator[tuple[SolvedMotion, ...]]:
        motions: tuple[SolvedMotion, ...] = ()
        for task in self.tasks:
            motions = (*motions, solve_motion(task, motions, self.seed, work))
            work.progress(task.label)
            yield motions

    def report(self, findings: tuple[SolvedMotion, ...]) -> Answer:
        name, stem, base = self.problem.name, f"{self.problem.name}-motions", findings[0].power_W
        over = "Least power over the coefficients beyond the paper's cubics, with the limit of the richest motions."
        return Answer(
            stem=stem,
            title=f"{name}: richer motions",
            verdict=describe_motions(findings),
            parts=(
                make_table(
                    "Optima",
                    findings,
                    {
                        "motion": describe_motion,
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
                Figure(name=stem, caption=over, drawing=plot_powers(findings)),
                Figure(
                    name=f"{stem}-paths",
                    caption="Paths of the hip, and of the swing foot if it moves.",
                    drawing=plot_paths(findings),
                ),
                _make_csv(stem, findings),
            ),
            data={"problem": name, "motions": [asdict(motion) for motion in findings]},
        )

    def failures(self, findings: tuple[SolvedMotion, ...]) -> list[str]:
        return [f"{motion.task.label}: {motion.status}" for motion in findings if not motion.feasible]


def describe_motion(motion: SolvedMotion) -> str:
    """Return in words what was solved."""
    if motion.task.kind == SMOOTHED:
        return f"{KIND_WORDS[SMOOTHED]}{motion.task.options['objective']}, {motion.task.trajectory}"
    if motion.task.kind == COARSE_KIND:
        return f"{motion.task.options['intervals'] + 1} samples: {motion.task.trajectory}"
    return KIND_WORDS[motion.task.kind] + motion.task.trajectory


def describe_motions(motions: Sequence[SolvedMotion]) -> list[str]:
    """Return sentences on the trend of the orders, violations between few samples, and the price of smoothness."""
    sentences = []
    for kind, (_, _, words) in LOOKS.items():
        powers = [m.power_W for m in motions if m.task.kind == kind]
        rises = [b - a for a, b in zip(powers, powers[1:], strict=False) if b > a]
        if len(powers) > 1:
            trend = f"rises by up to {max(rises):.2g} W" if rises else "never rises"
            limit = extrapolate(powers)
            goal = f"; its last three values point to {limit:.3f} W" if limit is not None else ""
            sentences.append(
                f"{words}: power {trend} from order to order, {powers[0]:.4f} W to {powers[-1]:.4f} W{goal}"
            )
    for m in motions:
        if m.task.kind == COARSE_KIND:
            sentences.append(
                f"on {m.task.options['intervals'] + 1} samples {m.task.trajectory} seems to need {m.power_W:.4f} W; "
                f"between them it needs {m.dense_power_W:.4f} W" + (f" and violates {m.worst}" if m.worst else "")
            )
    cheapest = {m.task.trajectory: m for m in motions if m.task.kind == PLANNED}
    for m in motions:
        if m.task.kind == SMOOTHED:
            least = cheapest[m.task.trajectory]
            gains = ", ".join(f"{name} {least.objectives[name]:.3g} to {v:.3g}" for name, v in m.objectives.items())
            cost = 100 * (m.power_W / least.power_W - 1)
            sentences.append(f"{describe_motion(m)} costs {cost:z.1f} % more power: {gains}")
    return sentences


def _make_csv(stem: str, motions: Sequence[SolvedMotion]) -> Table:
    header = (
        "kind problem trajectory objective samples_per_interval variables power_W dense_power_W worst_dense_violation "
        "converged starts iterations time_s joint_jerk_rad2_s6 torque_rate_Nm2_s2 status"
    ).split()
    rows = [
        [m.task.kind, m.task.problem, m.task.trajectory, m.task.options.get("objective", "power")]
        + [m.task.options["samples_per_interval"], m.variables, m.power_W, m.dense_power_W, m.worst, m.converged]
        + [m.attempts, m.iterations, f"{m.time_s:.3f}", *(m.objectives.values() or (None, None)), m.status]
        for m in motions
    ]
    return make_csv_table(stem, header, rows)


def plot_powers(motions: Sequence[SolvedMotion]) -> Drawing:
    """Plot the power over the number of free coefficients, with the limit of the richest motions."""
    with use_style():
        figure, axes = make_axes(4.6, 3.0)
        for kind, (colour, line, words) in LOOKS.items():
            drawn = [m for m in motions if m.task.kind == kind]
            if not drawn:
                continue
            axes.plot([m.coefficients for m in drawn], [m.power_W for m in drawn], line, color=colour, label=words)
            for m in drawn:
                word = m.task.trajectory.removeprefix("spline-")  # numbers of spans above the line, words below
                offset, side = ((3, 4), "left") if word.isdigit() else ((0, -11), "center")
                at = (m.coefficients, m.power_W)
                axes.annotate(word, at, offset, textcoords="offset points", fontsize=7, ha=side)
            limit = extrapolate([m.power_W for m in drawn])
            if limit is not None:
                axes.axhline(limit, color=colour, ls=":", lw=1.0, label=f"extrapolated, {limit:.3f} W")
        axes.set_xscale("symlog", linthresh=10)
        ticks = (0, 10, 20, 50, 100, 200, 500)
        axes.set_xticks(ticks, [str(tick) for tick in ticks])
        axes.set_xlim(-1, 1.3 * max(m.coefficients for m in motions) + 5)
        axes.set_xlabel("coefficients beyond the paper's cubics")
        axes.set_ylabel("least mean power [W]")
        axes.set_ylim(bottom=0.0)
        add_legend_below(figure)
    return figure


def plot_paths(motions: Sequence[SolvedMotion]) -> Drawing:
    """Plot the hip from above and from the side, and the swing foot from the side if it moves.

    Shown are the paper's cubics, the richest planned motion and the richest one with free joints.
    """
    richest = {m.task.kind: m for m in motions if m.task.kind in LOOKS}
    drawn = [motions[0], *(m for m in richest.values() if m is not motions[0])]
    arrays = [_sample_finely(m) for m in drawn]
    swings = bool(np.ptp(arrays[0]["right_foot"][:, 0]) > 0.0)
    colours = (COLOURS["ipopt"], *(colour for colour, _, _ in LOOKS.values()))
    with use_style():
        figure = make_figure(6.3 if swings else 4.6, 2.4)
        panels: Sequence[Axes] = figure.subplots(1, 3 if swings else 2)
        for motion, path, colour, line in zip(drawn, arrays, colours, ("--", "-", "-"), strict=False):
            x, y, z = 1e3 * path["hip"].T
            panels[0].plot(x, y, line, color=colour, label=describe_motion(motion))
            panels[1].plot(x, z, line, color=colour)
            if swings:
                foot = 1e3 * path["right_foot"]
                panels[2].plot(foot[:, 0], foot[:, 2], line, color=colour)
        names = [("hip x [mm]", "hip y [mm]"), ("hip x [mm]", "hip height [mm]"), ("foot x [mm]", "foot height [mm]")]
        for axes, (along, up) in zip(panels, names, strict=False):
            axes.set(xlabel=along, ylabel=up)
        add_legend_below(figure)
    return figure


def _sample_finely(motion: SolvedMotion) -> dict[str, Array]:
    problem = motion.task.spec.load().dense(DRAWN)
    assert problem is not None  # a phase has one; for the type checker
    return dict(problem.signals(motion.x).arrays)
