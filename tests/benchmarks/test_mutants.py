"""The mutants: every module of the table is there with its tests, and each mutant is another program."""

from __future__ import annotations

from pathlib import Path

from benchmarks.faults.mutants import BELONGING, mutants

ROOT = Path(__file__).parents[2]


def test_every_module_and_its_tests_are_there() -> None:
    missing = [path for module, tests in BELONGING.items() for path in (module, *tests) if not (ROOT / path).exists()]
    assert missing == []


def test_what_no_result_depends_on_is_left_alone() -> None:
    source = "@dataclass(frozen=True)\nclass A:\n    b: int = f(strict=False, encoding='utf-8', d=True)\n"
    changes = [change for _, change, _ in mutants(source)]
    assert len(changes) == 2 and all("d=True" in change or change == "True  ->  False" for change in changes)


def test_each_mutant_differs_and_the_source_is_left_alone() -> None:
    source = "def f(a, b):\n    return min(a, b) + 1 if a < b else not b\n"
    found = list(mutants(source))
    texts = [text for _, _, text in found]
    assert len(set(texts)) == len(texts) == 8 and source.strip() not in texts
    assert all(line == 2 for line, _, _ in found)
