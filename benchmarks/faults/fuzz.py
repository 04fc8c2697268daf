"""Fuzz file readers, the command line, Python arguments and plug-ins, and print a table of how the inputs ended.

    python -m benchmarks.faults.fuzz [--inputs 10000] [--lines 10000] [--calls 10000] [--seed 0] [--only NAME] [--out FOLDER]

An input is accepted for what it says, refused in one sentence, or a defect: a traceback, a hang, or an answer to something that
it does not say. Defects are written to the folder, each with what is wrong; exit status 1 if there is one. Put what is found
into ``tests/fuzz/corpus``.
"""

from __future__ import annotations

import argparse
import faulthandler
import random
import resource
import tempfile
import time
from pathlib import Path

from tests.fuzz.arguments import argument_ended, plugin_ended
from tests.fuzz.campaign import Tally, tried
from tests.fuzz.commands import ended, mutated_line, workplace
from tests.fuzz.readers import FORMATS

# A hang inside compiled code is not interrupted by a signal: the whole run ends with a traceback.
HARD_LIMIT_S = 900
LINE = "command line"
CALLS = {"Python arguments": argument_ended, "plug-ins": plugin_ended}


def lines_tried(count: int, seed: int, folder: Path) -> Tally:
    """Mutate command lines and run each in this process."""
    rng = random.Random(seed)
    ends, defects = [], []
    with workplace(folder):
        for _ in range(count):
            line = mutated_line(rng)
            faulthandler.dump_traceback_later(HARD_LIMIT_S, exit=True)
            ends.append(ended(line))
            if ends[-1] not in ("accepted", "refused"):
                defects.append((repr(line).encode("utf-8", "backslashreplace"), ends[-1]))
    faulthandler.cancel_dump_traceback_later()
    return Tally(
        name="command line", accepted=ends.count("accepted"), refused=ends.count("refused"), defects=tuple(defects)
    )


def calls_tried(count: int, seed: int, kind: str) -> Tally:
    """Call Python functions, or let plug-ins answer, with values of any kind."""
    rng, ends, defects = random.Random(f"{kind} {seed}"), [], []
    for _ in range(count):
        faulthandler.dump_traceback_later(HARD_LIMIT_S, exit=True)
        what, end = CALLS[kind](rng)
        ends.append(end)
        if end not in ("accepted", "refused"):
            defects.append((what.encode("utf-8", "backslashreplace"), end))
    faulthandler.cancel_dump_traceback_later()
    return Tally(name=kind, accepted=ends.count("accepted"), refused=ends.count("refused"), defects=tuple(defects))


def main() -> None:
    """Try all kinds in turn."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=10_000, help="mutated files of each kind")
    parser.add_argument("--lines", type=int, default=10_000, help="mutated command lines")
    parser.add_argument("--calls", type=int, default=10_000, help="of Python functions, and as many of plug-ins")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="one kind, as the table calls it")
    parser.add_argument("--out", type=Path, default=Path("fuzz-defects"))
    parser.add_argument("--memory", type=float, default=2.0, help="more than this is a defect [GB]; 0 for no limit")
    arguments = parser.parse_args()
    if arguments.memory:
        resource.setrlimit(resource.RLIMIT_DATA, (int(arguments.memory * 1e9),) * 2)
    print("| format | inputs | accepted | refused | defects | CPU time [s] |\n|---|--:|--:|--:|--:|--:|", flush=True)
    found = 0
    for form in (*FORMATS, LINE, *CALLS):
        name = form if isinstance(form, str) else form.name
        if arguments.only not in ("", name):
            continue
        started = time.process_time()
        with tempfile.TemporaryDirectory(prefix="nlp-gait-fuzz-") as folder:
            if not isinstance(form, str):
                tally = tried(form, arguments.inputs, arguments.seed, Path(folder))
            elif form == LINE:
                tally = lines_tried(arguments.lines, arguments.seed, Path(folder))
            else:
                tally = calls_tried(arguments.calls, arguments.seed, form)
        count = tally.accepted + tally.refused + len(tally.defects)
        ends = f"{tally.accepted} | {tally.refused} | {len(tally.defects)}"
        print(f"| {name} | {count} | {ends} | {time.process_time() - started:.0f} |", flush=True)
        found += len(tally.defects)
        for number, (data, wrong) in enumerate(tally.defects):
            arguments.out.mkdir(exist_ok=True)
            (arguments.out / f"{name}-{number}").write_bytes(data)
            (arguments.out / f"{name}-{number}.txt").write_text(wrong, encoding="utf-8", errors="backslashreplace")
    raise SystemExit(found > 0)


if __name__ == "__main__":
    main()
