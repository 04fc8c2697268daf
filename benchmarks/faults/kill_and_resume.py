"""Commands killed with -9 at random moments, and called again: nothing finished may be lost, and nothing done twice.

    python -m benchmarks.faults.kill_and_resume [--kills 100] [--seed 0] [--only NAME,NAME] [--out FOLDER]

Every command that writes is run undisturbed once. Then it is killed again and again, each time at a moment that is uniform over
its duration, so that these fall into starting, computing and writing alike. After each kill every file must be whole and every
finished record and step still there; at the end the same call must leave the undisturbed files, data for data but for times.
Exit status 1 if anything differs.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from nlp_gait import load

SMALL = ("nao-ssp", "--intervals", "2", "--starts", "1")
FIXED = (
    *("hip_height_m=0.31", "hip_vz_start_m_s=-0.00122", "hip_vz_end_m_s=0.0035", "hip_vx_start_m_s=0.01243"),
    *("hip_vx_end_m_s=0.001", "swing_height_m=0.015"),
)
WALKS = ("walk12", "--runs", "4", "--evaluations", "3000")
# {out} is the folder of the case; made before: {gait} a result, {finals} points from elsewhere, {study} the folder of a study.
CASES: dict[str, tuple[str, ...]] = {
    "compare": (
        "compare",
        *WALKS,
        "--algorithms",
        "pso,ga",
        "--starts",
        "4",
        "--polish",
        "--jobs",
        "2",
        "--out",
        "{out}",
    ),
    "search": ("search", *WALKS, "--algorithm", "de", "--jobs", "1", "--out", "{out}"),
    "bench": (
        *("bench", "--algorithm", "random", "--label", "mine", "--instances", "walk12-w015", "--runs", "4"),
        *("--jobs", "1", "--out", "{out}"),
    ),
    "sweep": ("sweep", "walk12", "--over", "step_length_m=0.06:0.12:12", "--starts", "3", "--out", "{out}"),
    "sweep by a search": (
        *("sweep", "walk12", "--over", "foot_lift_m=0.01:0.03:6", "--algorithm", "pso", "--evaluations", "2000"),
        *("--out", "{out}"),
    ),
    "walk": ("walk", "--over", "speed_m_s=0.02,0.03", "--starts", "1", "--intervals", "2", "--out", "{out}"),
    "pareto": (
        *(
            "pareto",
            "nao-ssp",
            "--intervals",
            "4",
            "--starts",
            "1",
            "--points",
            "5",
            "--objectives",
            "power,speed",
            "--search",
            "NSGA2=1000",
            "--runs",
            "2",
        ),
        *(f"--fix={fixed}" for fixed in FIXED),
        *("--out", "{out}"),
    ),
    "motions": ("motions", "--orders", "cubic", "--free-orders", "", "--starts", "1", "--out", "{out}"),
    "robust": ("robust", *SMALL, "--no-simulate", "--samples", "2", "--out", "{out}"),
    "motors": ("motors", *SMALL, "--out", "{out}"),
    "certainty": (
        *("certainty", "walk12", "--starts", "600", "--evaluations", "3000", "--time-limit", "0", "--out", "{out}"),
    ),
    "prices": ("prices", "walk12", "--starts", "2", "--out", "{out}"),
    "solve": ("solve", "walk12", "--starts", "40", "--out", "{out}/best.json"),
    "evaluate": ("evaluate", "walk12", "--x", "0.1,0.1,0.2,1", "--signals", "{out}/signals.npz"),
    "export": ("export", "{gait}", "--format", "json", "--out", "{out}/gait.json"),
    "animate": ("animate", "{gait}", "--out", "{out}/gait.gif", "--fps", "10"),
    "export-objective": ("export-objective", "walk12-w015", "--to", "{out}"),
    "export-solver": ("export-solver", "walk12", "--to", "{out}"),
    "list": ("list", "--robot", "nao-v6", "--out", "{out}/robot.png"),
    "import": ("import", "walk12", "{finals}", "--as", "GA (MATLAB)", "--out", "{out}"),
    "import into a study": ("import", "walk12", "{finals}", "--as", "GA (MATLAB)", "--out", "{out}"),
    "report": ("report", "{out}", "--csv"),
    "report with the engine": ("report", "{out}", "--engine"),
    "logs": ("logs", "{study}", "--to", "{out}"),
    "logs of COCO": ("logs", "{study}", "--to", "{out}", "--format", "coco"),
    "simulate": ("simulate", "{gait}", "--steps", "2", "--out", "{out}"),
    "simulate with a film": ("simulate", "{gait}", "--steps", "2", "--size", "320x240", "--video", "{out}/film.gif"),
    "reproduce": ("reproduce", "walk12", "--out", "{out}"),
}
# These begin in a copy of the study's folder.
IN_A_STUDY = ("import into a study", "report", "report with the engine")
STUDY = (
    *("compare", "nao-ssp", "--intervals", "4", "--algorithms", "random,de", "--evaluations", "500", "--runs", "6"),
    *("--starts", "6", "--jobs", "1", "--out"),
)
FINALS = 300  # rows
TIMES = ("time_s", "build_s", "compile_s", "objective_s", "cpu_s", "result_sha256", "sessions", "files")
TEXTS = (".dat", ".info", ".xml", ".cpp", ".hpp", ".h", ".c", ".sh", ".m", ".jl")


def begin(arguments: list[str]) -> subprocess.Popen[bytes]:
    """A command as a user starts it, in a process group of its own."""
    command = [sys.executable, "-m", "nlp_gait", *arguments]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True)


def finished(name: str, arguments: list[str]) -> float:
    """Let a command run to its end; returns the time it took [s]."""
    started = time.perf_counter()
    process = begin(arguments)
    _, said = process.communicate()
    if process.returncode != 0:
        raise SystemExit(f"{name} did not end well: {said.decode()}")
    return time.perf_counter() - started


def contents(folder: Path) -> dict[str, Any]:
    """Every file that is not temporary: JSON without times, archives byte by byte, and that others are whole."""
    found: dict[str, Any] = {}
    for path in sorted(p for p in folder.rglob("*") if p.is_file() and not p.name.startswith(".")):
        data: Any = path.stat().st_size > 0
        if path.suffix == ".json":
            data = without_times(json.loads(path.read_text()))
        elif path.suffix == ".npz":
            with zipfile.ZipFile(path) as archive:
                data = {item: archive.read(item) for item in archive.namelist()}
        elif path.suffix == ".png":
            data = path.read_bytes().endswith(b"IEND\xaeB`\x82")
        elif path.suffix in (".html", ".svg"):
            data = path.read_text().rstrip().endswith(("</html>", "</svg>"))
        elif path.suffix in TEXTS:
            data = path.read_text(encoding="utf-8")
        elif path.suffix == ".gif":
            data = path.read_bytes().endswith(b";")
        if data is False:
            raise SystemExit(f"{path} is torn")
        found[path.relative_to(folder).as_posix()] = data
    return found


def without_times(data: Any) -> Any:
    """Plain data without what differs between two equal runs."""
    if isinstance(data, dict):
        return {key: without_times(value) for key, value in data.items() if key not in TIMES}
    return [without_times(item) for item in data] if isinstance(data, list) else data


def kept(folder: Path) -> dict[str, bytes]:
    """Finished records and steps."""
    paths = [*folder.glob("records/*/*.json"), *folder.glob("store/**/*.json")]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def beforehand(folder: Path, names: Sequence[str]) -> dict[str, Path]:
    """What the cases start from, as far as one of them needs it."""
    made = {"gait": folder / "gait.json", "finals": folder / "finals.csv", "study": folder / "study"}
    finished("solve", ["solve", "walk12", "--starts", "1", "--out", str(made["gait"])])
    problem, draw = load("walk12"), random.Random(0)
    rows = [
        [draw.uniform(low, high) for low, high in zip(problem.lower.tolist(), problem.upper.tolist(), strict=True)]
        for _ in range(FINALS)
    ]
    lines = [",".join((*problem.names, "evaluations")), *(",".join(map(repr, [*row, 1000])) for row in rows)]
    made["finals"].write_text("\n".join(lines) + "\n")
    if any(name in IN_A_STUDY or "{study}" in CASES[name] for name in names):
        finished("compare", [*STUDY, str(made["study"])])
    return made


def tried(name: str, folder: Path, made: Mapping[str, Path], kills: int, moments: random.Random) -> list[str]:
    """What is wrong after so many kills of a command, and prints how far it came."""

    def line(out: Path) -> list[str]:
        resuming = name == "compare" and (out / "study.json").exists()
        words = ("compare", "--resume", "--jobs", "2", "--out", "{out}") if resuming else CASES[name]
        return [word.format(out=out, **made) for word in words]

    def begun(place: Path) -> None:
        shutil.rmtree(place, ignore_errors=True)
        if name in IN_A_STUDY:
            shutil.copytree(made["study"], place)
        else:
            place.mkdir(parents=True)

    undisturbed, killed = folder / "undisturbed", folder / "killed"
    for place in (undisturbed, killed):
        begun(place)
    duration = finished(name, line(undisturbed))
    whole, wrong, before, ends = contents(undisturbed), [], kept(killed), 0
    for _ in range(kills):
        process = begin(line(killed))
        try:
            process.communicate(timeout=moments.uniform(0.0, duration))
            ends += 1  # finished: begin again
            begun(killed)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
        after = kept(killed)
        if process.returncode == -signal.SIGKILL:
            wrong += [f"{file} was lost or done twice" for file, data in before.items() if after.get(file) != data]
        contents(killed)
        before = after
    finished(name, line(killed))
    final = contents(killed)
    wrong += [f"{file} is missing" for file in whole.keys() - final.keys()]
    wrong += [f"{file} is double" for file in final.keys() - whole.keys()]
    wrong += [f"{file} differs" for file, data in final.items() if file in whole and whole[file] != data]
    print(
        f"{name}: {kills} kills, {ends} of them after its end ({duration:.1f} s); {len(kept(killed))} steps and records, "
        f"{len(whole)} files; {len(wrong)} wrong",
        flush=True,
    )
    return [f"{name}: {what}" for what in wrong]


def main() -> None:
    """Kill every command in turn."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100, help="over all commands")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default=",".join(CASES))
    parser.add_argument("--out", type=Path, default=None)
    arguments = parser.parse_args()
    folder = arguments.out or Path(tempfile.mkdtemp(prefix="kill-and-resume-"))
    names, moments = arguments.only.split(","), random.Random(arguments.seed)
    made = beforehand(folder, names)
    shares = [arguments.kills // len(names) + (i < arguments.kills % len(names)) for i in range(len(names))]
    wrong = []
    for name, kills in zip(names, shares, strict=True):
        wrong += tried(name, folder / name.replace(" ", "-"), made, kills, moments)
    print(f"{arguments.kills} kills of {len(names)} commands: {len(wrong)} wrong", *wrong, sep="\n")
    raise SystemExit(bool(wrong))


if __name__ == "__main__":
    main()
