"""The operations at which a gait model is not smooth or not explicit, in two interpretations.

A problem is assembled once, against ``Nonsmooth``. ``Exact`` gives what the papers evaluate: it is compiled, searched and
judged. ``Lifted`` gives an NLP that IPOPT can solve: absolute values and minima become variables with inequalities, an
exact reformulation where the sense allows it (see ``backends/nlp.py``, which checks the sense); only a true jump is smoothed.
An equation that has no closed solution is solved by Newton's method under ``Exact``; its unknowns are variables under ``Lifted``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import casadi as ca
from casadi import MX, SX

# Keeps the slope of acos finite where its argument reaches 1 to machine precision.
LEAST_SINE_SQUARED = 1e-16
# The lifted acos is continued by its tangent from here at the latest, should the user ask for a smaller reach margin.
LEAST_REACH_MARGIN = 1e-6


class Angle(NamedTuple):
    """acos of an argument and its first and second derivative with respect to it."""

    value: SX
    first: SX
    second: SX


@dataclass(frozen=True, kw_only=True, eq=False)
class Root:
    """An equation of one instant, residual(unknown, inputs) = 0, and a method that solves it; expressions in, expressions out.

    Attributes:
        residual: of unknown (n,) and inputs: (n,) in units of 1, zero at the solution.
        newton: of the inputs: (n,) a guess followed by a fixed number of Newton steps, defined for all inputs.
        lift: whether ``Lifted`` makes the unknown a variable; else it differentiates through ``newton``.
    """

    residual: Callable[[SX, SX], SX]
    newton: Callable[[SX], SX]
    lift: bool


class OpenRoots(NamedTuple):
    """Equations of one instant that are to be tied by rows, one below the other.

    Attributes:
        unknowns: (n,) symbols.
        residual: (n,) that must be zero.
        start: (n,) what Newton's method finds.
    """

    unknowns: SX
    residual: SX
    start: SX


class Nonsmooth(Protocol):
    """What a problem may use besides smooth functions.

    Attributes:
        exact: whether the values are those that are judged; else a solver's on its way.
    """

    exact: bool

    def root(self, root: Root, inputs: SX) -> SX:
        """Solution (n,) of an equation of one instant, for its inputs."""

    def open_roots(self) -> OpenRoots | None:
        """Equations of the instant built last whose unknowns were left as symbols, once; None if there are none."""

    def solved(self, start: MX, residual: Callable[[MX], MX]) -> MX:
        """Unknowns (n, N) of N instants whose ``open_roots`` are tied by residual(unknowns) = 0, near a start (n, N)."""

    def acos(self, argument: SX, margin: SX) -> Angle:
        """acos, defined and finite for every argument; exact at least for |argument| <= 1 - margin."""

    def abs(self, v: MX) -> MX:
        """Elementwise |v|."""

    def min(self, a: MX, b: MX) -> MX:
        """Elementwise minimum."""

    def largest(self, v: MX) -> MX:
        """Largest |v_i| of a vector (m, 1)."""

    def step(self, switch: MX, below: MX, above: MX) -> MX:
        """Elementwise: ``below`` where switch < 0, else ``above``."""

    def tie(self, v: MX) -> MX:
        """The vector v (m, 1), a variable of its own where that spares a solver to differentiate through it."""

    def rollout(self, step: ca.Function, initial: MX, *inputs: MX) -> MX:
        """States (n, N) after each of N steps.

        Args:
            step: from a state (n, 1) and a column of each input to the next state.
            initial: (n, 1) state before the first step.
            inputs: (m, N) each, a column for every step.
        """


class Exact:
    """The functions as the papers mean them."""

    exact = True

    def root(self, root: Root, inputs: SX) -> SX:
        """What Newton's method finds, as part of the instant's expressions."""
        return root.newton(inputs)

    def open_roots(self) -> OpenRoots | None:
        """None: all are solved."""
        return None

    def solved(self, start: MX, residual: Callable[[MX], MX]) -> MX:
        """The start, which is the solution."""
        return start

    def acos(self, argument: SX, margin: SX) -> Angle:
        """Argument clamped to [-1, 1]: every reachable pose is exact, an unreachable one finite and still."""
        clamped = ca.fmax(-1, ca.fmin(1, argument))
        reachable = ca.fabs(argument) <= 1
        sine_squared = ca.fmax(1 - clamped * clamped, LEAST_SINE_SQUARED)
        first = -reachable / ca.sqrt(sine_squared)
        return Angle(ca.acos(clamped), first, first * clamped / sine_squared)

    def abs(self, v: MX) -> MX:
        """|v|."""
        return ca.fabs(v)

    def min(self, a: MX, b: MX) -> MX:
        """Minimum."""
        return ca.fmin(a, b)

    def largest(self, v: MX) -> MX:
        """Largest |v_i|, by halves: elementwise operations only."""
        v = ca.fabs(v)
        while v.shape[0] > 1:
            half = (v.shape[0] + 1) // 2
            v = ca.fmax(v[:half], v[-half:])
        return v

    def step(self, switch: MX, below: MX, above: MX) -> MX:
        """A true jump, written without a branch so that it vectorises."""
        return below + (switch >= 0) * (above - below)

    def tie(self, v: MX) -> MX:
        """The same v."""
        return v

    def rollout(self, step: ca.Function, initial: MX, *inputs: MX) -> MX:
        """One step after the other, in a loop at run time."""
        return step.mapaccum(inputs[0].shape[1])(initial, *inputs)


@dataclass(frozen=True, kw_only=True, eq=False)
class Lift:
    """New NLP variables that stand for a non-smooth expression.

    Attributes:
        variable: (k, 1) symbols.
        value: (k, 1) what they equal at the exact function (a start value, in terms of x and earlier lifts).
        rows: (r, 1) expressions that must be >= 0, or == 0 if the lift is tight.
        from_above: True if the variable may only exceed the exact value (abs), False if only fall short of it (min).
        tight: True if the rows leave the variable no freedom: it equals the exact value at every feasible point.
    """

    variable: MX
    value: MX
    rows: MX
    from_above: bool = True
    tight: bool = False


class Lifted:
    """Absolute values and minima as variables with inequalities; a jump as a sigmoid.

    Args:
        width: width of the sigmoid in units of the switch (an NLP parameter).
    """

    exact = False

    def __init__(self, width: MX) -> None:
        self.width = width
        self.lifts: list[Lift] = []
        self.smoothed = False
        self._open: list[OpenRoots] = []

    def root(self, root: Root, inputs: SX) -> SX:
        """A symbol of the instant, to be tied by a row; or what Newton's method finds, to be differentiated."""
        found = root.newton(inputs)
        if not root.lift:
            return found
        unknowns = SX.sym(f"unknown_{len(self._open)}", found.shape[0])
        self._open.append(OpenRoots(unknowns, root.residual(unknowns, inputs), found))
        return unknowns

    def open_roots(self) -> OpenRoots | None:
        """All equations of the instant one below the other."""
        found, self._open = self._open, []
        return OpenRoots(*(ca.vertcat(*parts) for parts in zip(*found, strict=True))) if found else None

    def solved(self, start: MX, residual: Callable[[MX], MX]) -> MX:
        """Variables, tied by one equation each."""
        columns = start.shape
        lifted = self._lifted("root", ca.vec(start), lambda v: ca.vec(residual(ca.reshape(v, *columns))), tight=True)
        return ca.reshape(lifted, *columns)

    def acos(self, argument: SX, margin: SX) -> Angle:
        """acos continued by its tangents beyond +-(1 - margin): smooth, with a slope that draws a solver back."""
        limit = 1 - ca.fmax(margin, LEAST_REACH_MARGIN)
        clamped = ca.fmax(-limit, ca.fmin(limit, argument))
        inside = ca.fabs(argument) <= limit
        sine_squared = 1 - clamped * clamped
        first = -1 / ca.sqrt(sine_squared)
        return Angle(ca.acos(clamped) + first * (argument - clamped), first, inside * first * clamped / sine_squared)

    def abs(self, v: MX) -> MX:
        """A variable s with s >= v and s >= -v."""
        return self._lifted("abs", ca.fabs(v), lambda s: ca.vertcat(s - v, s + v))

    def min(self, a: MX, b: MX) -> MX:
        """A variable d with d <= a and d <= b."""
        return self._lifted("min", ca.fmin(a, b), lambda d: ca.vertcat(a - d, b - d), from_above=False)

    def largest(self, v: MX) -> MX:
        """A variable s with s >= v_i and s >= -v_i for all i."""
        return self._lifted("largest", ca.norm_inf(v), lambda s: ca.vertcat(s - v, s + v))

    def step(self, switch: MX, below: MX, above: MX) -> MX:
        """A sigmoid between the two branches."""
        self.smoothed = True
        share = 0.5 * (1 + ca.tanh(switch / (2 * self.width)))
        return below + share * (above - below)

    def tie(self, v: MX) -> MX:
        """A variable that an equation ties to v."""
        return self._lifted("tied", v, lambda tied: tied - v, tight=True)

    def rollout(self, step: ca.Function, initial: MX, *inputs: MX) -> MX:
        """Multiple shooting: all states are variables, tied by one equation for each step."""
        n, steps = initial.shape[0], inputs[0].shape[1]
        states = MX.sym(f"states_{len(self.lifts)}", n * steps)
        path = ca.reshape(states, n, steps)
        reached = step.map(steps)(ca.horzcat(initial, path[:, :-1]), *inputs)
        exact = step.mapaccum(steps)(initial, *inputs)
        self.lifts.append(Lift(variable=states, value=ca.vec(exact), rows=ca.vec(path - reached), tight=True))
        return path

    def _lifted(self, name: str, value: MX, rows: Callable[[MX], MX], **kind: bool) -> MX:
        """A new variable that stands for a value; see ``Lift``."""
        variable = MX.sym(f"{name}_{len(self.lifts)}", value.shape[0])
        self.lifts.append(Lift(variable=variable, value=value, rows=rows(variable), **kind))
        return variable
