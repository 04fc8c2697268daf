"""The section of a report on the best gaits in a physics engine."""

from __future__ import annotations

from collections.abc import Sequence

from compare.analysis.engine import HEADER, agreement_of, drive_in_words, engine_rows
from compare.report.document import Part, Prose, Section, text_table
from compare.study.engine import Played

HOW = Prose(
    "The best gaits of this study have not been played in a physics engine. `nlp-gait report DIR --engine` plays those that "
    "can be (extra `sim`) and adds their energy, fate and rank to this report."
)


def engine_section(plays: Sequence[Played]) -> Section | None:
    """Every solver's best gait as the engine finds it, for each drive; None without any."""
    if not plays:
        return None
    parts: list[Part] = []
    for drive in dict.fromkeys(played.drive for played in plays):
        alike = [played for played in plays if played.drive == drive]
        parts.append(text_table(HEADER, engine_rows(alike), f"Best gaits; {drive_in_words(drive)}"))
        parts.append(agreement_of(alike).sentence())
    steps = plays[0].steps
    figure = (
        "mean power over the phase"
        if steps is None
        else f"energy for each planned metre over {steps} steps, every second one mirrored"
    )
    return Section(
        title="In the physics engine",
        parts=(
            f"Every solver's best gait, played open loop in MuJoCo. Model and engine: {figure}, mechanical and heat. The "
            "model's is that of the planned motion on a dense grid, and so is its rank. Ranks are those of the printed "
            "digits; a gait that falls has none. A cycle that stays up walks the stated part of the planned way.",
            *parts,
        ),
    )
