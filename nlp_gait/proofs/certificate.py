"""Certificates: proven bounds, their files, and the shipped ones. Only proving again excludes every false bound."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from nlp_gait.backends.exact import describe_difference, identify_problem
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, read_json
from nlp_gait.formulation import GaitProblem

CERTIFICATES = Path(str(files("nlp_gait.proofs") / "certificates"))
# Version of the prover, written into certificates and checkpoints: raise it by hand where a change of this package decides what
# remains of a box, or what a proof is.
PROVER = 1


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Proven bound on the objective."""

    objective: float  # exact value of the incumbent, in the problem's sense
    # No x within the variables' bounds that the judge finds feasible has a better objective; not finite if the time limit came
    # before any bound
    bound: float
    tolerance: float  # requested relative distance of bound and objective
    closed: bool  # whether that distance was reached
    boxes: int  # number of boxes that were enclosed
    left: int  # number of boxes neither dropped nor halved at the end
    time_s: float  # wall time [s]
    cpu_s: float  # processor time [s]
    x: tuple[float, ...]  # the incumbent

    @property
    def gap(self) -> float:
        """Relative distance of bound and objective."""
        return abs(self.bound - self.objective) / (abs(self.objective) or 1.0)


@dataclass(frozen=True, kw_only=True)
class CertificateFile:
    """A certificate and its problem."""

    schema: Literal[2] = 2  # version of the file format
    problem: Mapping[str, Any]  # see ``identify_problem``
    prover: int  # version that made the proof, see ``PROVER``
    certificate: Certificate  # the proven bound


def make_certificate_file(problem: GaitProblem, certificate: Certificate) -> CertificateFile:
    """Return the certificate of a problem with the problem and the version of the prover."""
    return CertificateFile(problem=identify_problem(problem), prover=PROVER, certificate=certificate)


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
    """Return the shipped certificate with the smallest gap of an equal problem, which may have another name; None for none."""
    equal = [file for file in load_certificates().values() if not describe_difference(file.problem, problem)]
    return min(equal, key=lambda file: file.certificate.gap, default=None)
