"""The joint laws a search may try, in every variant, and some on translations."""

from typing import Any

import numpy as np
import pytest

from spinepipe.effects import JointLaw, create, registered
from spinepipe.effects.contract import Array

NAMES = (
    "nonlinear_stiffening",
    "neutral_zone",
    "flexion_extension_asymmetry",
    "bending_rotation_coupling",
    "facet_contact",
    "level_dependence",
    "local_laxity",
    "preload_stiffening",
)

ON_TRANSLATIONS: tuple[tuple[str, dict[str, Any]], ...] = (
    *(
        ("nonlinear_stiffening", {"coordinate": "superior", "shape": shape})
        for shape in ("exponential", "tangent", "cubic")
    ),
    ("neutral_zone", {"coordinate": "anterior"}),
    ("flexion_extension_asymmetry", {"coordinate": "right"}),
    ("bending_rotation_coupling", {"pair": ("anterior", "extension")}),
    ("bending_rotation_coupling", {"pair": ("anterior", "superior")}),
    ("facet_contact", {"coordinate": "anterior", "side": "negative"}),
    ("level_dependence", {"coordinate": "right"}),
    ("local_laxity", {"coordinate": "superior"}),
)

VARIANTS = tuple((name, dict(v)) for name in NAMES for v in registered()[name].trial.variants)


def title(variant: tuple[str, dict[str, Any]]) -> str:
    name, options = variant
    return "-".join([name, *map(str, options.values())])


SEARCHED = pytest.mark.parametrize("variant", VARIANTS, ids=title)
EVERY = pytest.mark.parametrize("variant", [*VARIANTS, *ON_TRANSLATIONS], ids=title)
DEFAULT = pytest.mark.parametrize("name", NAMES)


def law_of(variant: tuple[str, dict[str, Any]]) -> JointLaw:
    law = create(*variant)
    assert isinstance(law, JointLaw)
    return law


def defaults(law: JointLaw, n: int = 1) -> Array:
    return np.tile([p.default for p in law.parameters], (n, 1))


def off(law: JointLaw, n: int = 1) -> Array:
    return np.tile([p.default if p.off is None else p.off for p in law.parameters], (n, 1))
