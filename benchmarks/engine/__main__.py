"""Print the tables about the physics engine as Markdown, all or those named.

    python -m benchmarks.engine [TABLE ...]

About half an hour for all but ``tuned`` on one core; that one runs if it is named, takes six hours and continues where it
stopped. Each table has a title. Nothing is tuned per gait or speed.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable

from benchmarks.engine import agreement, feedback, other_robots, sensitivity, tuning

TABLES: dict[str, Callable[[], Iterable[str]]] = {
    "waterfall": agreement.waterfall,
    "speeds": agreement.speeds,
    "ranking": agreement.ranking,
    "published": agreement.published,
    "gains": sensitivity.gains,
    "disturbed": feedback.disturbed,
    "stairs": other_robots.stairs,
    "tuned-briefly": tuning.tuned_briefly,
    "tuned": tuning.tuned,
}
LONG = "tuned"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.engine", description=__doc__.splitlines()[0])
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"{', '.join(TABLES)} (default: all but {LONG})")
    named = parser.parse_args().tables or [name for name in TABLES if name != LONG]
    unknown = [name for name in named if name not in TABLES]
    if unknown:
        parser.error(f"unknown table {unknown[0]!r}; known: {', '.join(TABLES)}")
    for name in named:
        print(f"\n### {name}: {(TABLES[name].__doc__ or '').splitlines()[0]}\n", flush=True)
        for line in TABLES[name]():
            print(line, flush=True)


if __name__ == "__main__":
    main()
