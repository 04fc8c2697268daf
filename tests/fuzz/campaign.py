"""Many mutated inputs of one kind, and how they ended."""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path

from tests.fuzz.readers import Format, prepared
from tests.fuzz.trial import outcome


@dataclass(frozen=True, kw_only=True)
class Tally:
    """How mutated inputs ended.

    Attributes:
        name: of their kind.
        accepted: for what they say.
        refused: in one sentence.
        defects: each input with what is wrong.
    """

    name: str
    accepted: int
    refused: int
    defects: tuple[tuple[bytes, str], ...]


def tried(form: Format, count: int, seed: int, folder: Path) -> Tally:
    """Mutate valid files, read each, and count.

    Args:
        form: kind of file.
        count: inputs.
        seed: of the mutations: equal seeds make equal inputs.
        folder: empty one to write them in.
    """
    rng, path, seeds = random.Random(f"{form.name} {seed}"), prepared(form, folder), form.seeds()
    ends: list[str] = []
    defects = []
    for _ in range(count):
        data = form.mutate(rng.choice(seeds), rng)
        path.write_bytes(data)
        ends.append(outcome(lambda: form.read(path)))
        if ends[-1] not in ("accepted", "refused"):
            defects.append((data, ends[-1]))
    return Tally(name=form.name, accepted=ends.count("accepted"), refused=ends.count("refused"), defects=tuple(defects))
