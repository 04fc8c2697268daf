"""The walking cycle: continuous over both switches, periodic after mirroring, with the loads of the published phases."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from nlp_gait.formulation import Array, GaitProblem, Signals, load
from nlp_gait.gaits.biped.cycle import make_walking_cycle
from nlp_gait.gaits.biped.limits import GOALS
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.nao.body import GRAVITY, make_nao
from nlp_gait.robots import load_robot
from nlp_gait.robots.tree import find_partner, mirror_sign
from tests.evaluation import evaluated
from tests.pinocchio_oracle import check_halves, check_standing, floating_model

# Asked for at both switches; it holds to rounding, for every x.
CONTINUITY = 1e-8
# The same sums in another order.
ROUNDING = 1e-12
SEEDS = range(3)
# Least power at 0.03 m/s.
OPTIMUM = (0.0062, 0.02935, 0.31, 0.01532, 0.04658, -0.00991, 0.1, -0.2)  # at lift-off
OPTIMUM += (0.03394, 0.02915, 0.30871, 0.01054, -0.0462, 0.00856, 0.05, 0.1)  # at touch-down
OPTIMUM += (0.015, 0.4, 2.0, 0.072)  # of which the last is the step's length, where it is free


@pytest.fixture(scope="module")
def at_speed() -> GaitProblem:
    return load("nao-cycle", objective="power")


def candidates(problem: GaitProblem) -> list[Array]:
    return [
        np.array(OPTIMUM[: len(problem.names)]),
        *(np.random.default_rng(seed).uniform(problem.lower, problem.upper) for seed in SEEDS),
    ]


Sampled = tuple[Array, Signals, Signals]


@pytest.fixture(scope="module")
def sampled(at_speed: GaitProblem) -> list[Sampled]:
    """Candidates with single and double support, both with their samples at the switch."""
    return [(x, *phases(at_speed, x)) for x in candidates(at_speed)]


def phases(problem: GaitProblem, x: Array) -> tuple[Signals, Signals]:
    """Single and double support, both with their samples at the switch."""
    body = make_nao("nao-v5")
    loads = make_divided_loads(body, problem.options["torso_share"])  # type: ignore[arg-type]
    assert problem.grid is not None
    cycle = make_walking_cycle(
        body, loads, problem.grid, GOALS["power"], at_given_speed=problem.options["objective"] == "power"
    )
    at = cycle.read_section(cycle.sections[0], problem.at(x))
    single, double = (phase.signals(at) for phase in cycle.phases.values())
    later = {**double.arrays, "t": single.arrays["t"][-1] + double.arrays["t"]}
    joined = cycle.signals(problem.at(x)).arrays["t"]
    np.testing.assert_array_equal(joined, [*single.arrays["t"], *later["t"][1:]])
    return single, replace(double, arrays=later)


def mirrored_row(signals: Signals, name: str, row: int) -> Array:
    """Joint values with left and right exchanged."""
    columns = {joint: i for i, joint in enumerate(signals.joints)}
    values = signals.arrays[name][row]
    robot, partners = load_robot("nao-v5"), {joint: find_partner(joint) for joint in signals.joints}
    return np.array([mirror_sign(robot, *pair) * values[columns[pair[1]]] for pair in partners.items()])


def test_positions_and_velocities_are_continuous_at_touch_down(sampled: list[Sampled]) -> None:
    for _, single, double in sampled:
        for name in ("q", "qd", "hip", "com", "left_foot", "right_foot"):
            np.testing.assert_allclose(double.arrays[name][0], single.arrays[name][-1], rtol=0, atol=CONTINUITY)


def test_the_end_is_the_mirror_image_of_the_beginning_a_step_further(
    at_speed: GaitProblem, sampled: list[Sampled]
) -> None:
    for x, single, double in sampled:
        step = evaluated(at_speed, x).metrics["step_length_m"]
        for name in ("q", "qd"):
            np.testing.assert_allclose(double.arrays[name][-1], mirrored_row(single, name, 0), rtol=0, atol=CONTINUITY)
        for end, start in (("hip", "hip"), ("left_foot", "right_foot"), ("right_foot", "left_foot")):
            image = single.arrays[start][0] * (1, -1, 1) + (step, 0, 0)
            np.testing.assert_allclose(double.arrays[end][-1], image, rtol=0, atol=CONTINUITY)


def test_torques_and_zmp_of_single_support_are_pinocchios(sampled: list[Sampled]) -> None:
    robot = load_robot("nao-v5")
    model, ankle = floating_model(robot), np.array([0.0, 0.05, robot.feet["left"].ankle_height_m])
    for _, single, _ in sampled:
        check_standing(single, model, ankle, range(11))


@pytest.mark.parametrize("rule", ["printed", "lever"])
def test_torques_and_zmp_of_double_support_are_pinocchios_halves(rule: str) -> None:
    problem, robot = load("nao-cycle", torso_share=rule), load_robot("nao-v5")
    for x in candidates(problem)[:2]:
        _, double = phases(problem, x)
        check_halves(double, robot, rule, 0.0, x[problem.variable_index("step_length_m")])


def test_the_objective_is_the_energy_of_the_signals(at_speed: GaitProblem, sampled: list[Sampled]) -> None:
    free = load("nao-cycle")
    for x, *halves in sampled:
        times = [x[at_speed.variable_index(f"{phase}_support_time_s")] for phase in ("single", "double")]
        energy, step = 0.0, 0.03 * sum(times)
        for signals in halves:
            tau, qd, t = (signals.arrays[name] for name in ("tau", "qd", "t"))
            energy += float(trapezoid((np.abs(tau * qd) + 0.025 * tau**2).sum(axis=1), t))
        power = evaluated(at_speed, x).cost
        assert power == pytest.approx(energy / sum(times), rel=ROUNDING)
        per_metre = evaluated(free, np.append(x, step)).cost
        assert per_metre == pytest.approx(energy / step, rel=ROUNDING)
        figures = evaluated(at_speed, x).metrics
        assert figures["speed_m_s"] == pytest.approx(0.03, rel=ROUNDING)
        assert figures["energy_J_per_m"] == pytest.approx(energy / step, rel=ROUNDING)
        weight = load_robot("nao-v5").mass_kg * GRAVITY
        assert figures["cost_of_transport"] == pytest.approx(power / (weight * 0.03), rel=ROUNDING)


def test_torque_jumps_are_those_of_the_signals(at_speed: GaitProblem, sampled: list[Sampled]) -> None:
    x, single, double = sampled[0]
    figures = evaluated(at_speed, x).metrics
    touch_down = double.arrays["tau"][0] - single.arrays["tau"][-1]
    lift_off = mirrored_row(single, "tau", 0) - double.arrays["tau"][-1]
    assert figures["touch_down_torque_jump_Nm"] == pytest.approx(np.abs(touch_down).max(), rel=ROUNDING)
    assert figures["lift_off_torque_jump_Nm"] == pytest.approx(np.abs(lift_off).max(), rel=ROUNDING)
