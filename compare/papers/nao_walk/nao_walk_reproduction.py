"""Claims of others about NAO's walk: runs, verdicts and a report."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from compare.papers.nao_walk import nao_walk_runs as claim_runs
from compare.papers.nao_walk import nao_walk_sources as published
from compare.papers.nao_walk.effort import Effort
from compare.papers.nao_walk.nao_walk_findings import Findings
from compare.papers.nao_walk.nao_walk_runs import SPECS, gaits_first, walks_then
from compare.papers.nao_walk.nao_walk_sources import SPEED_M_S
from compare.papers.nao_walk.report import document
from compare.report.writing import write_document
from compare.study.store import Store
from nlp_gait.errors import InputError
from nlp_gait.files import writable_folder
from nlp_gait.gaits.biped import cart_table, recorded_cycle
from nlp_gait.progress import Progress
from nlp_gait.simulation import simulate
from nlp_gait.simulation.engine import load_mujoco

FULL = Effort()
STEPS = FULL.steps


def reproduce(out: Path, *, progress: Progress, effort: Effort = FULL) -> None:
    """Write the report (HTML, Markdown), tables (CSV) and figures (PNG, SVG).

    Args:
        out: folder; results in ``out/store`` are reused.
        progress: told about each step, ``effort.steps`` times.
        effort: how much is computed.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        InputError: no optimal gait was found at the default speed.
        OutputError: the folder cannot be written to.
    """
    load_mujoco()  # if it is missing, say so before the work
    folder = writable_folder(out)
    compute = partial(
        Store(folder).compute_all, code=[claim_runs, published, cart_table, recorded_cycle, simulate], progress=progress
    )
    first = compute(gaits_first(effort))
    speeds = {heat: first[f"speeds-{heat.split()[-1]}"] for heat in SPECS}
    optima = {}
    for heat, points in speeds.items():
        at = next(point for point in points if point["speed_m_s"] == SPEED_M_S)
        if not at["feasible"]:
            raise InputError(f"no optimal gait was found at {SPEED_M_S:g} m/s with {heat}; ask for more starts")
        optima[heat] = at["x"]
    second = compute(walks_then(effort, optima))
    findings = Findings(
        speeds=speeds,
        torsos=first["torso-heights"],
        straighter=_named(first, "straighter-"),
        joints=_named(second, "joints-"),
        servos={name: list(_named(second, f"servos-{name}-").values()) for name in ("none", "torque")},
        stiffnesses=effort.stiffnesses,
    )
    progress("figures, tables and report")
    write_document(folder, document(findings, effort))


def _named(results: dict[str, Any], prefix: str) -> dict[str, Any]:
    """Results of the steps whose names begin so, by the rest of the name, in their order."""
    return {name.removeprefix(prefix): result for name, result in results.items() if name.startswith(prefix)}
