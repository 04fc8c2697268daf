"""The exported NLP: built by its own build line, called from C, equal to CasADi's functions and derivatives."""

import os
import shutil
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.export.solver import export_solver


@pytest.mark.skipif(not (shutil.which("c++") and shutil.which("cc")), reason="no C and C++ compiler")
@pytest.mark.parametrize("flags", ["", "-DLANES=1"])
def test_the_example_in_c_finds_casadis_numbers(tmp_path: Path, flags: str) -> None:
    problem = nlp_gait.load("walk12", quadrature="simpson")
    written = export_solver(problem, tmp_path)
    assert {file.name for file in written} == {"walk12_nlp.cpp", "walk12_nlp.h", "main.c", "build.sh"}
    header = (tmp_path / "walk12_nlp.h").read_text()
    assert "@" not in header and all(f"{v.name} [{v.unit}]" in header for v in problem.variables)
    environment = {**os.environ, "CXXFLAGS": flags}
    subprocess.run(["sh", str(tmp_path / "build.sh")], check=True, capture_output=True, timeout=300, env=environment)
    done = subprocess.run([str(tmp_path / "main")], check=True, capture_output=True, text=True, timeout=60)
    f, violation, slope, curvature, apart = (float(line[29:].split(",")[0]) for line in done.stdout.splitlines())

    model = build_nlp(problem)
    nlp, width = model.nlp, model.widths[-1]
    w, p = model.start(problem, (problem.lower + problem.upper) / 2, width), np.append(problem.p, width)
    total, x = nlp["f"] + ca.sum1(nlp["g"]), nlp["x"]
    wanted = [nlp["f"], nlp["g"], ca.sum1(ca.gradient(nlp["f"], x)), ca.sum1(ca.sum2(ca.hessian(total, x)[0]))]
    expected = [value.full().ravel() for value in ca.Function("expected", [x, nlp["p"]], wanted)(w, p)]
    bounds = model.bounds(problem)
    excess = np.maximum(bounds["lbg"] - expected[1], expected[1] - bounds["ubg"]).max(initial=0.0)
    assert [f, slope, curvature] == pytest.approx([expected[0][0], expected[2][0], expected[3][0]], rel=1e-9)
    assert violation == pytest.approx(excess, rel=1e-9, abs=1e-12) and apart < 1e-3
