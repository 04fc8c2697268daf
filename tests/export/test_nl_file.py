""".nl files: other readers find the same functions, bounds, names and optimum."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nlp_gait.backends.nlp import build_nlp
from nlp_gait.errors import InputError, OutputError
from nlp_gait.export.nl_file import export_nl, write_nl
from nlp_gait.formulation import GaitProblem, load
from tests.backends.toys import corner, toy

BOUNDS = {
    "lbx": np.array([-1.0, -np.inf]),
    "ubx": np.array([1.0, np.inf]),
    "lbg": np.zeros(3),
    "ubg": np.array([np.inf, 0.0, 2.0]),
}
ASL = "gjh_asl_json"


def read(path: Path) -> ca.NlpBuilder:
    """What CasADi's importer, which shares no code with the exporter, finds."""
    found = ca.NlpBuilder()
    found.import_nl(str(path), {"verbose": False})
    return found


def test_every_operation_is_read_back(tmp_path: Path) -> None:
    x = ca.SX.sym("x", 2)
    a, b = x[0], x[1]
    shared = ca.sin(a) * b
    f = shared**2 + ca.exp(a) / (2 + ca.cos(b)) + ca.fmin(a, b) * ca.fmax(a, 0.3) + ca.sqrt(3 + a) - ca.tan(a) * 2
    g = [
        ca.atan2(a, 2 + b) + shared,
        ca.acos(a / 3) + ca.asin(a / 4) + ca.atan(b),
        ca.tanh(a) + ca.log(5 + b) + ca.fabs(b) ** 1.5,
    ]
    nlp = ca.Function("nlp", [x], [f, ca.vertcat(*g)])
    path = tmp_path / "all.nl"
    path.write_text(write_nl(nlp, BOUNDS, np.array([0.1, 0.2]), "test"))
    found = read(path)
    again = ca.Function("again", [ca.vertcat(*found.x)], [found.f, ca.vertcat(*found.g)])
    for point in np.random.default_rng(0).uniform(-1.0, 1.0, (5, 2)):
        for left, right in zip(again(point), nlp(point), strict=True):
            np.testing.assert_allclose(left.full(), right.full(), rtol=1e-14, atol=1e-14)
    for name, values in (("x_lb", "lbx"), ("x_ub", "ubx"), ("g_lb", "lbg"), ("g_ub", "ubg")):
        assert np.array_equal(np.array(getattr(found, name)), BOUNDS[values])
    assert found.x_init == [0.1, 0.2]
    with pytest.raises(InputError, match="an .nl file cannot express"):
        write_nl(ca.Function("nlp", [x], [ca.erf(a), b]), BOUNDS, np.zeros(2), "test")


def test_another_reader_and_ipopt_find_the_optimum(tmp_path: Path) -> None:
    paths = {path.suffix: path for path in export_nl(toy(corner, limit=1.5), tmp_path, {"best_known": 1.5})}
    found = read(paths[".nl"])
    nlp = {"x": ca.vertcat(*found.x), "f": found.f, "g": ca.vertcat(*found.g)}
    quiet = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
    result = ca.nlpsol("ipopt", "ipopt", nlp, quiet)(
        x0=found.x_init, lbx=found.x_lb, ubx=found.x_ub, lbg=found.g_lb, ubg=found.g_ub
    )
    facts = json.loads(paths[".json"].read_text())
    assert float(result["f"]) == pytest.approx(facts["best_known"], abs=1e-6)
    names = paths[".col"].read_text().split()
    x = np.array(facts["offset"]) + np.array(facts["scale"]) * np.array(result["x"]).ravel()[:2]
    assert dict(zip(names, x, strict=False)) == pytest.approx({"x": 1.5, "y": 1.5}, abs=1e-6)
    assert len(names) == len(found.x) and paths[".row"].read_text().split()[-1] == "cost"
    assert len(paths[".row"].read_text().split()) == len(found.g) + 1
    paths[".nl"].write_text("g3 of another program")
    with pytest.raises(OutputError, match="nlp-gait did not write it"):
        export_nl(toy(corner), tmp_path, {})


@pytest.mark.program(ASL)
def test_the_ampl_solver_library_evaluates_a_gait_alike(tmp_path: Path) -> None:
    problem: GaitProblem = load("nao-dsp", intervals=4)
    path = export_nl(problem, tmp_path, {})[0]
    subprocess.run([ASL, str(path)], check=True, capture_output=True, timeout=60)
    found = json.loads(path.with_suffix(".json").read_text())["initial evaluations"]
    model = build_nlp(problem)
    width = model.widths[-1]
    w = model.start(problem, (problem.lower + problem.upper) / 2, width)
    nlp = ca.Function("nlp", [model.nlp["x"], model.nlp["p"]], [model.nlp["f"], model.nlp["g"]])
    f, g = nlp(w, np.append(problem.p, width))
    assert found["objective function"]["0"]["value"] == pytest.approx(float(f), rel=1e-12)
    rows = [found["constraints"][str(i)] for i in range(len(g.full()))]
    np.testing.assert_allclose(rows, g.full().ravel(), rtol=1e-11, atol=1e-11)
