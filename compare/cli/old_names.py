"""Removed commands and options: what replaces each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from typer.core import TyperGroup

from compare.cli.endings import fail

DRIVE_FILE = "its value belongs into the file of simulate --drive FILE.toml"
FILM = "simulate --page FILE.html plays the simulation at any speed"
# By "command", "command --option" or "--option" of any command.
REPLACEMENTS = {
    "animate": "export --to gif (or html) draws a gait",
    "archive": "verify FOLDER --pack FILE.zip packs a study",
    "bench --code": "verify FILE.zip --code names user code of an archive",
    "bench --leaderboard": "bench ranks an algorithm beside the baseline",
    "bench --objectives": "pareto PROBLEM --search NSGA2=10000 compares searches with the true front",
    "bench --rerun": "verify FILE.zip --rerun 5% repeats runs of an archive",
    "bench --submit": "verify FOLDER --pack FILE.zip packs a study",
    "bench --verify": "verify FILE.zip checks an archive",
    "capabilities": "sweep --capabilities reports what a robot can do",
    "cite": "list --cite [NAME] prints BibTeX",
    "export --format": "export --to KIND names the kind of the file",
    "export-objective": "export --to objective writes an instance of GaitBench in C++",
    "export-solver": "export --to solver writes a problem with its derivatives in C++",
    "logs": "report FOLDER --logs writes the runs as logs for iohinspector",
    "motions": "variants compares richer motions",
    "motors": "variants compares motors",
    "pareto --objectives": "pareto --against NAME trades power against one mean margin or the speed",
    "report --drive": "simulate RESULT --drive simulates one gait with another drive",
    "search": "compare PROBLEM --algorithms pso --starts 0 --runs 1 runs a search",
    "simulate --beside": FILM,
    "simulate --fps": FILM,
    "simulate --size": FILM,
    "simulate --speed": FILM,
    "simulate --feed-forward": DRIVE_FILE,
    "simulate --feedback-delay-ms": DRIVE_FILE,
    "simulate --feedback-noise": DRIVE_FILE,
    "simulate --feedback-seed": DRIVE_FILE,
    "simulate --interpolation": DRIVE_FILE,
    "simulate --period-ms": DRIVE_FILE,
    "simulate --push-at-s": "simulate --push X,Y,S has the time of the push",
    "walk": "sweep --engine simulates the cheapest cycle at each speed",
    "--derivatives": "give --set derivatives=finite-difference",
    "--fix": "--set NAME=VALUE fixes a variable",
    "--intervals": "give --set intervals=N",
    "--option": "--set NAME=VALUE sets options, too",
    "certainty --paths": "compare.questions and nlp_gait.proofs take it in Python",
    "certainty --tolerance": "compare.questions and nlp_gait.proofs take it in Python",
    "compare --csv": "report DIR --csv writes CSV files of a study",
    "compare --engine": "report DIR --engine simulates the best gaits of a study",
    "compare --penalty-weight": "give --handling penalty=WEIGHT",
    "compare --stagnation": "a study file has it, see --config",
    "compare --target": "a study file has it, see --config",
    "import --csv": "report DIR --csv writes CSV files of a study",
    "report --gradient-weight": "give --weights GRADIENT,HESSIAN",
    "report --hessian-weight": "give --weights GRADIENT,HESSIAN",
    "report --parquet": "--csv writes runs.csv, which pandas converts",
    "report --style": "compare.report.FurtherFiles takes it in Python",
    "robust --simulate": "simulate takes the gaits that robust writes for each robot",
    "robust --no-simulate": "robust simulates nothing; its files are for simulate",
    "robust --samples": "compare.questions takes it in Python",
}


class Commands(TyperGroup):
    """Commands of the app; a removed command or option ends with one sentence that names the new way."""

    def resolve_command(self, context: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Return the command of the arguments as Typer does, after a look at the removed names."""
        found = self.get_command(context, args[0])
        names = [args[0]] if found is None else _list_unknown_options(found, args)
        for name in names:
            if name in REPLACEMENTS:
                fail(f"{name.split()[-1]} was removed: {REPLACEMENTS[name]}", status=2)
        return super().resolve_command(context, args)


def _list_unknown_options(command: Any, args: Sequence[str]) -> list[str]:
    """Return the keys of options that a command does not have."""
    known = {flag for parameter in command.params for flag in (*parameter.opts, *parameter.secondary_opts)}
    given = [arg.split("=")[0] for arg in args[1:] if arg.startswith("--")]
    return [key for flag in given if flag not in known for key in (f"{args[0]} {flag}", flag)]
