"""Every file reader with its valid examples, its mutations, and what an accepted file must mean."""

from __future__ import annotations

import json
import math
import re
import tempfile
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from compare.study.record import read_record
from compare.study.run_study import Study, check_study
from compare.study.settings import FILE, StudySettings, read_manifest, read_settings
from compare.study.store import Store
from nlp_gait.backends.identity import identify_problem
from nlp_gait.errors import InputError
from nlp_gait.export.webots import format_motion, parse_motion, read_motion
from nlp_gait.files import replace_nan
from nlp_gait.formulation import load, load_result
from nlp_gait.proofs.certificate import check_certificate, read_certificate
from nlp_gait.robots import Robot, load_robot
from nlp_gait.robots.biped import make_biped_model
from tests.fuzz.mutation import Mutator, mutated_bytes, mutated_json, mutated_lines, mutated_xml
from tests.fuzz.trial import Misread

SEEDS = Path(__file__).with_name("seeds")


@dataclass(frozen=True, kw_only=True)
class Format:
    """A kind of file.

    Attributes:
        name: of its folder of valid examples.
        file: name that it has when it is read.
        mutate: makes a damaged file from a valid one.
        read: reads the file at a path, and raises Misread if what it got is not what stands there.
    """

    name: str
    file: str
    mutate: Mutator
    read: Callable[[Path], None]

    def seeds(self) -> list[bytes]:
        """Valid examples."""
        if self.name == "points":
            return [_points()]
        if self.name == "certificate":
            return [_certificate()]
        return [
            path.read_bytes() for path in sorted((SEEDS / self.name).iterdir()) if path.suffix == Path(self.file).suffix
        ]


def read_result(path: Path) -> None:
    """A result: its variables, options and parameters are those of the file."""
    result, raw = load_result(path), _plain(path)
    kept = raw["definition"]["problem"] if "definition" in raw else raw
    same(raw["x"], result.problem.by_name(result.x), "x")
    same(kept.get("problem", kept.get("name")), result.problem.name, "problem")
    for key, value in kept.get("options", {}).items():
        same(value, result.problem.options[key], key)
    same(kept.get("parameters", {}), dict(result.problem.values), "parameters")
    same(raw.get("schema", 1), 4 if "definition" in raw else 1, "schema")


def read_a_record(path: Path) -> None:
    """A record: written again it is the same file."""
    record, raw = read_record(path), _plain(path)
    if raw["verdict"]["guaranteed"] is not None:
        raw["verdict"]["guaranteed"] = {**NOTHING_MORE, **raw["verdict"]["guaranteed"]}
    raw = {"origin": None, **raw, "time_s": {"finished": "", **raw["time_s"]}}
    same(raw, replace_nan(record.to_json()), "record")


def read_a_manifest(path: Path) -> None:
    """A manifest: its sessions are those of the file, and its study too."""
    manifest, raw = read_manifest(path.parent), _plain(path)
    same(raw["sessions"], [asdict(session) for session in manifest.sessions], "sessions")
    if manifest.settings is None:
        raise Misread("no settings")
    same_study(raw["study"], manifest.settings)


def read_study(path: Path) -> None:
    """A study file, as far as `compare --config` checks it before the first run."""
    settings = read_settings(path)
    check_study(Study(tasks=settings.tasks()))
    same_study(tomllib.loads(path.read_text(encoding="utf-8")), settings)


def read_robot(path: Path) -> None:
    """A robot: every number of the file is in it."""
    robot = load_robot(str(path))
    same_robot(_plain(path), robot)


def read_urdf(path: Path) -> None:
    """A robot from a URDF with the robot file beside it: masses, limits and ranges are those of the file."""
    path.with_suffix(".json").write_bytes((SEEDS / "urdf" / "tiny.json").read_bytes())
    robot, root = load_robot(str(path)), ElementTree.fromstring(path.read_bytes())
    masses = [float(mass.get("value", "")) for mass in root.iterfind("link/inertial/mass")]
    near(math.fsum(masses), robot.mass_kg, "mass")
    for name, joint in robot.joints.items():
        element = root.find(f"joint[@name='{'LHip' if name == 'Left' else name}']")
        limit = element.find("limit") if element is not None else None
        if element is None or limit is None:
            raise Misread(f"joint {name} is not in the file")
        near(float(limit.get("effort", "")), joint.torque_limit_Nm, "effort")
        near(float(limit.get("velocity", "")), joint.velocity_limit_rad_s, "velocity")
        if element.get("type") == "revolute":
            ends = [float(limit.get(end, "0")) for end in ("lower", "upper")]
            wanted = [-ends[1], -ends[0]] if name == "Left" else ends
            for wish, found in zip(wanted, joint.limits_rad, strict=True):
                near(wish, found, "limit")


def read_biped(path: Path) -> None:
    """A robot from a URDF alone, as a biped: all masses of the file are in it, and its legs' limits are those of the file."""
    biped, root = make_biped_model(load_robot(str(path))), ElementTree.fromstring(path.read_bytes())
    masses = [float(mass.get("value", "")) for mass in root.iterfind("link/inertial/mass")]
    near(math.fsum(masses), biped.model.mass_kg, "mass")
    for name in biped.joints:
        limit = root.find(f"joint[@name='{name}']/limit")
        if limit is None:
            raise Misread(f"joint {name} is not in the file")
        near(float(limit.get("effort", "")), biped.model.joint(name).torque_limit_Nm, "effort")


def read_mjcf(path: Path) -> None:
    """A robot from an MJCF file: it weighs what MuJoCo finds by itself, and has that file's ranges."""
    import mujoco

    robot = load_robot(str(path))
    make_biped_model(robot)
    model = mujoco.MjModel.from_xml_path(str(path))
    tops = [i for i in range(1, model.nbody) if model.body_parentid[i] == 0]
    near(max(float(model.body_subtreemass[i]) for i in tops), robot.mass_kg, "mass")
    for name, joint in robot.joints.items():
        found = model.joint(int(name.split()[-1]) if name.startswith("joint ") else name)
        if model.jnt_limited[found.id]:
            for wish, end in zip(found.range - found.qpos0, joint.limits_rad, strict=True):
                near(float(wish), end, f"{name}.range")


def read_a_certificate(path: Path) -> None:
    """A certificate, read and followed: it says what stands there, and what passes has the incumbent's objective."""
    file, raw = read_certificate(path), _plain(path)
    same({"schema": 2, **raw}, replace_nan(asdict(file)), "certificate")
    check_certificate(file, paths=2)


def read_a_motion(path: Path) -> None:
    """A motion: its times and angles are those of the file, and it is the same when written again."""
    points = read_motion(path)
    rows = path.read_bytes().decode("utf-8").replace("\r\n", "\n").split("\n")
    for time, angles, line in zip(points.times_ms, points.angles.tolist(), rows[1:], strict=False):
        clock, _, *values = line.split(",")
        units = [1, 1000, 60_000]
        same(sum(unit * int(part) for unit, part in zip(units, reversed(clock.split(":")), strict=False)), time, "time")
        same([None if value == "*" else float(value) for value in values], replace_nan(angles), "angles")
    again = parse_motion(format_motion(points), "again")
    same((points.joints, points.times_ms), (again.joints, again.times_ms), "written again")


def read_stored(path: Path) -> None:
    """A stored result: what is loaded is what was computed, and what is damaged is computed again."""
    same(RESULT, Store(path.parent.parent).compute("one", INPUTS, lambda: RESULT), "result")


def read_archive(path: Path) -> None:
    """Stored arrays: what is loaded is what was stored; what is damaged is not loaded."""
    arrays = Store(path.parent.parent).load_arrays("one", INPUTS)
    if arrays is None:
        raise InputError("damaged")
    same({name: array.tolist() for name, array in ARRAYS.items()}, {n: a.tolist() for n, a in arrays.items()}, "arrays")


NOTHING_MORE: dict[str, Any] = {
    "violations": [],
    "sampled": [],
    "pieces": 0,
    "reason": "",
}  # that a guarantee need not say
INPUTS, RESULT = {"seed": 1}, {"runs": [{"x": [0.1, 0.2], "status": "converged"}], "best": 0.5}
ARRAYS = {"x": np.array([[0.5, 1.5], [2.5, 3.5]]), "power_W": np.array([0.25, 0.75])}

FORMATS = (
    Format(name="result", file="result.json", mutate=mutated_json, read=read_result),
    Format(name="record", file="record.json", mutate=mutated_json, read=read_a_record),
    Format(name="manifest", file=FILE, mutate=mutated_json, read=read_a_manifest),
    Format(name="study", file="study.toml", mutate=mutated_lines, read=read_study),
    Format(name="robot", file="robot.json", mutate=mutated_json, read=read_robot),
    Format(name="urdf", file="robot.urdf", mutate=mutated_xml, read=read_urdf),
    Format(name="biped", file="robot.urdf", mutate=mutated_xml, read=read_biped),
    Format(name="mjcf", file="robot.xml", mutate=mutated_xml, read=read_mjcf),
    Format(name="certificate", file="certificate.json", mutate=mutated_json, read=read_a_certificate),
    Format(name="motion", file="gait.motion", mutate=mutated_lines, read=read_a_motion),
    Format(name="stored", file="one.json", mutate=mutated_json, read=read_stored),
    Format(name="points", file="one.npz", mutate=mutated_bytes, read=read_archive),
)


def prepared(form: Format, folder: Path) -> Path:
    """Where a file of this kind is read from."""
    place = folder / "store" if form.name in ("stored", "points") else folder
    place.mkdir(parents=True, exist_ok=True)
    return place / form.file


def same(wanted: Any, found: Any, where: str) -> None:
    """Raise Misread unless two plain values are equal, truth values and numbers kept apart."""
    if isinstance(wanted, Mapping) and isinstance(found, Mapping):
        for key in {**wanted, **found}:
            if key not in wanted or key not in found:
                raise Misread(f"{where}.{key} is in one only")
            same(wanted[key], found[key], f"{where}.{key}")
    elif isinstance(wanted, (list, tuple)) and isinstance(found, (list, tuple)):
        if len(wanted) != len(found):
            raise Misread(f"{where} has {len(wanted)} and {len(found)} entries")
        for i, (a, b) in enumerate(zip(wanted, found, strict=True)):
            same(a, b, f"{where}[{i}]")
    elif isinstance(wanted, int) and isinstance(found, float) and not isinstance(wanted, bool):
        same(float(wanted), found, where)  # beyond 53 bits it is rounded
    elif wanted != found or isinstance(wanted, bool) != isinstance(found, bool):
        raise Misread(f"{where}: the file says {wanted!r}, read was {found!r}")


def near(wanted: float, found: float, where: str) -> None:
    """Raise Misread unless two numbers agree to rounding."""
    if not math.isclose(wanted, found, rel_tol=1e-9, abs_tol=1e-12):
        raise Misread(f"{where}: the file says {wanted!r}, read was {found!r}")


def same_study(raw: Mapping[str, Any], settings: StudySettings) -> None:
    """Raise Misread unless every key of the file is in the settings with its value."""
    plain = settings.to_json()
    for key, value in raw.items():
        if key == "handling":
            same({"name": value} if isinstance(value, str) else {"name": "deb", **value}, plain[key], key)
        elif key in ("problem", "solver"):
            same(len(value), len(plain[key]), key)
            for item, kept in zip(value, plain[key], strict=True):
                fixed = {f"{name}.{end}": v for name, v in item.get("fix", {}).items() for end in ("lower", "upper")}
                for name in item.keys() - {"fix", "set"}:
                    same(item[name], kept.get(name), f"{key}.{name}")  # null is left out
                for name, v in {**item.get("set", {}), **fixed}.items():
                    same(v, kept["set"][name], f"{key}.set.{name}")
        elif key == "schema":
            same(value, 1, key)
        else:
            same(value, plain.get(key), key)


def same_robot(raw: Mapping[str, Any], robot: Robot) -> None:
    """Raise Misread unless every record of the file is in the robot with its numbers."""
    for key in ("description", "name", "root"):
        if raw.get(key) is not None:  # null as if it were not there
            same(raw[key], getattr(robot, key), key)
    for name, link in raw.get("links", {}).items():
        for key in ("mass_kg", "com_m"):
            same(link[key], getattr(robot.links[name], key), f"{name}.{key}")
        if raw.get("inertia_about") != "joint":
            same(link["inertia_com_kgm2"], robot.links[name].inertia_com_kgm2, f"{name}.inertia")
    for name, joint in raw.get("joints", {}).items():
        for key, value in joint.items():
            if key == "motor":
                motor = value and asdict(robot.joints[name].motor)  # type: ignore[call-overload]
                given = motor and {
                    part: number for part, number in motor.items() if number is not None or part in value
                }
                same(value, given, f"{name}.motor")
            elif key != "axis":
                same(value, getattr(robot.joints[name], key), f"{name}.{key}")
    for side, foot in raw.get("feet", {}).items():
        for key, value in foot.items():
            same(value, getattr(robot.feet[side], key), f"{side}.{key}")


def _plain(path: Path) -> Any:
    """JSON read by other means than the package's: no key twice, no number beyond floats."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len({key for key, _ in pairs}) != len(pairs):
            raise Misread("a key is duplicated")
        return dict(pairs)

    def number(text: str) -> float:
        if not math.isfinite(float(text)):
            raise Misread(f"{text} is not finite")
        return float(text)

    def constant(text: str) -> float:
        raise Misread(f"{text} is no number")

    text = path.read_bytes().decode("utf-8")
    if re.search(r"\\u[dD][89abAB]", text):
        json.dumps(json.loads(text), ensure_ascii=False).encode()
    return json.loads(text, object_pairs_hook=once, parse_float=number, parse_constant=constant)


def _certificate() -> bytes:
    """Return a certificate with the probes that its problem has here."""
    raw = json.loads((SEEDS / "certificate" / "closed.json").read_text(encoding="utf-8"))
    stored = raw["problem"]
    raw["problem"] = identify_problem(load(stored["name"], **stored["options"]).with_values(**stored["parameters"]))
    return json.dumps(raw).encode()


def _points() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        Store(Path(folder)).save_arrays("one", INPUTS, ARRAYS)
        return (Path(folder) / "store" / "one.npz").read_bytes()
