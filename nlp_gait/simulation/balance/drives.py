"""Drives of simulated robots by name or from a file, with their feedback."""

import tomllib
from dataclasses import replace
from pathlib import Path

from nlp_gait.decoding import decode
from nlp_gait.errors import InputError, unknown
from nlp_gait.files import convert_errors, read_text
from nlp_gait.simulation.balance.controller import Balance
from nlp_gait.simulation.drive import DRIVES, Drive

FEEDBACKS = {"none": None, "balance": Balance()}


def load_drive(name: str) -> Drive:
    """Return the drive of a name in ``DRIVES``, or of a TOML file.

    The file has fields of ``Drive``, and those of ``Balance`` in a table ``[balance]``, or of ``JointController`` in a table
    ``[controller]``. Raises UnknownNameError, or InputError for a file or setting that is not allowed.
    """
    if not name.endswith(".toml"):
        if name not in DRIVES:
            raise unknown("drive", name, DRIVES)
        return DRIVES[name]
    text = read_text(Path(name), "drive")
    with convert_errors(f"drive {name!r}", InputError):
        raw = tomllib.loads(text)
        feedback = decode(Balance, raw.pop("balance"), "balance") if "balance" in raw else None
        return decode(Drive, raw, given={"feedback": feedback})


def choose_feedback(drive: Drive, name: str) -> Drive:
    """Return a drive with the feedback of a name in ``FEEDBACKS``; raises UnknownNameError."""
    if name not in FEEDBACKS:
        raise unknown("feedback", name, FEEDBACKS)
    return replace(drive, feedback=FEEDBACKS[name])
