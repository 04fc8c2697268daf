"""Options that several commands take, alone and in groups; ``command`` says what a group is."""

from __future__ import annotations

import inspect
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import Handling, ProblemSpec, Stop
from nlp_gait.errors import InputError, kind_name, unknown
from nlp_gait.formulation import Result
from nlp_gait.formulation.registry import problem_maker
from nlp_gait.formulation.result import load_result
from nlp_gait.references import is_reference, name_code

if TYPE_CHECKING:
    from nlp_gait.gaits.nao.recorded.problem import Recorded
    from nlp_gait.simulation.conditions import Conditions
    from nlp_gait.simulation.drive import Drive

ResultFile = Annotated[
    Path, typer.Argument(metavar="RESULT.json", help="From `solve --out`, a study's record, or written by hand.")
]
ProblemName = Annotated[
    str, typer.Argument(metavar="PROBLEM", help="For example nao-ssp, see `nlp-gait list`; or your own, FILE.py:NAME.")
]
Seed = Annotated[int, typer.Option(min=0, help="Same seed, same result; run k uses seed + k.")]
Jobs = Annotated[int | None, typer.Option(min=1, max=4096, help="Worker processes (default: all processors).")]
Evaluations = Annotated[int, typer.Option(min=1, max=10**12, help="Budget of one search run.")]
Code = Annotated[
    list[str] | None,
    typer.Option(
        "--code",
        metavar="FILE.py:NAME",
        help="Code of your own that the file names: it runs only if you say so; repeatable.",
    ),
]
AsCsv = Annotated[bool, typer.Option("--csv", help="Write all runs and all judged points as CSV files too.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
# Where results go unless --out names a folder.
RESULTS = Path("results")
# Options of problems that have a flag of their own.
FLAGS = ("robot", "intervals", "derivatives")


@dataclass(frozen=True, kw_only=True)
class StoredGait:
    """A gait in a file, and the code of one's own that it was made with."""

    result: ResultFile
    code: Code = None

    def load(self) -> Result:
        """The gait; raises as ``load_result``, and InputError for code that is no reference."""
        name_all(self.code)
        return load_result(self.result)


@dataclass(frozen=True, kw_only=True)
class CycleOptions:
    """How a walking cycle is built, and its values."""

    robot: Annotated[
        str | None,
        typer.Option(
            help="Of NAO and humanoid problems: nao-v5 (default), nao-v6, nao-v4, or a robot file (.json, .urdf)."
        ),
    ] = None
    intervals: Annotated[
        int | None,
        typer.Option(help="Equal parts of the motion (default: the problem's own, see `nlp-gait list PROBLEM`)."),
    ] = None
    option: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="Any other option of the problem; repeatable.")
    ] = None
    values: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="NAME=VALUE", help="Parameter, or a variable's bound as NAME.lower=VALUE; repeatable."
        ),
    ] = None
    fix: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="Hold a variable at a value; repeatable.")
    ] = None

    def spec_of(self, name: str) -> ProblemSpec:
        """The problem of that name with these options and values, checked.

        Raises:
            UnknownNameError: problem, option, parameter or variable.
            InputError: a value that is not allowed.
        """
        options: dict[str, Any] = {k: value for k, value in vars(self).items() if k in FLAGS and value is not None}
        known = inspect.signature(problem_maker(name)).parameters
        for key, text in _pairs(self.option, "--option"):
            if key not in known:
                raise unknown(f"option of {name}", key, known)
            options[key] = _typed(key, text, known[key].default)
        problem = ProblemSpec(name=name, options=options, values=_numbers(self.values, "--set")).load()
        fixed = problem.fix(**_numbers(self.fix, "--fix"))
        return ProblemSpec(name=name, options=options, values=dict(fixed.values))


@dataclass(frozen=True, kw_only=True)
class AnyCycle(CycleOptions):
    """A walking cycle that is NAO's unless another is named."""

    name: Annotated[
        str, typer.Argument(metavar="[PROBLEM]", help="nao-cycle, or humanoid-cycle with --robot FILE.")
    ] = "nao-cycle"


@dataclass(frozen=True, kw_only=True)
class ProblemOptions(CycleOptions):
    """How any problem is built, and its values."""

    derivatives: Annotated[
        str | None, typer.Option(help="Of nao-ssp and nao-dsp: analytic (default) or finite-difference.")
    ] = None


@dataclass(frozen=True, kw_only=True)
class NamedProblem(ProblemOptions):
    """A problem by its name, how it is built, and its values."""

    name: ProblemName

    def spec(self) -> ProblemSpec:
        """The problem, checked; raises as ``spec_of``."""
        return self.spec_of(self.name)


@dataclass(frozen=True, kw_only=True)
class AnyProblem(ProblemOptions):
    """A problem that need not be named where a file shows which it is."""

    name: Annotated[
        str | None,
        typer.Argument(metavar="[PROBLEM]", help="For example nao-ssp; may be left out with --motion or --check."),
    ] = None

    def spec(self) -> ProblemSpec:
        """The problem, checked; raises as ``spec_of``."""
        if self.name is None:
            raise InputError("name the problem, for example nao-ssp; only --motion and --check know theirs")
        return self.spec_of(self.name)

    def recorded(self, motion: Path, touch_down_s: float | None) -> Recorded:
        """The gait in a file of joint angles, with changed limits.

        Raises:
            InputError: the file holds no gait, or an option has no meaning for one.
        """
        from nlp_gait.export.motions import read_gait
        from nlp_gait.gaits.nao.recorded.problem import recorded
        from nlp_gait.robots import load_robot

        for flag, given in (("--option", self.option), ("--fix", self.fix), ("--derivatives", self.derivatives)):
            if given:
                raise InputError(f"{flag} has no meaning for a motion that is given; leave it out")
        robot = self.robot or "nao-v5"
        gait = recorded(
            read_gait(motion, load_robot(robot)),
            robot=robot,
            gait=self.name,
            touch_down_s=touch_down_s,
            **({} if self.intervals is None else {"intervals": self.intervals}),
        )
        return replace(gait, problem=gait.problem.with_values(**_numbers(self.values, "--set")))


@dataclass(frozen=True, kw_only=True)
class NaoPhase(NamedProblem):
    """A problem that is nao-ssp unless another is named."""

    name: ProblemName = "nao-ssp"


@dataclass(frozen=True, kw_only=True)
class DriveOptions:
    """How the simulated robot is driven: a drive by name, with settings of its own."""

    drive: Annotated[
        str,
        typer.Option(
            help="feed-forward: set-points every 10 ms, linear between them, planned velocity and torque fed forward. "
            "held: each held for 40 ms, nothing fed forward."
        ),
    ] = "feed-forward"
    period_ms: Annotated[float | None, typer.Option(help="Time between set-points, if not the drive's own.")] = None
    interpolation: Annotated[str | None, typer.Option(help="Between set-points: linear or held.")] = None
    feed_forward: Annotated[str | None, typer.Option(help="torque (and velocity), velocity, or none.")] = None
    torque_limits: Annotated[
        str | None, typer.Option(help="urdf (default), stall or continuous: published limits differ.")
    ] = None
    feedback: Annotated[
        str,
        typer.Option(help="none, in open loop, or torso-spring: balance by measured place and attitude of the torso."),
    ] = "none"
    feedback_delay_ms: Annotated[float | None, typer.Option(help="From measuring to acting, if not its own.")] = None
    feedback_noise: Annotated[float, typer.Option(help="Factor on the noise of its sensors; 0 for none.")] = 1.0
    feedback_seed: Annotated[int, typer.Option(min=0, help="Of this noise: same seed, same walk.")] = 0

    def chosen(self) -> Drive:
        """The drive, checked.

        Raises:
            UnknownNameError: no drive has this name.
            InputError: a setting that is not allowed.
        """
        from nlp_gait.simulation.drive import DRIVES
        from nlp_gait.simulation.feedback import FEEDBACKS

        for kind, name, known in (("drive", self.drive, DRIVES), ("feedback", self.feedback, FEEDBACKS)):
            if name not in known:
                raise unknown(kind, name, known)
        feedback = FEEDBACKS[self.feedback]
        if feedback is not None:
            delay_s = feedback.delay_s if self.feedback_delay_ms is None else self.feedback_delay_ms / 1000.0
            feedback = replace(feedback.with_noise(self.feedback_noise), delay_s=delay_s, seed=self.feedback_seed)
        period_s = None if self.period_ms is None else self.period_ms / 1000.0
        own = {**vars(self), "period_s": period_s}
        names = ("period_s", "interpolation", "feed_forward", "torque_limits")
        settings = {name: own[name] for name in names if own[name] is not None}
        return replace(DRIVES[self.drive], feedback=feedback, **settings)


@dataclass(frozen=True, kw_only=True)
class ConditionOptions:
    """World and robot of a simulation, where they differ from the plan's."""

    friction: Annotated[float | None, typer.Option(help="Coefficient of sliding friction (default: 0.7).")] = None
    slope_deg: Annotated[str, typer.Option(metavar="X,Y", help="Rise of the floor forward and to the left.")] = "0,0"
    mass_factor: Annotated[float, typer.Option(help="On all masses; the gait was planned for 1.")] = 1.0
    stiffness_factor: Annotated[
        float, typer.Option(help="True stiffness of the servos over what their drive assumes.")
    ] = 1.0
    push: Annotated[
        str, typer.Option(metavar="X,Y", help="Impulse on the torso in the middle, forward and to the left [N s].")
    ] = "0,0"

    def chosen(self) -> Conditions:
        """The conditions, checked.

        Raises:
            InputError: a value that is not allowed.
        """
        from nlp_gait.simulation.conditions import Conditions, Push

        slope, impulse = (_two(text, flag) for text, flag in ((self.slope_deg, "--slope-deg"), (self.push, "--push")))
        conditions = Conditions(
            mass_factor=self.mass_factor,
            stiffness_factor=self.stiffness_factor,
            slope_rad=(math.radians(slope[0]), math.radians(slope[1])),
            push=Push(impulse_Ns=impulse) if any(impulse) else None,
        )
        return conditions if self.friction is None else replace(conditions, friction=self.friction)


@dataclass(frozen=True, kw_only=True)
class FilmOptions:
    """A film of a simulated gait, and how it is made."""

    video: Annotated[
        Path | None, typer.Option(help="Film it to this .gif or .mp4 file, from the side, the front and above.")
    ] = None
    beside: Annotated[
        Path | None, typer.Option(metavar="OTHER.json", help="Play this gait as well, beside the other in the film.")
    ] = None
    size: Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="Of the film [pixels].")] = "1280x720"
    speed: Annotated[float, typer.Option(min=0.05, max=20.0, help="Speed of the film; 0.25 is slow motion.")] = 1.0
    frames_per_s: Annotated[float, typer.Option("--fps", min=0.1, max=50.0, help="Frames a second of the film.")] = 25.0

    @property
    def note(self) -> str:
        """What the film says of its speed."""
        if self.speed == 1.0:
            return ""
        return f"{'slow motion' if self.speed < 1.0 else 'fast'}: {self.speed:g} x real time"


@dataclass(frozen=True, kw_only=True)
class SearchOptions:
    """Runs of search algorithms: how many, how constraints are handled, and when a run ends."""

    runs: Annotated[int, typer.Option(min=1, max=100_000, help="Runs of each search algorithm.")] = 11
    seed: Seed = 0
    evaluations: Evaluations = 10_000
    handling: Annotated[
        str, typer.Option(help="Constraints in searches: deb (feasibility rules), penalty or epsilon.")
    ] = "deb"
    penalty_weight: Annotated[
        float | None, typer.Option(help="Objective units per unit of violation, for --handling penalty.")
    ] = None
    target: Annotated[float | None, typer.Option(help="End a search at a feasible objective at least this good.")] = (
        None
    )
    stagnation: Annotated[
        int | None, typer.Option(min=1, help="End a search after this many generations without progress.")
    ] = None
    time_limit: Annotated[float | None, typer.Option(help="End a run after this many seconds.")] = None
    polish: Annotated[
        bool, typer.Option("--polish", help="IPOPT from each search's result, as a solver of its own.")
    ] = False

    def study(self, problems: Sequence[ProblemSpec], solvers: Sequence[SolverSpec], starts: int = 20) -> StudySettings:
        """Study of these problems by these solvers.

        Args:
            problems: at least one.
            solvers: at least one.
            starts: of each gradient method.

        Raises:
            InputError: a penalty without weight, or a weight without penalty.
        """
        if (self.handling == "penalty") != (self.penalty_weight is not None):
            raise InputError("--handling penalty and --penalty-weight go together; no weight suits every problem")
        weight = {} if self.penalty_weight is None else {"weight": self.penalty_weight}
        return StudySettings(
            problems=tuple(problems),
            solvers=tuple(solvers),
            runs=self.runs,
            starts=starts,
            handling=Handling(name=self.handling, settings=weight),
            stop=Stop(
                evaluations=self.evaluations,
                target=self.target,
                stagnation=self.stagnation,
                time_limit_s=self.time_limit,
            ),
            seed=self.seed,
        )


def name_all(code: Sequence[str] | None) -> None:
    """Note that the user named code of their own, which files of data may then use."""
    for text in code or ():
        if not is_reference(text):
            raise InputError(f"--code takes FILE.py:NAME or MODULE:NAME, got {text!r}")
        name_code(text, "problem")
        name_code(text, "algorithm")


def names_in(text: str) -> list[str]:
    """Comma-separated names."""
    return [name.strip() for name in text.split(",") if name.strip()]


def numbers_in(text: str) -> list[float]:
    """Comma-separated numbers.

    Raises:
        InputError: one of them is no number.
    """
    return [_number("x", part, "--x") for part in text.split(",")]


def _pairs(items: Sequence[str] | None, flag: str) -> list[tuple[str, str]]:
    pairs = []
    for item in items or ():
        name, equals, text = item.partition("=")
        if not equals or not name:
            raise InputError(f"{flag} takes NAME=VALUE, got {item!r}")
        pairs.append((name.strip(), text.strip()))
    return pairs


def _numbers(items: Sequence[str] | None, flag: str) -> dict[str, float]:
    return {name: _number(name, text, flag) for name, text in _pairs(items, flag)}


def _two(text: str, flag: str) -> tuple[float, float]:
    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(f"{flag} takes two numbers X,Y, got {text!r}")
    return _number("X", parts[0], flag), _number("Y", parts[1], flag)


def _number(name: str, text: str, flag: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{flag}: {name} must be a number, got {text!r}") from None


def _typed(name: str, text: str, default: Any) -> str | int | float | bool:
    """Text as the type of an option's default."""
    kind = type(default)
    try:
        return {"true": True, "false": False}[text.lower()] if kind is bool else kind(text)
    except (KeyError, ValueError):
        raise InputError(f"--option {name} must be {kind_name(kind)}, got {text!r}") from None
