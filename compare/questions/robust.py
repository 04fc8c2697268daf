"""The price of robustness: least power of a gait that keeps its limits for all masses and soles within their tolerances."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, ClassVar

from compare.questions.perturbed_problem import is_mass
from compare.questions.question import Answer, Question, Work, make_optima_table, make_record_table, make_table
from compare.questions.robust_gait import Box, RobustGait, Worst, make_boxes, solve_robust
from compare.study.task import describe_problem
from nlp_gait.backends.identity import fingerprint

LISTED = 4  # links with a changed mass that a table names


@dataclass(frozen=True, kw_only=True, eq=False)
class Robust(Question[tuple[RobustGait, ...]]):
    """What does it cost to keep all limits for all robots within the tolerances: one gait for each box, the widest last."""

    name: ClassVar[str] = "robust"

    mass: float = 5.0  #: tolerance of every mass, up and down [%]
    sole: float = 2.0  #: tolerance of the soles' position in x and y [mm]
    starts: int = 10  #: random starts of the nominal problem
    seed: int = 0  #: of the starts and of the random corners
    samples: int = 20  #: random corners on which each result is evaluated

    def __post_init__(self) -> None:
        """Raise InputError if the problem has no robot."""
        self._make_boxes()

    def _make_boxes(self) -> dict[str, Box]:
        return make_boxes(self.problem, self.mass / 100.0, self.sole / 1000.0)

    def find(self, work: Work) -> Iterator[tuple[RobustGait, ...]]:
        effort = {"starts": self.starts, "seed": self.seed, "samples": self.samples}
        gaits: tuple[RobustGait, ...] = ()
        for name, box in self._make_boxes().items():
            inputs = {**fingerprint(self.problem), "box": dict(box), "name": name, **effort}
            solve = partial(solve_robust, self.problem, name, box, **effort, work=work)
            gaits = (*gaits, work.compute(RobustGait, "box", inputs, solve))
            yield gaits

    def get_optimum(self, findings: tuple[RobustGait, ...]) -> float:
        return findings[0].nominal_W

    def report(self, findings: tuple[RobustGait, ...]) -> Answer:
        name, stem, nominal, widest = self.problem.name, f"{self.problem.name}-robust", findings[0], findings[-1]
        return Answer(
            stem=stem,
            title=f"{name}: price of robustness",
            headline=(f"{nominal.nominal_W:.6f} W for the nominal robot; {_describe_box(widest.box)}",),
            parts=(
                make_table("Price of robustness", findings, PRICES),
                *(
                    f"{gait.name}: worst for the nominal gait with {_describe_corner(gait.nominal_worst.corner)}"
                    for gait in findings
                    if gait.nominal_worst.violation > 0.0
                ),
                make_optima_table({"nominal": nominal.nominal_x, **{gait.name: gait.x for gait in findings}}),
                make_record_table(stem, findings, leave_out=("corners", "robots")),
            ),
            data={"problem": name, "boxes": [asdict(gait) for gait in findings]},
            results=self._list_results(widest),
        )

    def _list_results(self, gait: RobustGait) -> dict[str, dict[str, Any]]:
        """Return the nominal and the robust gait on each robot of a box, for ``nlp-gait simulate``."""
        nominal = describe_problem(self.problem)
        return {
            f"{self.problem.name}-{kind}-{k}": {
                **nominal,
                "options": {**nominal["options"], "robot": robot},
                "x": dict(x),
            }
            for k, robot in enumerate(gait.robots)
            for kind, x in (("nominal", gait.nominal_x), ("robust", gait.x))
        }


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
            unlisted = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
            parts.append(f"{sign * max(map(abs, changed.values())):+.0%} {', '.join(names[:LISTED])}{unlisted}")
    return "; ".join(parts)
