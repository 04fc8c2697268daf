"""Robot data: frozen dataclasses, read from JSON files with a source for every table."""

from nlp_gait.robots.loading import load_robot, robot_names
from nlp_gait.robots.robot import Foot, Joint, Link, Motor, Robot

__all__ = ["Foot", "Joint", "Link", "Motor", "Robot", "load_robot", "robot_names"]
