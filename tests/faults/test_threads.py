"""The number of threads of BLAS and OpenMP changes no bit of a result."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tests.faults.processes import start

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def result(threads: int, *arguments: str) -> Any:
    """What a command prints, without its times."""
    output, messages = start(*arguments, "--json", **dict.fromkeys(VARIABLES, str(threads))).communicate(timeout=120)
    assert not messages
    return json.loads(output, object_hook=lambda data: {key: v for key, v in data.items() if key != "time_s"})


@pytest.mark.parametrize(
    "arguments",
    [
        ("search", "walk12", "--algorithm", "cma", "--runs", "2", "--evaluations", "1000"),  # eigenvalues by LAPACK
        ("search", "walk12", "--algorithm", "pso", "--runs", "2", "--evaluations", "1000"),
        ("solve", "walk12", "--starts", "3"),
    ],
    ids=["cma", "pso", "ipopt"],
)
def test_threads_change_no_bit(arguments: tuple[str, ...]) -> None:
    assert result(1, *arguments) == result(2, *arguments)
