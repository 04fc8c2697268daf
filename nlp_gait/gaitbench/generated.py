"""GaitBench 2: instances drawn from families of problems by a seed, as ``gb2:FAMILY:SEED``.

Every drawn number comes from SHA-256 of a text, so an instance is the same on every machine and in every version:

    u(NAME) = first 53 bits of SHA-256("gb2:FAMILY:SEED:NAME") / 2**53

A drawn quantity in [a, b] is a + u (b - a), rounded to six significant digits. Families never change; one that has to change
gets a new name.
"""

import hashlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache

import casadi as ca
import numpy as np

from nlp_gait.decoding import decode
from nlp_gait.errors import InputError, check_count, unknown
from nlp_gait.formulation import Assembly, Constraint, GaitProblem, Point, load, maker
from nlp_gait.gaitbench.facts import BY_ID, Definition, get_definition, read_data
from nlp_gait.gaitbench.transform import AffineMap, change_variables, hold_constant, rotate_pairs
from nlp_gait.providers import PROBLEMS
from nlp_gait.robots.perturbation import name_perturbed
from nlp_gait.symbolic.nonsmooth import Nonsmooth

PREFIX = "gb2"
ID = re.compile(rf"{PREFIX}:([a-z0-9-]+):(0|[1-9][0-9]{{0,11}})")
Range = tuple[float, float]
MOST_VARIABLES = 400  # of a problem that becomes an instance by its name, if equations tie them
STARTS = 20  # of IPOPT, for the best known point of such an instance
# The box, in units of the range of each variable: its width, the share of it that stays free on both sides of where the best
# points of the family are, and the angle by which two variables are mixed [rad].
WIDTHS: Range = (1.2, 1.6)
FREE = 0.02
ANGLES: Range = (math.radians(10.0), math.radians(35.0))


@dataclass(frozen=True, kw_only=True)
class Family:
    """A problem, and what is drawn for each instance of it."""

    name: str
    what: str  #: one line
    problem: str  #: as in ``nlp-gait list``
    source: str  #: paper that the problem comes from
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)  #: of all instances
    robots: tuple[str, ...] = ()  #: of which one is drawn
    robot: Mapping[str, Range] = field(default_factory=dict)  #: changes of it, see ``robots/perturbation.py``
    steps: Mapping[str, Range] = field(default_factory=dict)  #: options that are drawn
    limits: Mapping[str, Range] = field(default_factory=dict)  #: parameters that are drawn
    held: Mapping[str, Range] = field(default_factory=dict)  #: variables that are drawn, and constant
    #: Where the best points of pilot seeds are in the problem's own bounds, as shares of each range: the box is placed so that
    #: this is anywhere in it with equal probability
    typical: Mapping[str, Range] = field(default_factory=dict)
    starts: int  #: of IPOPT, for the best known point


@dataclass(frozen=True, kw_only=True)
class Draw:
    """The numbers of one instance, by name."""

    family: str
    seed: int

    def share(self, name: str) -> float:
        """Return a number of [0, 1)."""
        digest = hashlib.sha256(f"{PREFIX}:{self.family}:{self.seed}:{name}".encode()).digest()
        return float((int.from_bytes(digest[:8], "big") >> 11) / 2**53)

    def sign(self, name: str) -> float:
        """Return 1 or -1."""
        return 1.0 if self.share(name) < 0.5 else -1.0

    def within(self, name: str, ends: Range) -> float:
        """Return a number between two ends, of six digits."""
        return float(f"{ends[0] + self.share(name) * (ends[1] - ends[0]):.6g}")

    def all_within(self, ranges: Mapping[str, Range]) -> dict[str, float]:
        """Return a number for each range."""
        return {name: self.within(name, ends) for name, ends in ranges.items()}


@cache
def load_families() -> Mapping[str, Family]:
    """Return the families by name."""
    return {entry["name"]: decode(Family, entry, entry["name"]) for entry in read_data("families.json")}


def list_families() -> tuple[str, ...]:
    """Return the names of the families that ``generate`` draws from."""
    return tuple(load_families())


def make_id(family: str, seed: int) -> str:
    """Return the id of a drawn instance; raises UnknownNameError for the family and InputError for the seed."""
    if family not in load_families():
        raise unknown("family of GaitBench 2", str(family), list_families())
    return f"{PREFIX}:{family}:{check_count('seed', seed, at_least=0, at_most=10**12 - 1)}"


def parse_id(id: str) -> tuple[Family, Draw]:
    """Return the family and the numbers of an id; raises InputError and UnknownNameError."""
    match = ID.fullmatch(id)
    if match is None:
        raise InputError(f"a generated instance is {PREFIX}:FAMILY:SEED, for example {PREFIX}:ssp:3, got {id!r}")
    family, seed = match[1], int(match[2])
    make_id(family, seed)
    return load_families()[family], Draw(family=family, seed=seed)


def is_generated(id: str) -> bool:
    """Return whether an id is that of a generated instance."""
    return id.startswith(f"{PREFIX}:")


def resolve_name(name: str) -> tuple[str, dict[str, str]]:
    """Return name and options of the problem that an instance's id stands for; another name as it is, without options.

    Raises as ``define``.
    """
    if is_generated(name):
        parse_id(name)
    elif name in PROBLEMS or name not in BY_ID:
        return name, {}
    return "gaitbench", {"instance": name}


def define(id: str) -> Definition:
    """Return what an instance is made from: one of either suite, or a problem by its name, with its defaults.

    Raises UnknownNameError, or InputError for a malformed id, or a problem that no search can solve.
    """
    if id in PROBLEMS and id not in BY_ID:
        problem = load(id)
        if not problem.searchable and len(problem.names) > MOST_VARIABLES:
            raise InputError(f"{id} has {len(problem.names)} variables tied by equations, which no search can satisfy")
        return Definition(
            id=id, what=problem.title, problem=id, difficulty="medium", source=f"problem {id} of this package"
        )
    return draw_definition(id) if is_generated(id) else get_definition(id)


def draw_definition(id: str) -> Definition:
    """Return what a drawn instance is made from; raises as ``parse_id``."""
    family, draw = parse_id(id)
    options = {**family.options, **draw.all_within(family.steps)}
    if family.robots:
        chosen = family.robots[int(draw.share("robot") * len(family.robots))]
        options["robot"] = name_perturbed(chosen, draw.all_within(family.robot))
    return Definition(
        id=id,
        what=f"{family.what}, drawn by seed {draw.seed}",
        problem=family.problem,
        options=options,
        values=draw.all_within(family.limits),
        held=draw.all_within(family.held),
        difficulty="medium",
        source=f"{family.source}; drawn by this package",
    )


def draw_box(problem: GaitProblem, id: str) -> AffineMap:
    """Return the variables of a drawn instance, each from 0 to 1.

    With u the variables of the problem as shares of their ranges and c the middle of ``typical``:
    u = c + R diag(w) (z - t). R rotates pairs of variables by a moderate angle, w is the width of the box and t, where c is in
    it, is uniform over what leaves ``FREE`` around the typical range. The box may leave out a part of the problem's ranges.
    """
    family, draw = parse_id(id)
    names, n = problem.names, len(problem.names)
    ends = np.array([family.typical.get(name, (0.0, 1.0)) for name in names])
    centre, reach = ends.mean(axis=1), (ends[:, 1] - ends[:, 0]) / 2
    order = sorted(range(n), key=lambda k: draw.share(f"order {names[k]}"))
    angles = [draw.within(f"angle {names[i]}", ANGLES) * draw.sign(f"side {names[i]}") for i in order[: n - n % 2 : 2]]
    rotation = rotate_pairs(order, angles)
    extent = np.abs(rotation.T) @ reach + FREE
    width = np.maximum([draw.within(f"width {name}", WIDTHS) for name in names], 2 * extent)
    share = np.array([draw.share(f"place {name}") for name in names])
    place = extent / width + share * (1 - 2 * extent / width)
    mirror = np.array([draw.sign(f"mirror {name}") for name in names])
    matrix = problem.scale[:, None] * rotation * (width * mirror)
    offset = problem.lower + problem.scale * centre - matrix @ place
    return AffineMap(matrix=matrix, offset=offset, lower=np.zeros(n), upper=np.ones(n))


# No search satisfies an equation to the last bit: it becomes a band of this share of its row's scale to either side.
BAND = 1e-2


@maker
def gaitbench(*, instance: str = "ssp-v5") -> GaitProblem:
    """Make a problem of the suite by the id of its instance, of GaitBench 1 or generated; raises UnknownNameError.

    Source:
        GaitBench, whose instances name their papers.
    """
    return _make(instance)


@lru_cache(maxsize=64)
def _make(id: str) -> GaitProblem:
    definition = define(id)
    problem = _convert(load(definition.problem, **definition.options), definition)
    return change_variables(problem, draw_box(problem, id)) if is_generated(id) else problem


def _convert(base: GaitProblem, definition: Definition) -> GaitProblem:
    base = base.with_values(**definition.values)
    banded = hold_constant(base, definition.held).derive(
        name="gaitbench", title=f"GaitBench: {definition.what}", change=_widen_equations
    )
    problem = replace(banded, hints=replace(banded.hints, searchable=True))
    if (refine := base.refine) is None:
        return problem
    return replace(problem, refine=lambda factor: _convert(refine(factor), definition))


def _widen_equations(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
    return replace(assembly, constraints=tuple(map(_widen, assembly.constraints)))


def _widen(constraint: Constraint) -> Constraint:
    lower, upper = constraint.lower, constraint.upper
    if lower is None or upper is None or lower.shape != upper.shape or not ca.is_equal(lower, upper, 2):
        return constraint
    width = BAND * constraint.scale
    return replace(constraint, lower=lower - width, upper=upper + width)
