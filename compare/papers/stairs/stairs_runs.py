"""Runs and other computations of the stairs reproduction."""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, get_args

import numpy as np

from compare.judge import evaluate
from compare.papers import paper_runs
from compare.papers.claims import Series
from compare.papers.paper_runs import choose_best, get_point, make_computation, make_search_tasks, make_start_tasks
from compare.papers.stairs import stairs_paper
from compare.papers.stairs.stairs_instants import Decides
from compare.papers.stairs.stairs_paper import ANTS, CHOICES, ITERATIONS, PLAN_CHOICES, PRINTED, TABLE_3, TABLE_4
from compare.study.record import RunRecord
from compare.study.store import Computation
from compare.study.task import IPOPT, ProblemSpec, Task
from metaheuristics import AntColony, AntColonyGrid, GeneticAlgorithm, ParticleSwarm, minimize
from metaheuristics.interface import Algorithm
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.formulation import Array, Assembly, Point
from nlp_gait.gaits.stairs.leg_network import LEGS, NetworkPath, NetworkSettings, compute_leg_vector, train_angles
from nlp_gait.gaits.stairs.leg_network import PRINTED as PRINTED_NETWORK
from nlp_gait.gaits.stairs.planar_biped import LINKS, load_toe_foot_biped
from nlp_gait.gaits.stairs.track import PLAN
from nlp_gait.symbolic.nonsmooth import Nonsmooth

ALGORITHMS: Mapping[str, Algorithm] = {
    "aco": AntColony(population=ANTS, spread=stairs_paper.EVAPORATION),
    "aco-usual": AntColony(population=ANTS),  # with the spread of its authors
    "aco-grid": AntColonyGrid(population=ANTS, evaporation=stairs_paper.EVAPORATION),
    "pso": ParticleSwarm(),
    "ga": GeneticAlgorithm(),
}
ACO = "aco"  # the paper's search
DRAWN_CASE = 2  # where the paper draws one case only
TRACK_START = {"kp": 60.0, "kd": 60.0, "torso_pitch_rad": 1.4}
IMPOSSIBLE_RISE_M = 0.5
RULES = {  # of the network, and units of length in a metre
    "adam": (NetworkSettings(), 1.0),
    "gradient 0.3": (NetworkSettings(rule="gradient", rate=0.3), 1.0),
    "gradient 0.05": (NetworkSettings(rule="gradient", rate=0.05), 1.0),
    "gradient 1e-4, as printed, in m": (PRINTED_NETWORK, 1.0),
    "gradient 1e-4, as printed, in cm": (PRINTED_NETWORK, 100.0),
}
CLOSED_FORM, KINDS = "closed form", ("closed-form", "network")  # in the table of the network; of inverse kinematics
TORSO_INDEXES = ("energy_J", "zmp_margin_min_m")
PER_CASE = 4  # see ``make_computations``
POWERLESS = (stairs_paper.OURS, "jerk", PRINTED)  # readings of the tracked step that are tuned without the power, too


@dataclass(frozen=True, kw_only=True)
class StairsEffort(paper_runs.Effort):
    """Effort of the stairs reproduction."""

    cases: tuple[int, ...] = tuple(TABLE_4)
    plan_starts: int = 20  # of IPOPT on the plan of least energy
    jerk_starts: int = 20  # on that of least peak jerk
    first_starts: int = 5  # on the first step
    hip_starts: int = 6  # on the plan of least energy with the paper's hip height and none of our limits
    ideal_starts: int = 3
    runs: int = 3  # of each search
    plan_evaluations: int = 10_000
    track_evaluations: int = ANTS * ITERATIONS  # as in the paper
    instant_evaluations: int = ANTS * ITERATIONS  # of each search of Algorithm 4
    plan_choices: tuple[str, ...] = tuple(PLAN_CHOICES)  # of the planner
    from_jerk: bool = True  # whether plans of least energy are searched from those of least jerk under a choice, too
    choices: tuple[str, ...] = tuple(CHOICES)  # readings of the tracked step
    instants: tuple[str, ...] = stairs_paper.INSTANTS  # readings of Algorithm 4
    plan_settings: Mapping[str, Any] = field(default_factory=dict)  # of IPOPT on plans
    track_ipopt: bool = True  # whether IPOPT runs on the track
    # IPOPT on the track: lifted, a rollout has 16,000 variables; an iteration takes seconds.
    track_settings: Mapping[str, Any] = field(default_factory=lambda: {"time_limit_s": 1200.0})
    # Treads and rises of one step that the paper did not try [m]; a rise of IMPOSSIBLE_RISE_M is impossible.
    other_stairs: tuple[tuple[float, float], ...] = ((0.3, 0.1), (0.3, 0.13), (0.28, 0.17), (0.26, 0.2), (0.254, 0.5))
    other_starts: int = 8  # of IPOPT on the plan there
    poses: int = 350  # first ones of the swing leg, every 0.01 s, for which the network is trained
    printed_poses: int = 350  # of these at the printed rate
    plan_intervals: int = 40
    ideal_intervals: int = 70

    def count_other_starts(self, rise: float) -> int:
        """Return the number of starts on a stair that the paper did not try."""
        return min(3, self.other_starts) if rise >= IMPOSSIBLE_RISE_M else self.other_starts

    @property
    def instant_searches(self) -> tuple[tuple[str, Decides], ...]:
        """Readings of Algorithm 4, and what it decides."""
        return tuple((name, decides) for name in self.instants for decides in get_args(Decides))

    @property
    def plan_steps(self) -> int:
        """Plans under every choice and other plans of each case, first steps and simulations."""
        return len(self.plan_choices) * (2 + self.from_jerk) + len(self.cases) * (2 + self.first_starts + 1 + 3)

    @property
    def steps(self) -> int:
        """Runs, other computations of each case, the network, and the report."""
        gradient = self.plan_starts + self.jerk_starts + self.hip_starts + self.ideal_starts + self.track_ipopt
        searches = (3 * len(ALGORITHMS) + len(self.choices)) * self.runs
        case = gradient + searches + PER_CASE + len(POWERLESS) + len(self.instant_searches)
        others = sum(self.count_other_starts(rise) for _, rise in self.other_stairs)
        return len(self.cases) * case + others + 2 + self.plan_steps


def make_plan_spec(effort: StairsEffort, case: int, what: str = "plan") -> ProblemSpec:
    """Return the planner of a case: ``plan`` of least energy or ``jerk``; of least jerk too, ``first`` step and ``landing``.

    Of least energy too: ``hip`` at the paper's height without our limits; ``upright`` torso.
    """
    options: dict[str, str | int | bool] = {"intervals": effort.plan_intervals}
    values = _get_stair(case)
    if what in ("jerk", "first", "landing"):
        options["minimise"] = "jerk"
    if what in ("first", "landing"):
        options |= {"step": what, "balance": "polygon"}
    if what == "hip":
        options |= PLAN_CHOICES["no-limits"].options
        values |= {**PLAN_CHOICES["no-limits"].values, **fix("hip_height_m", TABLE_3["hip_height_m"])}
    if what == "upright":
        values |= fix("torso_pitch_rad", np.pi / 2)
    return ProblemSpec(name="stairs-plan", options=options, values=values, label=f"{what}-{case}")


def fix(name: str, value: float) -> dict[str, float]:
    """Return the bounds of a variable that has a given value."""
    return {f"{name}.{end}": value for end in ("lower", "upper")}


def make_ideal_spec(effort: StairsEffort, case: int) -> ProblemSpec:
    """Return the full trajectory optimisation of a case."""
    options = {"intervals": effort.ideal_intervals}
    return ProblemSpec(name="stairs-ideal", options=options, values=_get_stair(case), label=f"ideal-{case}")


def make_track_spec(case: int, plan: Mapping[str, float], **options: str | bool) -> ProblemSpec:
    """Return the tracking of a plan, given by the planner's variables, in a case."""
    values = {**_get_stair(case), **{name: plan[name] for name in PLAN}}
    return ProblemSpec(name="stairs-track", options=options, values=values, label=f"track-{case}")


def make_other_spec(effort: StairsEffort, tread: float, rise: float) -> ProblemSpec:
    """Return the planner on a stair that the paper did not try."""
    values = {"stair_length_m": 2 * tread, "rise_run_ratio": rise / tread}
    options = {"intervals": effort.plan_intervals}
    return ProblemSpec(name="stairs-plan", options=options, values=values, label=f"stairs-plan-{tread:g}-{rise:g}")


def _get_stair(case: int) -> dict[str, float]:
    row = TABLE_4[case]
    return {"stair_length_m": row.stair_length_m, "rise_run_ratio": row.rise_run_ratio}


@dataclass(frozen=True, kw_only=True, eq=False)
class StairsFindings:
    """All results of the reproduction: runs by title of the problem and solver, other results by name."""

    effort: StairsEffort
    runs: paper_runs.Runs
    others: Mapping[str, Any] = field(default_factory=dict)

    @property
    def cases(self) -> Sequence[int]:
        """Cases of Table IV."""
        return self.effort.cases

    def best(self, what: str, case: int, solver: str = IPOPT) -> RunRecord:
        """Return the best run of a solver on the ``plan``, ``jerk``, ``ideal`` or ``track`` of a case."""
        return choose_best(self.runs[f"{what}-{case}", solver])

    def plan(self, case: int, what: str = "plan") -> dict[str, float]:
        """Return the best plan of a case, with the parameters that are not its variables."""
        problem = make_plan_spec(self.effort, case).load()
        names = ("t3_s", "sole_angle_rad", "toe_angle_rad", "catch_angle_rad")
        return {**self.best(what, case).x, **{name: problem.value(name) for name in names}}

    @property
    def track_solvers(self) -> tuple[str, ...]:
        """Solvers on the track."""
        return (*ALGORITHMS, *([IPOPT] if self.effort.track_ipopt else []))

    def collect(self, title: str, key: str) -> Series:
        """Return a number of a computation in all cases."""
        return Series(self.others[f"{title}-{case}"][key] for case in self.cases)

    def best_track(self, case: int) -> RunRecord:
        """Return the best run of the paper's search on the track of a case."""
        return self.best("track", case, ACO)


def make_first_tasks(effort: StairsEffort) -> Iterator[Task]:
    """Yield ideals and plans, on the paper's stairs and on others."""
    settings = effort.plan_settings
    for case in effort.cases:
        yield from make_start_tasks(make_ideal_spec(effort, case), effort.ideal_starts, seed=case)
        for what, starts in (("plan", effort.plan_starts), ("jerk", effort.jerk_starts)):
            spec = make_plan_spec(effort, case, what)
            yield from make_start_tasks(spec, starts, settings=settings)
            yield from make_search_tasks(spec, ALGORITHMS, effort.runs, effort.plan_evaluations)
    for tread, rise in effort.other_stairs:
        settings = {"iterations": 100} if rise >= IMPOSSIBLE_RISE_M else effort.plan_settings
        spec = make_other_spec(effort, tread, rise)
        yield from make_start_tasks(spec, effort.count_other_starts(rise), settings=settings)


def make_track_tasks(findings: StairsFindings) -> Iterator[Task]:
    """Yield searches and IPOPT for the gains and torso pitch that track the plans of least energy."""
    effort = findings.effort
    for case in effort.cases:
        spec = make_track_spec(case, findings.plan(case))
        yield from make_search_tasks(spec, ALGORITHMS, effort.runs, effort.track_evaluations)
        if effort.track_ipopt:
            yield Task(problem=spec, solver=IPOPT, settings=effort.track_settings, start=TRACK_START)


def make_computations(findings: StairsFindings) -> Iterator[Computation]:
    """Yield the network, and in each case the printed gains, differences of both plans, the network in the loop."""
    effort, first = findings.effort, findings.cases[0]
    poses = {"poses": effort.poses, "printed_poses": effort.printed_poses}
    plan_spec, plan = make_plan_spec(effort, first, "jerk"), findings.plan(first, "jerk")
    yield make_computation("network", plan_spec, train_network, case=first, plan=plan, **poses)
    for case in effort.cases:
        plans = {what: findings.plan(case, what) for what in ("plan", "jerk", "upright")}
        plan, x = plans["plan"], get_point(findings.best_track(case))
        track = make_track_spec(case, plan)
        yield make_computation(f"printed-{case}", track, run_printed_gains, case=case, plans=plans, x=x)
        yield make_computation(f"learned-{case}", track, track_with_network, case=case, plan=plan, x=x)
        for what in ("plan", "jerk"):
            spec = make_track_spec(case, plans[what])
            yield make_computation(f"differences-{what}-{case}", spec, difference_angles, case=case, plan=plans[what])


def train_network(case: int, plan: Mapping[str, float], poses: int, printed_poses: int) -> dict[str, Any]:
    """Train the network on the first poses of a plan's swing leg: convergence, time and error against the closed form."""
    desired = roll_out(case, plan, [100.0, 100.0, plan["torso_pitch_rad"]])["q_desired"]
    all_poses = np.cumsum(desired[:poses, :2], axis=1) - plan["torso_pitch_rad"]  # thigh from torso, knee from thigh
    robot = load_toe_foot_biped()
    lengths = np.array([robot.link(name).length_m for name in LEGS[0]])
    legs = np.hstack([np.array(compute_leg_vector(angles, *lengths)) for angles in all_poses]).T
    found = {CLOSED_FORM: _describe_path(_solve_legs(legs, *lengths), all_poses, NetworkSettings())}
    for name, (settings, unit) in RULES.items():
        count = printed_poses if "printed" in name else poses
        path = train_angles(unit * legs[:count], unit * lengths[0], unit * lengths[1], settings)
        found[name] = _describe_path(path, all_poses[:count], settings)
    return found


def _describe_path(path: NetworkPath, q: Array, settings: NetworkSettings) -> dict[str, Any]:
    error = np.abs((path.angles - q + np.pi) % (2 * np.pi) - np.pi)
    bends = np.sign(np.sin(np.diff([path.angles, q], axis=2)))[..., 0]
    return {
        "converged": int((path.error_m2 <= settings.tolerance_m2).sum()),
        "poses": len(q),
        "iterations": path.iterations.tolist(),
        "time_s": path.time_s.tolist(),
        "largest_angle_error_rad": float(error.max()),
        "mean_angle_error_rad": float(error.mean()),
        "bent_otherwise": int((bends[0] != bends[1]).sum()),
    }


def _solve_legs(hip_to_ankle: Array, thigh: float, shank: float) -> NetworkPath:
    """Return leg angles by the cosine rule, and the time of each pose."""
    rows = []
    for x, z in hip_to_ankle.tolist():
        started = time.perf_counter()
        knee = math.acos((x * x + z * z - thigh**2 - shank**2) / (2 * thigh * shank))
        first = math.atan2(-z, x) - math.atan2(shank * math.sin(knee), thigh + shank * math.cos(knee))
        rows.append(([first, first + knee], 0.0, 0, time.perf_counter() - started))
    return NetworkPath(*(np.array(column) for column in zip(*rows, strict=True)))


def roll_out(case: int, plan: Mapping[str, float], x: list[float], kind: str = "closed-form") -> Mapping[str, Array]:
    """Return time histories of the closed loop with given gains and torso pitch; kind is the inverse kinematics."""
    return make_track_spec(case, plan, inverse_kinematics=kind).load().signals(np.array(x)).arrays


def run_printed_gains(case: int, plans: Mapping[str, Mapping[str, float]], x: Sequence[float]) -> dict[str, float]:
    """Return what the paper's gains do on our plans, and the best ones x on the plan for an upright torso.

    They are the largest errors and ZMP margins, also with the controller as printed on the plan of least jerk; and energies and
    ZMP margins upright.
    """
    row, plan, printed = TABLE_4[case], plans["plan"], CHOICES[PRINTED]
    compensated = make_track_spec(case, plan).load()
    as_printed = make_track_spec(case, plans["jerk"], **printed.options).load().with_values(**printed.values)
    tracked = {"implicit": compensated.with_values(gravity_compensation=0.0), "compensated": compensated}
    tracked["printed"] = as_printed
    gains = [row.kp, row.kd, row.torso_pitch_rad]
    indexes = {name: evaluate(how, gains).indexes for name, how in tracked.items()}
    found = {f"{name}_error_rad": own["largest_error_rad"] for name, own in indexes.items()}
    upright = {what: make_track_spec(case, plan).load() for what, plan in plans.items()}
    indexes |= {what: evaluate(problem, [*x[:2], np.pi / 2]).indexes for what, problem in upright.items()}
    return found | {f"{name}_{index}": own[index] for name, own in indexes.items() for index in TORSO_INDEXES}


def track_without_power(spec: ProblemSpec, evaluations: int) -> dict[str, float]:
    """Return the indexes of the gains and the torso pitch of least error without the power term of (53)."""
    problem = spec.load()

    def drop_power(assembly: Assembly, point: Point, _: Nonsmooth) -> Assembly:
        margin = point["zmp_weight"] * assembly.indexes["zmp_margin_min_m"]
        return replace(assembly, objective=assembly.indexes["tracking_cost"] - margin)

    objective = compile_objective(problem.derive(name="stairs-errors", change=drop_power), threads=1)
    found = minimize(objective, ALGORITHMS[ACO], evaluations=evaluations, seed=0)
    return dict(evaluate(problem, found.x).indexes)


def track_with_network(case: int, plan: Mapping[str, float], x: list[float]) -> dict[str, float]:
    """Compare a tracked step whose desired leg angles come from the network with the closed form: cost and angles."""
    found, angles = dict[str, float](), []
    for kind in KINDS:
        problem = make_track_spec(case, plan, inverse_kinematics=kind).load()
        found[f"{kind} cost"] = evaluate(problem, x).objective["value"]
        angles.append(problem.signals(np.array(x)).arrays["q_desired"])
    error = np.abs(angles[0] - angles[1])[:, [LINKS.index(link) for leg in LEGS for link in leg]]
    return {**found, "largest_angle_error_rad": float(error.max()), "mean_angle_error_rad": float(error.mean())}


def difference_angles(case: int, plan: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Return the largest acceleration and jerk of the joints by differences of the desired angles at 0.01 s, by their source."""
    found = {}
    for kind in KINDS:
        angles = roll_out(case, plan, [100.0, 100.0, plan["torso_pitch_rad"]], kind)["q_desired"]
        second, third = (float(np.abs(np.diff(angles, n, axis=0) / 0.01**n).max()) for n in (2, 3))
        found[kind] = {"acceleration": second, "jerk": third}
    return found
