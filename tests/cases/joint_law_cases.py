"""The joint laws a search may try, in every variant."""

from typing import Any

import numpy as np
from sweeps import sweep

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

VARIANTS = tuple((name, dict(v)) for name in NAMES for v in registered()[name].trial.variants)


def title(variant: tuple[str, dict[str, Any]]) -> str:
    name, options = variant
    return "-".join([name, *map(str, options.values())])


EVERY = sweep("variant", VARIANTS, title)
DEFAULT = sweep("name", NAMES)


def law_of(variant: tuple[str, dict[str, Any]]) -> JointLaw:
    law = create(*variant)
    assert isinstance(law, JointLaw)
    return law


def defaults(law: JointLaw, n: int = 1) -> Array:
    return np.tile([p.default for p in law.parameters], (n, 1))


def off(law: JointLaw, n: int = 1) -> Array:
    return np.tile([p.default if p.off is None else p.off for p in law.parameters], (n, 1))
