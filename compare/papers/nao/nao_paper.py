"""Tables 6 to 9, section 5.3 and the numbers in the text of the NAO paper, as printed.

Source:
    Gupta, Pratihar, Deb (2023), Analysis and optimization of gait cycle of 25-DOF NAO robot using particle swarm optimization
    and genetic algorithms.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from compare.analysis.statistics.inference import RankSum


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedOptimum:
    """A solution as printed."""

    x: tuple[float, ...]  # x1, x2 and so on
    power_W: float  # least mean power
    indexes: Mapping[str, float]  # performance figures, named as the problem's indexes


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedPhase:
    """Numbers of one support phase as printed, and where they are."""

    problem: str  # name of the problem here
    title: str  # in words
    optima: Mapping[str, PrintedOptimum]  # by search algorithm (Tables 6 and 8, 7 and 9)
    test: RankSum  # section 5.3; p_less is NaN where the paper gives none
    tables: tuple[int, int]  # numbers of the tables of variables and of indexes
    convergence_figure: int  # number of the figure of best per generation
    # Number of each figure of the objective against variables, to the positions of these in x
    scatter_figures: Mapping[int, tuple[int, ...]]
    duration: int  # position of the phase's time in x
    poses_every_s: float  # time between the poses of Fig. 20
    better: str  # section that says that PSO is better than GA
    steadier: str  # that its runs differ less
    higher_hip: str  # that a higher hip saves power
    slower: str  # that a longer phase does


def _indexes(*values: float) -> dict[str, float]:
    names = ("torque_change_Nm", "dbm_x_min_m", "dbm_y_min_m", "dbm_x_mean_m", "dbm_y_mean_m")
    return dict(zip(names, values, strict=True))


SSP = PrintedPhase(
    problem="nao-ssp",
    title="single support",
    optima={
        "pso": PrintedOptimum(
            x=(0.31, -0.0020, 0.0034, 0.0080, 0.0025, 0.0243, -0.0256, 0.015, 4.0),
            power_W=1.283,
            indexes=_indexes(0.4492, 0.0307, 0.0085, 0.0641, 0.0200),
        ),
        "ga": PrintedOptimum(
            x=(0.31, -0.005, 0.000, 0.0031, 0.0017, 0.0364, -0.0135, 0.015, 4.0),
            power_W=1.303,
            indexes=_indexes(0.5143, 0.0308, 0.0084, 0.0591, 0.0200),
        ),
    },
    test=RankSum(rank_sum=70.0, z=-3.6772, p_two_sided=0.000235, p_less=0.000117),
    tables=(6, 7),
    convergence_figure=9,
    scatter_figures={10: (0, 1, 2), 11: (3, 4), 12: (5, 6), 13: (7,), 14: (8,)},
    duration=8,
    poses_every_s=1.0,
    better="5.3.1",
    steadier="5.1",
    higher_hip="5.1.2",
    slower="5.1.6",
)
DSP = PrintedPhase(
    problem="nao-dsp",
    title="double support",
    optima={
        "pso": PrintedOptimum(
            x=(0.31, -0.0008, -0.0055, 0.0520, 0.0010, -0.0367, -0.0424, 2.0),
            power_W=1.0682,
            indexes=_indexes(0.6751, 0.0734, 0.0700, 0.0926, 0.0809),
        ),
        "ga": PrintedOptimum(
            x=(0.31, 0.0002, -0.0052, 0.0582, 0.0010, -0.0384, -0.0405, 2.0),
            power_W=1.0685,
            indexes=_indexes(0.6554, 0.0731, 0.0699, 0.0928, 0.0811),
        ),
    },
    test=RankSum(rank_sum=90.0, z=-2.3639, p_two_sided=0.0181, p_less=math.nan),
    tables=(8, 9),
    convergence_figure=15,
    scatter_figures={16: (0, 1, 2), 17: (3, 4), 18: (5, 6), 19: (7,)},
    duration=7,
    poses_every_s=0.25,
    better="5.3.2",
    steadier="5.2",
    higher_hip="5.2.2",
    slower="5.2.5",
)
PHASES = (SSP, DSP)

SWING_HEIGHT = 7  # position in x of nao-ssp
# Table 7, rows 6 to 11: least power found at each swing height [m: W].
SWING_POWER_W: Mapping[str, Mapping[float, float]] = {
    "pso": {0.015: 1.283, 0.018: 1.292, 0.022: 1.308, 0.024: 1.317, 0.026: 1.588, 0.028: 2.453},
    "ga": {0.015: 1.303, 0.018: 1.333, 0.022: 1.439, 0.024: 1.667, 0.026: 2.605, 0.028: 3.152},
}
# Durations of single support for a table of least power; the paper has a picture only (Fig. 14) [s].
DURATIONS_S = (0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 3.0, 4.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class VelocityRange:
    """A range of velocities [m/s] that a section gives for the solutions of a phase, with the variables' positions in x."""

    phase: PrintedPhase
    section: str
    variables: tuple[int, ...]
    low: float
    high: float


VELOCITY_RANGES = (
    VelocityRange(phase=SSP, section="5.1.2", variables=(1, 2), low=-0.005, high=0.005),
    VelocityRange(phase=SSP, section="5.1.3", variables=(3, 4), low=0.002, high=0.008),
    VelocityRange(phase=DSP, section="5.2.3", variables=(3,), low=0.045, high=0.075),
    VelocityRange(phase=DSP, section="5.2.3", variables=(4,), low=0.001, high=0.02),
    VelocityRange(phase=DSP, section="5.2.4", variables=(5, 6), low=-0.075, high=-0.035),
)
