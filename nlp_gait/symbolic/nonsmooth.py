"""Operations at which a gait model is not smooth or not explicit, in two interpretations.

A problem is assembled once, with the operations of ``Nonsmooth``. ``Exact`` is what the papers evaluate: it is compiled, searched
and judged. ``Lifted`` is an NLP that IPOPT can solve: absolute values and minima become variables with inequalities, which is
exact where the sense allows it (``backends/nlp.py`` checks the sense); only a true jump is smoothed. An equation without a closed
solution is solved by Newton's method under ``Exact``; its unknowns are variables under ``Lifted``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple

import casadi as ca
from casadi import MX, SX

from nlp_gait.errors import InputError

# Keeps the slope of acos finite where its argument reaches 1 to machine precision.
LEAST_SINE_SQUARED = 1e-16
# Smallest margin from which the lifted acos is continued by its tangent.
LEAST_REACH_MARGIN = 1e-6


class Angle(NamedTuple):
    """acos of an argument and its first and second derivative with respect to it."""

    value: SX
    first: SX
    second: SX


@dataclass(frozen=True, kw_only=True, eq=False)
class Root:
    """An equation of one instant, residual(unknown, inputs) = 0, with a method that solves it, as functions of expressions."""

    residual: Callable[[SX, SX], SX]  #: (n,) of unknown (n,) and inputs, dimensionless, zero at the solution
    #: (n,) of the inputs: a guess and a fixed number of Newton steps, defined for all inputs
    newton: Callable[[SX], SX]
    lift: bool  #: whether ``Lifted`` makes the unknown a variable; otherwise it differentiates through ``newton``


class ImplicitVariables(NamedTuple):
    """Unknowns of one instant, and the equations that determine them, one below the other."""

    unknowns: SX  #: (n,) symbols
    residual: SX  #: (n,) must be zero
    start: SX  #: (n,) result of Newton's method


class Nonsmooth:
    """Operations that a problem may use in addition to smooth functions, as the papers define them; ``Lifted`` overrides them.

    ``abs``, ``min`` and ``step`` take arrays of any shape; those of one call have one shape, or are scalars.
    """

    exact = True  #: whether the values are the exact ones, which are judged

    def root(self, root: Root, inputs: SX) -> SX:
        """Return the solution (n,) of an equation of one instant, for its inputs."""
        return root.newton(inputs)

    def collect_implicit_variables(self) -> ImplicitVariables | None:
        """Return and forget the equations of the last instant whose unknowns are still symbols; None if there are none."""
        return None

    def add_implicit_variables(self, start: MX, residual: Callable[[MX], MX]) -> MX:
        """Return the unknowns (n, N) of N instants, tied by residual(unknowns) = 0, near a start (n, N)."""
        return start

    def acos(self, argument: SX, margin: SX) -> Angle:
        """Return acos, defined and finite for every argument; exact at least for |argument| <= 1 - margin.

        Here the argument is clamped to [-1, 1]: reachable poses are exact, unreachable ones finite and at rest.
        """
        clamped = ca.fmax(-1, ca.fmin(1, argument))
        reachable = ca.fabs(argument) <= 1
        sine_squared = ca.fmax(1 - clamped * clamped, LEAST_SINE_SQUARED)
        first = -reachable / ca.sqrt(sine_squared)
        return Angle(ca.acos(clamped), first, first * clamped / sine_squared)

    def call(self, function: ca.Function, argument: MX) -> MX:
        """Return a function of a few sums over many samples; ``Lifted`` derives it by itself, not for each pair of samples."""
        return function.call([argument], True, False)[0]  # inlined

    def abs(self, v: MX) -> MX:
        """Return |v| elementwise."""
        return ca.fabs(v)

    def min(self, *values: MX) -> MX:
        """Return the minimum of several values elementwise."""
        check_shapes("min", *values)
        return reduce(ca.fmin, values)

    def largest(self, v: MX) -> MX:
        """Return the largest |v_i| of all elements: they are halved repeatedly, by elementwise operations only."""
        v = ca.fabs(ca.vec(v))
        while v.shape[0] > 1:
            half = (v.shape[0] + 1) // 2
            v = ca.fmax(v[:half], v[-half:])
        return v

    def step(self, switch: MX, below: MX, above: MX) -> MX:
        """Return ``below`` where switch < 0, else ``above``, elementwise; without a branch so that it vectorises."""
        check_shapes("step", switch, below, above)
        return below + (switch >= 0) * (above - below)

    def rollout(self, step: ca.Function, initial: MX, *inputs: MX) -> MX:
        """Return the states (n, N) after each of N steps, made one after the other in a loop at run time.

        ``step`` goes from a state (n, 1) and a column of each input (m, N) to the next state, first from ``initial`` (n, 1).
        """
        return step.mapaccum(inputs[0].shape[1])(initial, *inputs)


def check_shapes(operation: str, *values: MX) -> None:
    """Raise InputError unless the values of an elementwise operation have one shape or are scalars."""
    shapes = list(dict.fromkeys(MX(value).shape for value in values if MX(value).shape != (1, 1)))
    if len(shapes) > 1:
        got = " and ".join(map(str, shapes))
        raise InputError(f"ops.{operation} takes arrays of one shape, or scalars, got {got}; transpose or repeat one")


class Exact(Nonsmooth):
    """The functions as the papers define them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Lift:
    """New NLP variables that replace a non-smooth expression."""

    variable: MX  #: (k, 1) symbols
    value: MX  #: (k, 1) exact values (start values, in terms of x and earlier lifts)
    rows: MX  #: (r, 1) expressions that must be >= 0, or == 0 if the lift is tight
    #: True if the variable may only exceed the exact value (abs), False if it may only be less (min)
    from_above: bool = True
    tight: bool = False  #: whether the rows determine the variable: it equals the exact value at every feasible point

    @property
    def sense(self) -> float:
        """1 if the variable is its exact value or more, -1 if it is that or less, 0 if it is equal."""
        return 0.0 if self.tight else 1.0 if self.from_above else -1.0


class Lifted(Nonsmooth):
    """Absolute values and minima as variables with inequalities; a jump as a sigmoid: (L.3) to (L.11), (S.2) in docs/model.

    ``width`` is that of the sigmoid, in units of the switch (an NLP parameter).
    """

    exact = False

    def __init__(self, width: MX) -> None:
        self.width = width
        self.lifts: list[Lift] = []
        self.smoothed = False
        self._implicit: list[ImplicitVariables] = []

    def root(self, root: Root, inputs: SX) -> SX:
        """Return a symbol that a row must tie; or the result of Newton's method, to be differentiated."""
        solution = root.newton(inputs)
        if not root.lift:
            return solution
        unknowns = SX.sym(f"unknown_{len(self._implicit)}", solution.shape[0])
        self._implicit.append(ImplicitVariables(unknowns, root.residual(unknowns, inputs), solution))
        return unknowns

    def collect_implicit_variables(self) -> ImplicitVariables | None:
        found, self._implicit = self._implicit, []
        return ImplicitVariables(*(ca.vertcat(*columns) for columns in zip(*found, strict=True))) if found else None

    def add_implicit_variables(self, start: MX, residual: Callable[[MX], MX]) -> MX:
        return self._lift("root", start, residual, tight=True)

    def acos(self, argument: SX, margin: SX) -> Angle:
        """Continue acos by its tangents outside +-(1 - margin): smooth, with a slope that draws a solver back."""
        limit = 1 - ca.fmax(margin, LEAST_REACH_MARGIN)
        clamped = ca.fmax(-limit, ca.fmin(limit, argument))
        inside = ca.fabs(argument) <= limit
        sine_squared = 1 - clamped * clamped
        first = -1 / ca.sqrt(sine_squared)
        return Angle(ca.acos(clamped) + first * (argument - clamped), first, inside * first * clamped / sine_squared)

    def call(self, function: ca.Function, argument: MX) -> MX:
        return function(argument)

    def abs(self, v: MX) -> MX:
        """Return a variable s with s >= v and s >= -v."""
        return self._lift("abs", ca.fabs(v), lambda s: ca.vertcat(ca.vec(s - v), ca.vec(s + v)))

    def min(self, *values: MX) -> MX:
        """Return a variable d with d <= v for each value v."""
        return self._lift(
            "min", super().min(*values), lambda d: ca.vertcat(*(ca.vec(v - d) for v in values)), from_above=False
        )

    def largest(self, v: MX) -> MX:
        """Return a variable s with s >= v_i and s >= -v_i for all i."""
        v = ca.vec(v)
        return self._lift("largest", ca.norm_inf(v), lambda s: ca.vertcat(s - v, s + v))

    def step(self, switch: MX, below: MX, above: MX) -> MX:
        """Return a sigmoid between the two branches."""
        check_shapes("step", switch, below, above)
        self.smoothed = True
        share = 0.5 * (1 + ca.tanh(switch / (2 * self.width)))
        return below + share * (above - below)

    def rollout(self, step: ca.Function, initial: MX, *inputs: MX) -> MX:
        """Use multiple shooting: all states are variables, tied by one equation for each step."""
        n, steps = initial.shape[0], inputs[0].shape[1]
        states = MX.sym(f"states_{len(self.lifts)}", n * steps)
        path = ca.reshape(states, n, steps)
        reached = step.map(steps)(ca.horzcat(initial, path[:, :-1]), *inputs)
        exact = step.mapaccum(steps)(initial, *inputs)
        self.lifts.append(Lift(variable=states, value=ca.vec(exact), rows=ca.vec(path - reached), tight=True))
        return path

    def _lift(self, name: str, value: MX, rows: Callable[[MX], MX], **kind: bool) -> MX:
        """Return variables of the value's shape; ``rows`` makes their rows, of any shape."""
        variable = MX.sym(f"{name}_{len(self.lifts)}", value.numel())
        shaped = ca.reshape(variable, *value.shape)
        self.lifts.append(Lift(variable=variable, value=ca.vec(value), rows=ca.vec(rows(shaped)), **kind))
        return shaped
