"""Searches of small chains whose motion is known in closed form, from readings to verdict."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import spring_chain_cases as chains
from numpy.typing import NDArray
from spring_chain_cases import Yield

from spinepipe.studies.discrepancy.search.baseline import BaselineFit, fit_baseline
from spinepipe.studies.discrepancy.search.hypothesis import trials
from spinepipe.studies.discrepancy.search.noise import estimated_noise
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors
from spinepipe.studies.discrepancy.search.outcome import Outcome, outcome
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings
from spinepipe.studies.discrepancy.search.search import search
from spinepipe.studies.discrepancy.search.search_state import Rules, SearchResult
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.units import ROTATIONS

Array = NDArray[np.float64]

JOINTS = 3
MARGIN = 3.0
EFFECTS = (
    "flexion_extension_asymmetry",
    "level_dependence",
    "load_offset",
    "local_laxity",
    "marker_bias",
    "neutral_zone",
    "nonlinear_stiffening",
)


def exponential(rate: float) -> Yield:
    """Rotations that ``k sign(q) (exp(rate |q|) - 1) / rate`` carries the moments at."""

    def turned(joint: int, moments: Array, k: float) -> Array:
        return np.sign(moments) * np.log1p(rate * np.abs(moments) / k) / rate

    return turned


def one_sided(asymmetry: float) -> Yield:
    """Springs that are stiffer by that share to the positive side, softer to the other."""

    def turned(joint: int, moments: Array, k: float) -> Array:
        return moments / (k * np.where(moments > 0.0, 1.0 + asymmetry, 1.0 - asymmetry))

    return turned


def wavy(joint: int, moments: Array, k: float) -> Array:
    """Yields more and less in turns: no effect of the library."""
    return moments / k + 0.006 * np.sin(2.0 * np.pi * moments / 5.0 + 0.5)


@dataclass(frozen=True)
class Searched:
    """Where a search ended, and what it comes to."""

    found: SearchResult
    ended: Outcome

    def evidence(self) -> dict[str, float]:
        """By effect, on the first screen."""
        return {one.effect: one.log_evidence for one in self.found.stages[0].screen.effects}


def readings(
    seed: int, laws: Mapping[str, Yield], specimens: Sequence[str] = ("a", "b")
) -> list[SpecimenReadings]:
    """Two specimens, three tests of seven steps, three cycles; ``laws`` by test, others linear."""
    return chains.readings(seed, laws, specimens, joints=JOINTS)


def grounds_of(given: Sequence[SpecimenReadings]) -> BaselineFit:
    """The base fitted, noise from the repeats, nuisances as large as by default.

    Errors of the readings are white: cycles of a test share none.
    """
    noise = estimated_noise(given, None, zeroed=False, outliers=0, accuracy=np.zeros(6))
    assert noise is not None
    return fit_baseline(given, noise, NuisancePriors(), chains.start(given), at_once)


def searched(
    given: Sequence[SpecimenReadings],
    effects: Sequence[str] | None = EFFECTS,
    backwards: bool = False,
) -> Searched:
    """The search of a study; ``backwards``: effects are tried in the other order."""
    names = sorted(one.specimen for one in given)
    tried = trials(effects, ROTATIONS, names, JOINTS)
    rules = Rules(tried[::-1] if backwards else tried, ROTATIONS, 3)
    found = search(grounds_of(given), rules, at_once)
    return Searched(found, outcome(found))
