"""Figures and animations, in the project's matplotlib style."""

from pathlib import Path

STYLE = Path(__file__).with_name("gait.mplstyle")
