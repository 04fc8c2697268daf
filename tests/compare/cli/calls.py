"""The command line called by tests: in this process, or in one of its own where it is the process that is tested."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from typer.testing import CliRunner, Result

from compare.cli import app


def nlp_gait(*arguments: str | Path, status: int = 0, **environment: str) -> Result:
    """What a command prints; it must end with this status."""
    done = CliRunner().invoke(app, [str(argument) for argument in arguments], env=environment)
    assert done.exit_code == status, f"{arguments}: {done.exit_code} {done.exception!r}\n{done.output}"
    return done


def as_json(*arguments: str | Path) -> Any:
    """The one object that a command prints."""
    return json.loads(nlp_gait(*arguments, "--json").stdout)


def one_sentence(*arguments: str | Path, status: int = 1) -> str:
    """What a command that refuses prints on stderr."""
    done = nlp_gait(*arguments, status=status)
    assert is_one_sentence(done.stderr) and done.stdout == ""
    return done.stderr


def is_one_sentence(error: str) -> bool:
    """Whether a command that ends so says why, and nothing else."""
    return error.startswith("nlp-gait: ") and error.count("\n") == 1


def process(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """A command as a shell starts it."""
    return subprocess.run(
        [sys.executable, "-m", "nlp_gait", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
    )
