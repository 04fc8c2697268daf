"""The C++ compiler of this machine: found, asked for its version, run with a time limit."""

from __future__ import annotations

import functools
import os
import platform
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

from nlp_gait.errors import CompilerError

TIME_LIMIT_S = 300.0
VERSION_TIME_LIMIT_S = 20.0
COMMON_NAMES = ("c++", "g++", "clang++")
HOW_TO_GET_ONE = (
    "to get a compiler: pip install 'nlp-gait[compiler]', or your system's g++ or clang++, or name one in the environment "
    "variable CXX"
)


# Runs a program that ends with this process, however that ends: the end of the pipe on standard input, which nobody writes to,
# is the end of whoever holds its other side.
WATCHED = (
    "/bin/sh",
    "-c",
    'exec 3<&0 </dev/null; "$@" 3<&- & program=$!; { read -r _ <&3; kill -KILL 0; } >/dev/null 2>&1 & watch=$!; '
    'wait "$program"; status=$?; { kill "$watch"; wait "$watch"; } 2>/dev/null; exit "$status"',
    "sh",
)


@dataclass(frozen=True, kw_only=True)
class Compiler:
    """A C++ compiler.

    Attributes:
        command: program and leading arguments.
        version: what ``--version`` says, for cache keys.
    """

    command: tuple[str, ...]
    version: str

    @property
    def summary(self) -> str:
        """Program and first line of the version."""
        return f"{' '.join(self.command)} ({self.version.splitlines()[0] if self.version else 'version unknown'})"

    def build(self, source: Path, library: Path, flags: Sequence[str]) -> None:
        """Compile one C++ file into a shared library.

        Raises:
            CompilerError: the compiler fails, does not end in time, or leaves no library.
        """
        command = [*self.command, *flags, "-shared", "-fPIC", "-o", str(library), str(source), "-lm"]
        _run(command, TIME_LIMIT_S)
        if not library.is_file():
            raise CompilerError(f"{Path(self.command[0]).name} exited with status 0, but wrote no library")


def read_native_source(package: str, *names: str) -> str:
    """C++ of the files in a package's folder ``native``, one after the other."""
    native = files(package) / "native"
    return "\n".join((native / name).read_text(encoding="utf-8") for name in names)


def find_compiler() -> Compiler:
    """The first C++ compiler that works: ``$CXX``, ``$CC``, c++, g++, clang++, and the ``ziglang`` package.

    Raises:
        CompilerError: there is none; the message says what was tried.
    """
    return _find(os.environ.get("CXX", ""), os.environ.get("CC", ""), os.environ.get("PATH", ""))


@functools.lru_cache(maxsize=8)
def _find(cxx: str, cc: str, path: str) -> Compiler:
    tried: list[str] = []
    for name, text in (("CXX", cxx), ("CC", cc)):
        if _words(text) == ():
            tried.append(f"{name}={text!r}: not a command line")
    for command in _candidates(cxx, cc):
        if shutil.which(command[0], path=path) is None:
            tried.append(f"{command[0]}: not found")
            continue
        try:
            return Compiler(command=command, version=_run([*command, "--version"], VERSION_TIME_LIMIT_S).strip())
        except CompilerError as error:
            tried.append(str(error))
    raise CompilerError(f"no C++ compiler ({'; '.join(tried)}); {HOW_TO_GET_ONE}")


def _candidates(cxx: str, cc: str) -> list[tuple[str, ...]]:
    named = [words for variable in (cxx, cc) if (words := _words(variable))]
    found: list[tuple[str, ...]] = [(name,) for name in COMMON_NAMES]
    if find_spec("ziglang") is not None:
        found.append((sys.executable, "-m", "ziglang", "cc"))
    return named + found


def _words(text: str) -> tuple[str, ...] | None:
    """Words of a command line; none where its quotes are not closed or it names no program, None if there is no text."""
    if not text.strip():
        return None
    try:
        words = tuple(shlex.split(text))
    except ValueError:
        return ()
    return words if words and words[0] else ()


def _run(command: Sequence[str], time_limit_s: float) -> str:
    """Standard output of a program that ends with status 0 in time."""
    program = Path(command[0]).name
    watched, held = os.pipe()
    try:
        process = subprocess.Popen(
            [*WATCHED, *command] if os.name == "posix" else command,
            stdin=watched,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,  # so that the compiler's own children can be killed with it
        )
    except OSError as error:
        os.close(held)
        raise CompilerError(f"{program} cannot be run: {error}") from error
    finally:
        os.close(watched)
    try:
        output, messages = process.communicate(timeout=time_limit_s)
    except subprocess.TimeoutExpired as error:
        raise CompilerError(f"{program} did not end within {time_limit_s:g} s") from error
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
        os.close(held)
    if process.returncode != 0:
        lines = [line.strip() for line in messages.splitlines() if line.strip()]
        reason = next((line for line in lines if "error" in line.lower()), lines[-1] if lines else "no message")
        status = (
            process.returncode if process.returncode <= 128 else 128 - process.returncode
        )  # a signal, as sh says it
        raise CompilerError(f"{program} failed with exit status {status}: {reason}")
    return output


@functools.cache
def cpu_features() -> frozenset[str]:
    """Names of the instruction sets that this CPU has, as the operating system spells them; empty if it does not say."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="ignore").splitlines()
    except OSError:
        return frozenset()
    for line in lines:
        name, _, value = line.partition(":")
        if name.strip() in ("flags", "Features"):
            return frozenset(value.split())
    return frozenset()


# Flags that let the compiler use what the CPU has, by lane count; each needs the features named.
X86_SETS = (
    (8, ("avx512f", "avx512dq", "avx512vl", "avx512bw", "avx2", "fma")),
    (4, ("avx2", "fma")),
)


def native_lanes() -> int:
    """Doubles that one instruction of this CPU works on: 8 (AVX-512), 4 (AVX2), 2 (SSE2, NEON), else 1."""
    machine = platform.machine().lower()
    if machine in ("x86_64", "amd64"):
        return next((lanes for lanes, needed in X86_SETS if cpu_features().issuperset(needed)), 2)
    return 2 if machine in ("aarch64", "arm64") else 1


def lane_flags(lanes: int) -> tuple[str, ...]:
    """Compiler flags for a lane count."""
    if platform.machine().lower() in ("x86_64", "amd64"):
        needed = dict(X86_SETS).get(lanes, ())
        return tuple(f"-m{feature}" for feature in needed)
    return ()
