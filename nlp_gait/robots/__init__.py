"""Robot data: frozen dataclasses, read from JSON files with a source for every table."""

from nlp_gait.robots.loading import list_robots, load_robot
from nlp_gait.robots.robot import Foot, Joint, Link, Motor, Robot

__all__ = ["Foot", "Joint", "Link", "Motor", "Robot", "load_robot", "list_robots"]
