"""Runs and other computations of the stairs reproduction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, get_args

import numpy as np

from compare.judge import evaluate
from compare.papers.paper_runs import Effort, Runs, choose_best, get_point, make_search_tasks, make_start_tasks
from compare.papers.stairs.stairs_motion import swing_leg
from compare.papers.stairs.stairs_paper import ANTS, EVAPORATION, ITERATIONS, TABLE_3, TABLE_4
from compare.papers.stairs.stairs_replay import FEEDBACK, OPEN_LOOP, replay
from compare.study.record import RunRecord
from compare.study.store import Computation
from compare.study.task import IPOPT, ProblemSpec, Task
from metaheuristics import AntColony, AntColonyGrid, GeneticAlgorithm, ParticleSwarm
from metaheuristics.interface import Algorithm
from nlp_gait.backends.identity import fingerprint
from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.closed_loop import InverseKinematics
from nlp_gait.gaits.stairs.leg_network import LEGS, NetworkSettings, network_angles
from nlp_gait.gaits.stairs.planar_biped import LINKS
from nlp_gait.gaits.stairs.robot import toe_foot_biped
from nlp_gait.gaits.stairs.stair import PAPER_TIMES
from nlp_gait.gaits.stairs.track import PLAN

ALGORITHMS: Mapping[str, Algorithm] = {
    "aco": AntColony(population=ANTS, spread=EVAPORATION),
    "aco-grid": AntColonyGrid(population=ANTS, evaporation=EVAPORATION),
    "pso": ParticleSwarm(),
    "ga": GeneticAlgorithm(),
}
TRACK_START = {"kp": 60.0, "kd": 60.0, "torso_pitch_rad": 1.4}
IMPOSSIBLE_RISE_M = 0.5
LOST_RAD = 0.1  # a replayed pose this far from the planned one is lost
RULES = {
    "adam": NetworkSettings(),
    "gradient 0.3": NetworkSettings(rule="gradient", rate=0.3),
    "gradient 0.05": NetworkSettings(rule="gradient", rate=0.05),
    "gradient 1e-4, as printed": NetworkSettings(rule="gradient", rate=1e-4),
}
PER_CASE = 5  # steps beside the runs: see ``_make_case_computations``


@dataclass(frozen=True, kw_only=True)
class StairsEffort(Effort):
    """Effort of the stairs reproduction.

    Attributes:
        cases: of Table IV.
        plan_starts: of IPOPT on the plan of least energy.
        jerk_starts: on that of least peak jerk.
        hip_starts: on the plan of least energy with the paper's hip height.
        ideal_starts: on the ideal.
        runs: of each search.
        plan_evaluations: of a search for a plan.
        track_evaluations: of a search for gains, as in the paper.
        track_settings: of IPOPT on the track: lifted, a rollout has 16,000 variables; an iteration takes seconds.
        other_stairs: tread and rise of one step that the paper did not try [m]; a rise of ``IMPOSSIBLE_RISE_M`` is impossible.
        other_starts: of IPOPT on the plan there.
        poses: of the swing leg for which the network is trained.
        plan_intervals: between the samples of a plan.
        ideal_intervals: between those of the ideal.
    """

    cases: tuple[int, ...] = tuple(TABLE_4)
    plan_starts: int = 20
    jerk_starts: int = 5
    hip_starts: int = 6
    ideal_starts: int = 3
    runs: int = 3
    plan_evaluations: int = 10_000
    track_evaluations: int = ANTS * ITERATIONS
    track_settings: Mapping[str, float | str] = field(default_factory=lambda: {"time_limit_s": 1200.0})
    other_stairs: tuple[tuple[float, float], ...] = (
        (0.30, 0.10),
        (0.30, 0.13),
        (0.28, 0.17),
        (0.26, 0.20),
        (0.254, 0.50),
    )
    other_starts: int = 8
    poses: int = 351
    plan_intervals: int = 40
    ideal_intervals: int = 70

    @property
    def steps(self) -> int:
        """Runs, other computations of each case, the network, and the report."""
        gradient = self.plan_starts + self.jerk_starts + self.hip_starts + self.ideal_starts + 1
        case = gradient + 2 * len(ALGORITHMS) * self.runs + PER_CASE
        others = sum(1 + _count_other_starts(self, rise) for _, rise in self.other_stairs)
        return len(self.cases) * case + others + 2


def make_plan_spec(effort: StairsEffort, case: int, minimise: str = "energy") -> ProblemSpec:
    """Return the planner of a case."""
    label = f"{'plan' if minimise == 'energy' else minimise}-{case}"
    options: dict[str, str | int] = {"minimise": minimise, "intervals": effort.plan_intervals}
    return ProblemSpec(name="stairs-plan", options=options, values=get_stair(case), label=label)


def make_hip_spec(effort: StairsEffort, case: int) -> ProblemSpec:
    """Return the planner of a case with the paper's hip height."""
    fixed = {f"hip_height_m.{end}": TABLE_3["hip_height_m"] for end in ("lower", "upper")}
    spec = make_plan_spec(effort, case)
    return replace(spec, values={**spec.values, **fixed}, label=f"hip-{case}")


def make_ideal_spec(effort: StairsEffort, case: int) -> ProblemSpec:
    """Return the full trajectory optimisation of a case."""
    options = {"intervals": effort.ideal_intervals}
    return ProblemSpec(name="stairs-ideal", options=options, values=get_stair(case), label=f"ideal-{case}")


def make_track_spec(case: int, plan: Mapping[str, float], **options: str) -> ProblemSpec:
    """Return the tracking of a plan, given by the planner's variables, in a case."""
    values = {**get_stair(case), **{name: plan[name] for name in PLAN}}
    return ProblemSpec(name="stairs-track", options=options, values=values, label=f"track-{case}")


def make_other_spec(effort: StairsEffort, name: str, tread: float, rise: float) -> ProblemSpec:
    """Return the planner or the ideal on a stair that the paper did not try."""
    values = {"stair_length_m": 2 * tread, "rise_run_ratio": rise / tread}
    intervals = {"stairs-plan": effort.plan_intervals, "stairs-ideal": effort.ideal_intervals}[name]
    return ProblemSpec(name=name, options={"intervals": intervals}, values=values, label=f"{name}-{tread:g}-{rise:g}")


def get_stair(case: int) -> dict[str, float]:
    """Return the stair's parameters in a case of Table IV."""
    row = TABLE_4[case]
    return {"stair_length_m": row.stair_length_m, "rise_run_ratio": row.rise_run_ratio}


def make_first_tasks(effort: StairsEffort) -> Iterator[Task]:
    """Yield ideals and plans, on the paper's stairs and on others."""
    for case in effort.cases:
        yield from make_start_tasks(make_ideal_spec(effort, case), effort.ideal_starts, seed=case)
        yield from make_start_tasks(make_plan_spec(effort, case), effort.plan_starts)
        yield from make_start_tasks(make_plan_spec(effort, case, "jerk"), effort.jerk_starts)
        yield from make_start_tasks(make_hip_spec(effort, case), effort.hip_starts)
        for name, algorithm in ALGORITHMS.items():
            yield from make_search_tasks(
                make_plan_spec(effort, case), name, algorithm, effort.runs, effort.plan_evaluations
            )
    for tread, rise in effort.other_stairs:
        settings = {"iterations": 100} if rise >= IMPOSSIBLE_RISE_M else {}
        for name, count in (("stairs-plan", _count_other_starts(effort, rise)), ("stairs-ideal", 1)):
            yield from make_start_tasks(make_other_spec(effort, name, tread, rise), count, settings=settings)


def _count_other_starts(effort: StairsEffort, rise: float) -> int:
    return min(3, effort.other_starts) if rise >= IMPOSSIBLE_RISE_M else effort.other_starts


def make_track_tasks(effort: StairsEffort, runs: Runs) -> Iterator[Task]:
    """Yield searches and IPOPT for the gains and torso pitch that track the plans of least energy."""
    for case in effort.cases:
        spec = make_track_spec(case, choose_plan(runs, case))
        for name, algorithm in ALGORITHMS.items():
            yield from make_search_tasks(spec, name, algorithm, effort.runs, effort.track_evaluations)
        yield Task(problem=spec, solver=IPOPT, settings=effort.track_settings, start=TRACK_START)


def choose_plan(runs: Runs, case: int, minimise: str = "energy") -> dict[str, float]:
    """Return the best plan that IPOPT found in a case."""
    return dict(choose_best(runs[f"{'plan' if minimise == 'energy' else minimise}-{case}", IPOPT]).x)


def choose_best_track(runs: Runs, case: int) -> RunRecord:
    """Best run of any solver on the track of a case, a feasible one if there is one."""
    found = [record for name in (*ALGORITHMS, IPOPT) for record in runs[f"track-{case}", name]]
    return min(found, key=lambda record: (not record.verdict.feasible, record.verdict.objective))


def complete_plan(effort: StairsEffort, case: int, plan: Mapping[str, float]) -> dict[str, float]:
    """Return a plan with the parameters that are not its variables."""
    problem = make_plan_spec(effort, case).load()
    given = {name: problem.value(name) for name in ("t3_s", "sole_angle_rad", "toe_angle_rad", "catch_angle_rad")}
    return {**plan, **given}


def make_computations(effort: StairsEffort, runs: Runs) -> list[Computation]:
    """Return what is computed from the runs without being a run of a solver."""
    first = effort.cases[0]
    plan = complete_plan(effort, first, choose_plan(runs, first))
    trained = Computation(
        name="network",
        inputs={**fingerprint(make_plan_spec(effort, first).load()), "plan": plan, "poses": effort.poses},
        function=partial(train_network, first, plan, effort.poses),
    )
    return [trained, *(step for case in effort.cases for step in _make_case_computations(effort, case, runs))]


def _make_case_computations(effort: StairsEffort, case: int, runs: Runs) -> Iterator[Computation]:
    """Replay of the ideal, the printed scheme, differences of both plans, and the network in the loop."""
    ideal, plan = get_point(choose_best(runs[f"ideal-{case}", IPOPT])), choose_plan(runs, case)
    spec = make_ideal_spec(effort, case)
    yield _make_computation("replay", case, spec, partial(replay_ideal, spec), x=ideal)
    yield _make_computation("printed", case, make_track_spec(case, plan), partial(run_printed_scheme, case), plan=plan)
    for name in ("energy", "jerk"):
        used = choose_plan(runs, case, name)
        yield _make_computation(
            f"differences-{name}", case, make_track_spec(case, used), partial(difference_angles, case), plan=used
        )
    x = get_point(choose_best_track(runs, case))
    yield _make_computation(
        "learned", case, make_track_spec(case, plan), partial(track_with_network, case), plan=plan, x=x
    )


def _make_computation(name: str, case: int, spec: ProblemSpec, compute: Any, **arguments: Any) -> Computation:
    inputs = {**fingerprint(spec.load()), **arguments}
    return Computation(name=f"{name}-{case}", inputs=inputs, function=partial(compute, **arguments))


def train_network(case: int, plan: Mapping[str, float], poses: int) -> dict[str, Any]:
    """Train the network on poses of a plan's swing leg: convergence, time and error against the closed form."""
    tread = TABLE_4[case].stair_length_m / 2
    times = np.linspace(0.0, plan["t3_s"], poses)
    q, hip_to_ankle = swing_leg(plan, tread, tread * TABLE_4[case].rise_run_ratio, times)
    robot = toe_foot_biped()
    lengths = robot.link("HK").length_m, robot.link("KA").length_m
    found = {}
    for name, settings in RULES.items():
        path = network_angles(hip_to_ankle, *lengths, settings)
        error = np.abs(path.angles - q)
        found[name] = {
            "converged": int((path.error_m2 <= settings.tolerance_m2).sum()),
            "poses": len(q),
            "iterations": path.iterations.tolist(),
            "time_s": path.time_s.tolist(),
            "largest_angle_error_rad": float(error.max()),
            "mean_angle_error_rad": float(error.mean()),
        }
    return found


def roll_out(case: int, plan: Mapping[str, float], x: list[float]) -> Mapping[str, Array]:
    """Return time histories of the closed loop with given gains and torso pitch."""
    return make_track_spec(case, plan).load().signals(np.array(x)).arrays


def run_printed_scheme(case: int, plan: Mapping[str, float]) -> dict[str, float]:
    """Return the quanta that the paper's gains survive in the explicit scheme, and the errors in the implicit one."""
    row = TABLE_4[case]
    x = [row.kp, row.kd, row.torso_pitch_rad]
    compensated = make_track_spec(case, plan).load()
    implicit = compensated.with_values(gravity_compensation=0.0)
    explicit = make_track_spec(case, plan, scheme="explicit").load().with_values(gravity_compensation=0.0)
    return {
        "explicit_quanta": evaluate(explicit, x).indexes["quanta_before_divergence"],
        "implicit_largest_error_rad": evaluate(implicit, x).indexes["largest_error_rad"],
        "compensated_largest_error_rad": evaluate(compensated, x).indexes["largest_error_rad"],
    }


def track_with_network(case: int, plan: Mapping[str, float], x: list[float]) -> dict[str, float]:
    """Compare a tracked step whose desired leg angles come from the network with the closed form: cost and angles."""
    found: dict[str, float] = {}
    angles = []
    for kind in get_args(InverseKinematics):
        problem = make_track_spec(case, plan, inverse_kinematics=kind).load()
        found[f"{kind} cost"] = evaluate(problem, x).objective["value"]
        angles.append(problem.signals(np.array(x)).arrays["q_desired"])
    error = np.abs(angles[0] - angles[1])[:, [LINKS.index(link) for leg in LEGS for link in leg]]
    return {**found, "largest_angle_error_rad": float(error.max()), "mean_angle_error_rad": float(error.mean())}


def replay_ideal(ideal: ProblemSpec, x: list[float]) -> dict[str, float | None]:
    """Replay the torques of an ideal step by another integrator: errors of the pose with feedback, and without."""
    arrays = ideal.load().signals(np.array(x)).arrays
    _, followed = replay(arrays, FEEDBACK)
    time, fallen = replay(arrays, OPEN_LOOP)
    off = np.maximum.accumulate(np.abs(fallen).max(axis=1))
    return {
        "feedback_end_rad": float(np.abs(followed[-1]).max()),
        "open_loop_t1_rad": float(off[time <= PAPER_TIMES[0]][-1]),
        "open_loop_t2_rad": float(off[time <= PAPER_TIMES[1]][-1]),
        "open_loop_lost_s": float(time[np.argmax(off > LOST_RAD)]) if off[-1] > LOST_RAD else None,
        "open_loop_end_rad": float(np.abs(fallen[-1]).max()),
    }


def difference_angles(case: int, plan: Mapping[str, float]) -> dict[str, float]:
    """Return the largest acceleration and jerk of links and knees by differences of the desired angles at 0.01 s."""
    q = roll_out(case, plan, [100.0, 100.0, plan["torso_pitch_rad"]])["q_desired"]
    angles = np.column_stack([q, q[:, 1] - q[:, 0], q[:, 3] - q[:, 2]])  # links and knees
    acceleration = np.diff(angles, 2, axis=0) / 0.01**2
    jerk = np.diff(angles, 3, axis=0) / 0.01**3
    return {"acceleration": float(np.abs(acceleration).max()), "jerk": float(np.abs(jerk).max())}
