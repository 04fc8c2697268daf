"""A row of the benchmark table, and timing side by side."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from nlp_gait.backends.kernel.compiler import native_lanes

Array = np.ndarray
LANES = 8  # of the processor for which ratios of vectorised code were required


@dataclass(frozen=True, kw_only=True)
class Row:
    """One measurement.

    Attributes:
        name: what is measured.
        value: measured number.
        unit: for example ``"x"`` for a ratio, ``"s"``, ``"us"``.
        required: number that must be reached, or None for information only: absolute times belong to the machine.
        at_most: True if less is better.
        note: what belongs to the number.
    """

    name: str
    value: float
    unit: str
    required: float | None = None
    at_most: bool = False
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the required number is reached; None if there is none."""
        if self.required is None:
            return None
        return self.value <= self.required if self.at_most else self.value >= self.required


def side_by_side(
    functions: Mapping[str, Callable[[], object]], rounds: int, clock: Callable[[], float] = time.perf_counter
) -> dict[str, Array]:
    """Times [s] by a clock of functions that take turns, (rounds,) each, after one call to warm up."""
    for function in functions.values():
        function()
    times: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(rounds):
        for name, function in functions.items():
            started = clock()
            function()
            times[name].append(clock() - started)
    return {name: np.array(values) for name, values in times.items()}


def scale_to_lanes(required: float) -> float:
    """Return a ratio that is required with ``LANES`` for the lanes of this processor."""
    return required * native_lanes() / LANES


def ratio(slow: Array, fast: Array, times: float = 1.0) -> float:
    """Median over the rounds of slow / fast, multiplied by how much more work the fast one did."""
    return float(np.median(slow / fast)) * times


def table(rows: list[Row]) -> str:
    """Rows as aligned text."""
    cells = [("measure", "measured", "required", "", "note")]
    for row in rows:
        sign = "<=" if row.at_most else ">="
        required = "" if row.required is None else f"{sign} {row.required:g}"
        met = {True: "ok", False: "MISSED", None: ""}[row.met]
        cells.append((row.name, f"{row.value:.4g} {row.unit}", required, met, row.note))
    widths = [max(len(line[i]) for line in cells) for i in range(len(cells[0]))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in cells
    )
