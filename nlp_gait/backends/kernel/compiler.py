"""The C++ compiler of this machine, its version and flags; it runs with a time limit."""

import functools
import logging
import os
import platform
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

from nlp_gait.errors import CompilerError

TIME_LIMIT_S = 300.0
VERSION_TIME_LIMIT_S = 20.0
SILENT_S = 5.0  # after which the user is told what is waited for
COMMON_NAMES = ("c++", "g++", "clang++")
HOW_TO_GET_ONE = (
    "to get a compiler: pip install ziglang, or your system's g++ or clang++, or name one in the environment "
    "variable CXX"
)
# No -ffast-math: NaN and infinity keep their meaning. No contraction to fused multiply-add, which gains nothing: so results are
# the virtual machine's bits, except where libm's vector functions round differently. Hidden symbols: its helpers are inlined.
BASE_FLAGS = ("-std=c++17", "-O2", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-w")

# Runs a program that ends with this process, however this process ends: then the pipe on its standard input is closed.
WATCHED = (
    "/bin/sh",
    "-c",
    'exec 3<&0 </dev/null; "$@" 3<&- & program=$!; { read -r _ <&3; kill -KILL 0; } >/dev/null 2>&1 & watch=$!; '
    'wait "$program"; status=$?; { kill "$watch"; wait "$watch"; } 2>/dev/null; exit "$status"',
    "sh",
)


@dataclass(frozen=True, kw_only=True)
class Compiler:
    """A C++ compiler."""

    command: tuple[str, ...]  #: program and leading arguments
    version: str  #: output of ``--version``, for cache keys

    @property
    def summary(self) -> str:
        """Program, and first line of the version."""
        return f"{' '.join(self.command)} ({self.version.splitlines()[0] if self.version else 'version unknown'})"

    def build(self, source: Path, library: Path, flags: Sequence[str]) -> None:
        """Compile a C++ file to a shared library; CompilerError if that fails, takes too long, or writes none."""
        command = [*self.command, *flags, "-shared", "-fPIC", "-o", str(library), str(source), "-lm"]
        _run(command, TIME_LIMIT_S)
        if not library.is_file():
            raise CompilerError(f"{Path(self.command[0]).name} exited with status 0, but wrote no library")


def read_native_source(package: str, *names: str) -> str:
    """Return the C++ of files in a package's folder ``native``, one after the other."""
    native = files(package) / "native"
    return "\n".join((native / name).read_text(encoding="utf-8") for name in names)


def find_compiler() -> Compiler:
    """Return the first C++ compiler that works: ``$CXX``, ``$CC``, c++, g++, clang++, ``ziglang``; else raises CompilerError."""
    return _find(os.environ.get("CXX", ""), os.environ.get("CC", ""), os.environ.get("PATH", ""))


@functools.lru_cache(maxsize=8)
def _find(cxx: str, cc: str, path: str) -> Compiler:
    tried: list[str] = []
    commands: list[tuple[str, ...]] = []
    for name, text in (("CXX", cxx), ("CC", cc)):
        try:
            words = shlex.split(text)
        except ValueError:  # a quote is not closed
            words = [""]
        if words and words[0]:
            commands.append(tuple(words))
        elif text.strip():
            tried.append(f"{name}={text!r}: not a command line")
    commands += [(name,) for name in COMMON_NAMES]
    if find_spec("ziglang") is not None:
        commands.append((sys.executable, "-P", "-m", "ziglang", "cc"))
    for command in commands:
        if shutil.which(command[0], path=path) is None:
            tried.append(f"{command[0]}: not found")
            continue
        try:
            return Compiler(command=command, version=_run([*command, "--version"], VERSION_TIME_LIMIT_S).strip())
        except CompilerError as error:
            tried.append(str(error))
    raise CompilerError(f"no C++ compiler ({'; '.join(tried)}); {HOW_TO_GET_ONE}")


def _run(command: Sequence[str], time_limit_s: float) -> str:
    program = Path(command[0]).name
    read_end, write_end = os.pipe()
    try:
        process = subprocess.Popen(
            [*WATCHED, *command] if os.name == "posix" else command,
            stdin=read_end,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,  # so that the compiler's own children can be killed with it
        )
    except OSError as error:
        os.close(write_end)
        raise CompilerError(f"{program} cannot be run: {error}") from error
    finally:
        os.close(read_end)
    try:
        try:
            output, messages = process.communicate(timeout=SILENT_S)
        except subprocess.TimeoutExpired:
            waiting = "waiting for the compiler %s, which has run for %g s (limit: %g s)"
            logging.getLogger("nlp_gait").warning(waiting, program, SILENT_S, time_limit_s)
            output, messages = process.communicate(timeout=time_limit_s - SILENT_S)
    except subprocess.TimeoutExpired as error:
        raise CompilerError(f"{program} did not end within {time_limit_s:g} s") from error
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
        os.close(write_end)
    if process.returncode != 0:
        lines = [line.strip() for line in messages.splitlines() if line.strip()]
        reason = next((line for line in lines if "error" in line.lower()), lines[-1] if lines else "no message")
        status = process.returncode if process.returncode <= 128 else 128 - process.returncode  # sh: 128 + signal
        raise CompilerError(f"{program} failed with exit status {status}: {reason}")
    return output


@functools.cache
def read_cpu_info(*names: str) -> str:
    """Return the first entry of one of these names in Linux's list of processors; empty where there is none."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            name, _, value = line.partition(":")
            if name.strip() in names:
                return value.strip()
    return ""


# Instruction sets that a lane count needs; the compiler may use them.
X86_SETS = {8: ("avx512f", "avx512dq", "avx512vl", "avx512bw", "avx2", "fma"), 4: ("avx2", "fma")}


def native_lanes() -> int:
    """Return how many doubles one instruction of this CPU works on: 8 (AVX-512), 4 (AVX2), 2 (SSE2, NEON), else 1."""
    machine = platform.machine().lower()
    if machine in ("x86_64", "amd64"):
        available = set(read_cpu_info("flags", "Features").split())
        return next((lanes for lanes, needed in X86_SETS.items() if available.issuperset(needed)), 2)
    return 2 if machine in ("aarch64", "arm64") else 1


def lane_flags(lanes: int) -> tuple[str, ...]:
    """Return the compiler flags for a lane count."""
    if platform.machine().lower() in ("x86_64", "amd64"):
        return tuple(f"-m{feature}" for feature in X86_SETS.get(lanes, ()))
    return ()
