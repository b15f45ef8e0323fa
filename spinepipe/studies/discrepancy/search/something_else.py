"""Something else: what could be missing without being an effect that has a name.

A load that is a function of one motion of the joint, as a table says (`tabulated_law`): a Gaussian
process, its slope drawn anew for each stretch. It is looked at and fitted like a named effect.
"""

import numpy as np

from spinepipe.effects import PlaceSpread
from spinepipe.effects.tabulated_law import FURTHEST, ITSELF, TabulatedLaw
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Trials, Variant
from spinepipe.units import COORDINATES

TABLE = "tabulated_law"
DIGITS = 3


def tables(base: BaselineFit, coordinates: tuple[str, ...]) -> Trials:
    """Loads over any motion that was read, on any coordinate that was."""
    joints = next(iter(base.fit.models.values())).n_joints
    spreads = [PlaceSpread.SHARED]
    spreads += [PlaceSpread.BY_JOINT] if joints > 1 else []
    spreads += [PlaceSpread.BY_SPECIMEN] if len(base.readings) > 1 else []
    variants = tuple(_variant(base, on, over) for on in coordinates for over in coordinates)
    forms = tuple(CandidateForm(variant, spread) for variant in variants for spread in spreads)
    return Trials(TABLE, variants, forms)


def _variant(base: BaselineFit, on: str, over: str) -> Variant:
    """The table, as far as all specimens move: beyond, one would tell of the others."""
    at = COORDINATES.index(over)
    furthest = []  # motion of each specimen in that coordinate, m or rad, in the model or as read
    for name, one in base.readings.items():
        moved = [np.abs(test.mean[..., at][test.count[..., at] > 0]) for test in one.tests]
        moved += [np.abs(predicted[..., at]) for predicted in base.fit.predicted[name]]
        furthest.append(max(float(of_test.max(initial=0.0)) for of_test in moved))
    # a reading in a wrong unit may be further than any joint moves
    most = TabulatedLaw(over).furthest * FURTHEST
    reach = min(float(f"{min(furthest):.{DIGITS}g}"), most)
    over = ITSELF if over == on else over
    return Variant(TABLE, (("coordinate", on), ("over", over), ("reach", reach)))
