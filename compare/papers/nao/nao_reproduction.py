"""Gupta, Pratihar, Deb (2023), reproduced: Tables 6 to 9, Figs. 9 to 20, the tests of section 5.3 and the paper's claims."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from compare.analysis.record_statistics import compute_a12, correct_by_holm
from compare.papers.claims import SIGNIFICANT, bind_checks
from compare.papers.nao import nao_claims, nao_gait_claims
from compare.papers.nao import nao_runs as nao
from compare.papers.nao.nao_figures import draw_figures
from compare.papers.nao.nao_findings import NAMES, FeasiblePoints, NaoFindings, PhaseFindings, choose_sweep_values
from compare.papers.nao.nao_gait_claims import MARGINS, compute_joint_shares, describe_effect
from compare.papers.nao.nao_runs import ALGORITHMS, PAPER, SWING_POWER_W, FixedOptimum, NaoEffort, PrintedPhase
from compare.papers.paper_runs import Runner, Runs, choose_best, compute_range
from compare.papers.reproduction import Reproduction
from compare.report.document import Rows, Value
from compare.study.record_files import locate_record
from compare.study.store import Computation, Store
from compare.study.task import IPOPT, Task
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solvers import ipopt
from nlp_gait.files import make_writable_folder
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.robots import load_robot
from nlp_gait.simulation import simulate
from nlp_gait.simulation.mjcf import FRICTION, TIME_STEP
from nlp_gait.simulation.simulate import SETTLE_TIME

MEANS = ("dbm_x_mean_limit_m", "dbm_y_mean_limit_m")


def _run_nao(runner: Runner, effort: NaoEffort) -> NaoFindings:
    """Run searches and IPOPT on both phases, and sweep over their variables; again with other choices."""
    findings, others = NaoFindings(**_run_phases(runner, effort)), {}
    for choice in effort.others:
        folder = make_writable_folder(runner.folder / choice)
        changed = _run_phases(replace(runner, folder=folder), effort.choose_other(choice))
        others[choice] = replace(findings, **changed)
    return replace(findings, others=others)


def _run_phases(runner: Runner, effort: NaoEffort) -> dict[str, Any]:
    """Return the fields of the findings that an effort computes: those of its phases."""
    store, tasks = Store(runner.folder), nao.make_tasks(effort)
    searches = [task for task in tasks if task.title in nao.SEARCHES]
    for task in searches:
        if nao.load_points(store, task) is None:
            locate_record(runner.folder, task).unlink(missing_ok=True)  # only a run gives its points
    runs = runner.run_tasks(tasks, partial(nao.run_and_store_points, runner.folder))
    simulated = runner.compute(nao.make_simulations(effort), code=(nao, simulate))
    found: dict[str, Any] = {}
    for phase in effort.phases:
        points = _load_all_points(store, phase, searches)
        found[phase.problem[4:]] = _sweep_phase(runner, effort, phase, runs, points, simulated)
    special = _solve_sweeps(runner, nao.make_special_sweeps(effort))
    return found | dict(zip(("swing", "durations"), special, strict=False))


def _load_all_points(store: Store, phase: PrintedPhase, searches: Sequence[Task]) -> dict[str, FeasiblePoints]:
    points = {}
    for name in nao.SEARCHES:
        tasks = [task for task in searches if (task.problem.title, task.title) == (phase.problem, name)]
        runs = [found for task in tasks if (found := nao.load_points(store, task)) is not None]
        x, power = (np.concatenate(arrays) for arrays in zip(*runs, strict=True))
        run = np.repeat(np.arange(len(runs), dtype=float), [len(power) for _, power in runs])
        points[name] = FeasiblePoints(x=x, power_W=power, run=run)
    return points


def _sweep_phase(
    runner: Runner,
    effort: NaoEffort,
    paper: PrintedPhase,
    runs: Runs,
    points: Mapping[str, FeasiblePoints],
    simulated: Mapping[str, Any],
) -> PhaseFindings:
    """Sweep by IPOPT over each variable's feasible range."""
    spec, starts = nao.make_spec(paper.problem, effort), runs[paper.problem, IPOPT]
    sweeps, lower = [], spec.load().lower
    for i, optimum in enumerate(choose_best(starts).x.values()):
        values = choose_sweep_values(points, i, optimum, effort.sweep_points)
        if i in (0, paper.duration):  # down to the bound, where searches may have found nothing
            values = np.unique([*np.linspace(lower[i], values[0], effort.sweep_points[0]), *values]).tolist()
        sweeps.append(nao.make_sweep(f"{paper.problem}-sweep-x{i + 1}", spec, i, values, effort.sweep_starts))
    return PhaseFindings(
        paper=paper,
        problem=spec.load(),
        searches={name: runs[paper.problem, name] for name in nao.SEARCHES},
        starts=starts,
        sweeps=dict(enumerate(_solve_sweeps(runner, sweeps))),
        points=points,
        variants={name: runs[paper.problem, name] for name in (*nao.VARIANTS, *nao.MORE)},
        choices=nao.list_choices(paper.problem, effort, solved=False),
        choice_starts={k: runs[spec.title, IPOPT] for k, spec in nao.list_choices(paper.problem, effort).items()},
        simulations={name: simulated[f"simulate-{paper.problem}-{name}"] for name in ALGORITHMS},
    )


def _solve_sweeps(runner: Runner, sweeps: Sequence[Computation]) -> list[list[FixedOptimum]]:
    return [[FixedOptimum(**row) for row in rows] for rows in runner.compute(sweeps, code=(nao, ipopt)).values()]


def _compute_values(findings: NaoFindings) -> dict[str, Any]:
    ssp, dsp = findings.phases
    runs, robot = ssp.searches["pso"], str(ssp.problem.options["robot"])
    solutions = [(phase, *pair) for phase in findings.phases for pair in phase.paper.optima.items()]
    printed = [(o.power_W, phase.printed_here[name]["power_W"], o.legs_twice_W) for phase, name, o in solutions]
    margins = [(dsp.paper.optima[n].indexes[i], dsp.printed_here[n][i]) for n in ALGORITHMS for i in MARGINS]
    changes = np.array(list(findings.torque_changes_Nm.values()))
    target = np.array([dsp.paper.optima[name].indexes["torque_change_Nm"] for name in ALGORITHMS])
    misses = 100 * np.abs(changes / target - 1).max(axis=1)
    return {
        "runs": len(runs),
        "generations": runs[0].iterations,
        "starts": len(ssp.starts),
        "robot": robot,
        "ssp": _compute_phase_values(ssp),
        "dsp": _compute_phase_values(dsp),
        "costs": compute_range(100 * (here["power_W"] / dsp.best - 1) for here in dsp.printed_here.values()),
        **_compute_lever_values(dsp),
        "gaps": compute_range(power - here for power, here, _ in printed),
        "misses": compute_range(100 * (twice / power - 1) for power, _, twice in printed),
        "nearest": list(findings.torque_changes_Nm)[int(misses.argmin())],
        "nearest_Nm": changes[misses.argmin()],
        "nearest_miss": misses.min(),
        "candidates": len(changes) - 1,  # the first is ours
        "bodies": len(load_robot(robot).links),
        "masses_kg": [load_robot(name).mass_kg for name in ("nao-v5", "nao-v6")],
        "simulator": {"friction": FRICTION, "step_ms": 1000 * TIME_STEP, "settle_s": SETTLE_TIME}
        | {"drive": nao.WEBOTS_DRIVE},
        "pairs": len(ssp.final_powers("ga-more")),
        "printed_feasible": sum(
            build_exact_model(p.problem).at(p.problem.check_x(o.x), p.problem.p).violation <= FEASIBILITY_TOLERANCE
            for p, _, o in solutions
        ),
        "margin_gap_mm": 1000 * max(abs(there - here) for there, here in margins),
        **_compare_verdicts(findings),
        "bounds": {
            phase.problem.name[4:]: [f"{row.lower:g} to {row.upper:g} {row.unit}" for row in phase.problem.variables]
            for phase in findings.phases
        },
        "limits": [ssp.problem.value(name) for name in ("heat_loss_W_per_Nm2", "torque_change_limit_Nm", *MEANS)]
        + [dsp.problem.value(name) for name in MEANS],
        "backward": _count_backward(findings),
        "least_margin_mm": 1000
        * min(end.indexes[i] for phase in findings.phases for end in phase.feasible_ends for i in MARGINS[:2]),
    }


def _compute_lever_values(dsp: PhaseFindings) -> dict[str, Any]:
    optimum, printed = dsp.optimum_with("lever"), dsp.printed_by_choice["lever"]
    best = optimum.verdict.objective if optimum else math.nan
    x = [*optimum.x.values()] if optimum else [math.nan] * len(dsp.optimum.x)
    costs = [100 * (here["power_W"] / best - 1) for here in printed.values()]
    return {"lever_costs": costs, "lever_x": x, "dsp_x": [*dsp.optimum.x.values()]}


def _compare_verdicts(findings: NaoFindings) -> dict[str, Any]:
    """Return verdicts with other choices, the rows that they change, and those that Holm's correction would change."""
    checks, claims = REPRODUCTION.checks, REPRODUCTION.printed.claims
    texts = {name: replace(claims[name], detail="") for name in checks}
    here = {name: check(findings) for name, check in checks.items()}
    rows = {name: check.apply(texts[name]) for name, check in here.items()}
    agree = [check.values["agree"] for check in here.values() if "agree" in check.values]
    p = {name: float(check.values["p"]) for name, check in here.items() if "p" in check.values}
    corrected = dict(zip(p, correct_by_holm([*p.values()]), strict=True))
    lost = [f"{rows[name].text} (p = {p[name]:.2g})" for name in p if p[name] < SIGNIFICANT <= corrected[name]]
    changed = dict.fromkeys(NaoEffort.others, unknown := "not computed at this effort")
    verdicts = {choice: dict.fromkeys(checks, unknown) for choice in changed}
    for choice, other in findings.others.items():
        there = {name: check(other).apply(texts[name]) for name, check in checks.items()}
        verdicts[choice] = {name: row.verdict for name, row in there.items()}
        words = [
            f"{row.text}: {there[name].verdict} {there[name].detail}".rstrip() + f" instead of {row.verdict}"
            for name, row in rows.items()
            if there[name].verdict != row.verdict
        ]
        changed[choice] = f"{len(words)} of {len(rows)} verdicts are others: {'; '.join(words) or 'none'}"
    return {
        "tests": len(p),
        "level": f"{100 * SIGNIFICANT:.0f}",
        "holm": "; ".join(lost) or "none",
        "changed": changed,
        "verdicts": verdicts,
        "whole_tested": len(agree),
        "whole_differ": agree.count(False),
        "checks": {name: check.values for name, check in here.items()},
    }


def _count_backward(findings: NaoFindings) -> dict[str, float]:
    """Count final solutions whose hip moves backwards somewhere; velocities in mm/s."""
    ends, others = [], []
    for phase in findings.phases:
        printed = (phase.problem.by_name(phase.problem.check_x(optimum.x)) for optimum in phase.paper.optima.values())
        others += [1000 * phase.compute_least_speed(x) for x in (*printed, phase.optimum.x)]
        ends += [1000 * phase.compute_least_speed(run.x) for runs in phase.searches.values() for run in runs]
    return {"runs": sum(v < 0 for v in ends), "count": len(ends), "most": max(0.0, -min(ends)), "others": min(others)}


def _compute_phase_values(phase: PhaseFindings) -> dict[str, Any]:
    """Values of one phase; ``broken`` counts final solutions that violate a constraint between the paper's samples."""
    ends, optimum = phase.feasible_ends, phase.optimum.verdict
    shares = compute_joint_shares(phase.problem, phase.paper.optima["pso"].x)
    names = (*nao.SEARCHES, *phase.variants)
    return {
        "effects": {name: describe_effect(phase, name) for name in phase.choices},
        "median_W": {name.replace("-", "_"): float(np.median(phase.final_powers(name))) for name in names},
        "best_W": phase.best,
        "printed_W": {name: here["power_W"] for name, here in phase.printed_here.items()},
        "more": phase.test("pso-more", "ga-more"),
        "more_a12": compute_a12(phase.final_powers("pso-more"), phase.final_powers("ga-more")),
        "dense_W": (optimum.dense or {}).get("power_W", math.nan),
        "yaw_mW": 1000 * shares["HipYawPitch"] * phase.printed_here["pso"]["power_W"],
        "converged": phase.converged,
        "medians": "; ".join(f"{phase.median_run(name)} of {NAMES[name]}" for name in nao.SEARCHES),
        "feasible": len(ends),
        "broken": sum(end.dense_feasible is False for end in ends),
        "optimum": "does not" if optimum.dense_feasible else f"violates {optimum.violated[0]}",
        "below": 100 * max(phase.share_below(i) for i in phase.sweeps),
    }


def _make_tables(findings: NaoFindings) -> dict[str, Rows]:
    dsp = findings.dsp
    tables: dict[str, Rows] = {
        "table7-swing-heights": _list_swing_heights(findings),
        "durations": [(point.at, point.power_W) for point in findings.durations],
        "rank-sum-tests": [row for phase in findings.phases for row in _list_tests(phase)],
        "choices": [row for phase in findings.phases for row in _list_choices(phase)],
        "search-choices": [row for phase in findings.phases for row in _list_variants(phase)],
        "torque-changes": [
            ("printed", *(dsp.paper.optima[name].indexes["torque_change_Nm"] for name in ALGORITHMS)),
            *((name, *values) for name, values in findings.torque_changes_Nm.items()),
        ],
        "simulations": [row for phase in findings.phases for row in _list_simulations(phase)],
        "power-gap": [row for phase in findings.phases for row in _list_gaps(phase)],
    }
    for phase in findings.phases:
        for name, position in (("hip", 0), ("durations", phase.paper.duration)):
            rows: Rows = [(p.at, p.power_W if p.feasible else "none found") for p in phase.sweeps[position]]
            tables[f"{name}-{phase.problem.name}"] = rows
        variables, indexes = phase.paper.tables
        tables |= {
            f"runs-{phase.problem.name}": _list_runs(phase),
            f"table{variables}": _list_variables(phase),
            f"table{indexes}": _list_indexes(phase),
        }
    return tables


def _list_variables(phase: PhaseFindings) -> Rows:
    other = phase.optimum_with("v6")
    rows: list[list[Value]] = []
    for i, variable in enumerate(phase.problem.variables):
        name, (of_pso, of_ga) = variable.name, (phase.paper.optima[search].x[i] for search in ALGORITHMS)
        constant, damped, ga = (phase.median(search).x[name] for search in nao.SEARCHES)
        found = [of_pso, constant, damped, of_ga, ga, phase.optimum.x[name]]
        rows.append([f"x{i + 1} {name} [{variable.unit}]", *found, other.x[name] if other else None])
    return rows


def _list_indexes(phase: PhaseFindings) -> Rows:
    """Tables 7, 9: performance figures; the paper's also of its solutions here, on NAO V5 and V6."""
    other = phase.optimum_with("v6")
    rows = []
    for index, best in phase.optimum.verdict.indexes.items():
        row: list[Value] = [index]
        for name, ours in (("pso", ("pso-constant", "pso")), ("ga", ("ga",))):
            printed = phase.paper.optima[name]
            row += [printed.figures[index], phase.printed_here[name][index], phase.printed_by_choice["v6"][name][index]]
            row += [phase.median(search).verdict.indexes[index] for search in ours]
        rows.append([*row, best, other.verdict.indexes[index] if other else None])
    return rows


def _list_choices(phase: PhaseFindings) -> Rows:
    rows, every = [], {"": phase.printed_here, **phase.printed_by_choice}
    for choice, printed in every.items():
        title = PAPER.choices[choice].title if choice else "as here"
        best = phase.optimum_with(choice) if choice else phase.optimum
        solved = best is not None and best.claimed and best.verdict.feasible
        numbers = [printed[name][index] for name in ALGORITHMS for index in ("power_W", "torque_change_Nm")]
        rows.append([phase.paper.title, title, *numbers, best.verdict.objective if best and solved else "not solved"])
    return rows


def _list_variants(phase: PhaseFindings) -> Rows:
    rows: list[list[Value]] = []
    for name in (*nao.SEARCHES, *phase.variants):
        powers, p = phase.final_powers(name), [phase.test(name, other).p_two_sided for other in nao.SEARCHES]
        ends = [len(powers), sum(map(math.isfinite, powers)), float(np.median(powers))]
        rows.append([phase.paper.title, NAMES.get(name, name), *ends, *p])
    return rows


def _list_swing_heights(findings: NaoFindings) -> Rows:
    """Table 7, rows 6 to 11: least power at a swing height; true optima, and what search histories show."""
    phase = findings.ssp
    read = [phase.list_swing_powers(name, whole=whole) for name in nao.SEARCHES for whole in (False, True)]
    cheapest = findings.swing[0].power_W
    rows = []
    for k, held in enumerate(findings.swing):
        printed = [SWING_POWER_W[name][held.at] for name in ALGORITHMS]
        seen: list[Value] = ["none found" if math.isnan(column[k]) else column[k] for column in read]
        rows.append([held.at, *printed, *seen, held.power_W, 100 * (held.power_W / cheapest - 1)])
    return rows


def _list_runs(phase: PhaseFindings) -> Rows:
    rows = []
    for name, runs in (*phase.searches.items(), ("ipopt", phase.starts)):
        powers = [run.verdict.objective for run in runs if run.verdict.feasible and run.claimed]
        spread: list[Value] = [None] * 4
        if powers:
            middle = float(np.median(powers))
            spread = [min(powers), middle, max(powers), 100 * (middle / phase.best - 1)]
        time_s = float(np.median([run.time_s.solve for run in runs]))
        rows.append([NAMES[name], len(runs), len(powers), *spread, time_s])
    return rows


def _list_tests(phase: PhaseFindings) -> Rows:
    """Section 5.3: Wilcoxon's rank-sum tests of PSO's powers against GA's, and the effect size."""
    tests = [("paper", phase.paper.test, compute_implied_a12(phase))]
    for name in ("pso-constant", "pso"):
        share = compute_a12(phase.final_powers(name), phase.final_powers("ga"))
        tests.append((f"here, {NAMES[name]}", phase.test(name), share))
    return [[phase.paper.title, name, t.rank_sum, t.z, t.p_two_sided, t.p_less, share] for name, t, share in tests]


def compute_implied_a12(phase: PhaseFindings) -> float:
    """Return the effect size that follows from the paper's rank sum: the share of pairs of runs in which PSO's is better."""
    runs = len(phase.searches["pso"])
    return 1.0 - (phase.paper.test.rank_sum - runs * (runs + 1) / 2) / runs**2


def _list_gaps(phase: PhaseFindings) -> Rows:
    rows = []
    for name, optimum in phase.paper.optima.items():
        printed, here = optimum.power_W, phase.printed_here[name]["power_W"]
        rows.append((f"{phase.paper.title}, {name.upper()}", printed, here, printed - here, optimum.legs_twice_W))
    return rows


def _list_simulations(phase: PhaseFindings) -> Rows:
    """Section 5.4: the paper's solutions in MuJoCo."""
    rows, keys = [], ("tilt_rad", "planned_beyond_rad", "simulated_beyond_rad")
    for name, found in phase.simulations.items():
        tilt, planned, simulated = (math.degrees(found[key]) for key in keys)
        fell = "stays up" if found["fell_at_s"] is None else f"falls at {found['fell_at_s']:.2f} s"
        rows.append((f"{phase.paper.title}, {name.upper()}", fell, tilt, -planned, -simulated))
    return rows


REPRODUCTION = Reproduction(
    name="nao",
    full=NaoEffort(),
    run=_run_nao,
    values=_compute_values,
    tables=_make_tables,
    figures=draw_figures,
    checks=bind_checks("nao/nao_claims.toml", {**vars(nao_claims), **vars(nao_gait_claims)}),
)
