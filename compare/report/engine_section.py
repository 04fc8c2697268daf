"""The section of a report on the best gaits in the physics engine."""

from __future__ import annotations

from collections.abc import Sequence

from compare.analysis.simulated_gaits import HEADER, describe_drive, make_engine_rows, measure_agreement
from compare.report.document import Part, Prose, Section, text_table
from compare.study.simulations import SimulatedGait

HOW = Prose(
    "The best gaits of this study have not been simulated in a physics engine. `nlp-gait report DIR --engine` simulates those "
    "that can be (extra `sim`) and adds their energy, fate and rank to this report."
)


def engine_section(plays: Sequence[SimulatedGait]) -> Section | None:
    """Return the section on every solver's best gait in the engine, for each drive; None without simulations."""
    if not plays:
        return None
    parts: list[Part] = []
    for drive in dict.fromkeys(played.drive for played in plays):
        alike = [played for played in plays if played.drive == drive]
        parts.append(text_table(HEADER, make_engine_rows(alike), f"Best gaits; {describe_drive(drive)}"))
        parts.append(measure_agreement(alike).describe())
    steps = plays[0].steps
    figure = (
        "mean power over the phase"
        if steps is None
        else f"energy for each planned metre over {steps} steps, every second one mirrored"
    )
    return Section(
        title="In the physics engine",
        parts=(
            f"Every solver's best gait, simulated open loop in MuJoCo. Model and engine: {figure}, mechanical and heat. The "
            "model's value and rank refer to the planned motion on a dense grid. Ranks use the printed digits; a gait "
            "that falls has none. For a cycle that does not fall, the walked share of the planned distance is given.",
            *parts,
        ),
    )
