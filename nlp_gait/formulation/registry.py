"""Gait problems by name, and what turns a function with options into a problem that knows how it was made."""

from __future__ import annotations

import functools
import importlib
import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from nlp_gait.errors import InputError, check_name, kind_name, shown, unknown
from nlp_gait.formulation.checks import check_mathematics
from nlp_gait.formulation.gait_problem import GaitProblem
from nlp_gait.formulation.locking import one_at_a_time
from nlp_gait.formulation.numbers import is_number
from nlp_gait.references import guarded, installed, is_own, load_object, name_code, reference, source_sha256

# Module and maker of each problem, imported when it is asked for: no process pays for those that it does not use.
PROBLEMS = {
    "nao-ssp": "nlp_gait.gaits.nao.single_support:nao_ssp",
    "nao-dsp": "nlp_gait.gaits.nao.double_support:nao_dsp",
    "nao-ssp-free": "nlp_gait.gaits.nao.single_support_free:nao_ssp_free",
    "nao-dsp-free": "nlp_gait.gaits.nao.double_support_free:nao_dsp_free",
    "nao-cycle": "nlp_gait.gaits.nao.cycle.problem:nao_cycle",
    "humanoid-ssp": "nlp_gait.gaits.humanoid.single_support:humanoid_ssp",
    "humanoid-dsp": "nlp_gait.gaits.humanoid.double_support:humanoid_dsp",
    "humanoid-cycle": "nlp_gait.gaits.humanoid.cycle:humanoid_cycle",
    "walk12": "nlp_gait.gaits.walk12.problem:walk12",
    "stairs-plan": "nlp_gait.gaits.stairs.plan:stairs_plan",
    "stairs-track": "nlp_gait.gaits.stairs.track:stairs_track",
    "stairs-ideal": "nlp_gait.gaits.stairs.ideal:stairs_ideal",
    "gaitbench": "nlp_gait.gaitbench.suite_problem:gaitbench",
}

# Intervals and samples beyond this have no use, and a problem of that size is not built in any time.
LARGEST_COUNT = 10_000
GRID = ("intervals", "samples_per_interval")  # options whose product is as limited as each is

Maker = Callable[..., GaitProblem]


def maker(*later: Mapping[str, Any]) -> Callable[[Maker], Maker]:
    """Makes a function of keyword options into a problem's maker: options are checked, and written into the problem.

    The function's signature is the only list of the options. One whose annotation is a ``Literal`` takes its values only. The
    problem is refined by the option that its grid names.

    Args:
        later: groups of options that came after the first studies, with the values that these studies had. They are recorded
            after the others; a group that has these values is left out, so that records from before it stay valid.
    """

    def decorate(make: Maker) -> Maker:
        @one_at_a_time
        @functools.wraps(make)
        def made(**options: Any) -> GaitProblem:
            options = {name: _plain(value) for name, value in options.items()}
            check(made, options)
            call = {name: option.default for name, option in inspect.signature(make).parameters.items()} | options
            problem = make(**call)
            if not isinstance(problem, GaitProblem):
                raise InputError(f"{make.__name__!r} must make a GaitProblem, it made {type(problem).__name__}")
            grid, values = problem.grid, dict(call)
            if grid is not None and "samples_per_interval" in call:
                values["samples_per_interval"] = grid.samples_per_interval  # as chosen where that was left to it
            recorded = {name: value for name, value in values.items() if not any(name in group for group in later)}
            for group in later:
                if any(values[name] != value for name, value in group.items()):
                    recorded |= {name: values[name] for name in group}
            refined_by = None if grid is None else grid.refined_by
            if refined_by is None or refined_by not in call:  # a maker without that option refines its problem itself
                return replace(problem, options=recorded).with_origin(made, call)
            own = getattr(grid, refined_by)
            finer = replace(problem, options=recorded, refine=lambda factor: made(**{**call, refined_by: own * factor}))
            return finer.with_origin(made, call)

        made.options_checked = True  # type: ignore[attr-defined]
        return made

    return decorate


def problem_names() -> tuple[str, ...]:
    """Names of the problems that come with the package."""
    return tuple(PROBLEMS)


def problem_maker(name: str) -> Maker:
    """Function that makes a problem; its keyword arguments are the problem's options.

    Args:
        name: of a problem of the package, of an installed package's entry point, or ``file.py:name`` or ``module:name`` of
            a maker or a ``GaitProblem``.

    Raises:
        UnknownNameError: no such problem.
        OwnCodeError: code of one's own that cannot be found or fails.
    """
    if name not in PROBLEMS and is_own(name, "problem"):
        return own_maker(name)
    if name not in PROBLEMS:
        raise unknown("problem", name, [*PROBLEMS, *installed("problem")])
    module, _, function = PROBLEMS[name].partition(":")
    make: Maker = getattr(importlib.import_module(module), function)
    return make


def own_maker(name: str) -> Maker:
    """Maker of a problem of one's own, which is checked as it is made."""
    name_code(name, "problem")
    own = load_object(name, "problem")
    path = reference(name, "problem").home
    if isinstance(own, GaitProblem):
        kept = own

        def make() -> GaitProblem:
            return kept

    elif callable(own):
        make = own if hasattr(own, "options_checked") else maker()(own)
        for option, parameter in inspect.signature(make).parameters.items():
            if type(parameter.default) not in (str, int, float, bool) or parameter.kind is parameter.POSITIONAL_ONLY:
                raise InputError(f"{name!r}: option {option} needs a default: a text, a number, true or false")
    else:
        raise InputError(f"{name!r} must be a GaitProblem or a function that makes one, got {type(own).__name__}")

    again = OwnCode(name, source_sha256(name, "problem"))

    @one_at_a_time
    @functools.wraps(make)
    def made(**options: Any) -> GaitProblem:
        check(make, options)
        problem = guarded(name, path, lambda: make(**options))
        guarded(name, path, lambda: check_mathematics(problem))
        return replace(problem, loaded_as=name).with_origin(again, options)

    return made


@dataclass(frozen=True)
class OwnCode:
    """Makes a problem of one's own again, where it was pickled to.

    Attributes:
        name: see ``problem_maker``.
        source: hash of its source.
    """

    name: str
    source: str

    def __call__(self, **options: Any) -> GaitProblem:
        """The problem; InputError if its source is another one than it was."""
        if source_sha256(self.name, "problem") != self.source:
            raise InputError(f"{self.name!r} has changed since the problem was pickled; load it again")
        return load(self.name, **options)


def check_options(name: str, options: Mapping[str, Any]) -> None:
    """Refuse options of a problem that do not exist, or whose values are not allowed; raises as ``load``."""
    check(problem_maker(name), options)


def check(make: Maker, options: Mapping[str, Any]) -> None:
    """Refuse options that a maker does not have, that are not of their default's type, or not among those allowed.

    Raises:
        UnknownNameError: no such option.
        InputError: a value of another type, not among those allowed, or a count beyond what can be built.
    """
    known, allowed = inspect.signature(make).parameters, _choices(make)
    for option, given in options.items():
        value = _plain(given)
        if option not in known:
            raise unknown(f"option of {make.__name__.replace('_', '-')}", option, known)
        expected = type(known[option].default)
        right = type(value) is expected or (expected is float and type(value) is int)
        if not right or (expected is float and not is_number(value)):
            raise InputError(f"option {option} must be {kind_name(expected)}, got {shown(value)}")
        if expected is int and value > LARGEST_COUNT:
            raise InputError(f"option {option} must be at most {LARGEST_COUNT}, got {value}")
        if option in allowed and value not in allowed[option]:
            raise InputError(f"{option} must be one of {', '.join(allowed[option])}, got {shown(value)}")
    whole = [name for name, option in known.items() if type(option.default) is int]
    counts = {name: _plain(options.get(name, known[name].default)) for name in GRID if name in whole}
    if math.prod(max(1, count) for count in counts.values()) > LARGEST_COUNT:
        product = " x ".join(f"{name} {count}" for name, count in counts.items())
        raise InputError(f"a grid takes at most {LARGEST_COUNT} intervals in all, got {product}")


def _plain(value: Any) -> Any:
    """A number or a text of NumPy as Python's own."""
    return value.item() if isinstance(value, np.generic) else value


@functools.cache
def _choices(make: Maker) -> dict[str, tuple[str, ...]]:
    """Values of the options that have a choice."""
    return {name: get_args(hint) for name, hint in get_type_hints(make).items() if get_origin(hint) is Literal}


def load(name: str, /, **options: str | int | float | bool) -> GaitProblem:
    """Problem by name, built with the given options; the others keep their defaults.

    Args:
        name: see ``problem_maker``.
        options: of its maker.

    Raises:
        UnknownNameError: no such problem or option.
        InputError: a value that the option does not allow, or code of one's own that fails.
    """
    check_name("problem", name)
    return problem_maker(name)(**options)
