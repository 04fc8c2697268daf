"""C++ as WebAssembly for pages, by the package ``ziglang``, which has a compiler and a C library for it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from nlp_gait.backends.kernel.compiler import BASE_FLAGS

REMEDY = "WebAssembly needs the package ziglang: pip install ziglang"
# Two candidates at a time by the 128-bit instructions that every browser has since 2023.
LANES = ("-DLANES=2", "-msimd128")
TARGET = ("-target", "wasm32-wasi")
# No exceptions, which would need the run-time library of C++; no debug information, which takes most of the time.
LEAN = ("-fno-exceptions", "-fno-rtti", "-g0")


def has_compiler() -> bool:
    """Return whether ``compile_module`` works here."""
    return find_spec("ziglang") is not None


def compile_module(sources: Sequence[Path], exports: Sequence[str]) -> bytes:
    """Return a module that exports its memory, ``_initialize`` and functions by name, and imports nothing.

    Object files are written next to the sources.

    Raises:
        subprocess.CalledProcessError: the compiler fails; it has printed why.
    """
    objects = {source: source.with_suffix(".o") for source in sources}
    for source, target in objects.items():
        _run("c++", *BASE_FLAGS, *LANES, *LEAN, "-c", "-o", str(target), str(source))
    module = sources[0].with_suffix(".wasm")
    names = [f"-Wl,--export={name}" for name in exports]
    _run("cc", "-mexec-model=reactor", "-s", *names, "-o", str(module), *map(str, objects.values()))
    return module.read_bytes()


def _run(language: str, *arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "ziglang", language, *TARGET, *arguments], check=True)
