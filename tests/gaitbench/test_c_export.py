"""The exported C++: built by its own build line, called from C and from Octave, equal to the package to 1e-12."""

import ctypes
import os
import shutil
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from nlp_gait import gaitbench
from nlp_gait.formulation import Array
from nlp_gait.gaitbench.c_export import export_objective, make_prefix

EQUAL = 1e-12
IDS = ("walk12-w015", "ssp-v5-time10")

pytestmark = pytest.mark.skipif(not (shutil.which("c++") and shutil.which("cc")), reason="no C and C++ compiler")


@pytest.fixture(
    scope="module",
    params=[pytest.param(IDS[0], marks=pytest.mark.commit), pytest.param(IDS[1], marks=pytest.mark.nightly)],
)
def built(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    folder = tmp_path_factory.mktemp("c") / "out"
    export_objective(gaitbench.load(request.param), folder)
    subprocess.run(["sh", str(folder / "build.sh")], check=True, capture_output=True, timeout=300)
    yield request.param, folder


def points(id: str, count: int = 130) -> Array:
    """More than one block, not a whole number of them."""
    instance = gaitbench.load(id)
    return np.random.default_rng(1).uniform(instance.lower, instance.upper, (count, len(instance.names)))


def test_files_stand_alone(built: tuple[str, Path]) -> None:
    """No file of this package is included, and what is linked is libc and libm."""
    id, folder = built
    prefix = make_prefix(id)
    assert {f"{prefix}.cpp", f"{prefix}.h", "main.c", "build.sh", f"{prefix}_mex.cpp"} <= set(os.listdir(folder))
    included = [line for line in (folder / f"{prefix}.cpp").read_text().splitlines() if line.startswith("#include")]
    assert {line.split()[1] for line in included} <= {
        "<math.h>",
        "<stdlib.h>",
        "<string.h>",
        "<utility>",
        f'"{prefix}.h"',
    }
    if shutil.which("ldd"):
        linked = subprocess.run(["ldd", str(folder / f"lib{prefix}.so")], capture_output=True, text=True, check=True)
        libraries = {line.split()[0].split(".")[0] for line in linked.stdout.splitlines()}
        assert {name for name in libraries if name.startswith("lib")} <= {"libm", "libc", "libmvec"}


def test_called_as_a_library(built: tuple[str, Path]) -> None:
    """Objective, violation and every row of many points; rows may be left out; a NaN is infinite; threads share it."""
    id, folder = built
    instance, prefix, X = gaitbench.load(id), make_prefix(id), points(id)
    evaluate = getattr(ctypes.CDLL(str(folder / f"lib{prefix}.so")), f"{prefix}_evaluate")
    double = ctypes.POINTER(ctypes.c_double)
    evaluate.argtypes = [double, ctypes.c_longlong, double, double, double]

    def pointer(array: Array | None) -> object:
        return None if array is None else array.ctypes.data_as(double)

    def called(X: Array, rows: bool) -> tuple[Array, Array, Array]:
        f, violation = np.empty(len(X)), np.empty(len(X))
        G = np.empty((len(X), len(instance.row_names)))
        assert evaluate(pointer(X), len(X), pointer(f), pointer(violation), pointer(G) if rows else None) == 0
        return f, violation, G

    found = called(X, rows=True)
    expected = (*instance(X), instance.rows(X))
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=EQUAL, atol=EQUAL)
    np.testing.assert_array_equal(called(X, rows=False)[0], found[0])
    with ThreadPoolExecutor(4) as threads:
        for again in threads.map(lambda _: called(X, rows=True), range(16)):
            np.testing.assert_array_equal(again[2], found[2])
    X[0, 0] = np.nan
    assert np.isinf([part[0] for part in called(X, rows=False)[:2]]).all()


def test_called_from_c(built: tuple[str, Path]) -> None:
    """The example in C reads points, and prints what the package finds."""
    id, folder = built
    instance, X = gaitbench.load(id), points(id, 5)
    text = "\n".join(" ".join(map(repr, x)) for x in X.tolist())
    done = subprocess.run([str(folder / "main")], input=text, capture_output=True, text=True, check=True, timeout=60)
    lines = [line.split(maxsplit=3) for line in done.stdout.splitlines()[1:]]
    at = np.vstack([instance.best_x, X])
    f, violation = instance(at)
    G = instance.rows(at)
    assert len(lines) == len(at)
    for line, fi, vi, row in zip(lines, f, violation, G, strict=True):
        np.testing.assert_allclose([float(v) for v in line[:3]], [fi, vi, row.max()], rtol=EQUAL, atol=EQUAL)
        assert row[instance.row_names.index(line[3])] == pytest.approx(row.max(), rel=1e-9, abs=EQUAL)


@pytest.mark.program("octave-cli", "mkoctfile")
def test_called_from_octave(built: tuple[str, Path], tmp_path: Path) -> None:
    """Through the mex file: f, violation and G of several points, to the last digits that are printed."""
    id, folder = built
    instance, prefix, X = gaitbench.load(id), make_prefix(id), points(id, 3)
    command = ["mkoctfile", "--mex", f"{prefix}_mex.cpp", f"{prefix}.cpp", "-o", f"{prefix}.mex"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=300)
    rows = "; ".join(" ".join(map(repr, x)) for x in X.tolist())
    program = f"[f, v, G] = {prefix}([{rows}]); printf('%.17g\\n', f, v, G');"
    done = subprocess.run(
        ["octave-cli", "--no-gui", "-q", "--eval", program], cwd=folder, capture_output=True, text=True, timeout=120
    )
    found = np.array([float(line) for line in done.stdout.split()])
    expected = np.concatenate([*instance(X), instance.rows(X).ravel()])
    np.testing.assert_allclose(found, expected, rtol=EQUAL, atol=EQUAL)
