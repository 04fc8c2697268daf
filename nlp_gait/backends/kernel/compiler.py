"""C++ source of a function over lanes, the compiler of this machine, and libraries in the user's cache folder.

The name of a library consists of a hash of everything that it depends on and the checksum of the file. It is written under
another name and renamed; processes that need it at the same time wait for the first one. A broken file is built again.
"""

import atexit
import ctypes
import functools
import hashlib
import logging
import os
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

import casadi as ca

from nlp_gait.errors import CompilerError, warn_once
from nlp_gait.files import convert_errors, lock_folder, make_temporary_folder

TIME_LIMIT_S = 300.0
VERSION_TIME_LIMIT_S = 20.0
SILENT_S = 5.0  # after which the user is told what is waited for
COMMON_NAMES = ("c++", "g++", "clang++")
SYMBOLS = ("nlp_gait_rows_memory", "nlp_gait_evaluate_rows")  # functions of ``write_rows_source``
HOW_TO_GET_ONE = (
    "to get a compiler: pip install ziglang, or your system's g++ or clang++, or name one in the environment "
    "variable CXX"
)
# No -ffast-math: NaN and infinity keep their meaning. No contraction to fused multiply-add, which gains nothing: so results are
# the virtual machine's bits, except where libm's vector functions round differently. Hidden symbols: its helpers are inlined.
BASE_FLAGS = ("-std=c++17", "-O2", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-w")


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


def read_native_source(package: str, name: str) -> str:
    """Return the C++ of a file in a package's folder ``native``."""
    return (files(package) / "native" / name).read_text(encoding="utf-8")


def find_compiler() -> Compiler:
    """Return the first C++ compiler that works: ``$CXX``, ``$CC``, c++, g++, clang++, ``ziglang``; raises CompilerError."""
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
    pipe = subprocess.PIPE
    try:  # in a session of its own, so that the compiler's children can be killed with it
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=pipe,
            stderr=pipe,
            text=True,
            errors="replace",
            start_new_session=True,
        )
    except OSError as error:
        raise CompilerError(f"{program} cannot be run: {error}") from error
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
    if process.returncode != 0:
        lines = [line.strip() for line in messages.splitlines() if line.strip()]
        reason = next((line for line in lines if "error" in line.lower()), lines[-1] if lines else "no message")
        raise CompilerError(f"{program} failed with exit status {process.returncode}: {reason}")
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


def write_rows_source(function: ca.Function, *, objective: bool = False) -> str:
    """Return the C++ source of a function named ``kernel`` with dense results; the lane count is the macro LANES.

    With ``objective``, the function is (x, p) to (cost, g), and the code also computes the violation, see ``rows.hpp``.
    """
    inputs = [str(function.numel_in(i)) for i in range(function.n_in())]
    outputs = [str(function.numel_out(i)) for i in range(function.n_out())] + ["1"] * objective
    sources = [
        "#include <utility>",
        read_native_source("nlp_gait.backends.kernel", "lanes.hpp"),
        _generate_lane_code(function),
        *["#define OBJECTIVE"] * objective,
        f"enum {{ INPUTS = {len(inputs)}, OUTPUTS = {len(outputs)} }};",
        f"static const long long input_size[] = {{{', '.join(inputs)}}};",
        f"static const long long output_size[] = {{{', '.join(outputs)}}};",
        read_native_source("nlp_gait.backends.kernel", "rows.hpp"),
    ]
    return "\n".join(sources)


def _generate_lane_code(function: ca.Function) -> str:
    """Return CasADi's C code of a function, over the numbers of lanes.hpp."""
    generator = ca.CodeGenerator("kernel", {"casadi_real": "Lanes"})
    generator.add(function)
    entry = r"(\(\*\w+\+\+\)|\w+(?:\[i\])?)"  # of a vector, in a loop
    code = re.sub(rf"\({entry}\?{entry}:0\)", r"if_else_zero(\1,\2)", generator.dump())
    if function.is_a("SXFunction"):  # no argument or result is left out
        code = re.sub(r"(arg\[\d+\])\? (\1\[\d+\]) : 0", r"\2", re.sub(r"if \(res\[\d+\]!=0\) ", "", code))
    code = code.replace("x<0 ? -1 : x>0 ? 1 : x", "sign_of(x)")
    return f"#define __STDC_VERSION__ 199901L  // so that the generated code calls fmin, fmax and fabs of lanes.hpp\n{code}"


FOLDER_VARIABLE = "NLP_GAIT_CACHE"
SUFFIX = ".dylib" if sys.platform == "darwin" else ".so"


def load_library(
    source: str,
    compiler: Compiler,
    flags: Sequence[str],
    symbols: Sequence[str],
    write_sources: Callable[[], Sequence[str]] | None = None,
) -> tuple[ctypes.CDLL, Path]:
    """Return the library of a C++ source, which must have some functions, and its file, cached or built; raises CompilerError.

    With ``write_sources``, which is called to build it, ``source`` is everything that it depends on. All of these but the first
    are compiled once for all libraries of this process.
    """
    machine = (platform.system(), platform.machine(), *platform.libc_ver())
    inputs = (source, *compiler.command, compiler.version, *flags, *machine)
    key = hashlib.sha256("\0".join(inputs).encode()).hexdigest()[:32]
    reason = ""
    for find_folder in (find_cache_folder, make_private_folder):
        folder = find_folder()
        library = _find_library(folder, key, symbols)
        try:
            if library is None:
                with lock_folder(folder, f"{key}.lock"):  # another process may be building it
                    library = _find_library(folder, key, symbols)
                    if library is None:
                        _build_library(folder, key, write_sources or (lambda: [source]), compiler, flags)
                library = library or _find_library(folder, key, symbols)
        except OSError as error:  # a full disk, a folder that may only be read
            reason = error.strerror or str(error)
        if library is not None:
            if reason:
                warn_once(f"the cache folder cannot be used ({reason}); compiled code is stored for this process only")
            return library
        reason = reason or "what the compiler built cannot be loaded"
    raise CompilerError(f"no compiled code ({reason}); free some disk space, or name a folder in TMPDIR")


def _build_library(
    folder: Path, key: str, write_sources: Callable[[], Sequence[str]], compiler: Compiler, flags: Sequence[str]
) -> None:
    """Build a library and move it to its name in a folder; raises CompilerError, and OSError if there is no room."""
    with make_temporary_folder("nlp-gait-build-", CompilerError) as workshop:
        file, built = workshop / "source.cpp", workshop / f"library{SUFFIX}"
        source, *others = write_sources()
        file.write_text(source, encoding="utf-8")
        objects = [_compile_object(other, compiler, tuple(flags)) for other in others]
        compiler.build(file, built, (*flags, *objects))
        with tempfile.TemporaryDirectory(dir=folder, prefix="new-") as landing:
            copy = shutil.copyfile(built, Path(landing) / built.name)
            os.replace(copy, folder / f"{key}-{_hash(built)}{SUFFIX}")


@functools.lru_cache(maxsize=4)
def _compile_object(source: str, compiler: Compiler, flags: tuple[str, ...]) -> str:
    """Return the object file of a source, which exists until this process ends."""
    file = make_private_folder() / f"{hashlib.sha256(source.encode()).hexdigest()}.cpp"
    file.write_text(source, encoding="utf-8")
    compiler.build(file, file.with_suffix(".o"), (*flags, "-c"))
    return str(file.with_suffix(".o"))


def _find_library(folder: Path, key: str, symbols: Sequence[str]) -> tuple[ctypes.CDLL, Path] | None:
    """Return a library that has its checksum and the functions; other files of its name are removed."""
    for file in sorted(folder.glob(f"{key}-*{SUFFIX}")):
        with suppress(OSError, AttributeError):
            if file.stem.endswith(f"-{_hash(file)}"):
                library = ctypes.CDLL(str(file))
                for symbol in symbols:
                    getattr(library, symbol)
                return library, file
        with suppress(OSError):
            file.unlink()
    return None


def find_cache_folder() -> Path:
    """Return the folder of cached libraries: ``$NLP_GAIT_CACHE``, else the system's cache folder of this user.

    It is made if necessary; if that is impossible, a temporary folder of this process is used.
    """
    from platformdirs import user_cache_path  # on first use

    named = os.environ.get(FOLDER_VARIABLE)
    try:
        base = Path(named).expanduser().absolute() if named else user_cache_path("nlp-gait", appauthor=False)
        os.fsencode(base).decode()  # threadpoolctl decodes names of libraries
        base.mkdir(mode=0o700, parents=True, exist_ok=True)
    except (OSError, RuntimeError, UnicodeError) as error:  # RuntimeError: a user without a home
        reason = getattr(error, "strerror", None) or error
        warn_once(f"the cache folder cannot be made ({reason}); compiled code is stored for this process only")
        return make_private_folder()
    return base


@functools.cache
def make_private_folder() -> Path:
    """Return a folder that only this process uses, made when it is first needed and removed at the end."""
    with convert_errors("no folder for temporary files", CompilerError, "free some disk space, or name one in TMPDIR"):
        folder = Path(tempfile.mkdtemp(prefix="nlp-gait-")).resolve()

    @atexit.register
    def remove(owner: int = os.getpid()) -> None:
        if os.getpid() == owner:  # not in a fork of it
            shutil.rmtree(folder, ignore_errors=True)

    return folder


def _hash(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()[:32]
