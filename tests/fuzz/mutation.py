"""Seeded mutations of text files: of their structure where they have one, and of their bytes."""

from __future__ import annotations

import copy
import json
import random
import re
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

Mutator = Callable[[bytes, random.Random], bytes]


class Raw(str):
    """Text that stands in a file as it is, for example a number that JSON does not have."""


TEXTS = (
    "",
    "\x00",
    "\ud800",
    "<script>alert(1)</script>",
    "../../x",
    "[red]x[/red]",
    "[/]",
    "\x1b[31mred",
    "a" * 5000,
    "NaN",
    "1",
    "self",
    "name",
    "__class__",
    "$\\frac",
    "nao-v6",
    "walk12",
    "\u202e",
    "\ufeff",
    "nul.json",
)
NUMBERS = (
    0,
    1,
    -1,
    True,
    False,
    0.0,
    -0.0,
    1.5,
    1e308,
    -1e308,
    5e-324,
    2**31,
    2**63,
    2**64,
    -(2**63) - 1,
    10**400,
    1e16,
)
TOKENS = ("NaN", "Infinity", "-Infinity", "1e999", "01", "0x10", "1_000", "+1", ".5", "'x'", "nul", "True", '"\\ud800"')
OTHERS: tuple[Any, ...] = (None, [], {}, [[]], {"a": 1}, [0.0, 1.0], {"": {}}, {"name": "pso"})


def mutated_json(data: bytes, rng: random.Random) -> bytes:
    """One to three changes of a JSON file's tree; in a third of the cases of its bytes too."""
    tree = json.loads(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        tree = _changed(tree, rng)
    text = _json(tree).encode("utf-8", "surrogatepass")
    return mutated_bytes(text, rng) if rng.random() < 0.33 else text


def mutated_lines(data: bytes, rng: random.Random) -> bytes:
    """Changes of a file made of lines and fields: TOML, tables, motions."""
    lines = data.decode("utf-8").split("\n")
    for _ in range(rng.choice((1, 1, 2, 3))):
        i = rng.randrange(len(lines))
        what = rng.randrange(6)
        if what == 0:
            del lines[i]
        elif what == 1:
            lines.insert(rng.randrange(len(lines) + 1), lines[i])
        elif what == 2:
            j = rng.randrange(len(lines))
            lines[i], lines[j] = lines[j], lines[i]
        else:
            parts = re.split(r"([=,\[\]{}\s\"]+)", lines[i])
            k = rng.randrange(len(parts))
            parts[k] = rng.choice((_token(rng), parts[k] * 2, parts[k][:-1], _token(rng)))
            lines[i] = "".join(parts)
        if not lines:
            lines = [""]
    text = "\n".join(lines).encode("utf-8", "surrogatepass")
    return mutated_bytes(text, rng) if rng.random() < 0.33 else text


def mutated_xml(data: bytes, rng: random.Random) -> bytes:
    """Changes of an XML file's tree."""
    root = ElementTree.fromstring(data)
    for _ in range(rng.choice((1, 1, 2, 3))):
        parents = [element for element in root.iter() if len(element)] or [root]
        parent = rng.choice(parents)
        child = rng.choice(list(parent)) if len(parent) else root
        what = rng.randrange(7)
        if what == 0 and child is not root:
            parent.remove(child)
        elif what == 1 and child is not root:
            parent.append(copy.deepcopy(child))
        elif what == 2:
            child.tag = rng.choice(("link", "joint", "inertial", "mass", "limit", "origin", "x", child.tag + "s"))
        elif what == 3:
            _set(child, rng.choice(("name", "value", "xyz", "lower", "x")), rng)
        elif child.attrib:
            name = rng.choice(list(child.attrib))
            if what == 4:
                del child.attrib[name]
            else:
                _set(child, name, rng)
    text = ElementTree.tostring(root, encoding="utf-8")
    if rng.random() < 0.05:
        text = b'<!DOCTYPE robot [<!ENTITY a "a">]>' + text
    return mutated_bytes(text, rng) if rng.random() < 0.33 else text


def mutated_bytes(data: bytes, rng: random.Random) -> bytes:
    """One to four changes of bytes: flipped, cut, inserted, doubled, cut off."""
    raw = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4))):
        at = rng.randrange(len(raw) + 1)
        size = rng.choice((1, 1, 2, 8, 64))
        what = rng.randrange(7)
        if what == 0 and at < len(raw):
            raw[at] ^= 1 << rng.randrange(8)
        elif what == 1:
            del raw[at : at + size]
        elif what == 2:
            raw[at:at] = rng.randbytes(size)
        elif what == 3:
            raw[at:at] = raw[at : at + size]
        elif what == 4:
            raw[at:at] = rng.choice(
                (b"\x00", b"\xff", b"\xef\xbb\xbf", b"\r", b"\n\n", b"[" * 3000, b"{", b'"', b"-", b"9" * 400)
            )
        elif what == 5 and rng.random() < 0.3:
            del raw[at:]
        elif at < len(raw):
            raw[at] = rng.choice(b'0123456789-+.eE"{}[]:,<>=/ \n')
    return bytes(raw)


def _changed(tree: Any, rng: random.Random) -> Any:
    places = list(_places(tree))
    if not places:
        return _value(rng)
    holder, key = rng.choice(places)
    what = rng.randrange(10)
    if what <= 3:
        holder[key] = _value(rng)
    elif what == 4:
        del holder[key]
    elif what == 5:
        other, name = rng.choice(places)
        holder[key] = copy.deepcopy(other[name])
    elif isinstance(holder, list):
        holder.insert(key, copy.deepcopy(holder[key]))
    elif what == 6:
        holder[rng.choice((str(key) + "x", str(key)[:-1], str(key).upper(), str(key) + "m", *TEXTS))] = holder.pop(key)
    elif what == 7:
        holder[rng.choice(("x", "note", "self", "name", *TEXTS))] = _value(rng)
    elif what == 8:
        holder[Raw(key)] = holder[key]  # the same key again
        return _with_twin(tree, holder, key, rng)
    elif isinstance(holder[key], (int, float)) and abs(holder[key]) < 1e300 and not isinstance(holder[key], bool):
        holder[key] = rng.choice(
            (-holder[key], holder[key] * 1e3, holder[key] / 1e3, holder[key] + 1, str(holder[key]))
        )
    return tree


def _with_twin(tree: Any, holder: dict[Any, Any], key: Any, rng: random.Random) -> Any:
    """Return the tree with a duplicated key in its text."""
    value = holder[key]
    holder[key] = Raw(f"{_json(value)}, {json.dumps(str(key))}: {_json(rng.choice((value, _value(rng))))}")
    return tree


def _places(tree: Any) -> Any:
    if isinstance(tree, (dict, list)):
        for key in list(tree) if isinstance(tree, dict) else range(len(tree)):
            yield tree, key
            yield from _places(tree[key])


def _value(rng: random.Random) -> Any:
    kind = rng.randrange(5)
    if kind == 0:
        return rng.choice(TEXTS)
    if kind <= 2:
        return rng.choice(NUMBERS)
    if kind == 3:
        return Raw(rng.choice(TOKENS))
    deep: Any = rng.choice((0, {}))
    for _ in range(rng.choice((10, 100, 2000))):
        deep = Raw(f"[{deep if isinstance(deep, str) else json.dumps(deep)}]")
    return rng.choice((deep, *map(copy.deepcopy, OTHERS)))


def _token(rng: random.Random) -> str:
    return str(
        rng.choice((*TEXTS, *TOKENS, *(json.dumps(n) for n in NUMBERS), "nan", "inf", "true", "[", "]", "=", ",", "*"))
    )


def _set(element: ElementTree.Element, name: str, rng: random.Random) -> None:
    old = element.get(name, "")
    text = rng.choice(
        (_token(rng), old + " 0", old * 2, "-" + old, "1e308 0 0", "0 0", "nan nan nan", old.replace("0", "1"))
    )
    element.set(name, "".join(sign for sign in text if sign.isprintable() and not "\ud800" <= sign <= "\udfff"))


def _json(tree: Any) -> str:
    if isinstance(tree, Raw):
        return str.__str__(tree)
    if isinstance(tree, dict):
        return "{" + ", ".join(f"{json.dumps(str(key))}: {_json(value)}" for key, value in tree.items()) + "}"
    if isinstance(tree, list):
        return "[" + ", ".join(map(_json, tree)) + "]"
    return json.dumps(tree)
