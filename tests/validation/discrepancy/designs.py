"""How the cohorts that are scored are tested: drawn by seed, apart from what is hidden in them.

Small ones, so that a search takes seconds: two to four specimens of one to four joints, 7 to 13
load steps a test.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from tests.generators.hidden import KNOWN, USUAL, Recipe, draw_hidden

STREAM = 7

OF_LAWS = (
    "nonlinear_stiffening",
    "neutral_zone",
    "flexion_extension_asymmetry",
    "facet_contact",
    "hysteresis",
    "creep",
)
"""Effects that one joint shows by itself, in moments and in forces."""

OF_NEIGHBOURS = (
    "level_dependence",
    "local_laxity",
    "neighbour_coupling",
    "soft_tissue_artefact",
)
"""With one joint alone these leave no trace."""

TOLD_BY_TRANSLATIONS = ("joint_centre_offset", "joint_centre_migration", "follower_load")
"""With pure moments and rotations alone these leave little or no trace."""

PRELOAD_N = 200.0

Fields = dict[str, Any]


def _path(rng: np.random.Generator, share: float) -> Fields:
    """13 steps with unloading in that share of designs, else 7 to 11 without."""
    if rng.random() < share:
        return {"steps": 3, "unloading": True}
    return {"steps": int(rng.integers(3, 6)), "unloading": False}


def moments(rng: np.random.Generator) -> Fields:
    """Two to four joints in sweeps of moments, rotations read."""
    joints = int(rng.choice([2, 3, 4], p=[0.45, 0.4, 0.15]))
    return {
        "joints": joints,
        "lowest": int(rng.integers(0, 7 - joints)),
        "n_specimens": int(rng.choice([2, 3, 4], p=[0.45, 0.45, 0.1])),
        "zeroed": bool(rng.random() < 0.25),
        **_path(rng, 0.35),
    }


def six(rng: np.random.Generator) -> Fields:
    """One or two joints, all six coordinates read: the searches that take longest."""
    joints = int(rng.integers(1, 3))
    return {
        "joints": joints,
        "lowest": int(rng.integers(0, 7 - joints)),
        "n_specimens": int(rng.integers(2, 4)),
        "translations": True,
        **_path(rng, 0.2) | {"steps": 3},
    }


def one_joint(rng: np.random.Generator) -> Fields:
    """One segment of either region in flexion and extension, or in three sweeps."""
    cervical = bool(rng.random() < 0.4)
    return {
        "region": "cervical" if cervical else "lumbar",
        "joints": 1,
        "lowest": 0 if cervical else int(rng.integers(0, 3)),
        "peak_nm": 2.5 if cervical else 7.5,
        "design": str(rng.choice(["flexion_extension", "sweeps"])),
        "n_specimens": int(rng.integers(2, 5)),
        **_path(rng, 0.5),
    }


def shear(rng: np.random.Generator) -> Fields:
    """One segment, C6-C7 or L4-L5, pushed forth and back; its displacement read, or more."""
    cervical = bool(rng.random() < 0.5)
    more = bool(rng.random() < 0.3)
    return {
        "region": "cervical" if cervical else "lumbar",
        "joints": 1,
        "lowest": 0 if cervical else 1,
        "peak_n": 100.0 if cervical else 250.0,
        "design": "shear",
        "n_specimens": int(rng.integers(3, 6)),
        "gravity": False,
        "only": ("anterior", "extension") if more else ("anterior",),
        "noise_sd_mm": 0.02,
        **_path(rng, 0.5),
    }


def thin(rng: np.random.Generator) -> Fields:
    """Two or three specimens, eleven steps, every test once."""
    joints = int(rng.integers(1, 4))
    return {
        "joints": joints,
        "lowest": int(rng.integers(0, 7 - joints)),
        "n_specimens": int(rng.integers(2, 4)),
        "steps": 5,
        "cycles": 1,
        "noise_sd_deg": 0.05,
    }


DESIGNS: dict[str, Callable[[np.random.Generator], Fields]] = {
    "moments": moments,
    "six": six,
    "one_joint": one_joint,
    "shear": shear,
    "thin": thin,
}

USUAL_SHARES = {"moments": 0.4, "six": 0.1, "one_joint": 0.2, "shear": 0.2, "thin": 0.1}
SHARES: dict[str, dict[str, float]] = {
    **dict.fromkeys(OF_LAWS, USUAL_SHARES),
    **{name: {"six": 0.9, "moments": 0.1} for name in TOLD_BY_TRANSLATIONS},
    "preload_stiffening": {"moments": 1.0},
}
"""Of designs in which an effect is hidden; others are of several joints."""

OF_SEVERAL = {"moments": 0.7, "six": 0.15, "thin": 0.15}


def plain(seed: int, *names: str, **given: Any) -> Recipe:
    """A recipe without any effect, in a design that suits these; given fields are kept."""
    rng = np.random.default_rng([seed, STREAM])
    shares = _shares(names)
    kind = str(rng.choice(list(shares), p=list(shares.values())))
    fields = DESIGNS[kind](rng)
    noise = str(rng.choice(["white", "serial", "outliers"], p=[0.7, 0.15, 0.15]))
    fields["noise"] = "white" if kind == "thin" else noise  # one cycle shows no outlier
    if "hysteresis" in names:
        fields |= {"unloading": True, "steps": 3}
    if "preload_stiffening" in names:
        fields |= {"preload_n": PRELOAD_N, "joints": 3, "lowest": min(fields["lowest"], 3)}
    if set(names) & set(OF_NEIGHBOURS):
        joints = max(fields["joints"], 3)
        fields |= {"joints": joints, "lowest": min(fields["lowest"], 6 - joints)}
    found = fields | given
    if found.get("noise") == "outliers":
        found["cycles"] = max(found.get("cycles", 3), 3)
    return Recipe(seed=seed, **found)


def _shares(names: tuple[str, ...]) -> dict[str, float]:
    """Of one effect, its own; of several, where all of them can be."""
    if not names:
        return USUAL_SHARES
    every = [SHARES.get(name, OF_SEVERAL) for name in names]
    common = {one: min(s.get(one, 0.0) for s in every) for one in DESIGNS}
    total = sum(common.values())
    if not total:
        return {"six": 1.0}
    return {one: share / total for one, share in common.items() if share}


def design_of(recipe: dict[str, Any]) -> str:
    """In a word: shear, one joint, six coordinates, thin, or moments."""
    if recipe["design"] in ("shear", "two_shears"):
        return "shear"
    if recipe["translations"]:
        return "six"
    if recipe["cycles"] == 1:
        return "thin"
    return "one_joint" if recipe["joints"] == 1 else "moments"


def soiled(recipe: Recipe, share: float) -> Recipe:
    """With the usual dirt in that share of recipes: all of it, or one kind."""
    rng = np.random.default_rng([recipe.seed, STREAM + 1])
    if rng.random() >= share:
        return recipe
    one = str(rng.choice(list(USUAL)))
    return replace(recipe, dirt=dict(USUAL) if rng.random() < 0.5 else {one: USUAL[one]})


OTHER_SHARE = 0.65
"""Of effects with a formula that spinepipe does not have, where there is one."""


def with_effects(recipe: Recipe, *names: str) -> Recipe:
    """With effects drawn for the recipe's seed, of the library's formulas or of others."""
    rng = np.random.default_rng([recipe.seed, STREAM + 2])
    hidden = tuple(
        draw_hidden(name, recipe, number, other=bool(rng.random() < OTHER_SHARE))
        for number, name in enumerate(names)
    )
    return replace(recipe, hidden=hidden)


def known_effects() -> tuple[str, ...]:
    """Names by turns: laws of one joint twice, since they have most formulas and designs."""
    return (*KNOWN, *OF_LAWS)
