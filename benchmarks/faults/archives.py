"""Verify archives in fresh environments: ``python -m benchmarks.faults.archives [--archives 20] [--damaged 5]``.

Every archive is of another study. Each is verified by the package of its wheel, in a new process with an empty home,
an empty cache of compiled code and another working folder, and a share of its runs is repeated. The damaged ones must be refused.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

from tests.faults.forged_archives import damage, forge

ROOT = Path(__file__).parents[2]
STUDIES = (
    *(["walk12", "--set", f"lambda={weight}", "--algorithms", "pso,de"] for weight in (0.1, 0.2, 0.4, 0.6, 0.9, 1.0)),
    *(["walk12", "--algorithms", solver] for solver in ("ga", "aco", "lshade", "cma")),
    *(["nao-ssp", "--algorithms", solver] for solver in ("pso", "ga", "cma")),
    *(["nao-dsp", "--algorithms", solver] for solver in ("pso", "aco-grid", "sobol")),
    *(
        ["gaitbench", "--option", f"instance={id}", "--algorithms", "pso"]
        for id in ("ssp-v5-time10", "dsp-v5", "walk12-w100")
    ),
    ["stairs-plan", "--algorithms", "pso"],
)
RECORD = "records/"


def main() -> None:
    """Make and verify the archives, and print a line for each."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.faults.archives", description=__doc__.splitlines()[0])
    parser.add_argument("--archives", type=int, default=len(STUDIES))
    parser.add_argument("--damaged", type=int, default=5)
    parser.add_argument("--rerun", default="20%")
    arguments = parser.parse_args()
    rng = random.Random(0)
    studies = list(STUDIES[: arguments.archives])
    bad = set(rng.sample(range(len(studies)), arguments.damaged))
    right = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        site = install(folder)
        for k, study in enumerate(studies):
            archive = folder / f"study-{k}.zip"
            make(study, site, folder / f"study-{k}", archive)
            what = hurt(archive, rng) if k in bad else "intact"
            began = time.perf_counter()
            status, last = verify(archive, site, folder / f"home-{k}", arguments.rerun)
            right += (status == 0) == (k not in bad)
            print(
                f"{' '.join(study)}: {what}: status {status} after {time.perf_counter() - began:.1f} s; {last}",
                flush=True,
            )
    print(f"{right} of {len(studies)} archives were told right")
    sys.exit(right != len(studies))


def install(folder: Path) -> Path:
    """Build the wheel and unpack it."""
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "-w",
        str(folder),
        str(ROOT),
    ]
    subprocess.run(command, check=True)
    site = folder / "site"
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as wheel:
        wheel.extractall(site)
    return site


def make(study: list[str], site: Path, folder: Path, archive: Path) -> None:
    """Compute a small study and pack it."""
    nlp_gait = [sys.executable, "-m", "nlp_gait"]
    options = ["--runs", "2", "--starts", "2", "--evaluations", "300", "--jobs", "1", "--out", str(folder)]
    for command in (["compare", *study, *options], ["archive", str(folder), "--out", str(archive)]):
        subprocess.run([*nlp_gait, *command], check=True, capture_output=True, cwd=site, env=isolate(site, Path.home()))


def hurt(archive: Path, rng: random.Random) -> str:
    """Damage or forge an archive, and say how."""
    with zipfile.ZipFile(archive) as packed:
        files = {name: packed.read(name) for name in packed.namelist()}
    record = rng.choice([name for name in files if name.startswith(RECORD)])
    signed = forge(files, record) if any(name.startswith("certificates/") for name in files) else ()
    name, content, _ = rng.choice([*damage(files, record), *signed])
    archive.write_bytes(content)
    return name


def isolate(site: Path, home: Path) -> dict[str, str]:
    """Return the environment of a process that sees the wheel, its own home and its own cache."""
    cache = {"NLP_GAIT_CACHE": str(home / "cache")} if home != Path.home() else {}
    paths = {"PATH": os.environ["PATH"], "HOME": str(home), "PYTHONPATH": str(site), "PYTHONSAFEPATH": "1"}
    return {**paths, **cache}


def verify(archive: Path, site: Path, home: Path, rerun: str) -> tuple[int, str]:
    """Verify an archive far from where it was made; return the exit status and the last line."""
    home.mkdir()
    command = [sys.executable, "-m", "nlp_gait", "verify", str(archive), "--rerun", rerun]
    done = subprocess.run(command, capture_output=True, text=True, cwd=home, env=isolate(site, home))
    return done.returncode, (done.stderr or done.stdout).strip().splitlines()[-1]


if __name__ == "__main__":
    main()
