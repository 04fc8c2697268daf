"""The reproduction of the NAO paper: from end to end with few runs, and its parts."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import nlp_gait
from compare.papers.nao import report as nao_report
from compare.papers.nao import reproduce as nao
from compare.papers.nao.claims import claims
from compare.papers.nao.findings import Findings, Points, sweep_values
from compare.papers.nao.paper import DSP, PHASES, SSP
from compare.papers.nao.runs import judged, power_with_legs_twice, search
from compare.papers.nao.tables import implied_a12
from compare.study import parallel
from nlp_gait.errors import OutputError

RUNS, STARTS = 3, 2


def quick_sweep(problem: str, variable: str, values: list[float], starts: int) -> list[dict[str, Any]]:
    """What IPOPT's sweeps look like, without their cost: power falls with height and time."""
    falling = variable in ("hip_height_m", "single_support_time_s", "double_support_time_s")
    best = 0.5319 if problem == "nao-dsp" else 0.8459
    power = best * (np.linspace(2.0, 1.0, len(values)) if falling else np.linspace(1.0, 1.05, len(values)))
    return [
        {"at": at, "power_W": p, "feasible": True, "status": "converged", "x": []}
        for at, p in zip(values, power.tolist(), strict=True)
    ]


def coarse_save(figure: Figure, stem: Path) -> None:
    """Drawn in full, but of few pixels."""
    figure.savefig(stem.with_name(f"{stem.name}.png"), dpi=30)


@pytest.fixture(scope="module")
def small() -> Iterator[pytest.MonkeyPatch]:
    """Few runs, in this process, without sweeps."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {"RUNS": RUNS, "EVALUATIONS": 1000, "STARTS": STARTS, "LEVER_STARTS": 1}.items():
            patch.setattr(nao, name, value)
        patch.setattr(nao, "sweep", quick_sweep)
        patch.setattr(parallel, "default_jobs", lambda: 1)
        patch.setattr(nao, "save", coarse_save)
        yield patch


@pytest.fixture(scope="module")
def done(small: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Findings]:
    """Folder and findings of a finished reproduction."""
    out = tmp_path_factory.mktemp("nao")
    kept: list[Findings] = []

    def write_report(folder: Path, findings: Findings) -> None:
        kept.append(findings)
        nao_report.write_report(folder, findings)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nao, "write_report", write_report)
        nao.reproduce(out, progress=lambda note: None)
    return out, kept[0]


def test_everything_is_there_and_in_the_report(done: tuple[Path, Findings]) -> None:
    out, _ = done
    report = (out / "report.md").read_text()
    assert "{" not in report and "nan" not in report
    figures = re.findall(r"\((\S+)\.png\)", report)
    assert figures[:7] == ["fig09", "fig10", "fig11", "fig12", "fig13", "fig14", "fig20a"]
    assert figures[7:] == ["swing-height", "fig15", "fig16", "fig17", "fig18", "fig19", "fig20b"]
    for name in figures:
        assert (out / f"{name}.png").stat().st_size > 0
    for table in ("table6", "table7", "table7-swing-heights", "table8", "table9", "rank-sum-tests", "power-gap"):
        assert (out / f"{table}.md").read_text().strip() in report
        assert (out / f"{table}.csv").exists()


def test_every_feasible_solution_is_kept(done: tuple[Path, Findings]) -> None:
    out, findings = done
    problem = nlp_gait.load("nao-dsp")
    with np.load(out / "points" / "nao-dsp-ga-02.npz") as archive:
        x, power = archive["x"], archive["power_W"]
    f, violation = nlp_gait.compile_objective(problem)(x)
    assert len(x) > 100 and np.all(violation == 0.0)
    np.testing.assert_allclose(f, power, rtol=1e-12)
    assert power.min() == pytest.approx(findings.dsp.searches["ga"][2]["power_W"], rel=1e-9)


def test_paired_runs_start_alike(done: tuple[Path, Findings]) -> None:
    _, findings = done
    for phase in findings.phases:
        for pso, ga in zip(phase.searches["pso"], phase.searches["ga"], strict=True):
            assert pso["history_W"][0] == ga["history_W"][0]


def test_interrupted_and_started_again_it_continues(
    done: tuple[Path, Findings], small: pytest.MonkeyPatch, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, _ = done
    report = (out / "report.md").read_text()
    (out / "steps" / "nao-ssp-pso-01.json").write_text('{"inputs": ')  # torn by a crash
    (out / "points" / "nao-dsp-ga-00.npz").unlink()
    (out / "steps" / "nao-dsp-ipopt-01.json").unlink()
    again: list[str] = []

    def counted(**arguments: Any) -> Any:
        again.append(f"{arguments['problem']}-{arguments['algorithm']}-{arguments['seed']:02d}")
        return search(**arguments)

    counted.__module__ = search.__module__  # it is the same code for the steps
    monkeypatch.setattr(nao, "search", counted)
    monkeypatch.setattr(nao.figures, "all_figures", lambda findings: iter(()))  # the slow part, seen above
    stopped: list[str] = []

    def stop_early(note: str) -> None:
        stopped.append(note)
        if len(stopped) == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        nao.reproduce(out, progress=stop_early)
    assert again == ["nao-ssp-pso-01"]
    nao.reproduce(out, progress=lambda note: None)
    assert again == ["nao-ssp-pso-01", "nao-dsp-ga-00"]
    ran_anew = json.loads((out / "steps" / "nao-dsp-ipopt-01.json").read_text())
    assert ran_anew["result"]["success"]
    times = re.compile(r"\d+\.\d\d \|$", re.MULTILINE)  # all else is repeated to the last digit
    assert times.sub("", (out / "report.md").read_text()) == times.sub("", report)


def test_progress_is_told_as_often_as_announced() -> None:
    jobs = len(PHASES) * (2 * 11 + 20) + 5
    sweeps = 2 + 9 + 8
    assert jobs + sweeps + 1 == 109
    assert nao.STEPS == 109


def test_a_folder_that_cannot_be_written_to_fails_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        nao.reproduce(tmp_path / "file", progress=print)


def verdict(findings: Findings, start: str) -> str:
    (found,) = [claim.verdict for claim in claims(findings) if claim.text.startswith(start)]
    return found


def test_claims_follow_the_numbers(done: tuple[Path, Findings]) -> None:
    _, findings = done
    ssp = findings.ssp
    assert verdict(findings, "A higher hip saves power in single").startswith("holds in our model by 50 %")
    assert verdict(findings, "Slower saves power in double") == "holds in our model by a factor of 2.0"
    assert verdict(findings, "Beyond 0.024 m") == "does not hold"
    assert verdict(findings, "For some durations") == "does not hold"

    runs = [{**ssp.searches["pso"][0], "power_W": power} for power in (0.85, 0.86, 0.87, 0.88, 0.89)]
    worse = [{**run, "power_W": run["power_W"] + 0.1} for run in runs]
    pso_wins = replace(findings, ssp=replace(ssp, searches={"pso": runs, "ga": worse}))
    ga_wins = replace(findings, ssp=replace(ssp, searches={"pso": worse, "ga": runs}))
    assert verdict(pso_wins, "PSO is better than GA in single").startswith("holds in our model by 11.49 %")
    assert verdict(ga_wins, "PSO is better than GA in single") == "does not hold"

    rising = [{**point, "power_W": 3.0 - point["power_W"]} for point in ssp.sweeps[0]]
    dear = replace(findings, ssp=replace(ssp, sweeps={**ssp.sweeps, 0: rising}))
    assert verdict(dear, "A higher hip saves power in single") == "does not hold"

    gap = [{**point, "feasible": k != 3} for k, point in enumerate(findings.dsp.sweeps[DSP.duration])]
    broken = replace(findings, dsp=replace(findings.dsp, sweeps={**findings.dsp.sweeps, DSP.duration: gap}))
    assert verdict(broken, "For some durations") == "holds"


def test_infeasible_runs_rank_last(done: tuple[Path, Findings]) -> None:
    ssp = done[1].ssp
    runs = [
        {**ssp.searches["pso"][0], "power_W": p, "feasible": ok} for p, ok in ((0.1, False), (0.9, True), (0.8, True))
    ]
    phase = replace(ssp, searches={"pso": runs, "ga": runs})
    assert phase.final_powers("pso") == [float("inf"), 0.9, 0.8]
    assert phase.median_run("pso") == 1


def test_the_remark_on_the_gap_is_computed() -> None:
    """Verified values of the paper's solutions, and the power with the legs' mechanical term counted twice."""
    here, twice = [], []
    for phase in PHASES:
        problem = nlp_gait.load(phase.problem)
        here += [judged(problem, optimum.x)["power_W"] for optimum in phase.optima.values()]
        twice += [power_with_legs_twice(problem, optimum.x) for optimum in phase.optima.values()]
    assert here == pytest.approx([0.866844, 0.891966, 0.626506, 0.626492], abs=2e-6)
    assert twice == pytest.approx([1.306, 1.355, 1.084, 1.084], abs=5e-4)


def test_effect_size_of_the_printed_rank_sums(done: tuple[Path, Findings]) -> None:
    eleven = [{}] * 11
    found = [implied_a12(replace(done[1].ssp, paper=paper, searches={"pso": eleven})) for paper in (SSP, DSP)]
    assert found == pytest.approx([117 / 121, 97 / 121])  # W = 66 would be a win in all 121 pairs


def test_reading_a_history_and_choosing_where_to_sweep() -> None:
    points = Points(
        x=np.array([[0.0], [0.1], [0.1004], [1.0]]),
        power_W=np.array([1.0, 3.0, 2.0, 1.01]),
        run=np.array([0.0, 0.0, 1.0, 1.0]),
    )
    assert points.cheapest_near(0, 0.1, 0.0005) == 2.0
    assert points.cheapest_near(0, 0.1, 0.0005, run=0) == 3.0
    assert np.isnan(points.cheapest_near(0, 0.5, 0.0005))
    dear = Points(x=np.array([[-1.0], [2.0]]), power_W=np.array([5.0, 5.0]), run=np.zeros(2))
    assert sweep_values({"pso": points, "ga": dear}, 0, 0.3, (3, 2)) == [-1.0, 0.0, 0.3, 0.5, 1.0, 2.0]
