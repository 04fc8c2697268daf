"""The reproduction of the paper of 2025 from end to end with few runs, its measures and its claims."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compare.papers.nao_pareto import nao_pareto_reproduction as nao_pareto
from compare.papers.nao_pareto import report as pareto_report
from compare.papers.nao_pareto.nao_pareto_claims import FAILS, HOLDS, claims
from compare.papers.nao_pareto.nao_pareto_findings import Findings, Measured, evenly
from compare.papers.nao_pareto.nao_pareto_runs import ALGORITHMS, Effort, looks_of
from compare.report.document import Document

SMALL = Effort(runs=1, budgets=(200,), points=5, starts=1, intervals=4)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Findings, list[str]]:
    """Folder, findings and notes of a finished reproduction."""
    out = tmp_path_factory.mktemp("nao-pareto")
    kept: list[Findings] = []
    told: list[str] = []

    def document(findings: Findings) -> Document:
        kept.append(findings)
        return pareto_report.document(findings)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nao_pareto, "document", document)
        nao_pareto.reproduce(out, progress=told.append, effort=SMALL)
    return out, kept[0], told


@pytest.mark.slow
def test_everything_is_there_and_in_the_report(done: tuple[Path, Findings, list[str]]) -> None:
    out, findings, _ = done
    report = (out / "report.md").read_text()
    assert "{" not in report and "nan" not in report
    figures = re.findall(r"\((\S+)\.png\)", report)
    assert figures == ["running-nao-ssp", "fronts-nao-ssp", "running-nao-dsp", "fronts-nao-dsp"]
    assert all((out / f"{name}.{kind}").stat().st_size > 1000 for name in figures for kind in ("png", "svg"))
    tables = ("claims", "fronts", "ends-nao-ssp", "constraints-nao-dsp", "running-nao-ssp")
    assert all(len((out / f"{table}.csv").read_text().splitlines()) > 1 for table in tables)
    assert all(claim.text in report for claim in claims(findings))
    assert all(len(phase.runs) == len(ALGORITHMS) * SMALL.runs for phase in findings.phases)


@pytest.mark.slow
def test_no_point_of_a_search_betters_the_true_front(done: tuple[Path, Findings, list[str]]) -> None:
    _, findings, _ = done
    for phase in findings.phases:
        assert phase.answer.least_excess > -1e-6 and phase.answer.infeasible == 0
        front = np.array([(p.value, p.power_W) for p in phase.front])
        assert np.all(np.diff(front, axis=0) > 0.0)
        for measured in phase.measured.values():
            assert np.all((measured.hypervolume >= 0.0) & (measured.hypervolume < 1.0))
            assert np.all(measured.igd > 0.0) and np.all(measured.time_s >= measured.objective_time_s)


@pytest.mark.slow
def test_a_second_call_makes_no_run_again(done: tuple[Path, Findings, list[str]]) -> None:
    out, _, _ = done
    lost = out / "store" / "nao-dsp-cmoead-200-00.json"
    kept = lost.read_text()
    lost.unlink()
    told: list[str] = []
    nao_pareto.reproduce(out, progress=told.append, effort=SMALL)
    made = [note for note in told if "stored by an earlier run" not in note]
    assert made == ["nao-dsp-cmoead-200-00", "figures, tables and report"]
    found, before = (re.sub(r'"(objective_)?time_s": [\d.e-]+', "", text) for text in (lost.read_text(), kept))
    assert found.partition('"result_sha256"')[0] == before.partition('"result_sha256"')[0]


@pytest.mark.slow
def test_verdicts_follow_from_the_numbers(done: tuple[Path, Findings, list[str]]) -> None:
    """Made-up measures in which every claim about the searches holds, and then none."""
    _, findings, _ = done

    def made(order: tuple[str, ...], dear: str, infeasible: str, early: str) -> Findings:
        phases = []
        for phase in findings.phases:
            measured = {}
            for place, name in enumerate(order):
                rows = np.linspace(0.0, 1e-3, 11)[:, None]
                volume = np.array([0.5 + 0.3 * (name == early) - 0.01 * place, 0.99 - 0.01 * place]) + rows
                measured[name, 1000] = Measured(
                    algorithm=name,
                    budget=1000,
                    evaluations=np.array([100.0, 1000.0]),
                    hypervolume=volume,
                    igd=1.0 - volume,
                    feasible=0.5 - 0.2 * (name == infeasible) + rows[:, 0],
                    first_feasible=np.full(11, 3.0),
                    time_s=1.0 + (name == dear) + rows[:, 0],
                    objective_time_s=np.zeros(11),
                )
            copy = replace(phase)
            copy.__dict__.update(measured=measured, budgets=(1000,))
            phases.append(copy)
        return replace(findings, phases=tuple(phases))

    right = made(("NSGA2", "CMOPSO", "DCNSGA3", "CMOEAD"), "CMOEAD", "DCNSGA3", "CMOPSO")
    assert [claim.verdict for claim in claims(right)][:-1] == [HOLDS] * 7
    wrong = made(("DCNSGA3", "CMOEAD", "NSGA2", "CMOPSO"), "NSGA2", "CMOPSO", "NSGA2")
    assert [claim.verdict for claim in claims(wrong)][:-1] == [FAILS] * 7


def test_distances_are_measured_from_points_evenly_along_the_front() -> None:
    """Points that crowd in a corner move none of them."""
    plain = np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]])
    crowded = np.insert(plain, 1, [[0.0, y] for y in (0.03, 0.02, 0.01)], axis=0)
    np.testing.assert_allclose(evenly(crowded), evenly(plain), atol=1e-12)
    np.testing.assert_allclose(
        np.hypot(*np.diff(evenly(plain), axis=0).T).max(), 2 / (len(evenly(plain)) - 1), rtol=1e-9
    )


def test_looks_are_whole_generations_and_end_with_the_budget() -> None:
    for budget in (100, 200, 10_000, 100_000):
        looks = looks_of(budget)
        assert looks == sorted(set(looks)) and looks[0] == 100 and looks[-1] == budget
        assert all(look % 100 == 0 for look in looks)
