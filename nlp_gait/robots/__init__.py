"""Robot data: frozen dataclasses, read from JSON files with a source for every table."""

from typing import TYPE_CHECKING, Any

from nlp_gait.providers import import_object
from nlp_gait.robots.robot import Foot, Joint, Link, Motor, Robot

if TYPE_CHECKING:
    from nlp_gait.robots.loading import list_robots, load_robot

__all__ = ["Foot", "Joint", "Link", "Motor", "Robot", "load_robot", "list_robots"]


def __getattr__(name: str) -> Any:
    """Import the readers of files when the first robot is loaded."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_object(f"nlp_gait.robots.loading:{name}")
