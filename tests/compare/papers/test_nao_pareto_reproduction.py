"""The reproduction of the paper of 2025 from end to end with few runs, its measures and its claims."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from compare.papers.claims import ClaimVerdict
from compare.papers.nao_pareto import nao_pareto_reproduction
from compare.papers.nao_pareto.nao_pareto_claims import Measures, ParetoFindings, PhaseFronts, spread_evenly
from compare.papers.nao_pareto.nao_pareto_reproduction import REPRODUCTION
from compare.papers.nao_pareto.nao_pareto_runs import ALGORITHMS, PHASES, ParetoEffort, choose_looks
from compare.papers.paper_runs import Runner
from tests.compare.papers.finished import Finished, check_report, recompute, reproduce


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Finished]:
    """The least work: single support is computed, and stands for double support as well."""
    real = nao_pareto_reproduction._run_phase

    def run_first(runner: Runner, phase: str, effort: ParetoEffort) -> PhaseFronts:
        if phase == PHASES[0]:
            known.append(real(runner, phase, effort))
        return replace(known[-1], problem=replace(known[-1].problem, name=phase))

    known: list[PhaseFronts] = []
    folder, drawn = tmp_path_factory.mktemp("nao-pareto"), ("running-nao-ssp", "fronts-nao-ssp")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nao_pareto_reproduction, "_run_phase", run_first)
        yield reproduce("nao-pareto", folder, coarse=True, drawn=drawn, intervals=3)


@pytest.mark.slow
def test_the_report_contains_every_table_and_figure(finished: Finished) -> None:
    phases = ("nao-ssp", "nao-dsp")
    tables = [f"{table}-{phase}" for table in ("ends", "constraints", "running") for phase in phases]
    check_report(
        finished,
        "running-nao-ssp fronts-nao-ssp running-nao-dsp fronts-nao-dsp",
        " ".join(["claims", "differences", "fronts", *tables]),
    )
    assert all(claim.text in finished.report for claim in REPRODUCTION.check_claims(finished.findings).values())
    assert all(
        len(phase.runs) == len(ALGORITHMS) and all(map(len, phase.runs.values())) for phase in finished.findings.phases
    )


@pytest.mark.slow
def test_no_point_of_a_search_betters_the_true_front(finished: Finished) -> None:
    findings = finished.findings
    for phase in findings.phases:
        assert phase.answer.least_gap > -1e-6 and phase.answer.infeasible == 0
        front = np.array([(p.value, p.power_W) for p in phase.front])
        assert np.all(np.diff(front, axis=0) > 0.0)
        for measures in phase.measures.values():
            assert np.all((measures.hypervolume >= 0.0) & (measures.hypervolume < 1.0))
            assert np.all(measures.igd > 0.0) and np.all(measures.time_s >= measures.objective_time_s)


@pytest.mark.slow
def test_a_second_call_computes_only_what_is_missing(finished: Finished) -> None:
    path = finished.folder / "store" / "nao-ssp-cmoead-200-00.json"
    stored = path.read_text()
    path.unlink()
    assert recompute(finished) == ["nao-ssp-cmoead-200-00", "figures, tables and report"]
    again, before = (re.sub(r'"(objective_)?time_s": [\d.e-]+', "", text) for text in (path.read_text(), stored))
    assert again.partition('"result_sha256"')[0] == before.partition('"result_sha256"')[0]


def list_verdicts(findings: ParetoFindings) -> list[str]:
    return [claim.verdict for claim in REPRODUCTION.check_claims(findings).values()]


@pytest.mark.slow
def test_verdicts_follow_from_the_numbers(finished: Finished) -> None:
    """Made-up measures in which every claim about the searches holds, and then none."""
    findings = finished.findings

    def made(order: tuple[str, ...], dear: str, infeasible: str, early: str) -> ParetoFindings:
        phases = []
        for phase in findings.phases:
            measures = {}
            for place, name in enumerate(order):
                rows = np.linspace(0.0, 1e-3, 11)[:, None]
                volume = np.array([0.5 + 0.3 * (name == early) - 0.01 * place, 0.99 - 0.01 * place]) + rows
                measures[name, 1000] = Measures(
                    evaluations=np.array([100.0, 1000.0]),
                    hypervolume=volume,
                    igd=1.0 - volume,
                    feasible=0.5 - 0.2 * (name == infeasible) + rows[:, 0],
                    first_feasible=np.full(11, 3.0),
                    time_s=1.0 + (name == dear) + rows[:, 0],
                    objective_time_s=np.zeros(11),
                )
            copy = replace(phase)
            copy.__dict__.update(measures=measures, budgets=(1000,))
            phases.append(copy)
        return replace(findings, phases=tuple(phases))

    right = made(("NSGA2", "CMOPSO", "DCNSGA3", "CMOEAD"), "CMOEAD", "DCNSGA3", "CMOPSO")
    assert list_verdicts(right)[:-1] == [ClaimVerdict.HOLDS] * 7
    wrong = made(("DCNSGA3", "CMOEAD", "NSGA2", "CMOPSO"), "NSGA2", "CMOPSO", "NSGA2")
    assert list_verdicts(wrong)[:-1] == [ClaimVerdict.FAILS] * 7


def test_distances_are_measured_from_points_evenly_along_the_front() -> None:
    """Points that crowd in a corner move none of them."""
    plain = np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]])
    crowded = np.insert(plain, 1, [[0.0, y] for y in (0.03, 0.02, 0.01)], axis=0)
    np.testing.assert_allclose(spread_evenly(crowded), spread_evenly(plain), atol=1e-12)
    np.testing.assert_allclose(
        np.hypot(*np.diff(spread_evenly(plain), axis=0).T).max(), 2 / (len(spread_evenly(plain)) - 1), rtol=1e-9
    )


def test_looks_are_whole_generations_and_end_with_the_budget() -> None:
    for budget in (100, 200, 10_000, 100_000):
        looks = choose_looks(budget)
        assert looks == sorted(set(looks)) and looks[0] == 100 and looks[-1] == budget
        assert all(look % 100 == 0 for look in looks)
