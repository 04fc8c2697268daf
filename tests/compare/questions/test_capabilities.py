"""The question ``capabilities`` on a walk of two numbers whose maxima are known in closed form."""

from pathlib import Path

import pytest
from casadi import MX

from compare.questions.capabilities import Capabilities, Capability, describe_sharpest_turn
from compare.questions.question import Work, find
from nlp_gait.errors import InputError
from nlp_gait.formulation import Assembly, Constraint, GaitProblem, Objective, Parameter, Point, Variable, load
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.robots.crooked import crooked

MOST_ACCELERATION, LONGEST = 0.32, 0.5  # [m/s^2], [m]


def make_walk() -> GaitProblem:
    """A step in a time: the acceleration limits the speed, the leg the step."""

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        step, time, lift = point["step_length_m"], point["single_support_time_s"], point["swing_height_m"]
        rows = {"acceleration": step / time**2 - MOST_ACCELERATION, "leg": step + lift - LONGEST}
        return Assembly(
            objective=1 / time + step + lift,
            constraints=tuple(
                Constraint(name=name, unit="m", scale=1.0, value=value, lower=None, upper=MX(0.0))
                for name, value in rows.items()
            ),
            indexes={"speed_m_s": step / time},
        )

    return GaitProblem(
        name="two-number-walk",
        title="Walk",
        options={},
        variables=(
            Variable(name="single_support_time_s", unit="s", lower=1.0, upper=4.0, description="time"),
            Variable(name="step_length_m", unit="m", lower=0.05, upper=0.2, description="step"),
            Variable(name="swing_height_m", unit="m", lower=0.02, upper=0.3, description="lift"),
        ),
        own_parameters=(Parameter(name="unused", unit="1", default=0.0, description="none", minimum=0.0),),
        objective=Objective(name="cost", unit="J"),
        assemble=assemble,
    )


@pytest.fixture(scope="module")
def question() -> Capabilities:
    return Capabilities(problem=make_walk(), starts=1)


@pytest.fixture(scope="module")
def found(question: Capabilities) -> tuple[Capability, ...]:
    return find(question, Work())


def test_bounds_of_ours_are_moved_until_the_robot_stops(found: tuple[Capability, ...]) -> None:
    speed, step, lift = found
    assert speed.within is not None and speed.beyond is not None
    assert speed.within.value == pytest.approx(0.2, rel=1e-6)  # longest step in the shortest time
    assert {stop.name for stop in speed.within.stops if stop.ours} == {
        "bounds[single_support_time_s]",
        "bounds[step_length_m]",
    }
    # sqrt(step * acceleration), with the step that leaves the least lift
    assert speed.beyond.value == pytest.approx(((LONGEST - 0.02) * MOST_ACCELERATION) ** 0.5, rel=1e-6)
    assert {stop.name for stop in speed.beyond.stops} == {"acceleration", "leg", "bounds[swing_height_m]"}
    assert speed.end == "none of our bounds stops it"
    assert step.beyond is not None and step.beyond.value == pytest.approx(LONGEST - 0.02, rel=1e-6)
    assert lift.beyond is not None and lift.beyond.value == pytest.approx(LONGEST - 0.05, rel=1e-6)


def test_the_answer_says_what_stops_it_and_whose_bounds_these_are(
    question: Capabilities, found: tuple[Capability, ...]
) -> None:
    answer = question.report(found)
    assert answer.headline[0].startswith("highest speed: 0.2 m/s, stopped by bounds[")
    assert "; bounds of ours among them. With wider ones (" in answer.headline[0]


def test_a_problem_without_steps_is_refused() -> None:
    with pytest.raises(InputError, match=r"nao-dsp has no variable 'step_length_m'; use nao-cycle or humanoid-cycle"):
        Capabilities(problem=load("nao-dsp"))


def test_robots_that_turn_have_a_sharpest_turn(tmp_path: Path) -> None:
    pytest.importorskip("lxml")
    (sentence,) = describe_sharpest_turn(load("humanoid-cycle", robot=crooked(tmp_path), intervals=2))
    assert sentence.startswith("sharpest turn that joints and soles allow: ") and "if it is sharper, " in sentence
    assert not describe_sharpest_turn(load("humanoid-cycle", intervals=2))
