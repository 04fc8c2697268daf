"""``study.json``: settings of a study, and the commands, machines and versions that computed its records."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from compare.study.record import describe_processor, describe_system, format_now, hash_installed_code
from compare.study.settings import StudySettings, parse_settings
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.backends.kernel.compiler import BASE_FLAGS, find_compiler, lane_flags, native_lanes
from nlp_gait.decoding import decode
from nlp_gait.errors import CompilerError, InputError
from nlp_gait.files import convert_errors, read_json, write_json

FILE = "study.json"
REMEDY = "delete it; the records stay valid"
PACKAGES = ("nlp-gait", "casadi", "numpy", "scipy", "joblib", "cma", "pymoo", "distributed")


@dataclass(frozen=True, kw_only=True)
class Session:
    """One command that ran a part of a study."""

    command: str
    started: str  #: date and time, UTC
    machine: Mapping[str, str]  #: processor, system, number of usable processors
    versions: Mapping[str, str]  #: of Python and the installed packages, and the hash of the code that runs solvers
    kernel: str  #: compiler and flags of the objective, or why it is interpreted
    jobs: str  #: worker processes, or the address of the scheduler

    @classmethod
    def begin(cls, command: str, jobs: str) -> Session:
        """Return a session that begins now, in this process."""
        return cls(
            command=command,
            started=format_now(),
            machine={
                "processor": describe_processor(),
                "system": describe_system(),
                "processors": str(available_cores()),
            },
            versions={"python": sys.version.split()[0], **_versions(), "code": hash_installed_code()[:8]},
            kernel=_kernel(),
            jobs=jobs,
        )


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """Settings of the study that was run last, None without a manifest, and the sessions in its folder."""

    settings: StudySettings | None
    sessions: tuple[Session, ...]


@dataclass(frozen=True, kw_only=True)
class _File:
    schema: Literal[1]
    study: Mapping[str, Any]
    sessions: tuple[Session, ...]


def write_manifest(folder: Path, settings: StudySettings, session: Session) -> None:
    """Add a session to the manifest of a folder, with the latest settings; raises InputError if the manifest is damaged."""
    sessions: Sequence[Session] = read_manifest(folder).sessions
    data = {"schema": 1, "study": settings.to_json(), "sessions": [asdict(s) for s in (*sessions, session)]}
    write_json(folder / FILE, data)


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of a folder, empty if there is none; raises InputError if it is damaged or of another schema."""
    path = folder / FILE
    if not os.path.lexists(path):
        return Manifest(settings=None, sessions=())
    raw = read_json(path, "manifest", remedy=REMEDY)
    with convert_errors(f"manifest {str(path)!r} is damaged", InputError, REMEDY):
        file = decode(_File, raw)
    return Manifest(
        settings=parse_settings(file.study, f"manifest {str(path)!r}", runs_code=False), sessions=file.sessions
    )


def _versions() -> dict[str, str]:
    found = {}
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


def _kernel() -> str:
    lanes = native_lanes()
    try:
        return " ".join([find_compiler().summary, *BASE_FLAGS, *lane_flags(lanes), f"-DLANES={lanes}"])
    except CompilerError as error:
        return f"interpreted: {error}"
