"""Tables about NAO's walk."""

from __future__ import annotations

from compare.papers.nao_walk.nao_walk_findings import NaoWalkFindings
from compare.papers.nao_walk.nao_walk_runs import KINDS, sum_energy
from compare.report.document import Rows

NAMES = {
    "own": "own walk",
    "own-plain": "own walk, plain drives",
    "optimum-paper": "optimum for K of the paper",
    "optimum-sheet": "optimum for K of the data sheet",
}
HEATS = {"paper": "paper", "sheet": "data sheet"}


def make_tables(findings: NaoWalkFindings) -> dict[str, Rows]:
    """Return rows by name; headings and formats are in the report's template."""
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
    drives = [
        [name, share, point["walked_share"], point["sheet_J_per_m"], point["paper_J_per_m"], point["tracking_rad"]]
        + [point["falls"], point["disturbances"], 100 * point["fastest_m_s"]]
        for name, points in findings.drives.items()
        for share, point in zip(findings.effort.stiffnesses, points, strict=True)
    ]
    speeds = [
        [heat.removeprefix("K of the "), 100 * point["speed_m_s"], "yes" if point["feasible"] else "no"]
        + [point["cost_of_transport"], point["energy_J_per_m"]]
        for heat, points in findings.speeds.items()
        for point in points
    ]
    torsos = [
        [1000 * at["torso_m"], at["knee_deg"], at["paper_J_per_m"], at["sheet_J_per_m"]] for at in findings.torsos
    ]
    return {
        "joints": _make_joints(findings),
        "torsos": torsos,
        "straighter": straighter,
        "drives": drives,
        "speeds": speeds,
    }


def _make_joints(findings: NaoWalkFindings) -> Rows:
    """Shares of each kind of joint; the engine has no numbers of a walk that fell."""
    return [
        [
            NAMES[gait],
            where,
            HEATS[heat],
            *(100 * findings.share(gait, where, heat, kind) for kind in KINDS),
            sum_energy(found[where].values(), heat),
        ]
        for gait, found in findings.joints.items()
        for where in ("model", "engine")
        if where == "model" or found["fell_at_s"] is None
        for heat in HEATS
    ]
