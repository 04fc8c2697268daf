"""Claims of others about NAO's walk: runs, verdicts and a report."""

from __future__ import annotations

from typing import Any

from compare.analysis.units import join_words
from compare.papers.nao_walk import nao_walk_runs, nao_walk_sources
from compare.papers.nao_walk.nao_walk_claims import check_claims
from compare.papers.nao_walk.nao_walk_figures import draw_figures
from compare.papers.nao_walk.nao_walk_findings import NaoWalkFindings
from compare.papers.nao_walk.nao_walk_runs import (
    FRICTIONS,
    MASS_FACTORS,
    PUSHES_NS,
    SLOPES_DEG,
    SPECS,
    NaoWalkEffort,
    make_gait_computations,
    make_walk_computations,
)
from compare.papers.nao_walk.nao_walk_sources import LIFT_M, SPEED_M_S, STEP_M, STRETCHED_M, TORSO_M, make_footsteps
from compare.papers.nao_walk.nao_walk_tables import make_tables
from compare.papers.paper_runs import Runner
from compare.papers.reproduction import Reproduction
from nlp_gait.errors import InputError
from nlp_gait.gaits.biped import cart_table, recorded_cycle
from nlp_gait.simulation import simulate
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import load_mujoco


def run_nao_walk(runner: Runner, effort: NaoWalkEffort) -> NaoWalkFindings:
    """Compute optimal gaits, then simulate them and the robot's own walk.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        InputError: no optimal gait was found at the default speed.
    """
    load_mujoco()  # fail before the work if it is missing
    code = (nao_walk_runs, nao_walk_sources, cart_table, recorded_cycle, simulate)
    gaits = runner.compute(make_gait_computations(effort), code)
    speeds = {heat: gaits[f"speeds-{heat.split()[-1]}"] for heat in SPECS}
    optima = {}
    for heat, points in speeds.items():
        at = next(point for point in points if point["speed_m_s"] == SPEED_M_S)
        if not at["feasible"]:
            raise InputError(f"no optimal gait was found at {SPEED_M_S:g} m/s with {heat}; use more starts")
        optima[heat] = at["x"]
    walks = runner.compute(make_walk_computations(effort, optima), code)
    return NaoWalkFindings(
        effort=effort,
        speeds=speeds,
        torsos=gaits["torso-heights"],
        straighter=_select(gaits, "straighter-"),
        joints=_select(walks, "joints-"),
        drives={name: list(_select(walks, f"drives-{name}-").values()) for name in ("none", "torque")},
    )


def _select(results: dict[str, Any], prefix: str) -> dict[str, Any]:
    """Results whose names begin with a prefix, by the rest of the name, in their order."""
    return {name.removeprefix(prefix): result for name, result in results.items() if name.startswith(prefix)}


def compute_values(findings: NaoWalkFindings) -> dict[str, Any]:
    """Return the values of the places in the report's text."""
    effort = findings.effort
    disturbances = {"pushes": PUSHES_NS, "slopes": SLOPES_DEG, "frictions": FRICTIONS, "masses": MASS_FACTORS}
    return {
        "step_mm": 1000 * STEP_M,
        "period_s": make_footsteps().period_s,
        "speed_cm_s": 100 * SPEED_M_S,
        "torso_mm": 1000 * TORSO_M,
        "lift_mm": 1000 * LIFT_M,
        "stretched_mm": 1000 * STRETCHED_M,
        "starts": effort.starts,
        "full_error": Drive().full_error_rad,
        "walked": effort.walked,
        **{name: join_words(f"{value:g}" for value in values) for name, values in disturbances.items()},
        "lengths": join_words(f"{1000 * length:.0f}" for length in effort.steps_m),
    }


REPRODUCTION = Reproduction(
    template="nao_walk/nao_walk_report.md",
    full=NaoWalkEffort(),
    quick=NaoWalkEffort(
        starts=1,
        speeds_m_s=(0.08, SPEED_M_S),
        torsos_m=(TORSO_M, 0.32),
        heats=(0.025,),
        stiffnesses=(1.0, 0.5),
        steps_m=(STEP_M,),
        walked=2,
    ),
    run=run_nao_walk,
    values=compute_values,
    tables=make_tables,
    figures=draw_figures,
    claims=check_claims,
)
