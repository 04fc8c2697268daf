"""Robots of installed packages: ``PACKAGE:NAME`` is a URDF or MJCF file among the package's own, or one that it fetches."""

import os
import pkgutil
import re
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from nlp_gait.errors import RobotDataError, unknown

MARK = ":"  # between an installed package and one of its robots
MODEL_ENDINGS = (".urdf", ".xml", ".mjcf", ".xacro")
DESCRIPTION = "_description"  # end of the names of the modules of robot_descriptions
HEAD_BYTES = 65536  # of an XML file, within which its first tag is
FIRST_TAG = re.compile(rb"(?:<\?.*?\?>|<!--.*?-->|<!.*?>|[^<])*<(?:\w+:)?(\w+)", re.DOTALL)
KINDS = {"robot": "urdf", "mujoco": "mjcf"}  # of files by their first tag

Locate = Callable[[], str]  # returns the path of a robot's file


def find_robot_file(name: str) -> str:
    """Return the file of a robot in an installed package, ``example-robot-data:talos_reduced``; other names as they are.

    A file is named without its ending or, if files share a name, by its folder, or else by both. Raises UnknownNameError with
    the nearest names; RobotDataError for a package that is not installed, or does not provide the file.
    """
    if name.lower().endswith((".json", *MODEL_ENDINGS)) or MARK not in name:
        return name
    package, _, robot = name.partition(MARK)
    if not (package and robot):
        raise RobotDataError(f"robot {name!r}: PACKAGE:NAME needs both names")
    package, robot = SHORT_NAMES.get(package, package), robot.removesuffix(DESCRIPTION)
    try:
        robots = FINDERS.get(package, _list_files)(package)
    except PackageNotFoundError:
        raise RobotDataError(
            f"robot {name!r}: the package {package!r} is not installed; install it with pip install {package}, or give a file"
        ) from None
    if robot not in robots:
        raise unknown(f"robot of {package!r}", robot, robots)
    try:
        return robots[robot]()
    except Exception as error:  # any error of a package that downloads its robots
        raise RobotDataError(
            f"robot {name!r}: the package {package!r} does not provide it ({error}); it downloads its robots on first use"
        ) from error


def _list_files(package: str) -> Mapping[str, Locate]:
    """Return the URDF and MJCF files of a package by name, without scenes, which contain a robot's file."""
    files = [file for file in distribution(package).files or () if file.suffix in MODEL_ENDINGS]
    paths = [Path(str(file.locate())) for file in files]
    models = [path for path in paths if not path.stem.startswith("scene") and find_kind(path)]
    named: dict[str, Locate] = {}
    for form in ("{file}", "{folder}", "{folder}/{file}", "{path}"):
        names = {path: form.format(file=path.stem, folder=path.parent.name, path=path) for path in models}
        counts = Counter((*names.values(), *named))
        named |= {name: path.__str__ for path, name in names.items() if counts[name] == 1}
        models = [path for path, name in names.items() if counts[name] > 1]
    return named


def find_kind(path: Path) -> str:
    """Return the kind of a robot's file, ``urdf`` or ``mjcf``, by its first tag; "" for another tag, or if it is not read."""
    if not path.is_file():  # to open a pipe would wait for its writer
        return ""
    try:
        with path.open("rb") as file:
            tag = FIRST_TAG.match(file.read(HEAD_BYTES))
    except OSError:
        return ""
    return KINDS.get(tag[1].decode(), "") if tag else ""


def _list_menagerie(package: str) -> Mapping[str, Locate]:
    """Return the robots of MuJoCo's menagerie, which the package downloads, or reads below ``MENAGERIE_ROOT``."""
    distribution(package)
    robots = import_module("mujoco_menagerie").robots()
    return {robot.name: partial(_fetch_model, robot) for robot in robots}


def _fetch_model(robot: Any) -> str:
    return str(robot.xml(robot.default_model))


def _list_descriptions(package: str) -> Mapping[str, Locate]:
    """Return the modules of ``robot_descriptions``, each of which clones its robot's repository when it is imported."""
    distribution(package)
    modules = [module.name for module in pkgutil.iter_modules(import_module("robot_descriptions").__path__)]
    described = [name for name in modules if name.endswith(DESCRIPTION) and not name.startswith("_")]
    return {name.removesuffix(DESCRIPTION): partial(_import_description, name) for name in described}


def _import_description(name: str) -> str:
    module = import_module(f"robot_descriptions.{name}")
    paths = [str(getattr(module, kind)) for kind in ("URDF_PATH", "MJCF_PATH") if hasattr(module, kind)]
    if not paths or not os.path.isfile(paths[0]):
        raise FileNotFoundError("it has neither a URDF nor an MJCF file")
    return paths[0]


SHORT_NAMES = {"menagerie": "mujoco-menagerie", "robot_descriptions": "robot-descriptions"}
# Packages whose robots are not among their own files.
FINDERS: Mapping[str, Callable[[str], Mapping[str, Locate]]] = {
    "mujoco-menagerie": _list_menagerie,
    "robot-descriptions": _list_descriptions,
}
