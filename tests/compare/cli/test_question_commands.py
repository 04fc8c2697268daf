"""`pareto` and `certainty` as scripts use them, Ctrl-C where questions are answered, and a linear solver that is not there."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from compare.questions import prices, robust_gait, variants
from compare.questions.pareto import front as pareto_front
from nlp_gait.backends.solvers.solver import IterationWatch
from tests.compare.cli.calls import nlp_gait, one_sentence

pytestmark = pytest.mark.usefixtures("coarse_pictures")

# Three free variables, so that both the front and a search of one generation take no time.
SMALL = ["nao-ssp", "--set", "intervals=4", "--starts", "1", "--seed", "0"]
FIXED = {
    "hip_height_m": 0.31,
    "hip_vz_start_m_s": -0.00122,
    "hip_vz_end_m_s": 0.0035,
    "hip_vx_start_m_s": 0.01243,
    "hip_vx_end_m_s": 0.001,
    "swing_height_m": 0.015,
}
PARETO = ["pareto", *SMALL, "--points", "5", *(f"--set={name}={value}" for name, value in FIXED.items())]
CERTAINTY = ["certainty", "walk12", "--starts", "4", "--evaluations", "0"]


def test_pareto_prints_one_object_and_writes_its_files(tmp_path: Path) -> None:
    done = nlp_gait(*PARETO, "--against", "speed", "--search", "NSGA2=100", "--runs", "1", "--out", tmp_path, "--json")
    data = json.loads(done.stdout)
    powers = [point["power_W"] for point in data["front"]]
    assert len(powers) >= 4 and powers == sorted(powers)
    assert data["criterion"] == {"name": "speed", "unit": "m/s"}
    assert [(row["solver"], row["budget"], row["runs"]) for row in data["searches"]] == [("NSGA2", 100, 1)]
    written = {Path(file).name for file in data["files"]}
    assert written >= {"nao-ssp-front-speed.csv", "nao-ssp-pareto-speed.json"}
    assert all(Path(file).stat().st_size > 0 for file in data["files"])
    again = nlp_gait(
        *PARETO, "--against", "speed", "--search", "NSGA2=100", "--runs", "1", "--out", tmp_path
    )  # from its stored results
    assert "price" in again.stdout and " W per m/s " in again.stdout and "wrote " in again.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--against", "dbm_z"], ["unknown objective next to power 'dbm_z'", "dbm_y_mean"]),
        (["--search", "NSGA2"], ["--search takes NAME=BUDGET,BUDGET", "'NSGA2'"]),
        (["--search", "NSGA3=100"], ["Known: NSGA2, CMOPSO", "'NSGA3'"]),
        (["--search", "NSGA2=10"], ["at least the population of 100", "[10]"]),
    ],
)
def test_pareto_refuses_in_one_sentence_before_the_work(arguments: list[str], words: list[str], tmp_path: Path) -> None:
    error = one_sentence(*PARETO, *arguments, "--out", tmp_path)
    for word in words:
        assert word in error
    assert not list(tmp_path.rglob("*.json"))


def test_certainty_prints_one_object_and_writes_its_files(tmp_path: Path) -> None:
    done = nlp_gait(*CERTAINTY, "--time-limit", "0", "--out", tmp_path, "--json")
    data = json.loads(done.stdout)
    assert data["optima"][0]["objective"] == pytest.approx(0.970839, rel=1e-5)
    assert sum(data["statuses"].values()) == 4 and data["certificate"] is None
    assert (tmp_path / "walk12-certainty.json").as_posix() in data["files"]
    assert data["best_known"] == pytest.approx(0.970835, rel=1e-5)
    assert data["best_known_source"] == "shipped, proven to six digits"
    page = (tmp_path / "walk12-certainty.md").read_text()
    assert "Best known value: 0.970835 (shipped, proven to six digits)" in page
    assert "{Goswami2008," in page.split("How to cite")[1]
    assert all(Path(file).stat().st_size > 0 for file in data["files"])


def test_a_certificate_without_time_for_a_finite_bound_says_so(tmp_path: Path) -> None:
    done = nlp_gait(*CERTAINTY, "--time-limit", "1e-9", "--out", tmp_path)
    assert "Proven: nothing: the time limit was reached before a finite bound" in done.stdout
    data = json.loads((tmp_path / "walk12-certainty.json").read_text())
    assert data["certificate"]["bound"] is None and data["certificate"]["closed"] is False


def test_a_linear_solver_that_is_not_there_is_refused() -> None:
    try:
        error = one_sentence("solve", "walk12", "--starts", "1", "--linear-solver", "ma57")
    except AssertionError:
        assert "with ma57" in nlp_gait("solve", "walk12", "--starts", "1", "--linear-solver", "ma57").stdout
        pytest.skip("ma57 is installed here")
    assert "linear solver 'ma57' does not run in this installation" in error and "leave linear_solver out" in error


def test_solve_takes_any_nlp_solver_by_name(tmp_path: Path) -> None:
    out = tmp_path / "best.json"
    shown = nlp_gait("solve", "walk12", "--starts", "1", "--solver", "slsqp", "--out", out).stdout
    written = json.loads(out.read_text())
    assert "; slsqp\n" in shown and written["solver"] == "slsqp" and written["linear_solver"] == ""
    assert written["claimed"] and written["active_constraints"] == []
    assert "unknown NLP solver 'simplex'" in one_sentence("solve", "walk12", "--solver", "simplex")


def press(*_: object, **__: object) -> None:
    signal.raise_signal(signal.SIGINT)


def pressed_in_call(number: int, function: Callable[..., object]) -> Callable[..., object]:
    """The function, with Ctrl-C in place of one of its calls."""
    count = 0

    def counted(*arguments: object, **named: object) -> object:
        nonlocal count
        count += 1
        return press() if count == number else function(*arguments, **named)

    return counted


def test_ctrl_c_within_an_iteration_of_a_front_keeps_the_stored_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[str] = []
    evaluate = IterationWatch.eval

    def counted(watch: IterationWatch, arguments: object) -> object:
        if begun:
            press()
        return evaluate(watch, arguments)

    ends = pareto_front._solve_ends

    def found(*arguments: object, **named: object) -> object:
        result = ends(*arguments, **named)  # type: ignore[arg-type]
        begun.append("front")
        return result

    monkeypatch.setattr(IterationWatch, "eval", counted)
    monkeypatch.setattr(pareto_front, "_solve_ends", found)
    steps = tmp_path / "store"
    steps.mkdir()
    (steps / "earlier.json").write_text("{}")
    error = one_sentence(*PARETO, "--search", "none", "--out", tmp_path, status=130)
    kept = [path.name.partition("-")[0] for path in steps.iterdir()]
    assert kept.count("solve") == 4 and len(kept) == 5  # both ends of the front
    assert (
        error == f"nlp-gait: interrupted; 5 finished results are stored in {tmp_path}; rerun the command to continue\n"
    )


def test_ctrl_c_in_variants_writes_the_finished_variants(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(variants, "solve", pressed_in_call(2, variants.solve))
    done = nlp_gait(
        *("variants", "nao-ssp", "--over", "motors", "--set", "intervals=3", "--starts", "1", "--out", tmp_path),
        status=130,
    )
    assert (
        f"interrupted after 1 of 8 variants; the results are in {tmp_path}; rerun the command to continue\n"
        in done.stderr
    )
    assert len((tmp_path / "nao-ssp-variants.csv").read_text().splitlines()) == 2


def test_ctrl_c_before_the_first_result_counts_the_stored_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "solve-1.json").write_text("{}")
    for module in (variants, robust_gait):
        monkeypatch.setattr(module, "solve", press)
    monkeypatch.setattr(prices, "Continuation", press)
    out = ["--out", tmp_path]
    kept = f"finished results are stored in {tmp_path}; rerun the command to continue\n"
    assert f"after 0 of 8 variants; 1 {kept}" in one_sentence("variants", "--over", "motors", *out, status=130)
    assert f"interrupted; 1 {kept}" in one_sentence("robust", *out, status=130)
    assert f"interrupted; 1 {kept}" in one_sentence("prices", "walk12", *out, status=130)
    assert [path.name for path in tmp_path.iterdir()] == ["store"]
