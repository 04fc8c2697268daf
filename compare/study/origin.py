"""Where a record comes from: version and hash of the code that ran the solver, and the machine."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

from nlp_gait.backends.identity import hash_json
from nlp_gait.backends.kernel.compiler import read_cpu_info

# Packages and modules that decide the result of a run, next to the problem's mathematics, whose hash is in the definition.
CODE = ("metaheuristics", "nlp_gait.backends", "compare.study.run_task")
ENDINGS = (".py", ".hpp")


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Code and machine of a run."""

    version: str  #: of this package
    code_sha256: str  #: hash of the installed code that runs solvers
    casadi: str  #: its version, on which the hash of a problem depends
    machine: str  #: processor and system

    @classmethod
    @cache
    def make(cls) -> Origin:
        """Return the origin of a run in this process."""
        return cls(
            version=version("nlp-gait"),
            code_sha256=hash_installed_code(),
            casadi=version("casadi"),
            machine=f"{describe_processor()}, {describe_system()}",
        )

    @property
    def code(self) -> str:
        """Version and hash, for messages."""
        return f"{self.version}, code {self.code_sha256[:8]}, CasADi {self.casadi}"


def format_now() -> str:
    """Return the date and time, UTC."""
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")


@cache
def describe_processor() -> str:
    """Return the name of the processor."""
    return read_cpu_info("model name") or platform.processor() or "unknown"


def describe_system() -> str:
    """Return the operating system and the machine type."""
    return f"{platform.system()} {platform.release()} {platform.machine()}"


@cache
def hash_installed_code() -> str:
    """Return the hash of the installed code that runs solvers."""
    found = {}
    for name in CODE:
        package, _, module = name.rpartition(".")
        path = Path(str(files(package or module))) / (module if package else "")
        sources = sorted(path.rglob("*")) if path.is_dir() else [path.with_suffix(".py")]
        own = [source for source in sources if source.suffix in ENDINGS]
        found[name] = [(s.relative_to(path.parent).as_posix(), s.read_text(encoding="utf-8")) for s in own]
    return hash_json(found)
