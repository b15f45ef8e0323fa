"""All effects by name, and how one is drawn."""

from dataclasses import replace
from zlib import crc32

import numpy as np

from . import known_laws, known_others, unknown
from .anatomy import N_JOINTS
from .entry import Entry
from .recipe import Hidden, Recipe

CATALOGUE: dict[str, Entry] = {**known_laws.ENTRIES, **known_others.ENTRIES, **unknown.ENTRIES}
KNOWN = tuple(name for name, entry in CATALOGUE.items() if entry.known)
"""The vocabulary's 17."""
UNKNOWN = tuple(name for name, entry in CATALOGUE.items() if not entry.known)

ONE_JOINT_CHANCE = 0.2
_STREAM = 100


def draw_hidden(name: str, recipe: Recipe, number: int = 0, **given: object) -> Hidden:
    """An effect with a drawn coordinate, scope and shape.

    ``number`` tells the effects of one recipe apart; ``given`` fields of `Hidden` are kept.
    """
    entry = CATALOGUE[name]
    rng = np.random.default_rng([recipe.seed, _STREAM + number, crc32(name.encode())])
    drawn = Hidden(
        name,
        coordinate=str(rng.choice(entry.coordinates)) if entry.coordinates else None,
        joint=_joint(entry, rng),
        specimen=int(rng.integers(recipe.n_specimens)) if entry.one_specimen else None,
    )
    drawn = replace(drawn, **given)
    shape = entry.draw(rng, recipe, drawn.coordinate)
    return replace(drawn, shape=shape | drawn.shape)


def _joint(entry: Entry, rng: np.random.Generator) -> int | None:
    joint, chance = int(rng.integers(N_JOINTS)), rng.uniform()
    one = {"one": True, "all": False, "all or one": chance < ONE_JOINT_CHANCE}[entry.joints]
    return joint if one else None
