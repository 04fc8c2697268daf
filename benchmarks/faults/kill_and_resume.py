"""A study killed with -9 at random moments and resumed each time must end as an undisturbed one, file by file.

    python -m benchmarks.faults.kill_and_resume [--kills 20] [--seed 0] [--out FOLDER]

Moments are uniform over the study's own duration, so that they fall into starting, running and writing alike. Prints how
far each session came; exit status 1 if any record differs in anything but its times.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

STUDY = ["nao-ssp", "--algorithms", "pso,ga,aco", "--runs", "11", "--starts", "4", "--polish", "--jobs", "2"]


def begin(folder: Path, *options: str) -> subprocess.Popen[bytes]:
    """The study as a user starts it, in a process group of its own."""
    command = [sys.executable, "-m", "nlp_gait", "compare", *options, "--out", str(folder)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


def finish(folder: Path, *options: str) -> float:
    """Let the study run to its end; returns the time it took [s]."""
    started = time.perf_counter()
    if begin(folder, *options).wait() != 0:
        raise SystemExit(f"the study in {folder} did not end well")
    return time.perf_counter() - started


def contents(folder: Path) -> dict[str, Any]:
    """Every record without its times."""
    records = {p.relative_to(folder).as_posix(): json.loads(p.read_text()) for p in folder.glob("records/*/*.json")}
    for record in records.values():
        del record["time_s"]
    return records


def main() -> None:
    """Run the study twice, once undisturbed, and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path(tempfile.mkdtemp(prefix="kill-and-resume-")))
    arguments = parser.parse_args()
    undisturbed, killed = arguments.out / "undisturbed", arguments.out / "killed"
    duration = finish(undisturbed, *STUDY)
    whole = contents(undisturbed)
    print(f"undisturbed: {len(whole)} runs in {duration:.1f} s")
    moments = random.Random(arguments.seed)
    kills = 0
    while kills < arguments.kills:
        options = ["--resume"] if (killed / "study.json").exists() else STUDY
        before = len(list(killed.glob("records/*/*.json")))
        process = begin(killed, *options)
        moment = moments.uniform(0.0, duration)
        try:
            process.wait(moment)
            for path in list(killed.glob("records/*/*.json"))[::2]:  # it was done: take half away and go on
                path.unlink()
            continue
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        kills += 1
        after = len(list(killed.glob("records/*/*.json")))
        print(f"kill {kills} after {moment:.2f} s: {before} -> {after} runs finished")
        if after < before:
            raise SystemExit("a finished run was lost")
    finish(killed, *(["--resume"] if (killed / "study.json").exists() else STUDY))
    differing = [name for name, record in contents(killed).items() if whole.get(name) != record]
    missing = sorted(whole.keys() - contents(killed).keys())
    print(f"after {kills} kills: {len(whole)} runs, {len(differing)} differ, {len(missing)} are missing")
    if differing or missing:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
