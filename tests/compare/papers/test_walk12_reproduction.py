"""The quick reproduction of the 12-joint walk, and its paper data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import SimpleNamespace

import pytest

from compare.judge import evaluate
from compare.papers.claims import ClaimVerdict
from compare.papers.walk12 import walk12_runs
from compare.papers.walk12.walk12_paper import CHANGES, F1MAX, PAPER, SHARES, TABLE_3, TABLE_4
from compare.papers.walk12.walk12_reproduction import REPRODUCTION
from compare.study.record import read_record
from nlp_gait.formulation import GaitProblem
from tests.compare.papers.finished import Finished, check_report, recompute, reproduce
from tests.compare.papers.walk12_readings import (
    compute_corner_slopes,
    compute_f1_variants,
    compute_hip_miss,
    compute_shares,
    is_rounding,
)


def evaluate_only(problem: GaitProblem, x0: Sequence[float]) -> SimpleNamespace:
    """Stand in for a solve."""
    return SimpleNamespace(objective=evaluate(problem, x0, prove=False).objective["value"])


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Finished]:
    """The least of the quick reproduction: one start, one run.

    With the paper's integration step our optimum is evaluated, not solved again.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(walk12_runs, "solve", evaluate_only)
        patch.setitem(vars(REPRODUCTION), "quick", replace(REPRODUCTION.quick, starts=1, runs=1))
        drawn = ("tradeoff", "fig08", "fig12-13")
        yield reproduce("walk12", tmp_path_factory.mktemp("walk12"), coarse=True, drawn=drawn)


def test_f1_that_table_4_implies() -> None:
    assert [round(row.implied_f1) for row in TABLE_4] == [1139, 726, 277, 164]


def test_the_report_contains_every_table_and_figure(finished: Finished) -> None:
    check_report(
        finished,
        "tradeoff fig08 fig09 fig10 fig12-13 fig14-15 fig16-17 circle",
        "claims differences table3-paper table3-model table4 gaits readings quadrature second-optima walk-straight "
        "walk-circle",
    )


def test_numbers_in_the_texts_are_those_of_our_model() -> None:
    known = [compute_f1_variants(row.x) for row in TABLE_3]
    texts = str(REPRODUCTION.printed)
    for name, printed in CHANGES.items():
        ends = [f1[name] if name.endswith("mm") else 100 * (f1[name] / f1["ours"] - 1) for f1 in known]
        assert printed == (round(min(ends), 2), round(max(ends), 2)), name
    assert {name: round(share, 1) for name, share in compute_shares().items()} == SHARES
    assert round(1e3 * compute_hip_miss()) == PAPER.hip_miss_mm and compute_hip_miss(0.308) < 1e-9
    slopes = compute_corner_slopes()
    assert all(f"{slopes[name]:+.3f} per m" in texts for name in ("foot_lift_m", "bending_height_m"))
    assert f"{sum(map(is_rounding, TABLE_3))} of 7" in texts


def test_claims_are_decided_by_sizes(finished: Finished) -> None:
    claims = {row["claim"]: row for row in finished.rows("claims")}
    assert len(claims) >= 10 and set(row["verdict"].partition(" (")[0] for row in claims.values()) <= set(ClaimVerdict)
    assert claims["The largest f1: IPOPT's optimum"]["verdict"].startswith("does not hold (printed 442.5, here 470")
    assert claims["Time steps in one generation"]["verdict"] == "holds"
    assert claims["Walking becomes slower with higher stability margin"]["verdict"] == "holds"


def test_printed_numbers_alone_contradict_optimality(finished: Finished) -> None:
    (row,) = (row for row in finished.rows("claims") if "by the printed numbers and (11) alone" in row["claim"])
    assert (
        row["verdict"] == "does not hold" and "at λ = 0.1 that of 0.15 has 0.977 (printed 0.944)" in row["found here"]
    )
    ratios = [(r.f - (1 - r.weight) * r.x[0] / 0.13) / r.weight for r in TABLE_3]
    assert 0.1 * ratios[1] + 0.9 * TABLE_3[1].x[0] / 0.13 == pytest.approx(0.977, abs=5e-4)


def test_the_effect_of_the_quadrature_is_a_number(finished: Finished) -> None:
    rows = {float(row["lambda"]): row for row in finished.rows("quadrature")}
    ours, printed_step, simpson, exact = list(rows[0.9].values())[1::2][:1] + list(rows[0.9].values())[3:6]
    assert float(printed_step) == pytest.approx(float(ours), abs=2e-5)
    assert float(simpson) - float(exact) > 1e-4  # what IPOPT gains by Simpson's rule alone


def test_tables_agree_with_the_records(finished: Finished) -> None:
    records = finished.folder / "records"
    starts = [read_record(path) for path in (records / "table3-paper-1").glob("ipopt-*.json")]
    f1max = max(record.verdict.objective for record in starts)
    assert float(finished.rows("table3-paper")[-1]["IPOPT"]) == f1max and len(starts) == REPRODUCTION.quick.starts
    # The second normalisation is the first one's largest f1: f of the most stable gait is 1.
    model = [read_record(path) for path in (records / "table3-model-1").glob("ipopt-*.json")]
    assert model[0].definition["problem"]["parameters"]["f1max"] == f1max * F1MAX
    assert max(record.verdict.objective for record in model) == pytest.approx(1.0, abs=1e-6)


def test_a_second_call_computes_only_what_is_missing(finished: Finished) -> None:
    first = finished.folder / "records" / f"table3-paper-{TABLE_3[1].weight:g}" / "ga-0000.json"
    path = finished.folder / "store" / "front.json"
    stored = read_record(first), path.read_text()
    first.unlink()
    path.unlink()
    assert recompute(finished) == ["table3-paper-0.15, ga 0", "front", "figures, tables and report"]
    assert (read_record(first).x, path.read_text()) == (stored[0].x, stored[1])
