"""The price of robustness: least power of a gait that keeps its limits for all masses and soles within their tolerances."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import format_millimetres
from compare.drawing.figures import add_legend_below, make_figure, use_style
from compare.questions.perturbed_problem import is_mass
from compare.questions.question import Answer, Question, Work, make_optima_table, make_record_table, make_table
from compare.questions.robust.robust_gait import (
    Box,
    RobotSimulation,
    RobustGait,
    Worst,
    make_boxes,
    simulate_robots,
    solve_robust,
)
from compare.report.document import Figure, Table
from nlp_gait.simulation.engine import load_mujoco

NOMINAL, ROBUST, WORST = "0.72", "#0072B2", "#D55E00"
LISTED = 4  # links with a changed mass that a table names


class FoundRobust(NamedTuple):
    """Robust gaits, one for each box, the widest last, and simulations on the robots of the widest box."""

    gaits: tuple[RobustGait, ...]
    simulations: tuple[RobotSimulation, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Robust(Question[FoundRobust]):
    """What does it cost to keep all limits for all robots within the tolerances?"""

    name: ClassVar[str] = "robust"

    mass: float = 5.0  #: tolerance of every mass, up and down [%]
    sole: float = 2.0  #: tolerance of the soles' position in x and y [mm]
    starts: int = 10  #: random starts of the nominal problem
    seed: int = 0  #: of the starts and of the random corners
    samples: int = 20  #: random corners on which each result is evaluated
    simulate: bool = True  #: simulate both gaits on the worst robots (extra ``sim``)

    def __post_init__(self) -> None:
        """Require a robot, and MuJoCo if it is needed.

        Raises:
            InputError: the problem has no robot.
            MissingExtraError: MuJoCo is not installed.
        """
        self._make_boxes()
        if self.simulate:
            load_mujoco()

    def _make_boxes(self) -> dict[str, Box]:
        return make_boxes(self.problem, self.mass / 100.0, self.sole / 1000.0)

    def find(self, work: Work) -> Iterator[FoundRobust]:
        gaits: tuple[RobustGait, ...] = ()
        for name, box in self._make_boxes().items():
            gait = solve_robust(
                self.problem, name, box, starts=self.starts, seed=self.seed, samples=self.samples, work=work
            )
            gaits = (*gaits, gait)
            yield FoundRobust(gaits)
        if self.simulate:
            yield FoundRobust(gaits, tuple(simulate_robots(self.problem, gaits[-1], work)))

    def get_optimum(self, findings: FoundRobust) -> float:
        return findings.gaits[0].nominal_W

    def report(self, findings: FoundRobust) -> Answer:
        gaits, simulations = findings
        name, stem, widest = self.problem.name, f"{self.problem.name}-robust", gaits[-1]
        shown = "Power with the nominal robot and in the worst corner" + (
            "; lateral margins in model and engine" * bool(simulations)
        )
        return Answer(
            stem=stem,
            title=f"{name}: price of robustness",
            verdict=(f"{gaits[0].nominal_W:.6f} W for the nominal robot; {_describe_box(widest.box)}",),
            parts=(
                make_table("Price of robustness", gaits, PRICES),
                *(
                    f"{gait.name}: worst for the nominal gait with {_describe_corner(gait.nominal_worst.corner)}"
                    for gait in gaits
                    if gait.nominal_worst.violation > 0.0
                ),
                make_optima_table({"nominal": gaits[0].nominal_x, **{gait.name: gait.x for gait in gaits}}),
                *([_make_simulation_table(widest, simulations)] if simulations else ()),
                Figure(name=stem, caption=shown, drawing=plot_robust(gaits, simulations)),
                make_record_table(stem, gaits, leave_out=("corners", "robots")),
            ),
            data={
                "problem": name,
                "boxes": [asdict(gait) for gait in gaits],
                "simulations": [asdict(simulation) for simulation in simulations],
            },
        )


def _describe_violation(worst: Worst) -> str:
    return f"{worst.row} by {worst.violation:.3g} {worst.unit}" if worst.violation > 0.0 else "nothing"


PRICES = {
    "uncertain": lambda g: g.name,
    "nominal gait violates": lambda g: _describe_violation(g.nominal_worst),
    "robust gait, nominal robot": lambda g: f"{g.power_W:.6f} W",
    "price": lambda g: f"{g.power_W - g.nominal_W:+z.6f} W, {g.power_W / g.nominal_W - 1.0:+z.2%}",
    "worst corner": lambda g: f"{g.worst_W:.6f} W",
    "robust gait violates: scenarios": lambda g: _describe_violation(g.worst),
    "random corners": lambda g: _describe_violation(g.random_worst),
    "scenarios": lambda g: f"{len(g.corners)}" + ("" if g.settled else ", not settled"),
}


def _make_simulation_table(widest: RobustGait, simulations: Sequence[RobotSimulation]) -> Table:
    return make_table(
        f"Simulated open loop on the robots of the last box ({widest.name})",
        simulations,
        {
            "gait": lambda s: s.gait,
            "robot": lambda s: _describe_corner(widest.corners[widest.robots.index(s.robot)]),
            "in MuJoCo": lambda s: "stays up" if s.fell_at_s is None else f"FALLS at {s.fell_at_s:.2f} s",
            "largest tilt": lambda s: f"{s.largest_tilt_deg:.1f} degrees",
            "mean lateral margin: model": lambda s: format_millimetres(s.predicted_margin_m),
            "MuJoCo": lambda s: format_millimetres(s.margin_m),
        },
    )


def plot_robust(gaits: Sequence[RobustGait], simulations: Sequence[RobotSimulation]) -> Drawing:
    """Plot the power with the nominal robot and in the worst corner, and lateral margins in model and engine."""
    nominal = gaits[0].nominal_W
    names = ["none", *(gait.name for gait in gaits)]
    places = np.arange(len(names))
    with use_style():
        figure = make_figure(7.2 if simulations else 4.2, 2.7)
        ratios = (1.15, 1.0) if simulations else None
        left, *others = figure.subplots(1, 2 if simulations else 1, squeeze=False, width_ratios=ratios)[0]
        powers, worst = [nominal, *(g.power_W for g in gaits)], [nominal, *(g.worst_W for g in gaits)]
        left.barh(places - 0.19, powers, 0.36, color=ROBUST, label="nominal robot")
        left.barh(places + 0.19, worst, 0.36, color=WORST, label="worst corner")
        left.set_yticks(places, names)
        left.invert_yaxis()
        left.grid(visible=False, axis="y")
        left.set_xlim(left=0.8 * nominal)
        left.set_xlabel("power [W], axis cut off")
        left.set_title("uncertain")
        add_legend_below(figure)
        for axes in others:
            for kind, colour, marker in (("nominal", NOMINAL, "s"), ("robust", ROBUST, "o")):
                shown = [simulation for simulation in simulations if simulation.gait == kind]
                margins = [1000 * s.predicted_margin_m for s in shown], [1000 * s.margin_m for s in shown]
                axes.plot(*margins, marker, color=colour, label=f"{kind} gait")
            low, high = axes.get_xlim()
            axes.plot((low, high), (low, high), color="0.4", linewidth=0.6)
            axes.set_xlabel("mean lateral margin in the model [mm]")
            axes.set_ylabel("in MuJoCo [mm]")
            axes.legend()
    return figure


def _describe_box(box: Mapping[str, float]) -> str:
    masses = [half for name, half in box.items() if is_mass(name)]
    soles = f"soles +-{1000 * max(half for name, half in box.items() if not is_mass(name)):g} mm"
    return f"masses +-{100 * max(masses):g} %, {soles}" if masses else soles


def _describe_corner(corner: Mapping[str, float]) -> str:
    if not corner:
        return "no change"
    parts = [f"{name.removesuffix('_m')} {1000 * by:+g} mm" for name, by in corner.items() if not is_mass(name)]
    for sign in (1, -1):
        changed = {name.removesuffix(".mass"): by for name, by in corner.items() if is_mass(name) and sign * by > 0.0}
        if changed:
            names = sorted(changed)
            more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
            parts.append(f"{sign * max(map(abs, changed.values())):+.0%} {', '.join(names[:LISTED])}{more}")
    return "; ".join(parts)
