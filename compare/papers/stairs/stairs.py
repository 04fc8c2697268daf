"""Bhardwaj, Mishra, Sukavanam, Balasubramanian: a planned step on stairs, and its tracking by gains that an ant colony tunes.

Plans are IPOPT's, of least jerk as the paper's and of least energy. The tracked step is read in five ways: nearest the print the
hip is the base, so that something else carries the robot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from compare.drawing.figures import make_figure
from compare.judge import evaluate
from compare.papers.paper import Paper, read_book, read_table
from compare.papers.paper_runs import (
    Effort,
    Runner,
    Runs,
    choose_best,
    get_point,
    make_computation,
    make_search_tasks,
    make_start_tasks,
)
from compare.papers.stairs import printed
from compare.papers.stairs.printed import TABLE_3, TABLE_4, describe_climb, measure_equations, measure_slide, move
from compare.report.document import Figure, Table, Value
from compare.study.record import RunRecord
from compare.study.store import Computation
from compare.study.task import IPOPT, ProblemSpec, Task
from metaheuristics import AntColony, minimize
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.formulation import Assembly, Point
from nlp_gait.formulation.display import LEFT, RIGHT
from nlp_gait.gaits.stairs.closed_loop import QUANTUM
from nlp_gait.gaits.stairs.stair import SETBACK
from nlp_gait.gaits.stairs.track import PLAN
from nlp_gait.symbolic.nonsmooth import Nonsmooth

BOOK = read_book("stairs")
PLANS = {"least jerk": "jerk", "least energy": "energy"}  # readings of claims on plans
UNITS = {"jerk": "rad/s^3", "energy": "J"}
INDEXES = {"jerk": "peak_jerk_rad_s3", "energy": "energy_J"}
DRAWN_CASE = 2
ANTS, ITERATIONS = 30, 100  # Table IV
COLONY = AntColony(
    population=ANTS, spread=0.7
)  # of the printed evaporation rate; the paper defines none for real numbers
NETWORK_RATES = {
    "1e-4, lengths in m": (1e-4, 1.0),
    "1e-4, lengths in cm": (1e-4, 100.0),
    "0.3, lengths in m": (0.3, 1.0),
}
AS_PRINTED: Mapping[str, Any] = {"coordinates": "printed", "rates": "differences", "tracking_limit": False}
PRINTED_VALUES = {"gravity_compensation": 0.0, "spin_in_zmp": 0.0, "slope_in_single_support": 1.0}
# Fast for one solve from near the optimum; compiled and with exact derivatives a plan takes twice as long.
NEAR_OPTIMUM = {"compiled": False, "hessian": "limited-memory"}
TRACK_START = {"kp": 40.0, "kd": 6.0, "torso_pitch_rad": 1.58}
EVENT_NAMES = ("t1_s", "t2_s", "t_bc_s")


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracking:
    """A reading of the tracked step."""

    text: str
    plan: str
    options: Mapping[str, Any] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)


GAINS_TO_100 = {"kp.upper": 100.0, "kd.upper": 100.0}
TRACKINGS = {
    "as printed": Tracking(
        text="the hip as base and six contacts, angles by (27), (28), desired rates by differences, no compensation of gravity, "
        "no limit of errors, (49) as printed; plan of least jerk, gains up to 100",
        plan="jerk",
        options={**AS_PRINTED, "base": "hip"},
        values={**PRINTED_VALUES, **GAINS_TO_100},
    ),
    "network": Tracking(
        text="as printed with desired angles of the legs by the network, trained online within each evaluation: the "
        "paper's whole chain",
        plan="jerk",
        options={**AS_PRINTED, "base": "hip", "inverse_kinematics": "network"},
        values={**PRINTED_VALUES, **GAINS_TO_100},
    ),
    "gains to 10,000": Tracking(
        text="as printed with other bounds of the gains, which are not printed",
        plan="jerk",
        options={**AS_PRINTED, "base": "hip"},
        values=PRINTED_VALUES,
    ),
    "stance ankle": Tracking(
        text="the same with the stance ankle as base, gains up to 10,000",
        plan="jerk",
        options=AS_PRINTED,
        values=PRINTED_VALUES,
    ),
    "ours": Tracking(
        text="the stance ankle as base, joint angles and torques, exact rates, gravity compensated, errors within 0.1 rad; "
        "plan of least energy, gains up to 10,000",
        plan="energy",
    ),
}
LITERAL = "as printed"


def fix(**values: float) -> dict[str, float]:
    """Return the bounds of variables that have given values."""
    return {f"{name}.{end}": value for name, value in values.items() for end in ("lower", "upper")}


# The planner's choices that can be undone, as options and values, by the id of the difference.
CHOICES: Mapping[str, tuple[Mapping[str, Any], Mapping[str, float]]] = {
    "end-rate": ({}, fix(end_rate_rad_s=7.4279)),  # sqrt(g / r) of case 2
    "straight": ({}, {"foot_pitch_rad.upper": 0.0}),
    "torso": ({}, fix(torso_pitch_rad=TABLE_4[DRAWN_CASE].torso_pitch_rad)),
    "times": ({}, fix(**{name: TABLE_3[name] for name in EVENT_NAMES})),
    "shanks": ({"shanks": "limited"}, {}),
    "hull": ({"balance": "polygon"}, {}),
    "edges": ({}, {"clearance_m": -1.0}),
}
NO_LIMITS = {"acceleration_limit_rad_s2": 1e6, "zmp_margin_m": 0.0, "clearance_m": 0.0, "friction": 100.0}
NO_LIMITS |= {"least_stance_force_N": 0.0, "reach_margin": 1e-4}


@dataclass(frozen=True, kw_only=True)
class StairsEffort(Effort):
    """Effort of the reproduction."""

    runs: int = 3  # of the colony on each reading of the tracked step
    evaluations: int = ANTS * ITERATIONS  # of a run, as in the paper
    starts: int = 2  # of IPOPT on each plan, one of them near our best known plan; of the printed hip height
    poses: int = 350  # of the network, every 0.01 s
    track_s: float = 3.5  # of the tracked steps that IPOPT solves
    track_cases: tuple[int, ...] = tuple(TABLE_4)  # that IPOPT solves, in the literal reading

    @property
    def steps(self) -> int:
        """Plans, tracked steps, other computations, and the report."""
        cases = len(TABLE_4)
        plans = 2 * cases * self.starts + (2 * len(CHOICES) + cases * self.starts if self.runs else 0)
        tracks = len(self.track_cases) + len(TRACKINGS) * cases * self.runs
        return plans + tracks + 2 * (2 * cases + 1) + (len(TRACKINGS) * cases if self.runs else 0) + 1


@dataclass(frozen=True, kw_only=True, eq=False)
class StairsResults:
    """Results in one reading."""

    plan: str  # "jerk" or "energy"
    runs: Runs
    computed: Mapping[str, Any]  # by name
    tracking: str = ""  # reading of the tracked step

    def best(self, case: int) -> RunRecord:
        """Return our best plan of a case."""
        return choose_best(self.runs[f"{self.plan}-{case}", IPOPT])

    def list_plans(self, name: str) -> list[float]:
        """Return a variable of the plans of all cases."""
        return [self.best(case).x[name] for case in TABLE_4]

    @cached_property
    def motions(self) -> dict[int, tuple[Any, dict[str, Any]]]:
        """Motions of the plans by case, see ``move``."""
        return {case: move(make_plan_spec(self.plan, case), self.best(case).x) for case in TABLE_4}

    @cached_property
    def peaks(self) -> list[tuple[float, float]]:
        """Largest acceleration [rad/s^2] and jerk [rad/s^3] by case."""
        plans = [(case, self.best(case).x) for case in TABLE_4]
        return [printed.measure_peaks(make_track_spec(case, x), x["torso_pitch_rad"]) for case, x in plans]

    def list_computed(self, what: str, key: str | None = None) -> list[Any]:
        """Return a number of a computation on the plans of all cases, or on the tracked steps."""
        results = [self.computed[f"{what}-{self.tracking or self.plan}-{case}"] for case in TABLE_4]
        return results if key is None else [result[key] for result in results]

    @cached_property
    def tracked(self) -> list[RunRecord]:
        """The colony's best tracked steps by case."""
        return [choose_best(self.runs[_title(self.tracking, case), "aco"]) for case in TABLE_4]

    def list_tracked(self, name: str) -> list[float]:
        """Return a tuned value or an index of the tracked steps of all cases."""
        return [{**run.x, **run.verdict.indexes}[name] for run in self.tracked]


def make_plan_spec(plan: str, case: int, label: str = "", **options: Any) -> ProblemSpec:
    """Return the planner of a case, of least jerk or energy."""
    options = {"minimise": plan, **options}
    return ProblemSpec(name="stairs-plan", options=options, values=TABLE_4[case].stair, label=label or f"{plan}-{case}")


def make_track_spec(case: int, plan: Mapping[str, float], tracking: str = "", **options: Any) -> ProblemSpec:
    """Return the tracking of a plan, given by the planner's variables."""
    reading = TRACKINGS[tracking or LITERAL]
    values = {**TABLE_4[case].stair, **{name: plan[name] for name in PLAN}, **reading.values}
    label = _title(tracking, case)
    return ProblemSpec(name="stairs-track", options={**reading.options, **options}, values=values, label=label)


def _title(tracking: str, case: int) -> str:
    return f"track-{tracking.replace(' ', '-').replace(',', '')}-{case}"


def compute(runner: Runner, effort: StairsEffort) -> dict[str, StairsResults]:
    """Plan all steps; then undo choices of the planner, simulate the plans, and track them."""
    runs = runner.run_tasks(_make_plan_tasks(effort))
    plans = {plan: StairsResults(plan=plan, runs=runs, computed={}) for plan in PLANS.values()}
    tasks = [*_make_track_tasks(effort, plans), *(_make_choice_tasks(effort, plans) if effort.runs else ())]
    runs |= runner.run_tasks(tasks)
    computed = runner.compute([*_make_computations(effort, plans)], code=[printed])
    results = {reading: StairsResults(plan=plan, runs=runs, computed=computed) for reading, plan in PLANS.items()}
    if effort.runs:
        for name, tracking in TRACKINGS.items():
            results[name] = StairsResults(plan=tracking.plan, runs=runs, computed=computed, tracking=name)
        again = runner.compute([*_make_power_computations(effort, results)], code=[])
        results = {name: replace(result, computed={**computed, **again}) for name, result in results.items()}
    return results


def _make_plan_tasks(effort: StairsEffort) -> Iterator[Task]:
    for row in read_table("stairs", "starts"):
        spec = make_plan_spec(row.pop("plan"), int(row.pop("case")))
        start = {name: float(value) for name, value in row.items()}
        yield Task(problem=spec, solver=IPOPT, settings=NEAR_OPTIMUM, start=start)
        for task in make_start_tasks(spec, effort.starts - 1):
            yield replace(task, run=task.run + 1)


def _make_choice_tasks(effort: StairsEffort, plans: Mapping[str, StairsResults]) -> Iterator[Task]:
    """Yield plans of case 2 under each choice, from ours, and plans with the printed hip height without our limits."""
    for name, (options, values) in CHOICES.items():
        for plan, result in plans.items():
            spec = make_plan_spec(plan, DRAWN_CASE, label=f"{plan}-{name}", **options)
            yield _start_near(replace(spec, values={**spec.values, **values}), result.best(DRAWN_CASE))
    for case in TABLE_4:
        spec = make_plan_spec("energy", case, label=f"hip-{case}", balance="polygon", angle_limits=False)
        values = {**spec.values, **NO_LIMITS, **fix(hip_height_m=TABLE_3["hip_height_m"])}
        yield from make_start_tasks(replace(spec, values=values), effort.starts)


def _start_near(spec: ProblemSpec, best: RunRecord) -> Task:
    problem = spec.load()
    ends = zip(problem.names, problem.lower, problem.upper, strict=True)
    start = {name: float(np.clip(best.x[name], lower, upper)) for name, lower, upper in ends}
    return Task(problem=spec, solver=IPOPT, start=start)


def _make_track_tasks(effort: StairsEffort, plans: Mapping[str, StairsResults]) -> Iterator[Task]:
    for name, tracking in TRACKINGS.items():
        for case in TABLE_4:
            spec = make_track_spec(case, plans[tracking.plan].best(case).x, name)
            yield from make_search_tasks(spec, {"aco": COLONY}, effort.runs, effort.evaluations)
            if name == LITERAL and case in effort.track_cases:
                spec = replace(spec, options={**spec.options, "duration_s": effort.track_s})
                yield Task(
                    problem=spec if effort.runs else replace(spec, label=f"{spec.label}-short"),
                    solver=IPOPT,
                    settings={"time_limit_s": 600.0},
                    start=TRACK_START,
                )


def _make_computations(effort: StairsEffort, plans: Mapping[str, StairsResults]) -> Iterator[Computation]:
    for plan, result in plans.items():
        for case, row in TABLE_4.items():
            spec, x = make_plan_spec(plan, case), dict(result.best(case).x)
            yield make_computation(f"climb-{plan}-{case}", spec, partial(printed.simulate_climb, spec), x=x)
            track = make_track_spec(case, x)
            yield make_computation(f"gains-{plan}-{case}", track, partial(printed.follow_printed_gains, track, row))
        first = result.best(1).x
        track = make_track_spec(1, first)
        settings = {
            "torso_pitch_rad": first["torso_pitch_rad"],
            "rates": [*NETWORK_RATES.values()],
            "poses": effort.poses,
        }
        yield make_computation(f"network-{plan}", track, partial(printed.train_network, track), **settings)


def _make_power_computations(effort: StairsEffort, results: Mapping[str, StairsResults]) -> Iterator[Computation]:
    for name in TRACKINGS:
        for case, run in zip(TABLE_4, results[name].tracked, strict=True):
            spec = make_track_spec(case, results[name].best(case).x, name)
            settings = {"x": get_point(run), "evaluations": effort.evaluations}
            yield make_computation(f"power-{name}-{case}", spec, partial(tune_otherwise, spec), **settings)


def tune_otherwise(spec: ProblemSpec, x: Sequence[float], evaluations: int) -> dict[str, float]:
    """Return the energies of the gains tuned without the power in (53), and of the gains x with an upright torso [J]."""
    problem = spec.load()

    def drop_power(assembly: Assembly, point: Point, _: Nonsmooth) -> Assembly:
        margin = point["zmp_weight"] * assembly.indexes["zmp_margin_min_m"]
        return replace(assembly, objective=assembly.indexes["tracking_cost"] - margin)

    objective = compile_objective(problem.derive(name="stairs-errors", change=drop_power), threads=1)
    tuned = minimize(objective, COLONY, evaluations=evaluations, seed=0).x
    points = {"without_power_J": tuned.tolist(), "upright_J": [*x[:2], np.pi / 2]}
    return {name: float(evaluate(problem, point).indexes["energy_J"]) for name, point in points.items()}


@BOOK.claim("jerk-t1", name="t1_s")
@BOOK.claim("jerk-t2", name="t2_s")
@BOOK.claim("jerk-t_bc", name="t_bc_s")
def list_times(results: StairsResults, name: str) -> list[float]:
    return results.list_plans(name)


@BOOK.claim("jerk-terms")
def list_jerk_terms(results: StairsResults) -> list[float]:
    shares = [100 * case.jerk * QUANTUM / case.acceleration for case in TABLE_4.values()]
    return [share / divisor for share in shares for divisor in (2, 3)]


@BOOK.claim("peak-acceleration", column=0)
@BOOK.claim("peak-jerk", column=1)
def list_peaks(results: StairsResults, column: int) -> list[float]:
    return [peak[column] for peak in results.peaks]


@BOOK.claim("least-peaks")
def list_peak_leads(results: StairsResults) -> list[float]:
    return [lead for column in (0, 1) for lead in list_leads(list_peaks(results, column))]


def list_leads(values: Sequence[float]) -> list[float]:
    """Return by how much the values of cases 1 and 3 are above that of case 2 [%]."""
    return [100 * (values[k] / values[1] - 1) for k in (0, 2)]


@BOOK.claim("reach")
def list_reaches(results: StairsResults) -> list[float]:
    reaches = []
    for case, row in TABLE_4.items():
        x = dict(results.best(case).x)
        x |= {"hip_start_m": x["hip_start_m"] + row.step_m[0] / 2, "hip_height_m": TABLE_3["hip_height_m"]}
        problem = make_plan_spec(results.plan, case).load()
        reaches.append(float(problem.signals(problem.check_x(x)).arrays["reach"].max()))
    return reaches


@BOOK.claim("collisions")
def list_depths(results: StairsResults) -> list[float]:
    depths = []
    for case, (signals, legs) in results.motions.items():
        lifted = signals.arrays["t"] > results.best(case).x["t2_s"]
        depths.append(printed.measure_depths(TABLE_4[case], legs, lifted))
    return [depth for part in zip(*depths, strict=True) for depth in part]


@BOOK.claim("climb-landing", key="landing_%")
@BOOK.claim("climb-rise", key="risen_%")
def list_climbs(results: StairsResults, key: str) -> list[float] | None:
    climbs = results.list_computed("climb")
    return [climb[key] for climb in climbs] if all(climbs) else None


@BOOK.claim("network", key="converged_%")
@BOOK.claim("real-time", key="later_converged_%")
def measure_network(results: StairsResults, key: str) -> float:
    return float(results.computed[f"network-{results.plan}"][0][key])


@BOOK.claim("warm-network")
def measure_warm_network(results: StairsResults) -> float:
    network = results.computed[f"network-{results.plan}"][0]
    return 100 * network["later_steps"] / network["first_steps"]


@BOOK.claim("printed-gains")
def list_printed_errors(results: StairsResults) -> list[float]:
    return results.list_computed("gains")


@BOOK.claim("best-cost", runs=True, index="controller_cost")
@BOOK.claim("best-energy", runs=True, index="energy_J")
@BOOK.claim("best-torque", runs=True, index="peak_torque_Nm")
def list_tracked_leads(results: StairsResults, index: str) -> list[float]:
    return list_leads(results.list_tracked(index))


@BOOK.claim("least-gains", runs=True)
def list_gain_leads(results: StairsResults) -> list[float]:
    return [lead for gain in ("kp", "kd") for lead in list_leads(results.list_tracked(gain))]


@BOOK.claim("ratios-cost", runs=True, index="controller_cost")
@BOOK.claim("ratios-torque", runs=True, index="peak_torque_Nm")
def list_ratios(results: StairsResults, index: str) -> list[float]:
    return [1 + lead / 100 for lead in list_tracked_leads(results, index)]


@BOOK.claim("track-energy", runs=True)
def list_energies(results: StairsResults) -> list[float]:
    return results.list_tracked("energy_J")


@BOOK.claim("follow", runs=True)
def list_errors(results: StairsResults) -> list[float]:
    return results.list_tracked("largest_error_rad")


@BOOK.claim("torso-energy", runs=True, key="upright_J")
@BOOK.claim("power-term", runs=True, key="without_power_J")
def measure_saving(results: StairsResults, key: str) -> float:
    return 100 * (1 - sum(list_energies(results)) / sum(results.list_computed("power", key)))


def _describe_choice(results: Mapping[str, StairsResults], name: str) -> str:
    texts = []
    for reading, plan in PLANS.items():
        result, runs = results[reading], results[reading].runs[f"{plan}-{name}", IPOPT]
        (run,), ours = runs, result.best(DRAWN_CASE).verdict.indexes[INDEXES[plan]]
        value = f"{run.verdict.indexes[INDEXES[plan]]:.1f} {UNITS[plan]}"
        text = value if run.verdict.feasible else f"no plan ({', '.join(run.verdict.violated[:1])})"
        texts.append(f"{reading}: {text} instead of {ours:.1f} {UNITS[plan]}")
    return f"case {DRAWN_CASE}, {'; '.join(texts)}"


for _name in CHOICES:
    BOOK.effect(_name, runs=True)(partial(_describe_choice, name=_name))


@BOOK.effect("hip-height", runs=True)
def describe_hip_height(results: Mapping[str, StairsResults]) -> str:
    starts = [next(iter(results.values())).runs[f"hip-{case}", IPOPT] for case in TABLE_4]
    counts = " / ".join(str(sum(run.verdict.feasible for run in runs)) for runs in starts)
    violated = "; ".join([*choose_best(runs).verdict.violated, "nothing"][0] for runs in starts)
    return f"{counts} of {len(starts[0])} starts feasible at their samples, even without our limits; between them: {violated}"


@BOOK.effect("colony", runs=True)
def describe_colony(results: Mapping[str, StairsResults]) -> str:
    result = results[LITERAL]
    solved = [choose_best(result.runs[_title(LITERAL, case), IPOPT]).verdict.objective for case in TABLE_4]
    changes = [100 * (ours / run.verdict.objective - 1) for ours, run in zip(solved, result.tracked, strict=True)]
    return (
        f"IPOPT from one start ends {' / '.join(f'{change:+.1f}' for change in changes)} % above the colony's best run"
    )


@BOOK.effect("foot-angles")
def describe_foot_angles(results: Mapping[str, StairsResults]) -> str:
    misses = measure_equations(TABLE_4[DRAWN_CASE])
    return (
        f"with Table III the sole jumps by {misses['sole_jump_deg']:.0f} degrees at t1 and ends {misses['sole_end_deg']:.0f} "
        f"degrees off; the toe ends at {misses['toe_end_deg']:.0f} instead of 30 degrees"
    )


@BOOK.effect("bezier")
def describe_bezier(results: Mapping[str, StairsResults]) -> str:
    misses = measure_equations(TABLE_4[DRAWN_CASE])
    return (
        f"the printed weights pull the curve up to {misses['bridge_mm']:.0f} mm towards the origin, and the ankle's speed "
        f"jumps by {misses['lift_off_m_s']:.2f} m/s at t2, against the claim of continuity"
    )


@BOOK.effect("arc")
def describe_arc(results: Mapping[str, StairsResults]) -> str:
    return f"the hip would start {measure_equations(TABLE_4[DRAWN_CASE])['arc_m']:.2f} m above its place"


@BOOK.effect("flat-stairs")
def describe_flat_stairs(results: Mapping[str, StairsResults]) -> str:
    return f"{measure_slide(0.30, 0.10):.0f} mm inside a step of 10 cm on 30 cm; nothing on the stairs of Table IV"


def make_tables(results: Mapping[str, StairsResults]) -> list[Table]:
    """Return Tables III and IV next to ours, the plans in the engine, the tracked steps, and the network."""
    return [
        _tabulate_plans(results),
        _tabulate_table_4(results),
        _tabulate_climbs(results),
        _tabulate_tracks(results),
        _tabulate_network(results),
    ]


def _tabulate_plans(results: Mapping[str, StairsResults]) -> Table:
    names = results["least jerk"].best(DRAWN_CASE).x
    columns = {f"{reading}, case {case}": ".4f" for reading in PLANS for case in TABLE_4}
    rows: list[list[Value]] = [
        [name, TABLE_3.get(name), *(value for reading in PLANS for value in results[reading].list_plans(name))]
        for name in names
    ]
    caption = "Table III and our plans; its torso pitch is in Table IV"
    return Table(name="table3", columns={"parameter": "", "paper": ".4f", **columns}, rows=rows, caption=caption)


def _tabulate_table_4(results: Mapping[str, StairsResults]) -> Table:
    tracked = [name for name in TRACKINGS if name in results]
    rows: list[list[Value]] = []
    for column, quantity in enumerate(("acceleration", "jerk")):
        peaks = list_peaks(results["least jerk"], column)
        rows.append([quantity, *(getattr(case, quantity) for case in TABLE_4.values()), "least jerk", *peaks])
    indexes = {"cost": "controller_cost", "energy": "energy_J"}
    for quantity in ("torso_pitch_rad", "kp", "kd", "cost", "energy", "peak_torque_Nm"):
        for name in tracked:
            values = results[name].list_tracked(indexes.get(quantity, quantity))
            rows.append([quantity, *(getattr(case, quantity) for case in TABLE_4.values()), name, *values])
    papers, ours = ({f"{who}, case {case}": ".5g" for case in TABLE_4} for who in ("paper", "here"))
    caption = "Table IV; cost: the mean of (53), energy here in J"
    return Table(name="table4", columns={"quantity": "", **papers, "reading": "", **ours}, rows=rows, caption=caption)


def _tabulate_climbs(results: Mapping[str, StairsResults]) -> Table:
    rows: list[list[Value]] = [
        [reading, case, *map(climb.get, ("slip_m", "energy_J")), describe_climb(climb)]
        for reading in PLANS
        for case, climb in zip(TABLE_4, results[reading].list_computed("climb"), strict=True)
    ]
    columns = {"plan": "", "case": "d", "slip of the stance foot [m]": ".3f", "energy [J]": ".1f", "result": ""}
    caption = "The plans in MuJoCo, their angles followed by drives; feet and shanks are solid"
    return Table(name="climbs", columns=columns, rows=rows, caption=caption)


def _tabulate_tracks(results: Mapping[str, StairsResults]) -> Table:
    runs, rows = results["least jerk"].runs, list[list[Value]]()
    for (title, solver), records in runs.items():
        if title.startswith("track-"):
            best = choose_best(records)
            indexes, verdict = best.verdict.indexes, best.verdict
            names = ("controller_cost", "energy_J", "peak_torque_Nm", "zmp_margin_min_m", "largest_error_rad")
            numbers = [verdict.objective, *(indexes[name] for name in names), *get_point(best)]
            rows.append([title.removeprefix("track-"), solver, len(records), verdict.feasible, *numbers])
    headings = {"reading and case": "", "solver": "", "runs": "d", "feasible": "", "objective": ".4f"}
    headings |= {"mean of (53)": ".2f", "energy [J]": ".2f", "peak torque [N m]": ".2f", "ZMP margin [m]": ".4f"}
    headings |= {"error [rad]": ".4f", "K_p": ".2f", "K_d": ".2f", "torso [rad]": ".4f"}
    caption = (
        "Tracked steps by the colony and by IPOPT; the objective is the mean of (53) less the worth of the ZMP margin"
    )
    return Table(name="tracks", columns=headings, rows=sorted(rows, key=lambda row: str(row[:2])), caption=caption)


def _tabulate_network(results: Mapping[str, StairsResults]) -> Table:
    rows: list[list[Value]] = [
        [reading, label, *row.values()]
        for reading, plan in PLANS.items()
        for label, row in zip(NETWORK_RATES, results[reading].computed[f"network-{plan}"], strict=True)
    ]
    headings = ("converged [%]", "after the first pose [%]", "steps of the first pose", "median steps of later poses")
    columns = {"plan of case 1": "", "rate": "", **dict.fromkeys(headings, ".1f"), "largest error [rad]": ".4f"}
    caption = "Inverse kinematics by the network: poses within 1e-6 m^2 (cm^2) after at most 5000 steps"
    return Table(name="network", columns=columns, rows=rows, caption=caption)


def draw(results: Mapping[str, StairsResults]) -> Figure:
    """Return both legs in the plan of least jerk of case 2, on the stairs."""
    signals, legs = results["least jerk"].motions[DRAWN_CASE]
    tread, rise = TABLE_4[DRAWN_CASE].step_m
    figure = make_figure(height_in=3.2)
    edges = np.array([-1.6 * tread, *np.repeat([-SETBACK, tread - SETBACK], 2), 1.8 * tread])
    heights = np.repeat([-rise, 0.0, rise], 2)
    poses = np.linspace(0, len(signals.arrays["t"]) - 1, 25).astype(int)
    for axes, side, name in zip(figure.subplots(1, 2, sharey=True), (RIGHT, LEFT), ("swing", "stance"), strict=True):
        axes.fill_between(edges, heights, -1.3 * rise, color="0.9", linewidth=0)
        for k, pose in enumerate(poses):
            axes.plot(*legs[side][pose].T, color=(0.0, 0.45, 0.7, 0.25 + 0.75 * k / len(poses)), linewidth=0.8)
        axes.set(aspect="equal", xlabel="x [m]", title=f"{name} leg")
    figure.axes[0].set_ylabel("z [m]")
    caption = f"The plan of least jerk, case {DRAWN_CASE} (Figs. 8, 9): its shanks pass through the next step"
    return Figure(name="legs", caption=caption, drawing=figure)


def explain(results: Mapping[str, StairsResults]) -> list[str]:
    """Return what decides the headline, and what cannot be tested."""
    climbs = "; ".join(map(describe_climb, results["least jerk"].list_computed("climb")))
    return [
        "**In which reading case 2 is best.** Nearest the print the robot hangs on its planned hip, and gains are "
        "bounded by 100: case 2 then has the least cost, energy and torque and the least gains, as Table IV says. Its "
        "lead in torque is a hundredth, its errors are the largest of the three, and its tread is the shortest.",
        f"**The plan of least jerk in MuJoCo**, cases 1 / 2 / 3: {climbs}. Its shanks would be centimetres inside the "
        "next step, which the planner does not forbid, but the engine does.",
        "**What cannot be tested.** *Not printed:* moments of inertia, stiffness and damping of the ground, bounds of "
        "the gains, start of the hip, ends of the ZMP, edges of the stairs, units of cost and energy, and any number "
        "for flat feet, inverted pendulums, polynomials or supervised networks. Inertias and contact change the "
        "tracked step by 0.5 % at most. *Not implemented:* a colony at every instant (Algorithm 4), which an earlier "
        "version ran with a tenth of the paper's evaluations, see the differences.",
    ]


REPRODUCTION: Paper[StairsEffort, StairsResults] = Paper(
    book=BOOK,
    title="Climbing stairs with a toe-foot biped: Bhardwaj, Mishra, Sukavanam, Balasubramanian",
    full=StairsEffort(),
    quick=StairsEffort(runs=0, starts=1, poses=50, track_s=0.3, track_cases=(DRAWN_CASE,)),
    readings={
        "least jerk": "IPOPT's plan of least peak jerk, as the paper's knot shifting, within our limits",
        "least energy": "IPOPT's plan of least energy",
    },
    run_readings={name: tracking.text for name, tracking in TRACKINGS.items()},
    compute=compute,
    headlines=(
        *("best-cost", "best-energy", "best-torque", "least-gains", "track-energy"),
        *("jerk-t1", "jerk-t2", "climb-landing", "network", "printed-gains"),
    ),
    tables=make_tables,
    figure=draw,
    explain=explain,
)
