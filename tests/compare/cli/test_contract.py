"""The command line as scripts use it."""

import json

import numpy as np
import pytest

from tests.compare.cli.calls import as_json, nlp_gait

PSO_OF_THE_PAPER = "0.31,-0.002,0.0034,0.008,0.0025,0.0243,-0.0256,0.015,4"
# Verified by two independent implementations to nine digits; the paper's variables are rounded, the values are not.
AGREEMENT = 2e-6


def test_evaluate_prints_what_scripts_rely_on():
    done = nlp_gait("evaluate", "nao-ssp", "--x", PSO_OF_THE_PAPER, "--json")
    assert done.stderr == ""
    result = json.loads(done.stdout)
    assert result["problem"] == "nao-ssp" and result["robot"] == "nao-v5"
    assert list(result["x"])[:2] == ["hip_height_m", "hip_vz_start_m_s"]
    assert result["objective"] == {"name": "power", "value": pytest.approx(0.866844, abs=AGREEMENT), "unit": "W"}
    expected = {
        "power_W": 0.866844,
        "torque_change_Nm": 0.421864,
        "dbm_x_min_m": 0.029943,
        "dbm_y_min_m": 0.009195,
        "dbm_x_mean_m": 0.060437,
        "dbm_y_mean_m": 0.020754,
    }
    assert result["metrics"] == pytest.approx(expected, abs=AGREEMENT)
    assert set(result["dense"]) == set(expected)
    assert result["feasible"] is True
    assert all(set(row) == {"name", "value", "lower", "upper", "violation", "unit"} for row in result["constraints"])


@pytest.mark.commit
def test_solve_and_compare(tmp_path):
    solution = as_json("solve", "nao-ssp", "--starts", "1", "--seed", "0")
    named = "status claimed objective x iterations evaluations time_s active_constraints starts"
    assert set(named.split()) <= solution.keys()
    assert solution["claimed"] and solution["feasible"] and solution["objective"] == pytest.approx(0.845868, rel=1e-5)
    out = tmp_path / "study"
    done = nlp_gait(
        "compare", "nao-ssp", "--runs", "2", "--starts", "1", "--evaluations", "500", "--jobs", "1", "--out", str(out)
    )
    headline = done.stdout.splitlines()[-1]
    assert headline.startswith("nao-ssp: ") and "above the proven optimum 0.845869 W" in headline
    shown = (out / "report.md").read_text().replace("[proven](#section-how-it-is-proven)", "proven")
    assert headline.removeprefix("nao-ssp: ") in shown
    assert "<svg" in (out / "report.html").read_text()
    assert (out / "nao-ssp-convergence.svg").stat().st_size > 10_000
    # One start of IPOPT, and two runs each of pso, ga and aco.
    assert len(list((out / "records" / "nao-ssp").glob("*.json"))) == 7


def test_unreachable_pose_is_evaluated_and_named():
    x = PSO_OF_THE_PAPER.replace("0.31,", "0.36,", 1)
    result = as_json("evaluate", "nao-ssp", "--x", x)
    assert not result["feasible"]
    assert all(np.isfinite(value) for value in result["metrics"].values())
    out_of_reach = [
        row["name"] for row in result["constraints"] if row["name"].startswith("reach") and row["violation"] > 0
    ]
    assert "reach[left leg, 5]" in out_of_reach
    assert "reach[left leg, " in nlp_gait("evaluate", "nao-ssp", "--x", x).stdout


def test_solve_takes_any_nlp_solver_by_name(tmp_path):
    out = tmp_path / "best.json"
    shown = nlp_gait("solve", "walk12", "--starts", "1", "--solver", "slsqp", "--out", out).stdout
    written = json.loads(out.read_text())
    assert "; slsqp\n" in shown and written["solver"] == "slsqp" and written["linear_solver"] == ""
    assert written["claimed"] and written["active_constraints"] == []


BEAM = """
from nlp_gait.formulation import Assembly, Constraint, GaitProblem, Objective, Variable, maker


@maker
def beam() -> GaitProblem:
    def assemble(at, ops):
        row = Constraint(name="area", unit="in^2", scale=1.0, value=at["h"] * at["l"], lower=0.5, upper=0.5)
        return Assembly(objective=at["h"] + at["l"], constraints=(row,), metrics={})

    names = [Variable(name=name, unit="in", lower=0.1, upper=2.0, description=name) for name in "hl"]
    return GaitProblem(
        name="beam", title="beam", variables=tuple(names), objective=Objective(name="cost", unit="USD"), assemble=assemble
    )
"""


def test_a_problem_without_a_gait_is_evaluated_in_its_own_words(tmp_path):
    (tmp_path / "beam.py").write_text(BEAM)
    (tmp_path / "points.csv").write_text("h;l\n0,5;1,0\n0,4;1,2\n", encoding="utf-8-sig")
    beam = f"{tmp_path / 'beam.py'}:beam"
    exact, near, table = (
        nlp_gait("evaluate", beam, "--x", x).stdout for x in ("0.5,1", "0.5,1.00005", tmp_path / "points.csv")
    )
    assert exact.splitlines()[0].endswith("beam: cost 1.500000 USD") and exact.splitlines()[-1] == "feasible"
    assert "An equation is satisfied within 0.0001, which is often allowed elsewhere" in " ".join(near.split())
    assert "0.02" in table and "no" in table.split()
    for text in (exact, near, table):
        assert not {"guaranteed", "Guaranteed:", "samples", "dense"} & set(text.split())
