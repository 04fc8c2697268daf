"""What the NAO paper leaves open about margins and power, read in other ways for a printed solution."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compare.papers.nao.nao_runs import evaluate_indexes
from nlp_gait.formulation import GaitProblem, load
from nlp_gait.gaits.nao.body import load_nao, make_nao
from nlp_gait.gaits.nao.joints import ARM_JOINTS, PLANNED_JOINTS, YAW_PITCHES

SUPPORT_X_M = 0.06  # X_i of (21), section 4.1


def compute_powers(problem: GaitProblem, x: Sequence[float]) -> dict[str, float]:
    """Return the mean power by reading of (32) [W]: legs only, one motor for both yaw-pitch joints, other rules in time."""
    signals, heat = problem.signals(problem.check_x(x)), problem.value("heat_loss_W_per_Nm2")
    tau, qd, t = (signals.arrays[name] for name in ("tau", "qd", "t"))
    drawn = np.abs(tau * qd) + heat * tau**2
    arms = [joint[1:] in ARM_JOINTS for joint in signals.joints]
    yaw = tau[:, [signals.joints.index(name) for name in YAW_PITCHES]]  # at rest
    both = heat * (yaw.sum(axis=1) ** 2 - (yaw**2).sum(axis=1))

    def mean(power: np.ndarray) -> float:
        return float(np.trapezoid(power, t) / t[-1])

    total = drawn.sum(axis=1)
    return {
        "legs": mean(total - drawn[:, arms].sum(axis=1)),
        "one_motor": mean(total + both),
        "left_ends": float(total[:-1].mean()),
        "right_ends": float(total[1:].mean()),
    }


def compute_power_with_legs_twice(problem: GaitProblem, x: Sequence[float]) -> float:
    """Return the power with the mechanical term of the moving leg joints counted twice [W]; see the note in the report."""
    signals = problem.signals(problem.check_x(x))
    legs = [i for i, joint in enumerate(signals.joints) if joint in PLANNED_JOINTS]
    mechanical = np.abs(signals.arrays["tau"] * signals.arrays["qd"])[:, legs].sum(axis=1)
    mean = np.trapezoid(mechanical, signals.arrays["t"]) / signals.arrays["t"][-1]
    return float(evaluate_indexes(problem, x)["power_W"] + mean)


def compute_torque_changes_by_reading(
    problem: GaitProblem, x: Sequence[float], within: int = 50
) -> tuple[float, float]:
    """Return the largest torque change of a leg's joint, and of any joint within an interval: greatest minus least [Nm].

    ``within`` is the number of parts into which an interval is divided.
    """
    signals = problem.signals(problem.check_x(x))
    legs = [joint[1:] not in ARM_JOINTS for joint in signals.joints]
    fine = load(problem.name, **{**problem.options, "intervals": within * int(problem.options["intervals"])})
    tau = fine.signals(fine.check_x(x)).arrays["tau"]
    ranges = [np.ptp(tau[k : k + within + 1], axis=0).max() for k in range(0, len(tau) - 1, within)]
    return float(np.abs(np.diff(signals.arrays["tau"][:, legs], axis=0)).max()), float(max(ranges))


def compute_mean_margins(problem: GaitProblem, x: Sequence[float]) -> dict[str, float]:
    """Return the mean margin in x of single support by reading of (21) [mm].

    "least" is the least distance to an edge; "first" and "last" are (21) over the first and the last ten samples; "behind" is how
    far behind X_i the ZMP is at the sample nearest to it.
    """
    foot = load_nao(str(problem.options["robot"])).feet["left"]
    at = 1000 * (problem.signals(problem.check_x(x)).arrays["zmp"][:, 0] - SUPPORT_X_M)
    front, back = 1000 * foot.front_m - at, 1000 * foot.back_m + at
    printed = np.where(at >= 0, front, back)
    behind = at[at < 0]
    return {
        "least": float(np.minimum(front, back).mean()),
        "first": float(printed[:-1].mean()),
        "last": float(printed[1:].mean()),
        "all": float(printed.mean()),
        "behind": float(-behind.max()) if len(behind) else 0.0,
    }


def compute_load_shares(problem: GaitProblem, x: Sequence[float]) -> np.ndarray:
    """Return the ground's vertical force on both feet in weights, f_Lz + f_Rz of (30), at the samples of double support."""
    arrays, body = problem.signals(problem.check_x(x)).arrays, make_nao(str(problem.options["robot"]))
    return np.asarray((arrays["left_force"] + arrays["right_force"])[:, 2] / body.weight)
