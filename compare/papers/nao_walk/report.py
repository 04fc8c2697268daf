"""Report of the claims: the text is ``report.md``, with numbers, tables and figures filled in."""

from __future__ import annotations

from importlib import resources
from typing import Any

from compare.analysis.units import join_words
from compare.papers.nao_walk.effort import Effort
from compare.papers.nao_walk.nao_walk_claims import claims
from compare.papers.nao_walk.nao_walk_figures import all_figures
from compare.papers.nao_walk.nao_walk_findings import Findings
from compare.papers.nao_walk.nao_walk_runs import FRICTIONS, KINDS, MASS_FACTORS, PUSHES_NS, SLOPES_DEG, total
from compare.papers.nao_walk.nao_walk_sources import LIFT_M, SPEED_M_S, STEP_M, STRETCHED_M, TORSO_M, documented
from compare.report.document import Document, Rows
from compare.report.template import fill_template
from nlp_gait.simulation.drive import Drive

NAMES = {
    "own": "own walk",
    "own-plain": "own walk, plain servos",
    "optimum-paper": "optimum for K of the paper",
    "optimum-sheet": "optimum for K of the data sheet",
}
HEATS = {"paper": "paper", "sheet": "data sheet"}


def document(findings: Findings, effort: Effort) -> Document:
    """The whole report."""
    text = (resources.files("compare.papers.nao_walk") / "nao_walk_report.md").read_text(encoding="utf-8")
    return fill_template(text, values=_values(effort), tables=all_tables(findings), figures=dict(all_figures(findings)))


def _values(effort: Effort) -> dict[str, Any]:
    return {
        "step_mm": 1000 * STEP_M,
        "period_s": documented().period_s,
        "speed_cm_s": 100 * SPEED_M_S,
        "torso_mm": 1000 * TORSO_M,
        "lift_mm": 1000 * LIFT_M,
        "stretched_mm": 1000 * STRETCHED_M,
        "starts": effort.starts,
        "full_error": Drive().full_error_rad,
        "walked": effort.walked,
        "pushes": join_words(f"{value:g}" for value in PUSHES_NS),
        "slopes": join_words(f"{value:g}" for value in SLOPES_DEG),
        "frictions": join_words(f"{value:g}" for value in FRICTIONS),
        "masses": join_words(f"{value:g}" for value in MASS_FACTORS),
        "lengths": join_words(f"{1000 * length:.0f}" for length in effort.steps_m),
    }


def all_tables(findings: Findings) -> dict[str, Rows]:
    """Rows by the names of the tables in the text."""
    straighter = [
        [
            heat.replace("sheet", "data sheet"),
            *(
                value
                for bound in ("free", "paper")
                for value in (1000 * at[bound]["hip_m"], at[bound]["knee_deg"], at[bound]["power_W"])
            ),
        ]
        for heat, at in findings.straighter.items()
    ]
    servos = [
        [name, share, point["walked_share"], point["sheet_J_per_m"], point["paper_J_per_m"], point["tracking_rad"]]
        + [point["falls"], point["disturbances"], 100 * point["fastest_m_s"]]
        for name, points in findings.servos.items()
        for share, point in zip(findings.stiffnesses, points, strict=True)
    ]
    speeds = [
        [heat.removeprefix("K of the "), 100 * point["speed_m_s"], "yes" if point["feasible"] else "no"]
        + [point["cost_of_transport"], point["energy_J_per_m"]]
        for heat, points in findings.speeds.items()
        for point in points
    ]
    return {
        "claims": [[c.text, c.source.reference, c.source.read, c.evidence, c.verdict] for c in claims(findings)],
        "joints": _joints(findings),
        "torsos": [
            [1000 * at["torso_m"], at["knee_deg"], at["paper_J_per_m"], at["sheet_J_per_m"]] for at in findings.torsos
        ],
        "straighter": straighter,
        "servos": servos,
        "speeds": speeds,
    }


def _joints(findings: Findings) -> Rows:
    """Shares of each kind of joint; the engine has no numbers of a walk that fell."""
    return [
        [
            NAMES[gait],
            where,
            HEATS[heat],
            *(100 * findings.share(gait, where, heat, kind) for kind in KINDS),
            total(found[where].values(), heat),
        ]
        for gait, found in findings.joints.items()
        for where in ("model", "engine")
        if where == "model" or found["fell_at_s"] is None
        for heat in HEATS
    ]
