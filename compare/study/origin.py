"""Code and machine of a run."""

import platform
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

import nlp_gait
from nlp_gait.backends.identity import hash_json
from nlp_gait.backends.kernel.compiler import read_cpu_info
from nlp_gait.user_code import remove_comments

# Packages and modules that decide the result of a run, next to the problem, whose probes are compared.
CODE = ("metaheuristics", "nlp_gait.backends.solvers", "nlp_gait.backends.nlp", "compare.study.run_task")


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Code and machine of a run."""

    version: str  #: of this package
    casadi: str  #: its version
    machine: str  #: processor and system

    @classmethod
    @cache
    def make(cls) -> "Origin":
        """Return the origin of a run in this process."""
        return cls(
            version=nlp_gait.__version__,
            casadi=version("casadi"),
            machine=f"{describe_processor()}, {describe_system()}",
        )


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
    """Return the hash of the installed code that runs solvers, without comments and docstrings."""
    texts = {}
    for name in CODE:
        package, _, module = name.rpartition(".")
        path = Path(str(files(package or module))) / (module if package else "")
        sources = sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]
        texts[name] = [
            (s.relative_to(path.parent).as_posix(), remove_comments(s.read_bytes()).decode()) for s in sources
        ]
    return hash_json(texts)
