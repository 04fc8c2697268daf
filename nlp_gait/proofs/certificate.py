"""Certificates: files of proven bounds, and the shipped ones. See ``check.py`` for their check."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from nlp_gait.backends.identity import HASH, identify_problem
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, read_json
from nlp_gait.formulation import GaitProblem
from nlp_gait.proofs.bounds import make_bounds
from nlp_gait.proofs.branch_and_bound import Certificate
from nlp_gait.proofs.checkpoint import hash_code

CERTIFICATES = Path(str(files("nlp_gait.proofs") / "certificates"))


@dataclass(frozen=True, kw_only=True)
class CertificateFile:
    """A certificate and its problem."""

    schema: Literal[1] = 1  # version of the file format
    problem: Mapping[str, Any]  # name, options, parameters, and the hash of its mathematics
    code_sha256: str  # hash of the code that made the proof, see ``hash_code``
    certificate: Certificate  # the proven bound

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return asdict(self)


def make_certificate_file(problem: GaitProblem, certificate: Certificate) -> CertificateFile:
    """Return the certificate of a problem with its problem and code."""
    return CertificateFile(
        problem=identify_problem(problem), code_sha256=hash_code(make_bounds(problem)), certificate=certificate
    )


def read_certificate(path: Path) -> CertificateFile:
    """Read a certificate; raises InputError if the file is not one."""
    raw = read_json(path, "certificate")
    with convert_errors(f"certificate {str(path)!r} is damaged", InputError):
        return decode(CertificateFile, raw)


@cache
def load_certificates() -> Mapping[str, CertificateFile]:
    """Read the shipped certificates by file name without suffix: an instance of GaitBench, or ``walk12-lambda-LAMBDA``."""
    return {path.stem: read_certificate(path) for path in sorted(CERTIFICATES.glob("*.json"))}


def find_certificate(problem: Mapping[str, Any]) -> CertificateFile | None:
    """Return the shipped certificate of a problem with the smallest gap, see ``identify_problem``; None if there is none."""
    found = [file for file in load_certificates().values() if file.problem[HASH] == problem.get(HASH)]
    return min(found, key=lambda file: file.certificate.gap, default=None)
