"""Claims of others about NAO: the robot's own walk, what its joints draw, and verdicts that follow the numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from compare.papers.claims import ClaimVerdict
from compare.papers.nao_walk import nao_walk_runs
from compare.papers.nao_walk.nao_walk_claims import NaoWalkFindings
from compare.papers.nao_walk.nao_walk_reproduction import REPRODUCTION
from compare.papers.nao_walk.nao_walk_runs import (
    KINDS,
    SPEED_M_S,
    make_footsteps,
    plan_own_walk,
    simulate_joints,
    sum_energy,
)
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.simulation.measurements import measure_planned_distance, predict_power
from nlp_gait.simulation.plan import make_plan
from tests.compare.papers.finished import check_report, recompute, reproduce


def drawn(knees: float, others: float = 1.0) -> dict[str, Any]:
    """Energy of the joints [J/m], half of it heat."""
    kinds = {kind: {name: others for name in ("mechanical", "paper", "sheet")} for kind in KINDS}
    kinds["KneePitch"] = {name: knees for name in ("mechanical", "paper", "sheet")}
    walk = {"fell_at_s": None, "walked_m": 1.0, "duration_s": 10.0}
    return {**walk, "model": kinds, "engine": kinds}


def optimum(knee_deg: float) -> dict[str, Any]:
    """The same with and without the paper's bound."""
    return {bound: {"hip_m": 0.32, "knee_deg": knee_deg, "power_W": 2.0} for bound in ("free", "paper")}


def drive(energy: float | None, falls: int, fastest: float) -> dict[str, Any]:
    """One walk on drives; no energy means a fall."""
    found = {"fell": energy is None, "walked_share": 0.9, "tracking_rad": 0.1, "disturbances": 24}
    return {**found, "sheet_J_per_m": energy, "paper_J_per_m": energy, "falls": falls, "fastest_m_s": fastest}


def make_findings(**changes: Any) -> NaoWalkFindings:
    """Findings in which every claim holds."""
    speeds = [
        {"speed_m_s": speed, "feasible": True, "cost_of_transport": cost, "energy_J_per_m": 50.0, "x": {"a": 1.0}}
        for speed, cost in ((0.08, 1.0), (SPEED_M_S, 1.02))
    ]
    torsos = [
        {"torso_m": torso, "knee_deg": knee, "paper_J_per_m": energy, "sheet_J_per_m": energy}
        for torso, knee, energy in ((0.315, 49.0, 70.0), (0.32, 41.0, 60.0))
    ]
    holding: dict[str, Any] = {
        "speeds": {"paper": speeds, "sheet": speeds},
        "torsos": torsos,
        "straighter": {"0.025": optimum(40.0), "0.5": optimum(30.0), "sheet": optimum(25.0)},
        "joints": {name: drawn(5.0) for name in ("own", "own-plain", "optimum-paper", "optimum-sheet")},
        "drives": {name: [drive(100.0, 9, 0.1), drive(90.0, 1, 0.12)] for name in ("none", "torque")},
        "effort": REPRODUCTION.quick,
    }
    return NaoWalkFindings(**{**holding, **changes})


def test_verdicts_follow_the_numbers() -> None:
    holding = [claim.verdict for claim in REPRODUCTION.check_claims(make_findings()).values()]
    assert holding == ["holds"] * 6 + ["cannot be tested here"] * 2
    turned = make_findings(
        torsos=[
            {**at, "paper_J_per_m": 100 * at["torso_m"], "sheet_J_per_m": 100 * at["torso_m"]}
            for at in make_findings().torsos
        ],
        straighter={"0.025": optimum(25.0), "0.5": optimum(25.0), "sheet": optimum(26.0)},
        joints={name: drawn(0.5, 100.0) for name in make_findings().joints},
        drives={name: [drive(100.0, 5, 0.12), drive(None, 9, 0.1)] for name in ("none", "torque")},
    )
    claims = REPRODUCTION.check_claims(turned)
    verdicts = [claim.verdict for claim in claims.values()]
    assert verdicts[:6] == ["does not hold"] * 6 and verdicts[-1] == "does not hold"
    assert "100.0, falls J/m" in claims["efficient"].found
    close = make_findings(drives={name: [drive(100.0, 1, 0.1), drive(90.0, 0, 0.12)] for name in ("none", "torque")})
    robust = REPRODUCTION.check_claims(close)["robust"]
    assert robust.verdict == ClaimVerdict.NOT_SHOWN
    assert robust.detail == "(0 falls instead of 1 may be chance, Fisher: p = 0.5)"


def test_the_robots_own_walk_has_the_documented_speed_and_its_energy_splits_by_joint() -> None:
    """Sums over joints are what the package's own measurement and index say of the same walk."""
    walk = plan_own_walk(make_footsteps())
    indexes = build_exact_model(walk.problem).at(walk.x, walk.problem.p).indexes
    assert indexes["speed_m_s"] == pytest.approx(SPEED_M_S, rel=1e-12)
    found, plan = simulate_joints("torque", "", {}, 2), make_plan(walk, 2)
    assert found["fell_at_s"] is None and found["walked_m"] == pytest.approx(measure_planned_distance(plan), rel=0.02)
    whole = predict_power(plan).total_W * plan.duration_s / measure_planned_distance(plan)
    assert sum_energy(found["model"].values(), "paper") == pytest.approx(whole, rel=1e-12)
    assert sum_energy(found["engine"].values(), "paper") == pytest.approx(whole, rel=0.05)
    # Heat by the data sheet is 14 to 33 times that of the paper in the legs; each hip yaw-pitch motor turns two joints.
    for kind, parts in found["model"].items():
        if kind not in ("HipYawPitch", "arms"):
            assert 13.5 < parts["sheet"] / parts["paper"] < 33.5


def test_the_report_from_end_to_end_and_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With made-up runs: every result is computed once, stored, and in the report; a second call computes nothing."""
    findings, calls = make_findings(), []

    def replace_run(name: str, result: Any) -> None:
        def compute(*_: Any, **__: Any) -> Any:
            calls.append(name)
            return result

        monkeypatch.setattr(nao_walk_runs, name, compute)

    replace_run("solve_over_speed", findings.speeds["paper"])
    replace_run("compute_heights", findings.torsos)
    replace_run("solve_free_height", optimum(30.0))
    replace_run("simulate_joints", drawn(5.0))
    replace_run("simulate_drives", drive(100.0, 5, 0.1))
    finished = reproduce("nao-claims", tmp_path)
    check_report(finished, "joints drives speeds", "claims differences joints torsos straighter drives speeds")
    assert len(calls) == len(finished.progress) - 1
    assert finished.report.count("does not hold |") == 4  # softer drives change nothing, and K does not either
    calls.clear()
    assert recompute(finished) == ["figures, tables and report"] and not calls
