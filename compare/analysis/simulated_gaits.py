"""Agreement of model and physics engine on the energies of gaits: ranks, correlation and errors."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from compare.analysis.comparison import Comparison
from compare.analysis.units import with_unit
from compare.study.record import RunRecord
from compare.study.simulations import SimulatedGait
from nlp_gait.simulation.drive import Drive

GAIT_HEADER = ("solver", "model", "engine", "error", "rank", "engine's", "fate")
DIGITS = "#.4g"  # of energies; ranks use the printed numbers, as the engine resolves no finer differences
FEWEST = 3  # gaits for a rank correlation


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """Agreement of model and engine over the gaits that did not fall."""

    gaits: int  #: number simulated
    fallen: int  #: number that fell
    spearman: float | None  #: rank correlation; None for fewer than three gaits, or if all values of one are equal
    mean_error: float | None  #: mean of |engine / model - 1|; None if all fell
    largest_error: float | None  #: of these
    spread: float | None  #: the model's largest energy divided by its smallest, minus 1; None if all fell
    #: Largest minus smallest signed error; gaits closer than this in the model have no certain order
    error_spread: float | None

    def describe(self) -> str:
        """Return the agreement as sentences."""
        upright = self.gaits - self.fallen
        fate = (
            "none fell"
            if not self.fallen
            else f"{self.fallen} fell and {'has' if self.fallen == 1 else 'have'} no rank"
        )
        text = f"{self.gaits} gait{'s were' if self.gaits != 1 else ' was'} simulated, {fate}."
        if self.mean_error is not None and self.largest_error is not None:
            text += (
                f" Error of the model: {100 * self.mean_error:.2f} % mean, {100 * self.largest_error:.2f} % at most."
            )
        if self.spearman is None or self.spread is None or self.error_spread is None:
            reason = f"with fewer than {FEWEST} gaits" if upright < FEWEST else "where all gaits are equal"
            return f"{text} There is no rank correlation {reason}."
        text += f" Spearman correlation of the ranks: {self.spearman:.3f} over {upright} gaits;"
        apart = f"energies spread by {100 * self.spread:.2f} % in the model, errors by {100 * self.error_spread:.2f} %"
        doubt = "; their order is not certain" if self.spread < self.error_spread else ""
        return f"{text} {apart}{doubt}."


def compute_agreement(model: Sequence[float], engine: Sequence[float | None]) -> Agreement:
    """Compare energies or powers of the same gaits; None after a fall."""
    pairs = [(m, e) for m, e in zip(model, engine, strict=True) if e is not None]
    signed = [e / m - 1.0 for m, e in pairs]
    errors = [abs(error) for error in signed]
    ranked = [([round_as_printed(m) for m, _ in pairs]), ([round_as_printed(e) for _, e in pairs])]
    comparable = len(pairs) >= FEWEST and all(len(set(values)) > 1 for values in ranked)
    return Agreement(
        gaits=len(model),
        fallen=len(model) - len(pairs),
        spearman=_compute_spearman(*ranked) if comparable else None,
        mean_error=sum(errors) / len(errors) if errors else None,
        largest_error=max(errors, default=None),
        spread=max(m for m, _ in pairs) / min(m for m, _ in pairs) - 1.0 if pairs else None,
        error_spread=max(signed) - min(signed) if pairs else None,
    )


def round_as_printed(value: float) -> float:
    """Round a number to its printed digits."""
    return float(format(value, DIGITS))


def _compute_spearman(a: Sequence[float], b: Sequence[float]) -> float:
    from scipy.stats import spearmanr

    return float(spearmanr(a, b).statistic)


def select_best_gaits(comparisons: Sequence[Comparison]) -> list[RunRecord]:
    """Return every solver's best feasible run on every problem."""
    return [solver.best for problem in comparisons for solver in problem.solvers if solver.best is not None]


def group_by_problem(gaits: Sequence[SimulatedGait]) -> dict[str, list[SimulatedGait]]:
    """Group gaits by problem."""
    return {name: [p for p in gaits if p.problem == name] for name in dict.fromkeys(p.problem for p in gaits)}


def make_engine_rows(gaits: Sequence[SimulatedGait]) -> list[tuple[str, ...]]:
    """Return rows of text under ``GAIT_HEADER`` for gaits of one problem, the model's best first."""
    ordered = sorted(gaits, key=lambda gait: (gait.model, gait.solver))
    model = [round_as_printed(gait.model) for gait in ordered]
    engine = [math.inf if gait.engine is None else round_as_printed(gait.engine) for gait in ordered]
    return [
        (
            gait.solver,
            with_unit(gait.model, gait.unit, DIGITS),
            with_unit(gait.engine, gait.unit, DIGITS),
            "-" if gait.engine is None else f"{100.0 * (gait.engine / gait.model - 1.0):+z.2f} %",
            _rank(model, i),
            "-" if gait.engine is None else _rank(engine, i),
            _describe_fate(gait),
        )
        for i, gait in enumerate(ordered)
    ]


def describe_drive(drive: Drive) -> str:
    """Describe a drive, for example ``linear set-points every 10 ms, nothing fed forward``."""
    fed = {
        "torque": "velocity and torque fed forward",
        "velocity": "velocity fed forward",
        "none": "nothing fed forward",
    }
    return f"{drive.interpolation} set-points every {1e3 * drive.period_s:g} ms, {fed[drive.feed_forward]}"


def measure_agreement(gaits: Sequence[SimulatedGait]) -> Agreement:
    """Return the agreement of model and engine on gaits of one problem."""
    return compute_agreement([gait.model for gait in gaits], [gait.engine for gait in gaits])


def _rank(values: Sequence[float], i: int) -> str:
    return str(1 + sum(value < values[i] for value in values))


def _describe_fate(gait: SimulatedGait) -> str:
    if gait.fell_at_s is not None:
        return f"falls at {gait.fell_at_s:.2f} s"
    return "stays up" if gait.walked_share is None else f"walks {100.0 * gait.walked_share:.1f} %"
