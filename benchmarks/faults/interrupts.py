"""Ctrl-C at random moments in the first second of every command: status 130 and one line, never a traceback.

    python -m benchmarks.faults.interrupts [--presses 120] [--within 1.0] [--seed 0]

Python itself starts in some 20 ms, before any line of the package runs; what happens there is counted apart. A command that ends
by itself before it is interrupted counts as such.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import typer

from compare.cli import app

COMMANDS: dict[str, tuple[str, ...]] = {
    "list": (),
    "evaluate": ("walk12", "--x", "0.1,0.1,0.2,1"),
    "solve": ("nao-ssp", "--starts", "100"),
    "search": ("nao-ssp", "--runs", "100"),
    "compare": ("nao-ssp", "--runs", "20", "--out", "{out}"),
    "report": ("{out}",),
    "reproduce": ("walk12", "--out", "{out}"),
    "bench": ("--algorithm", "pso", "--label", "mine", "--out", "{out}"),
    "sweep": ("nao-ssp", "--over", "swing_height_m=0.015:0.028:50", "--out", "{out}"),
    "walk": ("--out", "{out}"),
    "animate": ("{out}/gait.json", "--out", "{out}/gait.gif"),
    "simulate": ("{out}/gait.json", "--out", "{out}"),
    "export": ("{out}/gait.json", "--format", "csv"),
    "export-objective": ("ssp-v5", "--to", "{out}"),
    "certainty": ("nao-ssp", "--out", "{out}"),
}


def pressed(arguments: list[str], after_s: float) -> str:
    """How a command ends that is interrupted after so long."""
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(filter(None, (os.getcwd(), os.environ.get("PYTHONPATH")))),
    }
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", "from compare.__main__ import main; main()", *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env=environment,
    )
    time.sleep(after_s)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate()
    lines = said.splitlines()
    if process.returncode == 130 and len(lines) == 1 and lines[0].startswith("nlp-gait: interrupted"):
        return "one line"
    if process.returncode in (0, 1, 2) and "Traceback" not in said and "Interrupt" not in said:
        return "had ended"
    inside = any(f"{os.sep}{package}{os.sep}" in said for package in ("compare", "nlp_gait", "metaheuristics"))
    if not inside and (process.returncode == -signal.SIGINT or "KeyboardInterrupt" in said):
        return "Python had not started"
    return f"wrong: status {process.returncode}: {said}"


def main() -> None:
    """Interrupt the commands in turn."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--presses", type=int, default=120)
    parser.add_argument("--within", type=float, default=1.0, help="moments are uniform over this time [s]")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    for name in (*typer.main.get_command(app).commands,):  # type: ignore[attr-defined]
        COMMANDS.setdefault(name, ("nao-ssp", "--out", "{out}"))
    moments, ends = random.Random(arguments.seed), Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        gait = ["solve", "walk12", "--starts", "1", "--out", f"{folder}/gait.json"]
        subprocess.run([sys.executable, "-m", "nlp_gait", *gait], check=True, capture_output=True)
        for press in range(arguments.presses):
            name = list(COMMANDS)[press % len(COMMANDS)]
            words = [word.format(out=Path(folder)) for word in COMMANDS[name]]
            moment = moments.uniform(0.0, arguments.within)
            end = pressed([name, *words], moment)
            ends[end.partition(":")[0]] += 1
            if end.startswith("wrong"):
                print(f"{name} after {moment:.3f} s: {end}", flush=True)
    print(f"{arguments.presses} presses over {len(COMMANDS)} commands:", *(f"{n} {end};" for end, n in ends.items()))
    raise SystemExit(ends["wrong"] > 0)


if __name__ == "__main__":
    main()
