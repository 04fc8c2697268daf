"""The recorded study of the engine as objective: NAO's cycle in four settings, resumable in the folder ``tuned``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

import nlp_gait
from benchmarks.engine.markdown import cells, header
from compare.questions.question import Work, find
from compare.questions.sweep import Axis
from compare.questions.tune import Tune, TunedGait
from compare.study.memo import Memo
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.mjcf import Bumps
from nlp_gait.simulation.simulate import Conditions

FOLDER = Path("tuned")
SETTINGS = {
    "calm": (Drive(), Conditions()),
    "bumps of 1 mm": (Drive(), Conditions(bumps=Bumps(height_m=0.001))),
    "mass +5 %": (Drive(), Conditions(mass_factor=1.05)),
    "no feed-forward": (Drive(feed_forward="none"), Conditions()),
}
LIMITS = [Axis(name="ssp_dbm_y_mean_limit_m", values=(0.003, 0.006, 0.01, 0.015, 0.02))]


def tuned() -> Iterator[str]:
    """NAO's cycle tuned in the engine: four settings, 11 runs of 300 simulations, about eight hours of processor time."""
    yield from _tabulate(SETTINGS, runs=11, simulations=300)


def tuned_briefly() -> Iterator[str]:
    """The same for a calm floor alone: one run of 100 simulations."""
    yield from _tabulate(["calm"], runs=1, simulations=100)


def _tabulate(settings: Iterable[str], runs: int, simulations: int) -> Iterator[str]:
    yield header("setting", "gait", "simulations", "J/m", "held-out floors", "model", "falls", "runs")
    for setting in settings:
        drive, conditions = SETTINGS[setting]
        effort = {"runs": runs, "simulations": simulations, "limits": LIMITS}
        question = Tune(problem=nlp_gait.load("nao-cycle"), drive=drive, conditions=conditions, **effort)
        rows = find(question, Work(memo=Memo(FOLDER / setting.replace(" ", "-"))))
        for solver in dict.fromkeys(row.solver for row in rows):
            yield cells(setting, solver, *_summarise([row for row in rows if row.solver == solver]))


def _summarise(rows: list[TunedGait]) -> Iterator[str]:
    scores = [score for row in rows for score in (row.here, *row.elsewhere)]
    yield f"{rows[0].simulations}"
    yield f"{np.median([row.here.J_per_m for row in rows]):.2f}"
    yield f"{np.median([row.elsewhere_J_per_m for row in rows]):.2f}"
    yield f"{np.median([row.model_J_per_m for row in rows]):.2f}"
    yield f"{sum(score.fell_at_s is not None for score in scores)} of {len(scores)}"
    yield f"{len(rows)}"
