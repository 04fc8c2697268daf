"""Bhardwaj, Mishra, Sukavanam, Balasubramanian, reproduced: Tables III and IV, Figs. 3, 6 to 29, next to IPOPT and searches."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from compare.papers.stairs import replay as stairs_replay
from compare.papers.stairs import runs as stairs_runs
from compare.papers.stairs.figures import write_figures
from compare.papers.stairs.paper import TABLE_4
from compare.papers.stairs.report import write_report
from compare.papers.stairs.runs import (
    ALGORITHMS,
    IDEAL_STARTS,
    JERK_STARTS,
    PLAN_EVALUATIONS,
    STARTS,
    TRACK_EVALUATIONS,
    TRACK_SETTINGS,
    TRACK_START,
    best_track,
    complete,
    loaded,
    on_stair,
    plan_problem,
    track_problem,
)
from compare.study.steps import Steps, fingerprint
from nlp_gait.files import writable_folder

# Told of by ``reproduce``: in each case the ideal and its replay, two plans, their differences, the printed scheme, the network,
# every search on plan and track, and IPOPT on the track; once the other stairs, the network's rules, and the writing.
STEPS = len(TABLE_4) * (9 + 2 * len(ALGORITHMS)) + 3


def reproduce(out: Path, *, progress: Callable[[str], None]) -> None:
    """Write tables (Markdown, CSV), figures (PNG, SVG) and ``report.md``.

    Args:
        out: folder; results of finished steps are kept in ``out/steps`` and used again.
        progress: told about each step, ``STEPS`` times.

    Raises:
        OutputError: the folder cannot be written to.
    """
    folder = writable_folder(out)
    steps = Steps(folder, progress, code=(stairs_runs, stairs_replay))
    cases = {case: _case(steps, case) for case in TABLE_4}
    stairs = [fingerprint(loaded(name)) for name in ("stairs-plan", "stairs-ideal")]
    other = steps("other-stairs", {"problems": stairs}, stairs_runs.other_stairs)
    network = steps(
        "network",
        {**fingerprint(plan_problem(1)), "plan": _plan(cases[1])},
        partial(stairs_runs.network, 1, complete(1, _plan(cases[1]))),
    )
    for case, found in cases.items():  # last, as they take minutes each
        track = track_problem(case, _plan(found))
        found["track"]["ipopt"] = steps(
            f"track-ipopt-{case}",
            fingerprint(track),
            partial(stairs_runs.by_ipopt, track, 1, x0=TRACK_START, solver=TRACK_SETTINGS),
        )
        best = best_track(found)
        found["learned"] = steps(
            f"learned-{case}",
            {**fingerprint(track), "x": best},
            partial(stairs_runs.with_network, case, _plan(found), best),
        )
    progress("figures, tables and report")
    write_figures(folder, cases, network)
    write_report(folder, cases, network, other)


def _plan(found: dict[str, Any]) -> dict[str, float]:
    """Plan of least energy that IPOPT found in a case."""
    return dict(found["plan"]["ipopt"]["x"])


def _case(steps: Steps, case: int) -> dict[str, Any]:
    """Runs of one case of Table IV, by name."""
    ideal, plan, jerk = on_stair(loaded("stairs-ideal"), case), plan_problem(case), plan_problem(case, "jerk")
    found: dict[str, Any] = {
        "ideal": steps(
            f"ideal-{case}", fingerprint(ideal), partial(stairs_runs.by_ipopt, ideal, IDEAL_STARTS, seed=case)
        ),
        "plan": {"ipopt": steps(f"plan-ipopt-{case}", fingerprint(plan), partial(stairs_runs.by_ipopt, plan, STARTS))},
        "jerk": steps(f"jerk-ipopt-{case}", fingerprint(jerk), partial(stairs_runs.by_ipopt, jerk, JERK_STARTS)),
        "track": {},
    }
    found["replay"] = steps(
        f"replay-{case}",
        {**fingerprint(ideal), "x": found["ideal"]["x"]},
        partial(stairs_runs.replayed, case, list(found["ideal"]["x"].values())),
    )
    best = _plan(found)
    track = track_problem(case, best)
    for name in ALGORITHMS:
        found["plan"][name] = steps(
            f"plan-{name}-{case}", fingerprint(plan), partial(stairs_runs.by_search, plan, name, PLAN_EVALUATIONS)
        )
        found["track"][name] = steps(
            f"track-{name}-{case}", fingerprint(track), partial(stairs_runs.by_search, track, name, TRACK_EVALUATIONS)
        )
    found["printed"] = steps(f"printed-{case}", fingerprint(track), partial(stairs_runs.printed_scheme, case, best))
    plans = {"energy": best, "jerk": found["jerk"]["x"]}
    found["differences"] = {
        name: steps(
            f"differences-{name}-{case}",
            {**fingerprint(track), "plan": used},
            partial(stairs_runs.differences, case, used),
        )
        for name, used in plans.items()
    }
    return found
