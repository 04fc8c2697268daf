"""Tables of the stairs report with one row for each case."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compare.papers.stairs.paper import TABLE_4
from compare.papers.tables import Cell, write_table

Found = Mapping[str, Any]
Cases = Mapping[int, Found]


def printed_table(folder: Path, cases: Cases) -> str:
    """The paper's gains in its own scheme, and in the implicit one."""
    columns = {
        "explicit: quanta of 0.01 s before divergence": ".0f",
        "implicit: largest error [rad]": ".3f",
        "implicit, gravity compensated [rad]": ".3f",
    }
    row = _picked("printed", "explicit_quanta", "implicit_largest_error_rad", "compensated_largest_error_rad")
    return _by_case(folder / "printed-scheme", cases, columns, row)


def ideal_table(folder: Path, cases: Cases) -> str:
    """Full trajectory optimisation."""
    columns = {
        "effort": ".4f",
        "all starts": "",
        "energy [J]": ".2f",
        "plan's energy [J]": ".2f",
        "peak torque [N m]": ".2f",
        "torso [rad]": ".4f",
        "time a start [s]": ".1f",
    }

    def row(_: int, found: Found) -> list[Cell]:
        run, own = found["ideal"], found["ideal"]["indexes"]
        starts = ", ".join(f"{s['objective']:.3f}" if s["success"] else "failed" for s in run["starts"])
        time_s = float(np.mean([start["time_s"] for start in run["starts"]]))
        energies: list[Cell] = [own["energy_J"], found["plan"]["ipopt"]["objective"]]
        return [run["objective"], starts, *energies, own["peak_torque_Nm"], own["torso_pitch_rad"], time_s]

    return _by_case(folder / "ideal", cases, columns, row)


def replay_table(folder: Path, cases: Cases) -> str:
    """Its torques on the model by another integrator."""
    columns = {
        "with feedback: error at the end [rad]": ".1e",
        "without: until t1 = 0.5 s [rad]": ".1e",
        "until t2 = 1.4 s [rad]": ".1e",
        "beyond 0.1 rad at [s]": ".2f",
        "at the end [rad]": ".0f",
    }
    names = ("feedback_end", "open_loop_t1", "open_loop_t2")
    row = _picked("replay", *(f"{name}_rad" for name in names), "open_loop_lost_s", "open_loop_end_rad")
    return _by_case(folder / "replay", cases, columns, row)


def jerk_table(folder: Path, cases: Cases) -> str:
    """Plans of least peak jerk."""
    columns = {"paper [rad/s^3]": ".1f", "least peak jerk [rad/s^3]": ".1f", "at energy [J]": ".1f"}
    return _by_case(
        folder / "jerk",
        cases,
        columns,
        lambda case, found: [TABLE_4[case].jerk, found["jerk"]["objective"], found["jerk"]["indexes"]["energy_J"]],
    )


def learned_table(folder: Path, cases: Cases) -> str:
    """Desired angles by the network against the closed form."""
    columns = {
        "cost, closed form": ".4f",
        "cost, network": ".4f",
        "largest angle error [rad]": ".4f",
        "mean [rad]": ".4f",
    }
    row = _picked("learned", "closed-form cost", "network cost", "largest_angle_error_rad", "mean_angle_error_rad")
    return _by_case(folder / "learned", cases, columns, row)


def differences_table(folder: Path, cases: Cases) -> str:
    """Largest acceleration and jerk by differences over 0.01 s."""
    columns = {
        "acceleration, paper [rad/s^2]": ".2f",
        "plan of least energy [rad/s^2]": ".2f",
        "plan of least jerk [rad/s^2]": ".2f",
        "jerk, paper [rad/s^3]": ".1f",
        "plan of least energy [rad/s^3]": ".1f",
        "plan of least jerk [rad/s^3]": ".1f",
    }

    def row(case: int, found: Found) -> list[Cell]:
        ours = found["differences"].values()
        paper = TABLE_4[case]
        return [
            *(paper.acceleration, *(plan["acceleration"] for plan in ours)),
            *(paper.jerk, *(plan["jerk"] for plan in ours)),
        ]

    return _by_case(folder / "differences", cases, columns, row)


def _by_case(path: Path, cases: Cases, columns: Mapping[str, str], row: Callable[[int, Found], Sequence[Cell]]) -> str:
    """Table of one row for each case; ``columns`` without the first, the case."""
    return write_table(path, {"case": "d", **columns}, [[case, *row(case, found)] for case, found in cases.items()])


def _picked(step: str, *keys: str) -> Callable[[int, Found], Sequence[Cell]]:
    """Row of a case: results of a step, by name."""
    return lambda case, found: [found[step][key] for key in keys]
