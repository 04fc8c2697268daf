"""The recorded study of the engine as objective, resumable in the folder ``tuned``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import nlp_gait
from benchmarks.engine.markdown import cells, header
from compare.questions.question import Work, find
from compare.questions.sweep import Axis
from compare.questions.tune import Tune, TunedGait
from compare.study.memo import Memo
from nlp_gait.files import make_file_name
from nlp_gait.simulation.balance.controller import Balance
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.mjcf import Bumps
from nlp_gait.simulation.simulate import Conditions

FOLDER = Path("tuned")
LIMITS = (Axis(name="ssp_dbm_y_mean_limit_m", values=(0.003, 0.006, 0.01, 0.015, 0.02)),)
LEAST_DURATIONS = (  # bounds, for a drive that knows nothing of the dynamics
    Axis(name="single_support_time_s.lower", values=(0.8, 1.2, 1.6, 2.0)),
    Axis(name="double_support_time_s.lower", values=(0.4, 0.8, 1.2)),
)


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A robot in a world, and how much of it is searched."""

    problem: str = "nao-cycle"
    options: Mapping[str, str] = field(default_factory=dict)  #: of the problem
    drive: Drive = Drive()
    conditions: Conditions = Conditions()
    runs: int = 3  #: of each search
    simulations: int = 300  #: of a search
    limits: Sequence[Axis] = LIMITS  #: that IPOPT tunes


BALANCED = {
    "problem": "humanoid-cycle",
    "options": {"robot": "jvrc-description:jvrc1"},
    "drive": Drive(feedback=Balance()),
    "simulations": 100,
    "limits": (),
}
SETTINGS = {
    "NAO, calm": Setting(runs=11),
    "NAO, bumps of 1 mm": Setting(conditions=Conditions(bumps=Bumps(height_m=0.001))),
    "NAO, mass +5 %": Setting(conditions=Conditions(mass_factor=1.05)),
    "NAO, no feed-forward": Setting(drive=Drive(feed_forward="none"), limits=LEAST_DURATIONS),
    "JVRC-1 with balance, calm": Setting(**BALANCED),
    "JVRC-1 with balance, bumps of 5 mm": Setting(**BALANCED, conditions=Conditions(bumps=Bumps(height_m=0.005))),
}


def tuned() -> Iterator[str]:
    """Cycles tuned in the engine: NAO's in four settings, JVRC-1's in two; six hours of processor time."""
    yield from _tabulate(SETTINGS)


def tuned_briefly() -> Iterator[str]:
    """The same for NAO on a calm floor alone: one run of 100 simulations."""
    yield from _tabulate({"NAO, calm": Setting(runs=1, simulations=100)})


def _tabulate(settings: Mapping[str, Setting]) -> Iterator[str]:
    yield header("setting", "gait", "simulations", "J/m", "held-out floors", "model", "off its way", "falls", "runs")
    for name, setting in settings.items():
        question = Tune(
            problem=nlp_gait.load(setting.problem, **setting.options),
            drive=setting.drive,
            conditions=setting.conditions,
            runs=setting.runs,
            simulations=setting.simulations,
            limits=setting.limits,
        )
        rows = find(question, Work(memo=Memo(FOLDER / make_file_name(name.replace(" ", "-")))))
        for solver in dict.fromkeys(row.solver for row in rows):
            yield cells(name, solver, *_summarise([row for row in rows if row.solver == solver]))


def _summarise(rows: list[TunedGait]) -> Iterator[str]:
    scores = [score for row in rows for score in (row.here, *row.elsewhere)]
    yield f"{rows[0].simulations}"
    yield _format_median([row.here.J_per_m for row in rows if row.here.fell_at_s is None])
    yield _format_median([row.elsewhere_J_per_m for row in rows if not np.isnan(row.elsewhere_J_per_m)])
    yield f"{np.median([row.model_J_per_m for row in rows]):.2f}"
    yield f"{100 * np.median([row.here.off for row in rows]):.1f} %"
    yield f"{sum(score.fell_at_s is not None for score in scores)} of {len(scores)}"
    yield f"{len(rows)}"


def _format_median(energies: Sequence[float]) -> str:
    """Format the median of the gaits that stand."""
    return f"{np.median(energies):.2f}" if energies else "-"
