"""Command lines with mutated arguments, run in this process.

Budgets are small and stay so: what is mutated is everything but the counts that decide how long a run takes, and those get
values that are not allowed. Commands that take minutes when their arguments are right (`reproduce`) are given wrong ones only.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import typer

from compare.cli import app, main
from nlp_gait.providers import PROBLEMS
from tests.fuzz.mutation import TEXTS
from tests.fuzz.readers import SEEDS
from tests.fuzz.trial import Hung, limited

TIME_LIMIT_S = 60.0
WALK = ("step_length_m", "frontal_shift_m", "foot_lift_m", "bending_height_m")
GAIT = "0.31,-0.0008,-0.0055,0.052,0.001,-0.0367,-0.0424,2"
EVALUATE = ("evaluate", "nao-dsp", "--x", GAIT)
STEP = "0.31,-0.001,0.003,0.012,0.001,-0.03,-0.03,0.015,0.6"
SEARCH = tuple("compare nao-dsp --starts 0 --runs 1 --evaluations 60 --jobs 1 --out searched --algorithms".split())
SOLVE = ("solve", "walk12", "--starts", "1")
# Valid command lines, and how often each is taken.
KNOWN_LINES: tuple[tuple[int, tuple[str, ...]], ...] = (
    (2, ("list",)),
    (2, ("list", "walk12", "--json")),
    (4, ("list", "--robot", "robot.json", "--json")),
    (4, ("list", "--robot", "crooked.urdf")),
    (4, ("list", "--robot", "crooked.xml")),
    (1, ("list", "--robot", "nao-v6", "--out", "out/robot.png")),
    (8, EVALUATE),
    (6, (*EVALUATE, "--set", "torque_change_limit_Nm=1", "--option", "intervals=8", "--json")),
    (4, (*EVALUATE, "--robot", "robot.json", "--derivatives", "finite-difference")),
    (3, (*EVALUATE, "--signals", "out/signals.npz")),
    (3, (*SEARCH, "pso", "--seed", "3", "--handling", "deb", "--json")),
    (3, (*SEARCH, "pso", "--handling", "penalty", "--penalty-weight", "1", "--stagnation", "2", "--target", "0.5")),
    (2, (*SEARCH, "pso", "--fix", "double_support_time_s=2", "--time-limit", "1")),
    (1, (*SOLVE, "--x0", "0.1,0.1,0.2,1", "--json")),
    (1, (*SOLVE, "--set", "f1max=2", "--out", "out/solved.json")),
    (1, (*SOLVE, "--jobs", "2", "--seed", "5")),
    (2, ("export-solver", "walk12", "--to", "out/solver", "--set", "lambda=0.3", "--intervals", "20")),
    (2, ("certainty", "--check", "certificate.json", "--seed", "1", "--json")),
    (2, ("sweep", "walk12", "--over", "speed_m_s=0.02,0.04", "--starts", "1", "--engine", "--out", "walked")),
    (1, ("sweep", "walk12", "--over", "lambda=0.2,0.3", "--starts", "1", "--out", "swept")),
    (4, ("compare", "--config", "study.toml", "--out", "study", "--jobs", "1", "--runs", "3")),
    (4, ("compare", "--resume", "--out", "absent")),
    (4, ("compare", "walk12", "--algorithms", "psso", "--starts", "1", "--runs", "1", "--out", "study")),
    (2, ("report", "absent", "--gradient-weight", "5", "--engine", "--drive", "held", "--json")),
    (6, ("export", "result.json", "--format", "csv", "--period-ms", "100", "--out", "out/gait.csv")),
    (4, ("export", "result.json", "--format", "webots")),
    (3, ("animate", "result.json", "--out", "gait.txt", "--fps", "10", "--speed", "1")),
    (3, ("simulate", "walk.json", "--sole", "round", "--torque-limits", "none", "--friction", "0.5")),
    (3, ("simulate", "walk.json", "--video", "out/film.txt", "--size", "640x360", "--speed", "0.5")),
    (3, ("simulate", "walk.json", "--steps", "1", "--mass-factor", "1.1", "--slope-deg", "1,0", "--push", "0.1,0")),
    (3, ("simulate", "walk.json", "--drive", "held", "--period-ms", "20", "--stiffness-factor", "0.9", "--json")),
    (3, ("simulate", "walk.json", "--feedback", "torso-spring", "--feedback-delay-ms", "20", "--feedback-noise", "2")),
    (2, ("simulate", "result.json", "--interpolation", "held", "--json")),
    (1, ("simulate", "walk.json", "--steps", "1", "--out", "out/played")),
    (1, ("bench", "--instances", "walk12-w015", "--out", "benched", "--json")),
    (
        2,
        (
            "bench",
            "--algorithm",
            "random",
            "--instances",
            "walk12-w015",
            "--runs",
            "2",
            "--jobs",
            "1",
            "--out",
            "benched",
        ),
    ),
    (3, ("import", "walk12", "finals.csv", "--as", "GA (MATLAB)", "--evaluations", "100", "--out", "taken")),
    (3, ("import", "walk12", "finals.csv", "--history", "histories.csv", "--as", "other", "--out", "taken", "--csv")),
    (1, ("report", "taken", "--gradient-weight", "5", "--json")),
    (3, ("report", "taken", "--logs")),
    (2, ("export-objective", "walk12-w015", "--to", "out/objective")),
    (2, ("export", "walk.json", "--format", "npz", "--out", "out/gait.npz")),
    (4, ("evaluate", "--motion", "hand.motion", "--touch-down", "0.3", "--json")),
    (2, ("evaluate", "nao-ssp", "--x", STEP, "--engine", "--intervals", "4")),
    (3, ("evaluate", "humanoid-dsp", "--robot", "crooked.urdf", "--x", "1,2", "--intervals", "2")),
    (2, ("evaluate", "humanoid-ssp", "--robot", "crooked.xml", "--x", "1,2", "--intervals", "2")),
    (
        1,
        (
            "solve",
            "humanoid-dsp",
            "--robot",
            "crooked.urdf",
            "--intervals",
            "2",
            "--starts",
            "1",
            "--set",
            "speed_m_s=nan",
        ),
    ),
    (1, ("prices", "walk12", "--starts", "1", "--checks", "0", "--out", "priced", "--json")),
    (1, ("compare", "walk12", "--algorithms", "de", "--scheduler", "nowhere:1", "--jobs", "2", "--out", "study")),
    (2, ("reproduce", "nothing", "--out", "reproduction")),
)
# Studies of minutes: they are asked for what does not exist.
STUDIES = tuple(sorted(set(typer.main.get_command(app).commands) - {line[0] for _, line in KNOWN_LINES}))  # type: ignore[attr-defined]
SEED_LINES = (*KNOWN_LINES, *((1, (name, "nothing", "--out", "out")) for name in STUDIES))
COUNTS = ("--starts", "--runs", "--evaluations", "--jobs", "--poses", "--steps", "--checks")
BAD_COUNTS = ("0", "-1", "1.5", "", "nan", "many", "9" * 400, "\ud800")
# Little mutated: with right values they take minutes.
SLOW = ("bench", "compare", "reproduce", "animate", *STUDIES)
# How sentences before the last one may begin: what was fixed in a robot's file, what a result depends on.
NOTES = ("robot ", "steps ")
HOSTILE = (
    *(text for text in TEXTS if text not in PROBLEMS),
    *("nan", "inf", "-inf", "1e999", "1e308", "-1", "0", "9" * 400, "=", "a=", "=1", "a=b", "--", "-", "--help", "--x"),
    *("torque_change_limit_Nm=nan", "torque_change_limit_Nm=-1", "hip_height_m.lower=1e308", "self=1", "name=1"),
    *("intervals=0", "intervals=1e9", "intervals=99999999999", "robot=nao-v7", "step_length_m=inf", "derivatives=x"),
    *("rotational_inertia=maybe", ",,,", "1,2", ",".join(["nan"] * 8), ",".join(["1e308"] * 8), "lambda=0:1:0"),
    *("lambda=0:1:-3", "lambda=0:1:1000000000", "a:b:c", "result.json", "robot.json", "study.toml", "absent", "."),
    *(
        "pymoo:",
        "pymoo:XX",
        "pso,,ga",
        "out",
        "loop.json",
        "folder.json",
        "pipe.json",
        "broken.json",
        "x" * 300 + ".json",
    ),
)
OPTIONS = (
    "--json",
    "--robot",
    "--set",
    "--fix",
    "--option",
    "--intervals",
    "--seed",
    "--x",
    "--nothing",
    "-h",
    "--format",
)


def mutated_line(rng: random.Random) -> list[str]:
    """A valid command line with one to three changes."""
    weights, lines = zip(*SEED_LINES, strict=True)
    line = list(rng.choices(lines, weights)[0])
    slow = line[0] in SLOW
    for _ in range(rng.choice((1, 1, 2, 3))):
        i = rng.randrange(1, len(line)) if len(line) > 1 else 0
        counted = line[i] in COUNTS or line[max(i - 1, 0)] in COUNTS
        what = rng.randrange(6)
        if what == 0 and not slow and not counted and len(line) > 1:
            del line[i]
        elif what == 1:
            line.insert(i, line[i])
        elif what == 2:
            line[i:i] = [rng.choice(OPTIONS), rng.choice(HOSTILE)]
        elif counted and line[i] not in COUNTS:
            line[i] = rng.choice(BAD_COUNTS)
        elif not counted and (not slow or i == 1):
            line[i] = _spoilt(line[i], rng)
    return [argument.replace("\x00", "") for argument in line]  # the system's own calls end there


def _spoilt(text: str, rng: random.Random) -> str:
    if rng.random() < 0.6 or not text:
        return rng.choice(HOSTILE)
    at = rng.randrange(len(text))
    return text[:at] + rng.choice(("", "-", ",", "=", "e", "9", ".", "\x1b", "\u00e9")) + text[at + 1 :]


@contextmanager
def workplace(folder: Path) -> Iterator[None]:
    """Folder deep below ``folder`` with files of every kind, as the current one."""
    place = folder / "a" / "b" / "c" / "d"
    place.mkdir(parents=True)
    (place / "out").mkdir()
    (place / "folder.json").mkdir()
    (place / "result.json").write_bytes((SEEDS / "result" / "by-hand.json").read_bytes())
    (place / "robot.json").write_bytes((SEEDS / "robot" / "heavy.json").read_bytes())
    (place / "crooked.urdf").write_bytes((SEEDS / "biped" / "crooked.urdf").read_bytes())
    (place / "crooked.xml").write_bytes((SEEDS / "mjcf" / "crooked.xml").read_bytes())
    (place / "walk.json").write_text(
        json.dumps({"problem": "walk12", "x": dict(zip(WALK, (0.1, 0.1, 0.02, 0.01), strict=True))})
    )
    (place / "finals.csv").write_text(
        "\n".join([",".join(("run", *WALK)), "0,0.1,0.1,0.02,0.01", "1,0.12,0.1,0.01,0.02"])
    )
    (place / "histories.csv").write_text("run,evaluations,objective,time_s\n0,10,,0.1\n0,90,1.5,0.2\n1,80,1.25,0.3\n")
    (place / "hand.motion").write_bytes((SEEDS / "motion" / "hand.motion").read_bytes())
    (place / "certificate.json").write_bytes((SEEDS / "certificate" / "closed.json").read_bytes())
    (place / "broken.json").write_bytes(b'{"schema": 1, "schema": 1}')
    (place / "study.toml").write_bytes((SEEDS / "study" / "least.toml").read_bytes())
    (place / "loop.json").symlink_to("loop.json")
    os.mkfifo(place / "pipe.json")
    with contextlib.chdir(place):
        yield


def ended(line: Sequence[str]) -> str:
    """``"accepted"`` (status 0), ``"refused"`` (1 or 2, said why), or what is wrong."""
    out = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="backslashreplace")  # as Python's own
    status: object = None
    try:
        with (
            limited(TIME_LIMIT_S),
            mock.patch.object(sys, "argv", ["nlp-gait", *line]),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("error")
            main()
    except SystemExit as stop:
        status = stop.code or 0
    except Hung:
        return f"hangs for more than {TIME_LIMIT_S:g} s"
    except BaseException as error:
        return f"{type(error).__name__}: {error}"
    for stream in (out, err):
        stream.flush()
    printed, said = (stream.buffer.getvalue().decode("utf-8") for stream in (out, err))  # type: ignore[attr-defined]
    return _judged(status, printed, said)


def _judged(status: object, printed: str, said: str) -> str:
    if "Traceback" in said or "\x1b" in printed + said:
        return f"a traceback or a control character on the terminal: {(printed + said)!r}"
    if status == 0:
        return "accepted"
    *notes, sentence = said.splitlines() or [""]
    if status == 1 and sentence.startswith("nlp-gait: ") and all(note.startswith(NOTES) for note in notes):
        return "refused"
    if status == 2 and said.strip():
        return "refused"
    return f"status {status}, {said!r}"
