"""How plans and the tracked step of the stairs paper may be read (``stairs_plan_choices.toml``, ``stairs_choices.toml``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from compare.papers.claims import read_tables
from nlp_gait.decoding import decode

OURS, FREE, PRINTED = "ours", "free", "printed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A reading of the planner or of the tracked step: options and values of the problem; the plan that is followed."""

    text: str
    plan: str = "plan"
    plans: tuple[str, ...] = ("jerk", "plan")  # of a reading of the planner: least jerk, least energy
    contains: tuple[
        str, ...
    ] = ()  # of the tracked step: readings with the same objective and narrower bounds or more limits
    options: Mapping[str, str | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)


CHOICES = {name: decode(Choice, row) for name, row in read_tables("stairs/stairs_choices.toml").items()}
INSTANTS = (OURS, FREE, PRINTED)  # with which Algorithm 4 runs
PLAN_CHOICES = {name: decode(Choice, row) for name, row in read_tables("stairs/stairs_plan_choices.toml").items()}
