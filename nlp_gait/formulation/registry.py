"""Gait problems by name, and ``maker``, which turns a function with options into a maker of problems."""

import functools
import inspect
import math
import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
from casadi import MX, Function, vertcat

from nlp_gait import user_code
from nlp_gait.decoding import find_groups, list_options, pack_options, replace_signature
from nlp_gait.errors import InputError, check_name, describe_type, format_value, unknown
from nlp_gait.files import check_path
from nlp_gait.formulation.added_limits import AddedLimits, hash_limits, resolve_limits
from nlp_gait.formulation.assembly import Assembly, Parameter, Variable, is_number
from nlp_gait.formulation.gait_problem import GaitProblem
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.plain_problem import name_problem
from nlp_gait.providers import PROBLEMS, import_object
from nlp_gait.symbolic.nonsmooth import Exact

# More intervals and samples than this are of no use, and such a problem takes too long to build.
LARGEST_COUNT = 10_000
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]{0,63}")
ARGUMENT = re.compile(r"^ {4}(\w+): (.+(?:\n {8,}.+)*)", re.MULTILINE)  # of a docstring
GRID = ("intervals", "samples_per_interval")  # options whose product has the same limit as each

Maker = Callable[..., GaitProblem]


def maker(make: Maker) -> Maker:
    """Turn a function of keyword options into a maker of problems: options are checked, and recorded in the problem.

    The function's signature is the only list of the options; an argument annotated with a data class stands for its fields. An
    option annotated with a ``Literal`` takes its values only. The problem is refined by the option that its grid names.
    """
    groups, parameters = find_groups(make), list_options(make)

    @lock_casadi
    @functools.wraps(make)
    def make_problem(**options: Any) -> GaitProblem:
        options = {name: _to_python(value) for name, value in options.items()}
        check_options(make_problem, options)
        call = {name: option.default for name, option in parameters.items()} | options
        files = hash_files(call)
        problem = make(**pack_options(groups, call))
        if hash_files(call) != files:
            raise InputError(f"a file of {make.__name__.replace('_', '-')} changed while it was read; load it again")
        if not isinstance(problem, GaitProblem):
            raise InputError(f"{make.__name__!r} must make a GaitProblem, it made {type(problem).__name__}")
        grid = problem.grid
        recorded = {name: str(value) if isinstance(value, AddedLimits) else value for name, value in call.items()}
        if grid is not None and "samples_per_interval" in call:
            recorded["samples_per_interval"] = grid.samples_per_interval  # 0 leaves the choice to the problem
        problem = replace(problem, options=recorded, files=files)
        refined_by = "" if grid is None else grid.refined_by or ""
        if refined_by in call:  # otherwise the maker sets ``refine`` itself
            count = getattr(grid, refined_by)
            problem = replace(problem, refine=lambda factor: make_problem(**{**call, refined_by: count * factor}))
        return problem.with_origin(make_problem, call)

    replace_signature(make_problem, [*parameters.values()])
    make_problem.checks_options = True  # type: ignore[attr-defined]
    return make_problem


def list_problems() -> tuple[str, ...]:
    """Return the names of the problems in this package."""
    return tuple(PROBLEMS)


def find_maker(name: str) -> Maker:
    """Return the function that makes a problem; its keyword arguments are the problem's options.

    The name is that of a problem of this package or of an installed package's entry point, or ``file.py:name`` or ``module:name``
    of a maker or a ``GaitProblem``. Raises UnknownNameError, and UserCodeError for code that is not found or fails.
    """
    if name in PROBLEMS:
        return import_object(PROBLEMS[name])
    if user_code.is_user_code(name, "problem"):
        return _load_user_maker(name)
    raise unknown("problem", name, [*PROBLEMS, *user_code.find_entry_points("problem")])


def _load_user_maker(name: str) -> Maker:
    user_code.allow_code(name)
    files = user_code.read_source_files(name, "problem")
    loaded: Any = user_code.load_object(name, "problem", files)
    make: Maker
    if isinstance(loaded, GaitProblem):

        def make() -> GaitProblem:
            return loaded

    elif callable(loaded):
        make = loaded if hasattr(loaded, "checks_options") else maker(loaded)
        for option, parameter in inspect.signature(make).parameters.items():
            if type(parameter.default) not in (str, int, float, bool) or parameter.kind is parameter.POSITIONAL_ONLY:
                raise InputError(f"{name!r}: option {option} needs a default: a text, a number, true or false")
    else:
        raise InputError(f"{name!r} must be a GaitProblem or a function that makes one, got {type(loaded).__name__}")

    origin = UserMaker(name, files.digest)

    @lock_casadi
    @functools.wraps(make)
    def make_checked(**options: Any) -> GaitProblem:
        check_options(make, options)
        made = user_code.call_user_code(name, lambda: make(**options))
        problem = name_problem(made, user_code.shorten_name(name))
        user_code.call_user_code(name, lambda: check_mathematics(problem))
        hashes = {**problem.files, "code": files.digest}
        return replace(problem, loaded_as=name, files=hashes).with_origin(origin, options)

    return make_checked


@dataclass(frozen=True)
class UserMaker:
    """Maker of a user-defined problem in the process where the problem is unpickled."""

    name: str  # see ``find_maker``
    source: str  # hash of its source

    def __call__(self, **options: Any) -> GaitProblem:
        """Return the problem; raise InputError if its source has changed."""
        if user_code.read_source_files(self.name, "problem").digest != self.source:
            raise InputError(f"{self.name!r} has changed since the problem was pickled; load it again")
        return load(self.name, **options)


def check_options(make: Maker, options: Mapping[str, Any]) -> None:
    """Check that a maker has these options, and allows their values; raises UnknownNameError or InputError."""
    parameters, allowed = inspect.signature(make).parameters, list_choices(make)
    for option, given in options.items():
        value = _to_python(str(given) if isinstance(given, AddedLimits) else given)
        if option not in parameters:
            raise unknown(f"option of {make.__name__.replace('_', '-')}", option, parameters)
        expected = type(parameters[option].default)
        right = type(value) is expected or (expected is float and type(value) is int)
        if not right or (expected is float and not is_number(value)):
            raise InputError(f"option {option} must be {describe_type(expected)}, got {format_value(value)}")
        if expected is int and value > LARGEST_COUNT:
            raise InputError(f"option {option} must be at most {LARGEST_COUNT}, got {value}")
        if option in allowed and value not in allowed[option]:
            raise InputError(f"{option} must be one of {', '.join(allowed[option])}, got {format_value(value)}")
    whole = [name for name, option in parameters.items() if type(option.default) is int]
    counts = {name: _to_python(options.get(name, parameters[name].default)) for name in GRID if name in whole}
    if math.prod(max(1, count) for count in counts.values()) > LARGEST_COUNT:
        product = " x ".join(f"{name} {count}" for name, count in counts.items())
        raise InputError(f"a grid takes at most {LARGEST_COUNT} intervals in all, got {product}")


def resolve_stored(name: str, options: Mapping[str, Any], owner: str) -> tuple[str, dict[str, Any]]:
    """Return name and options of a problem in a data file (the owner), with user code as it was named; see ``resolve_code``."""
    limits = {"limits": resolve_limits(str(options["limits"]), owner)} if options.get("limits") else {}
    return user_code.resolve_code(name, "problem", owner), {**options, **limits}


def hash_files(options: Mapping[str, Any]) -> dict[str, str]:
    """Return the hashes of the files that options of a problem name, by option."""
    hashes = {"limits": hash_limits(str(options["limits"]))} if options.get("limits") else {}
    if "robot" in options:
        from nlp_gait.robots.loading import hash_robot

        hashes["robot"] = hash_robot(options["robot"])
    return {name: digest for name, digest in hashes.items() if digest}


def _to_python(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def describe_options(make: Maker) -> dict[str, str]:
    """Return the meaning of a maker's options by name, from the docstrings of the maker and of the classes that declare them."""
    groups = (kind for group in find_groups(make).values() for kind in reversed(inspect.getmro(group)))
    texts = [inspect.cleandoc(declared.__doc__ or "") for declared in (make, *groups)]
    return {name: " ".join(words.split()).rstrip(".") for text in texts for name, words in ARGUMENT.findall(text)}


@functools.cache
def list_choices(make: Maker) -> dict[str, tuple[str, ...]]:
    """Return the values that a maker's options allow, of options with a list of them."""
    return {name: get_args(hint) for name, hint in get_type_hints(make).items() if get_origin(hint) is Literal}


def load(name: str, /, **options: str | int | float | bool) -> GaitProblem:
    """Return a problem by name, see ``find_maker``, built with the given options; the others keep their defaults.

    A problem of this package with equal options is made once, unless they name a file. Raises UnknownNameError, and InputError
    for a value that the option does not allow, or user code that fails.
    """
    check_name("problem", name)
    make = find_maker(name)
    if name not in PROBLEMS:
        return make(**options)
    check_options(make, options)  # first, for what is not hashable
    return make(**options) if hash_files(options) else _make_once(make, **options)


@functools.lru_cache(maxsize=64, typed=True)
def _make_once(make: Maker, /, **options: Any) -> GaitProblem:
    return make(**options)


def check_mathematics(problem: GaitProblem) -> None:
    """Assemble a problem once and check that backends can use it; raises InputError that says what is wrong."""
    owner = f"problem {problem.name!r}"
    if not NAME.fullmatch(problem.name):  # files are named after it
        raise InputError(f"{owner}: a name has 1 to 64 letters, digits and . _ + -, and starts with a letter or digit")
    if not problem.variables:
        raise InputError(f"{owner} has no variables")
    point = problem.symbols()
    assembly = problem.assemble(point, Exact())
    if not isinstance(assembly, Assembly):
        raise InputError(f"{owner}: assemble must return an Assembly, it returned {type(assembly).__name__}")
    counts = Counter(name for constraint in assembly.constraints for name in constraint.row_names)
    duplicates = [name for name, count in counts.items() if count > 1]
    if duplicates:
        raise InputError(f"{owner}: duplicated rows: {', '.join(duplicates[:5])}")
    inputs = [point.x, point.p]
    bounds: dict[str, MX] = {}
    expressions = {"objective": assembly.objective}
    expressions |= {f"metric {name!r}": value for name, value in assembly.metrics.items()}
    for constraint in assembly.constraints:
        row = f"constraint {constraint.name!r}"
        expressions[row] = constraint.value
        for end in ("lower", "upper"):
            bound = getattr(constraint, end)
            if bound is None:
                continue
            bounds[f"{row}: {end}"] = expressions[f"{row}, {end}"] = bound
            if Function("bound", inputs, [bound], {"allow_free": True}).sparsity_jac(0, 0).nnz():
                remedy = "move terms with variables into value"
                raise InputError(f"{owner}: {row}: {end} must depend on parameters only; {remedy}")
    for what, value in expressions.items():
        free = Function("part", inputs, [vertcat(value)], {"allow_free": True}).free_mx()
        if free:
            symbol = free[0].name()
            raise InputError(f"{owner}: {what} contains {symbol!r}, which is neither a variable nor a parameter")
    for what, bound in bounds.items():
        if np.isnan(np.array(Function("bound", inputs, [vertcat(bound)])(problem.lower, problem.p))).any():
            raise InputError(f"{owner}: {what} is NaN; give a number, or leave it out for no bound")
    _check_texts(owner, problem, assembly)
    if problem.hints.start is not None:
        start = np.asarray(problem.hints.start(problem.parameter_values, np.random.default_rng(0)))
        if start.shape != (len(problem.names),):
            raise InputError(f"{owner}: start must return {len(problem.names)} values, it returned shape {start.shape}")


def _check_texts(owner: str, problem: GaitProblem, assembly: Assembly) -> None:
    """Check that files, tables and axes can show all names and units."""
    quantities: tuple[Variable | Parameter, ...] = (*problem.variables, *problem.own_parameters)
    texts = [problem.objective.name, problem.objective.unit, *assembly.metrics]
    texts += [text for quantity in quantities for text in (quantity.name, quantity.unit)]
    texts += [text for group in assembly.constraints for text in (group.name, group.unit, *group.labels)]
    for text in texts:
        if not isinstance(text, str) or not text.strip() or not text.isprintable() or "$" in text:  # $ begins a formula
            remedy = "printable text without '$', and not blank (the unit of a pure number is '1')"
            raise InputError(f"{owner}: a name, label or unit must be {remedy}, got {text!r}")
    for text in (problem.title, *(quantity.description for quantity in quantities)):
        check_path(text, f"{owner}: a description, {text[:60]!r}", InputError)
