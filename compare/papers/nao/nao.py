"""Gupta, Pratihar, Deb (2023): NAO's single and double support at least power, in two readings of the margins.

The printed reading takes ten samples, (19) and (20) with g = 9.8 as a number, and 23 masses in double support; the other one ten
intervals and physical gravity.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

from compare.analysis.record_statistics import approximate_rank_sum
from compare.drawing.figures import COLOURS, make_axes
from compare.papers.paper import Paper, read_book, read_table
from compare.papers.paper_runs import Effort, Runner, make_computation, make_search_tasks
from compare.papers.rules import Found
from compare.report.document import Figure, Table
from compare.study.record import RunRecord
from compare.study.task import ProblemSpec
from metaheuristics.registry import make_algorithm
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solve import solve
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.signals import Signals

BOOK = read_book("nao")
PHASES = {"ssp": "single support", "dsp": "double support"}
TABLES = {"ssp": 7, "dsp": 9}
MARGINS = tuple(f"dbm_{axis}_{kind}_m" for kind in ("min", "mean") for axis in "xy")
INDEXES = ("power_W", "torque_change_Nm", *MARGINS)
PRINTED_OPTIONS: Mapping[str, Mapping[str, Any]] = {
    "ssp": {"intervals": 9, "zmp_gravity": "printed"},
    "dsp": {"intervals": 9, "zmp_gravity": "printed", "zmp_masses": 23},
}
OPTIONS: Mapping[str, Mapping[str, Mapping[str, Any]]] = {
    "printed": PRINTED_OPTIONS,
    "physical": {"ssp": {}, "dsp": {}},
}
SWARMS = {"constant": "pso-constant", "damped": "pso"}
TIMES = {"ssp": "single_support_time_s", "dsp": "double_support_time_s"}
HIPS_M = (0.31, 0.29, 0.27, 0.256)  # heights of a sweep, from the optimum on
DURATIONS_S = {"ssp": (4.0, 2.0, 1.0, 0.7), "dsp": (2.0, 1.0, 0.5, 0.3)}
SWINGS_M = (0.024, 0.028)
PACES = 9  # durations at which a printed gait is evaluated
STRAIGHT = {"hip_vz_start_m_s": 0.0, "hip_vz_end_m_s": 0.0}
KINDS = ("HipYawPitch", "Hip", "Knee", "Ankle")


@dataclass(frozen=True, kw_only=True)
class NaoEffort(Effort):
    """Effort of the reproduction; what does not depend on runs of the searches is the same in each."""

    evaluations: int = 10_000  # of a search, as in the paper
    starts: int = 3  # of IPOPT

    @property
    def steps(self) -> int:
        """Solved optima and sweeps, searches, and the report."""
        return len(_make_computations(self)) + len(OPTIONS) * len(PHASES) * 3 * self.runs + 1


@dataclass(frozen=True, kw_only=True)
class PrintedSolution:
    """A printed solution and its figures."""

    x: tuple[float, ...]
    figures: Mapping[str, float]


def _read_solutions() -> dict[tuple[str, str], PrintedSolution]:
    rows = read_table("nao", "solutions")
    return {
        (row["phase"], row["search"]): PrintedSolution(
            x=tuple(map(float, row["x"].split())), figures={index: float(row[index]) for index in INDEXES}
        )
        for row in rows
    }


PRINTED = _read_solutions()
SEARCHES = ("PSO", "GA")


@dataclass(frozen=True, kw_only=True, eq=False)
class NaoResults:
    """Results of one reading."""

    reading: str
    solved: Mapping[str, list[dict[str, Any]]]  # optima by name of the computation: x, power_W, feasible
    searches: Mapping[tuple[str, str], Sequence[RunRecord]] = field(default_factory=dict)  # by phase; "PSO" or "GA"

    def measure(self, phase: str, search: str, /, **changes: float) -> Mapping[str, float]:
        """Return the figures of a printed solution, with other values of some variables."""
        return evaluate(_make_spec(phase, self.reading), _change(phase, search, changes))

    def sample(self, phase: str, search: str = "PSO", /, **changes: float) -> Signals:
        """Return the signals of a printed solution, with other values of some variables."""
        return _make_spec(phase, self.reading).load().signals(_change(phase, search, changes))

    def optimum(self, phase: str) -> dict[str, Any]:
        """Return IPOPT's optimum."""
        return self.solved[f"optimum-{phase}"][0]

    def list_powers(self, sweep: str) -> list[float] | None:
        """Return the power over a sweep, without the points at which there is no gait; None if fewer than two are left."""
        powers = [point["power_W"] for point in self.solved[sweep] if point["feasible"]]
        return powers if len(powers) > 1 else None

    def lowest_hip_m(self, phase: str) -> float:
        """Return the lowest hip of the sweep at which there is a gait."""
        return min(
            height for height, point in zip(HIPS_M, self.solved[f"hips-{phase}"], strict=True) if point["feasible"]
        )

    def final_powers(self, phase: str, search: str) -> list[float]:
        """Return the power at the end of each run [W]; infinite without a feasible solution."""
        ends = [run.verdict for run in self.searches[phase, search]]
        return [end.objective if end.feasible else math.inf for end in ends]

    @cached_property
    def excess(self) -> dict[tuple[str, str], float]:
        """Power of the printed solutions above IPOPT's optimum, by phase and search [%]."""
        return {
            (phase, search): 100 * (self.measure(phase, search)["power_W"] / self.optimum(phase)["power_W"] - 1)
            for phase, search in PRINTED
        }


def _make_spec(phase: str, reading: str, **options: Any) -> ProblemSpec:
    chosen = {**OPTIONS[reading][phase], **options}
    return ProblemSpec(name=f"nao-{phase}", options=chosen, label=f"nao-{phase}-{reading}")


@cache
def _load(phase: str, options: tuple[tuple[str, Any], ...]) -> tuple[GaitProblem, Any]:
    problem = ProblemSpec(name=f"nao-{phase}", options=dict(options)).load()
    return problem, build_exact_model(problem)


@cache
def _evaluate(phase: str, options: tuple[tuple[str, Any], ...], x: tuple[float, ...]) -> Mapping[str, float]:
    problem, model = _load(phase, options)
    indexes: Mapping[str, float] = model.at(problem.check_x(x), problem.p).indexes
    return indexes


def evaluate(spec: ProblemSpec, x: Sequence[float]) -> Mapping[str, float]:
    """Return the figures of a solution by the exact functions."""
    return _evaluate(spec.address.removeprefix("nao-"), tuple(sorted(spec.options.items())), tuple(x))


def _change(phase: str, search: str, changes: Mapping[str, float]) -> list[float]:
    names = _load(phase, ())[0].names
    return list({**dict(zip(names, PRINTED[phase, search].x, strict=True)), **changes}.values())


def solve_path(spec: ProblemSpec, fixed: Sequence[Mapping[str, float]], starts: int, x0: Any) -> list[dict[str, Any]]:
    """Return optima with variables fixed one after the other, each from the one before; first from ``x0`` and random points."""
    points: list[dict[str, Any]] = []
    for values in fixed:
        problem = spec.load().fix(**values) if values else spec.load()
        solution = solve(problem, starts=1 if points else starts, x0=x0, workers=1)
        point = {"x": dict(solution.x), "power_W": float(solution.objective), "feasible": bool(solution.converged)}
        points.append(point if point["feasible"] else {**point, "power_W": 0.0})
        x0 = solution.x if solution.converged else x0
    return points


def _list_shares() -> list[tuple[str, str]]:
    return [(share, arms) for share in ("printed", "lever") for arms in ("carried", "separate", "shared")]


def _make_computations(effort: NaoEffort) -> list[Any]:
    paths: dict[str, tuple[ProblemSpec, list[dict[str, float]]]] = {}
    for reading in OPTIONS:
        for phase in PHASES:
            spec = _make_spec(phase, reading)
            paths[f"{reading}/optimum-{phase}"] = spec, [{}]
            paths[f"{reading}/hips-{phase}"] = spec, [{"hip_height_m": height} for height in HIPS_M]
            paths[f"{reading}/durations-{phase}"] = spec, [{TIMES[phase]: duration} for duration in DURATIONS_S[phase]]
        paths[f"{reading}/swings"] = _make_spec("ssp", reading), [{"swing_height_m": height} for height in SWINGS_M]
    for share, arms in _list_shares():
        spec = _make_spec("dsp", "printed", torso_share=share, arms=arms)
        mean = evaluate(spec, PRINTED["dsp", "PSO"].x)["dbm_y_mean_m"]
        spec = ProblemSpec(name=spec.name, options=spec.options, values={"dbm_y_mean_limit_m": mean})
        paths[f"printed/share-{share}-{arms}"] = spec, [{"hip_height_m": 0.31, TIMES["dsp"]: 2.0}]
    return [
        make_computation(
            name.replace("/", "-"),
            spec,
            partial(solve_path, spec),
            fixed=fixed,
            starts=effort.starts if "optimum" in name else 1,
            x0=list(PRINTED[spec.address.removeprefix("nao-"), "PSO"].x),
        )
        for name, (spec, fixed) in paths.items()
    ]


def compute(runner: Runner, effort: NaoEffort) -> dict[str, NaoResults]:
    """Return results by reading, and by reading and swarm where there are runs."""
    computed = runner.compute(_make_computations(effort), code=[])
    solved = {
        reading: {
            name.removeprefix(f"{reading}-"): value for name, value in computed.items() if name.startswith(reading)
        }
        for reading in OPTIONS
    }
    results = {reading: NaoResults(reading=reading, solved=solved[reading]) for reading in OPTIONS}
    if not effort.runs:
        return results
    algorithms = {name: make_algorithm(name) for name in (*SWARMS.values(), "ga")}
    tasks = [
        task
        for reading in OPTIONS
        for phase in PHASES
        for task in make_search_tasks(_make_spec(phase, reading), algorithms, effort.runs, effort.evaluations)
    ]
    runs = runner.run_tasks(tasks)
    for reading in OPTIONS:
        for label, swarm in SWARMS.items():
            searches = {
                (phase, search): runs[f"nao-{phase}-{reading}", name]
                for phase in PHASES
                for search, name in (("PSO", swarm), ("GA", "ga"))
            }
            results[f"{reading}, {label}"] = NaoResults(reading=reading, solved=solved[reading], searches=searches)
    return results


def _list_margins(result: NaoResults, phase: str, indexes: Sequence[str] = MARGINS) -> list[float]:
    return [1000 * result.measure(phase, search)[index] for search in SEARCHES for index in indexes]


@BOOK.claim("margins-ssp", phase="ssp")
@BOOK.claim("margins-ssp-digits", phase="ssp")
@BOOK.claim("margins-dsp", phase="dsp")
def measure_margins(result: NaoResults, phase: str) -> list[float]:
    return _list_margins(result, phase)


@BOOK.claim("least-margins-dsp")
def measure_least_margins(result: NaoResults) -> list[float]:
    return _list_margins(result, "dsp", MARGINS[:2])


@BOOK.claim("pso-optimal-ssp", phase="ssp")
@BOOK.claim("pso-optimal-dsp", phase="dsp")
def measure_excess(result: NaoResults, phase: str) -> float | None:
    return result.excess[phase, "PSO"] if result.optimum(phase)["feasible"] else None


@BOOK.claim("power-ssp", phase="ssp", index="power_W")
@BOOK.claim("power-dsp", phase="dsp", index="power_W")
@BOOK.claim("torque-level-ssp", phase="ssp", index="torque_change_Nm")
@BOOK.claim("torque-level-dsp", phase="dsp", index="torque_change_Nm")
def measure_levels(result: NaoResults, phase: str, index: str) -> list[float]:
    return [result.measure(phase, search)[index] for search in SEARCHES]


@BOOK.claim("power-lead-ssp")
def measure_power_lead(result: NaoResults) -> float:
    pso, ga = measure_levels(result, "ssp", "power_W")
    return 1000 * (ga - pso)


@BOOK.claim("similar-power-ssp", phase="ssp", index="power_W")
@BOOK.claim("similar-power", phase="dsp", index="power_W")
@BOOK.claim("torque-change-ssp", phase="ssp", index="torque_change_Nm")
@BOOK.claim("torque-change-dsp", phase="dsp", index="torque_change_Nm")
def measure_share(result: NaoResults, phase: str, index: str) -> float:
    pso, ga = measure_levels(result, phase, index)
    return 100 * (pso / ga - 1)


@BOOK.claim("mean-x-lead", phase="ssp", indexes=MARGINS[2:3])
@BOOK.claim("least-margins-ssp", phase="ssp", indexes=MARGINS[:2], sign=-1)
@BOOK.claim("mean-lead-dsp", phase="dsp", indexes=MARGINS[2:], sign=-1)
@BOOK.claim("min-lead-dsp", phase="dsp", indexes=MARGINS[:2])
def measure_leads(result: NaoResults, phase: str, indexes: Sequence[str], sign: int = 1) -> list[float]:
    pso, ga = (result.measure(phase, search) for search in SEARCHES)
    return [round(1000 * sign * (pso[index] - ga[index]), 1) for index in indexes]


@BOOK.claim("more-stable")
def measure_more_stable(result: NaoResults) -> list[float]:
    ssp, dsp = (result.measure(phase, "PSO") for phase in PHASES)
    return [1000 * (dsp[index] - ssp[index]) for index in MARGINS]


@BOOK.claim("higher-hip-ssp", sweep="hips-ssp", last_first=True)
@BOOK.claim("higher-hip-dsp", sweep="hips-dsp", last_first=True)
@BOOK.claim("slower-ssp", sweep="durations-ssp", last_first=True)
@BOOK.claim("slower-dsp", sweep="durations-dsp", last_first=True)
@BOOK.claim("swing-beyond", sweep="swings")
def measure_sweep(result: NaoResults, sweep: str, *, last_first: bool = False) -> list[float] | None:
    powers = result.list_powers(sweep)
    return powers[::-1] if powers and last_first else powers


@BOOK.claim("lower-hip-x", axis="x")
@BOOK.claim("lower-hip-y", axis="y")
def measure_lower_hip(result: NaoResults, axis: str) -> list[list[float]]:
    index = f"dbm_{axis}_min_m"
    changes = [{}, {"hip_height_m": 0.0}]
    return [
        [
            1000 * result.measure(phase, "PSO", **{k: result.lowest_hip_m(phase) for k in change})[index]
            for change in changes
        ]
        for phase in PHASES
    ]


@BOOK.claim("straight")
def measure_straight(result: NaoResults) -> list[list[float]]:
    gaits = [[result.measure(phase, "PSO", **change) for change in ({}, STRAIGHT)] for phase in PHASES]
    return [[1000 * gait[index] for gait in pair] for pair in gaits for index in MARGINS[:2]]


@BOOK.claim("oscillation")
def measure_oscillation(result: NaoResults) -> list[list[float]]:
    return [[result.measure(phase, "PSO", **change)["power_W"] for change in (STRAIGHT, {})] for phase in PHASES]


@BOOK.claim("oscillation-torque")
def measure_oscillation_torque(result: NaoResults) -> list[list[float]]:
    return [[_root_mean(result.sample(phase, **change).arrays["tau"]) for change in (STRAIGHT, {})] for phase in PHASES]


def _root_mean(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@BOOK.claim("relief")
def measure_relief(result: NaoResults) -> list[list[float]]:
    rows = []
    for phase in PHASES:
        ends = [result.sample(phase, hip_height_m=height) for height in (result.lowest_hip_m(phase), HIPS_M[0])]
        for kind in ("Knee", "Ankle"):
            columns = [name[1:].startswith(kind) for name in ends[0].joints]
            rows.append([_root_mean(end.arrays["tau"][:, columns]) for end in ends])
    return rows


@BOOK.claim("few-mm")
@BOOK.claim("hip-variation", searches=("GA", "PSO"))
def measure_hip_range(result: NaoResults, searches: Sequence[str] = SEARCHES) -> list[float]:
    return [1000 * float(np.ptp(result.sample("ssp", search).arrays["hip"][:, 2])) for search in searches]


def _compute_energies(result: NaoResults, search: str, *, heat: bool = True) -> dict[str, float]:
    """Return the energy that each joint draws in single support, or its mechanical part [J]."""
    signals, problem = result.sample("ssp", search), _load("ssp", ())[0]
    tau, loss = signals.arrays["tau"], heat * problem.value("heat_loss_W_per_Nm2")
    energies = np.trapezoid(np.abs(tau * signals.arrays["qd"]) + loss * tau**2, signals.arrays["t"], axis=0)
    return dict(zip(signals.joints, map(float, np.asarray(energies)), strict=True))


@BOOK.claim("knees", kind="Knee")
@BOOK.claim("hips", kind="Hip")
def measure_joints(result: NaoResults, kind: str) -> list[float]:
    leads = []
    for search in SEARCHES:
        drawn, shares = _compute_energies(result, search), dict.fromkeys((*KINDS, "arms"), 0.0)
        for joint, energy in drawn.items():
            group = next((k for k in KINDS if joint[1:].startswith(k)), "arms")
            shares[group] += 100 * energy / sum(drawn.values())
        leads.append(shares.pop(kind) - max(shares.values()))
    return leads


@BOOK.claim("swing-hip")
def measure_swing_hip(result: NaoResults) -> list[float]:
    shares = []
    for heat in (True, False):
        drawn = _compute_energies(result, "PSO", heat=heat)
        swing, support = (sum(drawn[f"{side}Hip{axis}"] for axis in ("Roll", "Pitch")) for side in "RL")
        shares.append(100 * swing / (swing + support))
    return shares


@BOOK.claim("swing-joints")
def measure_swing_joints(result: NaoResults) -> list[float]:
    ends = [result.sample("ssp", swing_height_m=height) for height in (0.015, 0.030)]
    columns = [ends[0].joints.index(f"R{joint}Pitch") for joint in ("Hip", "Knee", "Ankle")]
    hip, knee, ankle = np.degrees(np.abs(ends[1].arrays["q"] - ends[0].arrays["q"]).max(axis=0)[columns])
    return [float(knee - hip), float(ankle - hip)]


@BOOK.claim("too-slow-ssp", phase="ssp", end=-1)
@BOOK.claim("too-slow-dsp", phase="dsp", end=-1)
@BOOK.claim("too-fast-ssp", phase="ssp", end=0)
@BOOK.claim("too-fast-dsp", phase="dsp", end=0)
def measure_pace(result: NaoResults, phase: str, end: int) -> float:
    problem, time = _load(phase, ())[0], TIMES[phase]
    x = dict(zip(problem.names, PRINTED[phase, "PSO"].x, strict=True))
    margins = []
    for at in np.geomspace(problem.value(f"{time}.lower"), problem.value(f"{time}.upper"), PACES).tolist():
        rates = {name: value * x[time] / at for name, value in x.items() if name.startswith("hip_v")}
        gait = result.measure(phase, "PSO", **{time: at}, **rates)
        margins.append(min(gait[index] for index in MARGINS[:2]))
    return 100 * (1 - margins[end] / max(margins))


@BOOK.claim("lateral-margin")
def measure_lateral_margin(result: NaoResults) -> float:
    x6, x7 = PRINTED["ssp", "PSO"].x[5:7]
    halved = result.measure("ssp", "PSO", hip_vy_start_m_s=x6 / 2, hip_vy_end_m_s=x7 / 2)
    return 1000 * (result.measure("ssp", "PSO")["dbm_y_mean_m"] - halved["dbm_y_mean_m"])


@BOOK.claim("arms")
def measure_arms(result: NaoResults) -> list[float]:
    gains = []
    for phase in PHASES:
        held = evaluate(_make_spec(phase, result.reading, arms="held"), PRINTED[phase, "PSO"].x)
        gains.append(max(1000 * (result.measure(phase, "PSO")[index] - held[index]) for index in MARGINS))
    return gains


@BOOK.claim("statistic-ssp", rank_sum=70)
@BOOK.claim("statistic-dsp", rank_sum=90)
def measure_statistic(result: NaoResults, rank_sum: int, runs: int = 11) -> list[float]:
    z = (rank_sum - runs * (2 * runs + 1) / 2 + 0.5) / math.sqrt(runs**2 * (2 * runs + 1) / 12)
    p = math.erfc(abs(z) / math.sqrt(2))
    return [z, p, p / 2]


@BOOK.claim("better-ssp", runs=True, phase="ssp")
@BOOK.claim("better-dsp", runs=True, phase="dsp")
def measure_better(result: NaoResults, phase: str) -> Found:
    pso, ga = (result.final_powers(phase, search) for search in SEARCHES)
    return Found(1000 * float(np.median(ga) - np.median(pso)), p=approximate_rank_sum(pso, ga).p_two_sided)


@BOOK.claim("same-optimum-ssp", runs=True, phase="ssp")
@BOOK.claim("same-optimum-dsp", runs=True, phase="dsp")
def measure_run_excess(result: NaoResults, phase: str) -> list[float]:
    best = result.optimum(phase)["power_W"]
    return sorted(100 * (power / best - 1) for power in result.final_powers(phase, "PSO"))


@BOOK.claim("torque-rank", runs=True)
def measure_run_torques(result: NaoResults) -> list[float]:
    return [run.verdict.indexes["torque_change_Nm"] for run in result.searches["ssp", "PSO"]]


@BOOK.effect("zmp")
@BOOK.effect("samples")
@BOOK.effect("masses")
def describe_reading(results: Mapping[str, NaoResults]) -> str:
    return "largest error of the printed margins: " + "; ".join(
        f"{reading} reading {_find_error(results[reading], 'ssp'):.2f} mm in single support, "
        f"{_find_error(results[reading], 'dsp', MARGINS[:2]):.2f} mm in least margins of double support"
        for reading in OPTIONS
    )


def _find_error(result: NaoResults, phase: str, indexes: Sequence[str] = MARGINS) -> float:
    printed = [1000 * PRINTED[phase, search].figures[index] for search in SEARCHES for index in indexes]
    return float(np.abs(np.subtract(_list_margins(result, phase, indexes), printed)).max())


def _describe_option(results: Mapping[str, NaoResults], **option: Any) -> str:
    """Return powers and torque changes of PSO's printed solutions with another option."""
    texts = []
    for phase in PHASES:
        if phase == "ssp" and "torso_share" in option or option.get("arms") == "shared" and phase == "ssp":
            continue
        after = evaluate(_make_spec(phase, "printed", **option), PRINTED[phase, "PSO"].x)
        before = results["printed"].measure(phase, "PSO")
        changes = [
            f"{word} {100 * (after[index] / before[index] - 1):+.1f} %"
            for word, index in (("power", "power_W"), ("torque change", "torque_change_Nm"))
        ]
        margin = max(1000 * abs(after[index] - before[index]) for index in MARGINS)
        texts.append(f"{PHASES[phase]}: {', '.join(changes)}, margins by up to {margin:.1f} mm")
    return "; ".join(texts)


EFFECTS: Mapping[str, Mapping[str, Any]] = {
    "lever": {"torso_share": "lever"},
    "arms-shared": {"arms": "shared"},
    "finite": {"derivatives": "finite-difference-2"},
    "robot": {"robot": "nao-v6"},
    "separate": {"arms": "separate"},
    "held": {"arms": "held"},
}
for _name, _option in EFFECTS.items():
    BOOK.effect(_name)(partial(_describe_option, **_option))


def make_tables(results: Mapping[str, NaoResults]) -> list[Table]:
    """Return Tables 6 to 9 next to ours in both readings, rows 6 to 11 of Table 7, and shares of double support."""
    return [
        *(_tabulate_phase(results, phase) for phase in PHASES),
        _tabulate_swings(results),
        _tabulate_shares(results),
        *([_tabulate_runs(results)] if any(result.searches for result in results.values()) else []),
    ]


def _tabulate_phase(results: Mapping[str, NaoResults], phase: str) -> Table:
    columns: dict[str, Callable[[str], Any]] = {}
    for search in SEARCHES:
        printed = PRINTED[phase, search]
        columns[f"{search}, paper"] = printed.figures.__getitem__
        for reading, result in results.items():
            if not result.searches:
                columns[f"{search}, {reading} reading"] = result.measure(phase, search).__getitem__
        for robot in ("nao-v4", "nao-v6"):
            spec = _make_spec(phase, "printed", robot=robot)
            columns[f"{search}, printed reading, {robot[-2:].upper()}"] = evaluate(spec, printed.x).__getitem__
    for reading in OPTIONS:
        x = list(results[reading].optimum(phase)["x"].values())
        columns[f"IPOPT, {reading} reading"] = evaluate(_make_spec(phase, reading), x).__getitem__
    rows = [(index, *(value(index) for value in columns.values())) for index in INDEXES]
    headings = {"index": "", **dict.fromkeys(columns, ".4f")}
    return Table(
        name=f"table{TABLES[phase]}", columns=headings, rows=rows, caption=f"Table {TABLES[phase]}, {PHASES[phase]}"
    )


def _tabulate_swings(results: Mapping[str, NaoResults]) -> Table:
    rows = []
    for row in read_table("nao", "swing_heights"):
        height, printed = float(row["swing_height_m"]), [float(row[f"{search}_W"]) for search in SEARCHES]
        here = [results["printed"].measure("ssp", search, swing_height_m=height)["power_W"] for search in SEARCHES]
        rows.append((height, *printed, *here, printed[0] - here[0], printed[1] - here[1]))
    headings = (
        "PSO, paper [W]",
        "GA, paper [W]",
        "PSO's solution [W]",
        "GA's solution [W]",
        "PSO missing [W]",
        "GA missing [W]",
    )
    columns = {"swing height [m]": ".3f", **dict.fromkeys(headings, ".4f")}
    return Table(
        name="table7-swing-heights",
        columns=columns,
        rows=rows,
        caption="Table 7, rows 6 to 11; the printed solutions raised",
    )


def compare_shares(results: Mapping[str, NaoResults]) -> dict[tuple[str, str], tuple[float, float]]:
    """Return power [W] and excess over the optimum [%] of PSO's printed double support by share and who carries the arms."""
    shares = {}
    for share, arms in _list_shares():
        power = evaluate(_make_spec("dsp", "printed", torso_share=share, arms=arms), PRINTED["dsp", "PSO"].x)["power_W"]
        optimum = results["printed"].solved[f"share-{share}-{arms}"][0]
        shares[share, arms] = power, 100 * (power / optimum["power_W"] - 1) if optimum["feasible"] else math.nan
    return shares


def _tabulate_shares(results: Mapping[str, NaoResults]) -> Table:
    rows = [(*key, *values) for key, values in compare_shares(results).items()]
    columns = {"share of the torso": "", "arms": "", "PSO's solution [W]": ".4f", "above the optimum [%]": ".2f"}
    caption = "Double support: hip and time of the print, mean y margin at least that of the printed solution"
    return Table(name="shares", columns=columns, rows=rows, caption=caption)


def _tabulate_runs(results: Mapping[str, NaoResults]) -> Table:
    rows = []
    for reading, result in results.items():
        for phase, search in result.searches:
            powers = result.final_powers(phase, search)
            best = result.optimum(phase)["power_W"]
            rows.append(
                (reading, PHASES[phase], search, len(powers), min(powers), float(np.median(powers)), max(powers), best)
            )
    numbers = ("best [W]", "median [W]", "worst [W]", "IPOPT [W]")
    columns = {"reading": "", "phase": "", "search": "", "runs": "d", **dict.fromkeys(numbers, ".5f")}
    return Table(name="runs", columns=columns, rows=rows, caption="Runs of the searches")


def draw(results: Mapping[str, NaoResults]) -> Figure:
    """Return the errors of all printed margins in both readings."""
    figure, axes = make_axes(6.0, 3.0)
    for (reading, colour), offset in zip((("printed", "ga"), ("physical", "pso")), (-0.2, 0.2), strict=True):
        errors = [
            1000 * (results[reading].measure(phase, search)[index] - PRINTED[phase, search].figures[index])
            for phase, search in PRINTED
            for index in MARGINS
        ]
        axes.bar(np.arange(len(errors)) + offset, errors, 0.4, color=COLOURS[colour], label=f"{reading} reading")
    labels = [
        f"{phase} {search}\n{'least' if 'min' in index else 'mean'} {index[4]}"
        for phase, search in PRINTED
        for index in MARGINS
    ]
    axes.set_xticks(range(len(labels)), labels, rotation=90, fontsize="x-small")
    axes.set(ylabel="error of the margin [mm]")
    axes.legend()
    return Figure(
        name="margins", caption="Margins of the printed solutions here, less the printed ones", drawing=figure
    )


def explain(results: Mapping[str, NaoResults]) -> list[str]:
    """Return what stays unexplained, and what cannot be tested."""
    result = results["printed"]
    missing = {key: PRINTED[key].figures["power_W"] - result.measure(*key)["power_W"] for key in PRINTED}
    torque = [result.measure("dsp", search)["torque_change_Nm"] for search in SEARCHES]
    printed = [PRINTED["dsp", search].figures["torque_change_Nm"] for search in SEARCHES]
    means = [
        m - 1000 * PRINTED["dsp", "PSO"].figures[index]
        for index, m in zip(MARGINS[2:], _list_margins(result, "dsp", MARGINS[2:])[:2], strict=True)
    ]
    shares = compare_shares(results)
    carried, apart, shared = (f"{shares['lever', arms][1]:.1f} %" for arms in ("carried", "separate", "shared"))
    return [
        f"**Unexplained.** Power of single support is {missing['ssp', 'PSO']:.3f} W (PSO) and {missing['ssp', 'GA']:.3f} W (GA) "
        "below the print: nearly a constant, which touches no optimum or ranking (at other swing heights see the table). "
        f"Torque change of double support is {torque[0]:.3f} and {torque[1]:.3f} Nm for {printed[0]} and {printed[1]} Nm in "
        f"print; its mean margins differ by {means[0]:+.1f} and {means[1]:+.1f} mm (x, y). Its power depends on who carries the "
        f"arms, which is not printed: PSO's printed solution is {shares['printed', 'carried'][1]:.1f} % above the optimum by "
        f"(28), (29) as printed, and {apart} (arms apart), {shared} (arms shared), "
        f"{carried} (own arms) by the lever rule of the text.",
        "**Not tested.** Not printed: initial populations, final values of single runs, masses, figures as numbers, and other "
        "genetic algorithms against which SBX is called the most efficient. Not implemented: Webots, the robot itself.",
    ]


REPRODUCTION: Paper[NaoEffort, NaoResults] = Paper(
    book=BOOK,
    title="The gait cycle of NAO: Gupta, Pratihar, Deb (2023)",
    full=NaoEffort(runs=11),
    quick=NaoEffort(),
    readings={
        "printed": "ten samples, (19) and (20) with g = 9.8 as printed, 23 masses in double support",
        "physical": "ten intervals, physical gravity, all masses",
    },
    run_readings={
        f"{reading}, {label}": f"{reading} reading; PSO with {word}"
        for reading in OPTIONS
        for label, word in (("constant", "the inertia weight of 1"), ("damped", "the damping of the cited code"))
    },
    compute=compute,
    headlines=(
        "margins-ssp-digits",
        "pso-optimal-ssp",
        "better-ssp",
        "better-dsp",
        "mean-x-lead",
        "torque-level-ssp",
        "least-margins-dsp",
        "power-ssp",
        "torque-level-dsp",
        "slower-ssp",
    ),
    tables=make_tables,
    figure=draw,
    explain=explain,
)
