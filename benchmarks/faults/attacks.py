"""Repeat the attacks of each class with new inputs, and print class, inputs and how many succeeded.

    python -m benchmarks.faults.attacks [--seed 100] [--only CLASS]

The inputs are drawn by the seed, differently from those of the tests. An attack succeeds if it changes a file that must stay,
runs code that was not named, writes what cannot be read, gives a wrong verdict, takes more than 60 s or 2 GiB, or ends in
anything but an answer or one sentence. The exit status is the number of classes with a success.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from unittest import mock

from typer.testing import CliRunner

from benchmarks.faults.robot_bombs import write_hostile_robots
from compare.analysis.comparison import compare_problems
from compare.analysis.verdict import compare_pairs, write_verdict
from compare.cli import app
from compare.study.import_runs import import_runs
from compare.study.record import read_record
from compare.study.record_files import read_records, write_record
from compare.study.run_task import try_task
from compare.study.task import ProblemSpec, list_solvers
from nlp_gait.backends.kernel import library_cache
from nlp_gait.errors import GaitError, InputError
from nlp_gait.files import format_csv, remove_leftovers
from nlp_gait.formulation import Objective
from nlp_gait.formulation.registry import check_mathematics
from tests.backends.toys import row, toy
from tests.compare.analysis.test_ties import study
from tests.compare.records import judged
from tests.faults import test_written_records as written
from tests.fuzz.arguments import argument_ended, plugin_ended
from tests.fuzz.campaign import tried
from tests.fuzz.commands import ended, mutated_line, workplace
from tests.fuzz.readers import FORMATS
from tests.robots.custom import humanoid

ROOT = Path(__file__).parents[2]
PROGRAM = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from compare.__main__ import main; main()"
COMPARE = "compare walk12 --algorithms random --starts 0 --evaluations 60 --out"
TIME_LIMIT_S, MEMORY_KIB = 60.0, 2 * 2**20
STARTING_S = 10.0  # of the program, on a busy machine

Attack = Iterator[str | None]  # for each input None, or what succeeded


def draw_text(draw: random.Random) -> str:
    """Return a text that files, axes or terminals cannot show."""
    signs = [
        "$",
        "\ud83d",
        "\udce9",
        "\n",
        "\x00",
        "\x1b",
        "\u2028",
        "\u202e",
        "=1+1",
        "|",
        "x" * draw.randrange(1, 5000),
    ]
    return "".join(draw.choices(signs, k=draw.randrange(1, 5)))


def attack_records(draw: random.Random, folder: Path) -> Attack:
    """Let runs return anything: the record can be read."""
    texts = [draw_text(draw) for _ in range(8)]
    numbers = [draw.choice([1, -1]) * draw.choice([2, 10]) ** draw.randrange(63, 600) for _ in range(8)]
    sound = judged("random", dict.fromkeys(written.TASK.problem.load().names, 0.1), problem="walk12")
    with mock.patch.object(written, "TEXTS", texts), mock.patch.object(written, "NUMBERS", numbers):
        for make in list(written.hostile_results(sound, draw.randrange(10**6))):
            path = write_record(try_task(written.TASK, run=lambda task, start, make=make: make()), folder)
            again = read_record(path).to_json() == json.loads(path.read_text(encoding="utf-8"))
            yield None if again else f"{path} reads differently"


def attack_names(draw: random.Random, folder: Path) -> Attack:
    """Give problems names and units that cannot be shown, or bounds that are NaN."""
    sound = toy(lambda x, y, limit, ops: (x * y, (row(x, upper=limit),)))
    for _ in range(40):
        text = draw_text(draw) + draw.choice("$\n\x00\ud83d")
        bound = draw.choice(["lower", "upper"])
        for problem in (
            replace(sound, objective=Objective(name=text, unit="m")),
            replace(sound, objective=Objective(name="cost", unit=text)),
            toy(lambda x, y, limit, ops, b=bound: (x * y, (row(x, **{b: (limit * 0 - 1).sqrt()}),))),
        ):
            try:
                check_mathematics(problem)
                yield f"accepted {text!r}"
            except InputError as error:
                yield None if "\n" not in str(error) else repr(str(error))


def attack_verdicts(draw: random.Random, folder: Path) -> Attack:
    """Add noise below the judge's tolerance to optima of any size: no solver differs, and no text says so."""
    for _ in range(150):
        optimum = draw.choice([0.0, 10 ** draw.uniform(-30, 12), -(10 ** draw.uniform(-30, 12))])
        noise = 10 ** draw.uniform(-17, -6.4) * (abs(optimum) if abs(optimum) > 1e-8 else 1.0)
        values = {s: [optimum + draw.random() ** k * noise for _ in range(12)] for k, s in enumerate("abc", start=1)}
        (comparison,) = compare_problems(study(values))
        sentence = write_verdict([comparison])[1]
        wrong = any(pair.rank_sum < 1.0 for pair in compare_pairs(comparison)) or "e-1" in sentence.replace("e-08", "")
        yield f"{optimum:g} {noise:g}: {sentence}" if wrong else None


def attack_tables(draw: random.Random, folder: Path) -> Attack:
    """Begin cells with formulas: a spreadsheet computes none."""
    for _ in range(150):
        cell = draw.choice(["", " ", "\t", "\r", "\xa0", "\u3000 "]) * draw.randrange(3)
        cell += draw.choice("=+-@") + draw.choice(["1+1", "cmd|' /C calc'!A0", "SUM(A1)", "HYPERLINK(1)", "=x", "A1"])
        shown = format_csv([[cell]]).lstrip('"')
        yield None if shown.startswith("'") else repr(cell)


def attack_outputs(draw: random.Random, folder: Path) -> Attack:
    """Name inputs and files of other programs for output, by other spellings of their paths."""
    names = json.loads(CliRunner().invoke(app, ["list", "walk12", "--json"]).stdout)["variables"]
    variables = [variable["name"] for variable in names]
    with contextlib.chdir(folder):
        Path("p.csv").write_text(",".join(variables) + "\n" + ",".join(["0.1"] * len(variables)) + "\n")
        Path("w.json").write_text(json.dumps({"problem": "walk12", "x": dict.fromkeys(variables, 0.1)}))
        Path("my.json").write_text(json.dumps(humanoid()))
        shutil.copy(ROOT / "examples" / "bring_your_own.py", "byo.py")
        Path("sub").mkdir()
        calls = {
            "solve nao-dsp --robot my.json --starts 1 --out": "my.json",
            "solve byo.py:two_link --starts 1 --out": "byo.py",
            "evaluate walk12 --x p.csv --csv": "p.csv",
            "export w.json --format json --out": "w.json",
            "animate w.json --out": "w.json",
            "list --robot my.json --out": "my.json",
        }
        for call, own in calls.items():
            for number in range(12):
                other = draw.choice([own, f"notes{number}{draw.choice(['.json', '.csv', '.gif', '.png'])}"])
                target = Path(other)
                if other != own:
                    target.write_bytes(draw.randbytes(draw.randrange(2000)))
                before = target.read_bytes()
                path = draw.choice(["{0}", "./{0}", "sub/../{0}", f"{folder}/{{0}}", f"../{folder.name}/{{0}}"]).format(
                    other
                )
                done = CliRunner().invoke(app, [*call.split(), path])
                kept = done.exit_code == 1 and done.stderr.count("\n") == 1 and target.read_bytes() == before
                yield None if kept else f"{call} {path}: {done.output[:200]}"


def attack_leftovers(draw: random.Random, folder: Path) -> Attack:
    """Leave old files with names like those of temporary files: they stay."""
    for _ in range(60):
        digits = "".join(draw.choices("0123456789abcdefABCDEFgxyz", k=draw.choice([0, 1, 8, 15, 17, 32])))
        file = folder / (
            draw.choice([".", "", "~", ".."]) + digits + "z" * (len(digits) == 16) + draw.choice([".tmp", ".tmp~"])
        )
        file.write_text("mine")
        os.utime(file, (1, 1))
        remove_leftovers(folder)
        yield None if file.exists() else file.name


def attack_cache(draw: random.Random, folder: Path) -> Attack:
    """Let other users write to any parent of the cache folder, or own it."""
    for number in range(80):
        parts = [folder / str(number)]
        for k in range(draw.randrange(1, 5)):
            parts.append(parts[-1] / str(k))
        parts[-1].mkdir(parents=True, mode=0o700)
        victim = draw.choice(parts)
        if os.getuid() == 0 and draw.random() < 0.4:
            os.chown(victim, draw.randrange(1000, 60_000), -1)
        else:
            victim.chmod(0o700 | draw.choice([0o020, 0o002, 0o022]) | draw.choice([0o000, 0o055]))
        link = folder / f"link{number}"
        link.symlink_to(parts[-1].parent)
        found = draw.choice([parts[-1], link / parts[-1].name])
        with mock.patch.dict(os.environ, {library_cache.FOLDER_VARIABLE: str(found)}):
            used = library_cache.find_cache_folder()
        yield None if used == library_cache.make_private_folder() else str(victim)


def attack_imports(draw: random.Random, folder: Path) -> Attack:
    """Import runs with extreme numbers: rejected in one sentence, or a record that can be read."""
    spec = ProblemSpec(name="walk12")
    names = list(spec.load().names)
    for number in range(100):
        column = draw.choice(["run", "seed", "evaluations", "time_s", "objective", "violation", names[0]])
        value = draw.choice(
            ["-5", "1e300", "-1e308", str(2**63), str(10**30), "nan", "inf", "", "0x1", "1e-320", "=1", "٣"]
        )
        cells = {**dict.fromkeys(names, "0.1"), column: value}
        file = folder / f"{number}.csv"
        file.write_text(",".join(cells) + "\n" + ",".join(cells.values()) + "\n")
        try:
            for record in import_runs(spec, file, f"other {number}", None, draw.choice([None, 50])):
                read_record(write_record(record, folder / "study"))
            yield None
        except GaitError as error:
            yield None if "\n" not in str(error) else repr(str(error))


def attack_readers(draw: random.Random, folder: Path) -> Attack:
    """Damage files of each format."""
    for form in FORMATS:
        (folder / form.name).mkdir()
        count = 30 if form.name in ("mjcf", "certificate") else 60
        tally = tried(form, count, draw.randrange(10**6), folder / form.name)
        yield from [f"{form.name}: {what}" for _, what in tally.defects]
        yield from [None] * (tally.accepted + tally.refused)


def attack_lines(draw: random.Random, folder: Path) -> Attack:
    """Change arguments of command lines."""
    with workplace(folder):
        for _ in range(100):
            line = mutated_line(draw)
            end = ended(line)
            yield None if end in ("accepted", "refused") else f"{line}: {end}"


def attack_calls(draw: random.Random, folder: Path) -> Attack:
    """Call Python functions, and let plug-ins answer, with values of any kind."""
    for kind in (argument_ended, plugin_ended):
        for _ in range(150):
            what, end = kind(draw)
            yield None if end in ("accepted", "refused") else f"{what}: {end}"


def attack_limits(draw: random.Random, folder: Path) -> Attack:
    """Run with few files and little memory, and with strange variables of the environment: done, or one sentence."""
    run_program(folder, f"{COMPARE} first --runs 2 --jobs 1")
    limits = [f"-n {draw.randrange(10, 60)}" for _ in range(6)]
    limits += [
        f"-v {draw.randrange(least, most) * 1000}" for least, most in [(50, 1048), (1049, 2000)] for _ in range(4)
    ]
    for number, limit in enumerate(limits):
        done = run_program(folder, f"{COMPARE} first --runs {3 + number} --jobs {draw.randrange(1, 6)}", limit)
        kept = len(list(folder.glob("first/records/walk12/*.json"))) >= 2
        quiet = done.returncode == 0 or (done.returncode == 1 and done.stderr.count("\n") == 1 and not done.stdout)
        yield (
            None
            if kept and quiet and "Traceback" not in done.stdout + done.stderr
            else f"{limit}: {done.stderr[-300:]}"
        )
    variables = [
        {"COLUMNS": draw_text(draw).replace("\0", "")[:50]},
        {"MPLBACKEND": "module://x"},
        {"PYTHONOPTIMIZE": "2"},
    ]
    for variable in (*variables, {"COLUMNS": "-1"}, {"LC_ALL": "xx"}, {"OMP_NUM_THREADS": "-1"}, {"HOME": "/dev/null"}):
        done = run_program(folder, "list walk12", **variable)
        yield None if done.returncode == 0 and done.stdout and not done.stderr else f"{variable}: {done.stderr[-300:]}"


def run_program(folder: Path, line: str, limit: str = "", **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a command line in a folder, under a limit of the shell."""
    return subprocess.run(
        ["sh", "-c", f'{limit and f"ulimit {limit};"} exec "$@"', "sh", sys.executable, "-P", "-c", PROGRAM, *line.split()],
        cwd=folder, env={**os.environ, **variables}, capture_output=True, text=True, errors="replace", timeout=900,
    )  # fmt: skip


def attack_seeds(draw: random.Random, folder: Path) -> Attack:
    """Run every solver with other jobs, threads and hash seeds, in fresh processes: the runs are equal to the last bit."""
    seed, searches = draw.randrange(10**6), ",".join(name for name in list_solvers() if name not in ("ipopt", "bayes"))
    for names, budget, starts in ((searches, 600, 2), ("bayes", 20, 0)):
        found: list[dict[tuple[str, int], object]] = []
        for jobs in (1, 2):
            line = (
                f"compare nao-ssp --algorithms {names} --starts {starts} --evaluations {budget} --runs 2 --seed {seed}"
            )
            threads = {name: str(draw.randrange(1, 5)) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
            run_program(
                folder, f"{line} --jobs {jobs} --out {jobs}", **threads, PYTHONHASHSEED=str(draw.randrange(10**6))
            )
            records = read_records(folder / str(jobs))
            found.append({(r.solver, r.run): (r.status, r.x, r.history, r.evaluations) for r in records})
            shutil.rmtree(folder / str(jobs))
        for key in found[0].keys() | found[1].keys():
            yield None if found[0].get(key) == found[1].get(key) else f"{key}: {found[0].get(key)}, {found[1].get(key)}"


def attack_robots(draw: random.Random, folder: Path) -> Attack:
    """Read hostile robot files: within 60 s and 2 GiB, accepted or one sentence."""
    worst = [0.0, 0.0]
    for file in write_hostile_robots(folder, draw.randrange(10**6)):
        began = time.monotonic()
        words = [sys.executable, "-P", "-c", PROGRAM, "list", "--robot", str(file)]
        process = subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        timer = threading.Timer(4 * TIME_LIMIT_S, process.kill)
        timer.start()
        _, errors = process.communicate()
        timer.cancel()
        taken = time.monotonic() - began
        memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss  # the largest of all children so far
        worst = [max(worst[0], taken), memory]
        fine = process.returncode == 0 or (process.returncode == 1 and errors.count("\n") == 1)
        fine = fine and taken < TIME_LIMIT_S + STARTING_S and memory < MEMORY_KIB and "Traceback" not in errors
        yield (
            None
            if fine
            else f"{file}: status {process.returncode}, {taken:.1f} s, {memory / 2**20:.2f} GiB: {errors[-300:]}"
        )
        shutil.rmtree(file.parent)
    print(f"  robot files: at most {worst[0]:.1f} s, {worst[1] / 2**20:.2f} GiB in one process", flush=True)


def attack_folders(draw: random.Random, folder: Path) -> Attack:
    """Ten rounds of six processes with different settings in one folder: every record is there and can be read."""
    for number in range(10):
        line = f"{COMPARE.replace('--evaluations 60', '--evaluations {}')} {number} --runs 25 --jobs 1"
        budgets = draw.sample(range(50, 200), 6)
        words = [sys.executable, "-P", "-c", PROGRAM]
        running = [
            subprocess.Popen(
                [*words, *line.format(budget).split()], cwd=folder, stdout=-3, stderr=subprocess.PIPE, text=True
            )
            for budget in budgets
        ]
        errors = [process.communicate()[1] for process in running]
        found = {(r.definition["stop"]["evaluations"], r.run) for r in read_records(folder / str(number))}
        whole = found == {(budget, run) for budget in budgets for run in range(25)}
        statuses = [process.returncode for process in running]
        yield (
            None
            if whole and statuses == [0] * 6
            else f"round {number}: {len(found)} of 150, {statuses}: {errors}"[:600]
        )


ATTACKS: dict[str, Callable[[random.Random, Path], Attack]] = {
    "records that cannot be read (C1)": attack_records,
    "names, units, NaN bounds (C1, A4)": attack_names,
    "verdicts on noise, optima near zero (A5, A6)": attack_verdicts,
    "formulas in CSV (B4)": attack_tables,
    "outputs over inputs and other files (C3)": attack_outputs,
    "files like temporary ones (C4)": attack_leftovers,
    "cache folders of others (B2)": attack_cache,
    "imports of extreme numbers (A8, C1)": attack_imports,
    "damaged files of 12 formats": attack_readers,
    "command lines": attack_lines,
    "Python calls and plug-ins": attack_calls,
    "equal seeds of every solver (A3)": attack_seeds,
    "limits and environments (C5, D)": attack_limits,
    "robot files (B3)": attack_robots,
    "six processes in one folder, rounds (C2)": attack_folders,
}


def main() -> None:
    """Run all classes and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--only", default="", help="part of a class's name")
    given = parser.parse_args()
    table, failed = [], 0
    for name, attack in ATTACKS.items():
        if given.only not in name:
            continue
        with tempfile.TemporaryDirectory(prefix="attacks-") as folder:
            began, count, succeeded = time.monotonic(), 0, 0
            try:
                for end in attack(random.Random(f"{name} {given.seed}"), Path(folder).resolve()):
                    count += 1
                    if end is not None:
                        succeeded += 1
                        print(f"  {name}: {end[:600]}", flush=True)
            except Exception as error:  # an attack that ends the benchmark has succeeded
                succeeded += 1
                print(f"  {name}: {type(error).__name__}: {error}", flush=True)
        failed += bool(succeeded)
        table.append(f"| {name} | {count} | {succeeded} |")
        print(f"{table[-1]} {time.monotonic() - began:.0f} s", flush=True)
    print("\n| class | inputs | succeeded |\n|---|--:|--:|", *table, sep="\n")
    sys.exit(failed)


if __name__ == "__main__":
    main()
