"""The reproduction of the NAO paper: from end to end with few runs on few samples, and its parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import nlp_gait
from compare import judge
from compare.papers.nao import nao_figures, nao_runs
from compare.papers.nao.nao_findings import FeasiblePoints, NaoFindings, PhaseFindings, choose_sweep_values
from compare.papers.nao.nao_reproduction import REPRODUCTION, compute_implied_a12
from compare.papers.nao.nao_runs import DSP, PAPER, PHASES, SSP, FixedOptimum, evaluate_indexes
from compare.study.record import RunRecord, read_record
from compare.study.task import ProblemSpec
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.proofs.guarantee import Guarantee
from nlp_gait.simulation import mjcf
from nlp_gait.simulation import simulate as simulating
from tests.compare.papers.finished import Finished, check_report, recompute, reproduce
from tests.compare.papers.nao_geometry import compare_geometry
from tests.compare.papers.nao_readings import (
    compute_load_shares,
    compute_mean_margins,
    compute_power_with_legs_twice,
    compute_powers,
    compute_torque_changes_by_reading,
)
from tests.compare.papers.nao_torque_changes import compute_torque_changes


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """The least work; simulations, sweeps, choices, plots and proofs of one kind are computed once for all."""
    effort: dict[str, Any] = {
        "intervals": 3,
        "runs": 2,
        "variant_runs": 1,
        "more_runs": 1,
        "evaluations": 600,
        "starts": 1,
    }
    simulate, sweep, draw, prove = (
        nao_runs.simulate_solution,
        nao_runs.solve_sweep,
        nao_figures._draw_scatter,
        judge.guarantee,  # type: ignore[attr-defined]
    )
    draw_gait = nao_figures._draw_gait
    known, swept = dict[str, Any](), dict[str, Any]()

    def simulate_once(spec: ProblemSpec, x: Sequence[float]) -> dict[str, Any]:
        known[spec.title] = known.get(spec.title) or simulate(spec, x)
        return dict(known[spec.title])

    def sweep_once(spec: ProblemSpec, variable: str, values: Sequence[float], starts: int) -> list[dict[str, Any]]:
        if len(values) > 1 or spec.title not in swept:
            swept[spec.title] = sweep(spec, variable, values, starts)
            return list(swept[spec.title])
        return [{**swept[spec.title][-1], "at": values[0]}]

    def prove_ssp(problem: GaitProblem, x: Array) -> Guarantee:
        return prove(problem, x) if problem.name == "nao-ssp" else Guarantee(satisfied=None, reason="not tried")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judge, "guarantee", prove_ssp)
        patch.setattr(simulating, "SETTLE_TIME", 0.0)
        for module in (mjcf, simulating):
            patch.setattr(module, "TIME_STEP", 0.002)
        patch.setattr(nao_figures, "_draw_gait", lambda p: draw_gait(p) if p.problem.name == "nao-ssp" else Figure())
        patch.setattr(nao_runs, "simulate_solution", simulate_once)
        patch.setattr(nao_runs, "solve_sweep", sweep_once)
        patch.setattr(nao_figures, "_draw_scatter", lambda phase, at: draw(phase, at) if len(at) == 1 else Figure())
        for name in ("finite", "separate", "reach", "points"):
            patch.setitem(PAPER.choices, name, replace(PAPER.choices["held"], title=name))
        folder = tmp_path_factory.mktemp("nao")
        drawn = ("fig09", "fig13")
        return reproduce("nao", folder, coarse=True, drawn=drawn, **effort, choices=("lever",), sweep_points=(0, 0))


def test_the_report_contains_every_table_and_figure(finished: Finished) -> None:
    check_report(
        finished,
        "fig09 fig10 fig11 fig12 fig13 fig14 fig20a swing-height fig15 fig16 fig17 fig18 fig19 fig20b",
        "table6 table7 table7-swing-heights table8 table9 rank-sum-tests power-gap claims differences durations runs-nao-ssp "
        "runs-nao-dsp choices search-choices torque-changes simulations hip-nao-ssp hip-nao-dsp durations-nao-ssp "
        "durations-nao-dsp",
    )


def test_every_feasible_solution_is_stored(finished: Finished) -> None:
    findings = finished.findings
    with np.load(finished.folder / "store" / "points" / "nao-dsp-ga-01.npz") as archive:
        x, power = archive["x"], archive["power_W"]
    f, violation = nlp_gait.compile_objective(findings.dsp.problem)(x)
    assert len(x) > 20 and np.all(violation == 0.0)
    np.testing.assert_allclose(f, power, rtol=1e-12)
    assert power.min() == pytest.approx(findings.dsp.searches["ga"][1].verdict.objective, rel=1e-9)


def test_paired_runs_start_alike(finished: Finished) -> None:
    for phase in finished.findings.phases:
        for constant, pso, ga in zip(*phase.searches.values(), strict=True):
            assert constant.history.objective[0] == pso.history.objective[0] == ga.history.objective[0]
            assert (constant.settings["inertia_damping"], pso.settings["inertia_damping"]) == (1.0, 0.99)


def test_nothing_lies_below_ipopts_optimum(finished: Finished) -> None:
    """Neither where a search ends, nor an optimum with a variable held."""
    for phase in finished.findings.phases:
        assert min(phase.final_powers("pso") + phase.final_powers("ga")) > phase.best
        for sweep in phase.sweeps.values():
            assert all(held.power_W > phase.best * (1 - 1e-6) for held in sweep if held.feasible)


def test_an_interrupted_reproduction_continues(finished: Finished) -> None:
    record = finished.folder / "records" / "nao-ssp" / "pso-0001.json"
    points, path = (finished.folder / "store" / name for name in ("points/nao-dsp-ga-00.npz", "nao-dsp-sweep-x1.json"))
    swept = path.read_text()
    record.unlink()
    points.unlink()
    path.write_text(swept[: len(swept) // 2])  # torn by a crash
    for news in ("nao-dsp, ga 0", "nao-ssp, pso 1", "nao-dsp-sweep-x1"):
        assert recompute(finished, news) == [news]
    assert recompute(finished) == ["nao-dsp-sweep-x1", "figures, tables and report"]
    assert path.read_text() == swept and points.exists()
    assert read_record(record).x == finished.findings.ssp.searches["pso"][1].x


def test_the_full_effort_counts_all_its_steps() -> None:
    searches, choices = len(PHASES) * ((3 + 8) * 11 + 3 * 44), 5 * (6 + 7)
    other = 3 * (3 * 11 + 8 * 3 + 3 * 44 + 8 + 1)  # both phases on NAO V6, double support by the text on (28), (29)
    sweeps = [2 + 9 + 8 + 4, 2 + 9 + 8 + 4, 8 + 2]
    assert REPRODUCTION.full.steps == searches + len(PHASES) * 20 + choices + other + sum(sweeps) + 1


def test_verdicts_with_other_choices_are_compared(finished: Finished) -> None:
    findings = finished.findings
    assert "verdicts are others" not in finished.report and "not computed at this effort" in finished.report
    lines = [with_sweep(findings, 0, powers) for powers in ((2.0, 1.5, 1.0), (1.0, 1.5, 2.0))]
    values = REPRODUCTION.values(replace(lines[0], others={"v6": lines[1]}))
    assert (
        f"{REPRODUCTION.printed.claims['higher-hip-ssp'].text}: does not hold instead of holds"
        in values["changed"]["v6"]
    )
    assert values["verdicts"]["v6"]["higher-hip-ssp"] == "does not hold"
    assert values["changed"]["lever"] == values["verdicts"]["lever"]["higher-hip-ssp"] == "not computed at this effort"


def verdict(findings: NaoFindings, name: str) -> str:
    """Without the detail that the file gives."""
    claim = REPRODUCTION.checks[name](findings).apply(replace(REPRODUCTION.printed.claims[name], detail=""))
    return f"{claim.verdict} {claim.detail}".rstrip()


def with_sweep(findings: NaoFindings, position: int, powers: Sequence[float]) -> NaoFindings:
    """With a line of IPOPT in single support that has these powers; infinity where nothing is feasible."""
    line = [
        FixedOptimum(at=0.25 + 0.01 * k, power_W=power, feasible=np.isfinite(power)) for k, power in enumerate(powers)
    ]
    phases = [replace(phase, sweeps={**phase.sweeps, position: line}) for phase in findings.phases]
    return replace(findings, ssp=phases[0], dsp=phases[1])


def with_powers(phase: PhaseFindings, powers: Mapping[str, Sequence[float]]) -> PhaseFindings:
    """With these powers at the ends of the searches; infinity for an infeasible end."""

    def run(power: float) -> RunRecord:
        known = phase.searches["pso"][0]
        return replace(known, verdict=replace(known.verdict, objective=power, feasible=np.isfinite(power)))

    return replace(phase, searches={name: [run(power) for power in ends] for name, ends in powers.items()})


def test_claims_follow_the_numbers(finished: Finished) -> None:
    findings = finished.findings
    ssp = findings.ssp
    low = [0.85, 0.86, 0.87, 0.88, 0.89]
    high = [power + 0.1 for power in low]
    little = [power * 1.015 for power in low]

    def compare(constant: Sequence[float], pso: Sequence[float], ga: Sequence[float]) -> list[str]:
        changed = with_powers(ssp, {"pso-constant": constant, "pso": pso, "ga": ga})
        return [verdict(replace(findings, ssp=changed), name) for name in ("better-ssp", "better-ssp-damped")]

    tight, wide = (list(np.linspace(0.85, 0.85 + width, 11)) for width in (1e-4, 2e-4))
    printed = [power + SSP.optima["ga"].power_W - SSP.optima["pso"].power_W for power in tight]
    assert compare(high, low, high) == [
        "not shown (rank-sum test, p = 1)",
        "direction holds, size does not (printed 20, here 100)",
    ]
    assert compare(tight, [2 * power for power in tight], printed) == [
        "holds",
        "does not hold (printed 20, here -830)",
    ]
    assert compare(low, wide, little)[0].startswith("not shown (rank-sum test")
    medians = [with_powers(ssp, {"pso-constant": high, "pso": low, "ga": ga}) for ga in (low, high)]
    found = [[verdict(replace(findings, ssp=m), f"median-ssp{end}") for end in ("", "-damped")] for m in medians]
    assert found == [["does not hold", "not shown"], ["not shown", "holds"]]  # by the left-tailed test

    falling, rising = (with_sweep(findings, 0, powers) for powers in ((2.0, 1.5, 1.0), (1.0, 1.5, 2.0)))
    assert (verdict(falling, "higher-hip-ssp"), verdict(rising, "higher-hip-ssp")) == ("holds", "does not hold")

    whole, gap = (with_sweep(findings, DSP.duration, (2.0, middle, 1.0)) for middle in (1.5, np.inf))
    assert verdict(whole, "slower-dsp") == "holds" and verdict(whole, "gaps") == "does not hold"
    assert verdict(gap, "gaps") == "holds"
    short = with_sweep(findings, DSP.duration, (np.inf, 1.5, 1.0))
    assert verdict(short, "gaps") == "does not hold"  # below the shortest duration is no gap


@pytest.fixture(scope="module")
def printed() -> dict[str, GaitProblem]:
    """The phases with the paper's samples."""
    return {phase.problem: nlp_gait.load(phase.problem) for phase in PHASES}


def test_the_printed_solutions_have_the_values_of_the_audit(printed: dict[str, GaitProblem]) -> None:
    pairs = {}
    for phase in PHASES:
        found = [evaluate_indexes(printed[phase.problem], optimum.x) for optimum in phase.optima.values()]
        pairs[phase.problem] = [[round(f[index], 4) for f in found] for index in ("torque_change_Nm", "dbm_x_mean_m")]
    assert pairs == {"nao-ssp": [[0.4219, 0.4816], [0.0604, 0.0604]], "nao-dsp": [[0.2882, 0.3116], [0.0967, 0.0974]]}


def test_candidates_for_the_torque_change_change_one_thing_each(printed: dict[str, GaitProblem]) -> None:
    problem = printed["nao-dsp"]
    found, ga = (compute_torque_changes(problem, DSP.optima[name].x) for name in ("pso", "ga"))
    assert PAPER.torque_changes_Nm == {name: (round(found[name], 4), round(ga[name], 4)) for name in found}
    own = evaluate_indexes(problem, DSP.optima["pso"].x)["torque_change_Nm"]
    assert found["torque of one joint over one interval, as here"] == pytest.approx(own, rel=1e-9)
    assert found["gravity only"] == pytest.approx(own, rel=0.02)  # in 2 s nearly static
    assert found["sum over all joints"] > found["over two intervals"] > own
    assert found["half of the torso on each leg"] < found["the whole torso on each leg"]


def test_numbers_in_the_texts_are_those_of_our_model(printed: dict[str, GaitProblem]) -> None:
    texts = str(REPRODUCTION.printed.differences)
    for phase in PHASES:
        problem = printed[phase.problem]
        for name, optimum in phase.optima.items():
            powers = compute_powers(problem, optimum.x)
            ends = [
                powers[key] for key in (("legs", "one_motor") if name == "pso" else ()) + ("left_ends", "right_ends")
            ]
            assert all(f"{power:.4f}" in texts for power in ends), (phase.problem, name)
            changes = compute_torque_changes_by_reading(problem, optimum.x)
            assert all(f"{change:.4f}" in texts for change in changes), (phase.problem, name)
            if phase is SSP:
                assert all(f"{value:.1f}" in texts for value in compute_mean_margins(problem, optimum.x).values())
    shares = compute_load_shares(printed["nao-dsp"], DSP.optima["pso"].x)
    assert f"{shares.min():.4f} to {shares.max():.4f} of the weight" in texts


def test_the_robot_has_the_geometry_of_the_printed_tables_with_their_slips_corrected() -> None:
    gaps = list(compare_geometry("nao-v5").values())
    assert max(gaps[1::2]) < 1e-12 and gaps[0::2] == pytest.approx([481, 183, 12.3], rel=3e-3)
    assert all(text in str(REPRODUCTION.printed.differences) for text in ("481 mm", "183 mm", "12.3 mm", "1e-12 mm"))


def test_the_printed_solutions_stay_up_in_the_engine(finished: Finished) -> None:
    for phase in finished.findings.phases:
        for found in phase.simulations.values():
            assert found["fell_at_s"] is None and found["tilt_rad"] < 0.1 and found["simulated_beyond_rad"] < 0.0


def test_infeasible_runs_rank_last(finished: Finished) -> None:
    phase = with_powers(finished.findings.ssp, {"pso": [np.inf, 0.9, 0.8]})
    assert phase.final_powers("pso") == [float("inf"), 0.9, 0.8]
    assert phase.median_run("pso") == 1


def test_the_note_on_the_gap_is_computed(printed: dict[str, GaitProblem]) -> None:
    """Verified values of the paper's solutions, and the power with the legs' mechanical term counted twice."""
    here, twice = [], []
    for phase in PHASES:
        problem = printed[phase.problem]
        here += [evaluate_indexes(problem, optimum.x)["power_W"] for optimum in phase.optima.values()]
        twice += [compute_power_with_legs_twice(problem, optimum.x) for optimum in phase.optima.values()]
    assert here == pytest.approx([0.866844, 0.891966, 0.626506, 0.626492], abs=2e-6)
    assert twice == pytest.approx(
        [optimum.legs_twice_W for phase in PHASES for optimum in phase.optima.values()], abs=5e-5
    )


def test_effect_size_of_the_printed_rank_sums(finished: Finished) -> None:
    eleven = with_powers(finished.findings.ssp, {"pso": [1.0] * 11})
    found = [compute_implied_a12(replace(eleven, paper=paper)) for paper in (SSP, DSP)]
    assert found == pytest.approx([117 / 121, 97 / 121])  # W = 66 would be a win in all 121 pairs


def test_reading_a_history_and_choosing_where_to_sweep() -> None:
    points = FeasiblePoints(
        x=np.array([[0.0], [0.1], [0.1004], [1.0]]),
        power_W=np.array([1.0, 3.0, 2.0, 1.01]),
        run=np.array([0.0, 0.0, 1.0, 1.0]),
    )
    assert points.cheapest_near(0, 0.1, 0.0005) == 2.0
    assert points.cheapest_near(0, 0.1, 0.0005, run=0) == 3.0
    assert np.isnan(points.cheapest_near(0, 0.5, 0.0005))
    dear = FeasiblePoints(x=np.array([[-1.0], [2.0]]), power_W=np.array([5.0, 5.0]), run=np.zeros(2))
    assert choose_sweep_values({"pso": points, "ga": dear}, 0, 0.3, (3, 2)) == [-1.0, 0.0, 0.3, 0.5, 1.0, 2.0]
