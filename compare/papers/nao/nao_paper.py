"""Tables 6 to 9, section 5.3 and the numbers in the text of the NAO paper, as printed (``nao_paper.toml``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from compare.analysis.record_statistics import RankSum
from compare.papers.claims import read_printed


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedOptimum:
    """A solution as printed."""

    x: tuple[float, ...]  # x1, x2 and so on
    power_W: float  # least mean power
    legs_twice_W: float  # ours: power with the mechanical term of the moving leg joints counted twice
    indexes: Mapping[str, float]  # performance figures, named as the problem's indexes

    @property
    def figures(self) -> dict[str, float]:
        """Performance figures with the power, as the problem's indexes."""
        return {"power_W": self.power_W, **self.indexes}


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedPhase:
    """Numbers of one support phase as printed, and where they are."""

    problem: str  # name of the problem here
    title: str  # in words
    optima: Mapping[str, PrintedOptimum]  # by search algorithm (Tables 6 and 8, 7 and 9)
    test: RankSum  # section 5.3
    tables: tuple[int, int]  # numbers of the tables of variables and of indexes
    convergence_figure: str  # name of the figure of best per generation
    scatter_figures: Mapping[str, tuple[int, ...]]  # figures of power against variables, to the positions of these in x
    duration: int  # position of the phase's time in x
    poses_every_s: float  # time between the poses of Fig. 20


@dataclass(frozen=True, slots=True, kw_only=True)
class VelocityRange:
    """A range of velocities [m/s] of the solutions of a phase, with the variables' positions in x."""

    phase: Literal["ssp", "dsp"]
    variables: tuple[int, ...]
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A choice other than ours, as options and parameters of the problems."""

    title: str  # in words
    phases: tuple[str, ...] = ("nao-ssp", "nao-dsp")  # problems
    options: Mapping[str, str | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class NaoPaper:
    """Content of ``nao_paper.toml``."""

    ssp: PrintedPhase
    dsp: PrintedPhase
    swing_heights_m: tuple[float, ...]
    swing_power_W: Mapping[str, tuple[float, ...]]  # by search algorithm, at these heights
    durations_s: tuple[float, ...]  # of single support
    velocity_ranges: Mapping[str, VelocityRange]  # by id of the claim
    choices: Mapping[str, Choice]
    torque_changes_Nm: Mapping[str, tuple[float, float]]  # ours, by candidate for the cause of the printed ones


PAPER = read_printed(NaoPaper, "nao/nao_paper.toml")
SSP, DSP = PHASES = PAPER.ssp, PAPER.dsp
SWING_HEIGHT = 7  # position in x of nao-ssp
SWING_POWER_W = {name: dict(zip(PAPER.swing_heights_m, row, strict=True)) for name, row in PAPER.swing_power_W.items()}
