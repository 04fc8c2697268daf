"""Problems of this package by name, each with the place of its definition, which is imported on first use.

The command line imports this module before everything else, so it imports nothing that takes time.
"""

from __future__ import annotations

TYPE_CHECKING = False  # in place of typing's, as in ``nlp_gait/__init__.py``
if TYPE_CHECKING:
    from typing import Any

PROBLEMS = {
    "nao-ssp": "nlp_gait.gaits.nao.problems:nao_ssp",
    "nao-dsp": "nlp_gait.gaits.nao.problems:nao_dsp",
    "nao-walk": "nlp_gait.gaits.nao.problems:nao_walk",
    "nao-cycle": "nlp_gait.gaits.nao.problems:nao_cycle",
    "humanoid-ssp": "nlp_gait.gaits.humanoid.problems:humanoid_ssp",
    "humanoid-dsp": "nlp_gait.gaits.humanoid.problems:humanoid_dsp",
    "humanoid-cycle": "nlp_gait.gaits.humanoid.problems:humanoid_cycle",
    "humanoid-walk": "nlp_gait.gaits.humanoid.problems:humanoid_walk",
    "walk12": "nlp_gait.gaits.walk12.walk12_problem:walk12",
    "stairs-plan": "nlp_gait.gaits.stairs.plan:stairs_plan",
    "stairs-track": "nlp_gait.gaits.stairs.track:stairs_track",
    "stairs-climb": "nlp_gait.gaits.stairs.climb:stairs_climb",
    "gaitbench": "nlp_gait.gaitbench.generated:gaitbench",
}
LIMITS = "nlp_gait.limits:LIMITS"  # the table of limits


def import_object(place: str) -> Any:
    """Return the object at ``"module:object"``."""
    from importlib import import_module

    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
