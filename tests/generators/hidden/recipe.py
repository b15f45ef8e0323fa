"""What a set of data is asked to be: plain values only, so that a recipe is its own JSON."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

Shape = dict[str, Any]

_TRANSLATIONS = ("anterior", "superior", "right")
_ROTATIONS = ("extension", "right_bending", "left_rotation")


@dataclass(frozen=True)
class Hidden:
    """One effect that is in the data and not in the base model.

    Attributes
    ----------
    name : of the vocabulary, or of one of the effects outside it (`catalogue.CATALOGUE`).
    coordinate : joint coordinate it acts on; None for effects that have none.
    joint : index from the most caudal joint, None for all.
    specimen : index, None for all.
    shape : everything but the strength, ``formula`` among it; what is left out takes the effect's
        own value. Lengths of a coordinate (``gap``, ``width``) are in its unit, m or rad.
    strength : SI; None to have it scaled until the wanted gap is reached.
    """

    name: str
    coordinate: str | None = None
    joint: int | None = None
    specimen: int | None = None
    shape: Shape = field(default_factory=dict)
    strength: float | None = None


@dataclass(frozen=True)
class Recipe:
    """One cohort folder; every default makes the small scoring cohort without any effect.

    Attributes
    ----------
    seed : of everything that is drawn; recipes of one seed share geometry, stiffness and noise.
    region : "lumbar" (S1 to T12) or "cervical" (C7 to C3). joints, lowest : how many joints a
        specimen has, and the number of the most caudal one in its region.
    design : a name of `design.DESIGNS`: which sweeps of moments or forces.
    steps : load steps away from zero per test and side, at even shares of the peak.
    unloading : whether each side is also stepped back to zero.
    cycles : repeats of a test; each starts from rest, without memory of the one before.
    peak_nm, peak_n : largest moment N m, and force N where the design has forces.
    preload_n : 0, or a compressive force with which every test is repeated, N; the lowest joint
        carries all of it, the others less (`scene.preload_points`).
    gravity : whether bodies have weight. zeroed : whether step 0 is subtracted in every cycle.
    translations : whether translations are reported beside rotations.
    only : coordinates that are reported, and no others; empty: as ``translations`` says.
    noise : "none", "white", "serial" (0.5 from one step to the next), "outliers" (1 % at 10 SD).
    state_sd : whether cohort.yaml states the noise SD.
    hold_s : s, duration of one load step.
    hidden : effects; each is scaled alone to the gap unless its strength is given.
    gap : wanted root mean square discrepancy, in SD of one reading; see `gap.py`.
    dirt : names of `dirt.DIRT` -> size (deg for posture, fraction for gain, ...), or 0.
    errors : names of `errors.ERRORS` -> options: mistakes in the files, not physics.
    """

    seed: int
    region: str = "lumbar"
    joints: int = 6
    lowest: int = 0
    n_specimens: int = 3
    design: str = "sweeps"
    steps: int = 3
    unloading: bool = False
    cycles: int = 3
    peak_nm: float = 7.5
    peak_n: float = 0.0
    preload_n: float = 0.0
    gravity: bool = True
    zeroed: bool = False
    translations: bool = False
    only: tuple[str, ...] = ()
    noise: str = "white"
    noise_sd_deg: float = 0.1
    noise_sd_mm: float = 0.1
    state_sd: bool = True
    hold_s: float = 30.0
    hidden: tuple[Hidden, ...] = ()
    gap: float = 1.0
    dirt: dict[str, float] = field(default_factory=dict)
    errors: dict[str, Shape] = field(default_factory=dict)

    @property
    def read(self) -> tuple[str, ...]:
        """Names of the coordinates that are reported."""
        if self.only:
            return self.only
        return (*_TRANSLATIONS, *_ROTATIONS) if self.translations else _ROTATIONS

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as JSON holds them."""
        hidden = [asdict(effect) for effect in self.hidden]
        return asdict(self) | {"hidden": hidden, "only": list(self.only)}


def recipe_from(values: Mapping[str, Any]) -> Recipe:
    """The recipe of `Recipe.as_dict`."""
    hidden = tuple(Hidden(**effect) for effect in values.get("hidden", ()))
    return Recipe(**{**values, "hidden": hidden, "only": tuple(values.get("only", ()))})
