"""Section on how the settings of a study's searches were tuned."""

from __future__ import annotations

from collections.abc import Sequence

from compare.analysis.tuning import Tuning, describe_choice
from compare.analysis.units import join_words
from compare.report.document import Section, text_table


def make_tuning_section(tunings: Sequence[Tuning]) -> tuple[Section, ...]:
    """Return the section, none without tunings."""
    if not tunings:
        return ()
    rows = [
        (
            tuning.solver,
            *(f"{area:.3f}" for area in tuning.area),
            *(str(tuning.trials), f"{tuning.evaluations:,}".replace(",", " "), f"{tuning.time_s:.0f} s"),
            describe_choice(tuning),
        )
        for tuning in tunings
    ]
    header = ("solver", "area before", "tuned", "trials", "evaluations", "time of all runs", "chosen settings")
    return (
        Section(
            title="Tuning",
            parts=(
                f"A trial of a search is one run on each of {join_words(tunings[0].training)}, which are not judged here or have "
                "other seeds; the first has the settings before. Optuna's tree-structured Parzen estimator proposes the others "
                "within the ranges that belong to the search's settings, and the trial with the largest mean area over the "
                "convergence curve (AOCC, from 0 to 1) gives the solver NAME-tuned. Its evaluations are spent before the judged "
                "runs, and are not counted there.",
                text_table(header, rows, "Settings before and after tuning", prose=True),
            ),
        ),
    )
