"""What the real motors change: the optimum of a NAO phase with one set of their features after another."""

import inspect
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import list_units, make_axis_label, name_in_words
from compare.drawing.figures import add_legend_below, make_figure, use_style
from compare.questions.perturbed_problem import rebuild
from compare.questions.question import Answer, Question, Work, make_csv_table, make_optima_table, make_table
from compare.report.document import Figure, Table, Value, make_text_table
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.registry import find_maker

# Each variant with the features of ``nao_motors``; the first is the paper's.
VARIANTS: Mapping[str, str] = {
    "as published": "",
    "with speed and torque limits": "limits",
    "with coupled ankles, too": "limits,ankle",
    "with these, braking is free": "limits,ankle,free-braking",
    "with these, braking gives back": "limits,ankle,regeneration",
    "with these, K of each motor": "limits,ankle,heat",
    "with these, K and free braking": "limits,ankle,heat,free-braking",
    "with these, inertia of rotors": "limits,ankle,rotor",
}
# Kinds of limits, with their rows in the problem with limits.
LIMITS = {
    "speed": ("joint_speed",),
    "torque against speed": ("torque_forwards", "torque_backwards"),
    "continuous torque": ("continuous_torque",),
}
CONSTANT = 1e-4  # of a variable's range


@dataclass(frozen=True, kw_only=True)
class Use:
    """Largest share of one kind of limit that a gait uses, and the row."""

    share: float
    row: str


@dataclass(frozen=True, kw_only=True)
class Variant:
    """The optimum with some features of the motors."""

    name: str  #: in words
    features: str  #: as in the option ``motors``
    feasible: bool  #: IPOPT converged to a feasible point
    status: str  #: in words
    power_W: float  #: at the optimum, as this variant computes it
    unchanged_power_W: float  #: at the published optimum, as this variant computes it
    unchanged_violation: float  #: of the published optimum with this variant's limits
    published_power_W: float  #: at this variant's optimum, as the paper computes it
    x: Mapping[str, float]  #: by variable name
    #: largest distance of a variable from the published optimum, in units of its range, and the variable's name
    moved: tuple[float, str]
    uses: Mapping[str, Use]  #: by kind of limit, at this optimum, also without the limits


@dataclass(frozen=True, kw_only=True, eq=False)
class RealMotors(Question[tuple[Variant, ...]]):
    """What do the real motors change in a NAO phase (without the option ``motors``)?"""

    name: ClassVar[str] = "motors"
    counts: ClassVar[str] = "variants"

    starts: int = 10  #: random starts of IPOPT for each variant
    seed: int = 0  #: of the starts

    def __post_init__(self) -> None:
        """Require a problem with motors, and without the option."""
        if "motors" not in inspect.signature(find_maker(self.problem.address)).parameters:
            raise InputError(f"only nao-ssp and nao-dsp have motors, got {self.problem.name!r}")
        if self.problem.options.get("motors"):
            raise InputError("this command solves all variants of the motors; leave out --option motors")

    @property
    def total(self) -> int:
        return len(VARIANTS)

    def find(self, work: Work) -> Iterator[tuple[Variant, ...]]:
        published, solver = self.problem, work.solver()
        limited = {rotor: rebuild(published, motors=f"limits{rotor}") for rotor in ("", ",rotor")}
        variants: tuple[Variant, ...] = ()
        for name, features in VARIANTS.items():
            problem = rebuild(published, motors=features) if features else published
            first = published.check_x(variants[0].x) if variants else None
            solution = solve(problem, starts=self.starts, seed=self.seed, x0=first, solver=solver)
            x = problem.check_x(solution.x)
            unmoved = x if first is None else first
            moves = np.abs(x - unmoved) / problem.scale
            unchanged = build_exact_model(problem).at(unmoved, problem.p)
            variant = Variant(
                name=name,
                features=features,
                feasible=solution.converged,
                status=solution.status,
                power_W=solution.objective,
                unchanged_power_W=unchanged.cost,
                unchanged_violation=unchanged.violation,
                published_power_W=build_exact_model(published).at(x, published.p).cost,
                x=solution.x,
                moved=(float(moves.max()), problem.names[int(moves.argmax())]),
                uses=compute_uses(limited[",rotor" if "rotor" in features else ""], x),
            )
            variants = (*variants, variant)
            work.progress(name)
            yield variants

    def get_optimum(self, findings: tuple[Variant, ...]) -> float | None:
        return findings[0].power_W if findings[0].feasible else None

    def report(self, findings: tuple[Variant, ...]) -> Answer:
        name, stem, kinds = self.problem.name, f"{self.problem.name}-motors", tuple(findings[0].uses)
        uses = [
            (v.name, *(f"{v.uses[kind].share:.1%} {v.uses[kind].row.partition('[')[2][:-1]}" for kind in kinds))
            for v in findings
        ]
        columns = {
            "motors": lambda v: v.name,
            "optimum [W]": lambda v: f"{v.power_W:.6f}",
            "published x* [W]": lambda v: (
                f"{v.unchanged_power_W:.6f}" + (" (infeasible)" if v.unchanged_violation > 0.0 else "")
            ),
            "optimum's power as published [W]": lambda v: f"{v.published_power_W:.6f}",
            "x* moves most in": lambda v: (
                "-" if v.moved[0] < CONSTANT else f"{v.moved[1]} by {v.moved[0]:.0%} of its range"
            ),
        }
        shown = "Power at the optimum and at the published one; position of x* in its ranges."
        return Answer(
            stem=stem,
            title=f"{name} with real motors",
            parts=(
                make_table("Effect of each feature", findings, columns),
                make_text_table(
                    ("motors", *kinds), uses, "Largest share of each limit that the optimum uses: joint, sample"
                ),
                make_optima_table({v.name: v.x for v in findings}),
                Figure(name=stem, caption=shown, drawing=plot_motors(findings, self.problem)),
                _make_csv(stem, findings),
            ),
            data={"problem": name, "variants": [asdict(variant) for variant in findings]},
        )

    def failures(self, findings: tuple[Variant, ...]) -> list[str]:
        return [f"{variant.name}: {variant.status}" for variant in findings if not variant.feasible]


def compute_uses(limited: GaitProblem, x: Array) -> dict[str, Use]:
    """Return the largest shares of the motors' limits that x (n,) uses, in a problem with ``motors=limits``."""
    model = build_exact_model(limited)
    names, values = model.row_names, model.at(x, limited.p)
    uses = {}
    for kind, groups in LIMITS.items():
        rows = [i for i, name in enumerate(names) if name.partition("[")[0] in groups]
        shares = [values.g[i] / (values.upper[i] if values.g[i] > 0.0 else values.lower[i]) for i in rows]
        largest = int(np.argmax(shares))
        uses[kind] = Use(share=float(shares[largest]), row=names[rows[largest]])
    return uses


def _make_csv(stem: str, variants: tuple[Variant, ...]) -> Table:
    names, kinds = list(variants[0].x), list(variants[0].uses)
    header = [
        *("variant", "motors", "power_W", "power_at_published_x_W", "violation_of_published_x", "power_as_published_W"),
        *(*names, *(f"share_of_{kind.replace(' ', '_')}" for kind in kinds), "feasible", "status"),
    ]
    rows: list[list[Value]] = [
        [
            *(v.name, v.features, v.power_W, v.unchanged_power_W, v.unchanged_violation, v.published_power_W),
            *v.x.values(),
            *(v.uses[kind].share for kind in kinds),
            *(v.feasible, v.status),
        ]
        for v in variants
    ]
    return make_csv_table(stem, header, rows)


def plot_motors(variants: tuple[Variant, ...], problem: GaitProblem) -> Drawing:
    """Plot the power at the optimum and at the published one (left), and the position of x* in its ranges (right)."""
    places = np.arange(len(variants))
    with use_style():
        figure = make_figure(7.6, 0.9 + 0.34 * len(variants))
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
        unchanged = [v.unchanged_power_W for v in variants]
        left.barh(places - 0.19, unchanged, 0.36, color="0.75", label="at the published x*")
        left.barh(places + 0.19, [v.power_W for v in variants], 0.36, color="#0072B2", label="at the optimum")
        left.set_yticks(places, [v.name for v in variants])
        left.invert_yaxis()
        left.grid(visible=False, axis="y")
        left.set_xlabel(make_axis_label("power", "W"))
        add_legend_below(figure)
        shares = np.array([(np.array(list(v.x.values())) - problem.lower) / problem.scale for v in variants])
        image = right.imshow(shares, aspect="auto", cmap="viridis", vmin=0.0, vmax=1.0)
        units = list_units(problem)
        words = [name_in_words(name, units[name]) for name in problem.names]
        right.set_xticks(range(len(words)), words, rotation=40, ha="right")
        right.set_yticks([])
        right.grid(visible=False)
        figure.colorbar(image, ax=right, label="x* from lower to upper bound")
    return figure
