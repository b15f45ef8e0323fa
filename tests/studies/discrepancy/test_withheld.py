"""Effects no larger than the imperfections allowed for: to what these would have to be known."""

import numpy as np
import pytest
from imperfect_cases import JOINTS, SPECIMENS, alike, grounds_of, off_centre
from sweeps import sweep

from spinepipe.studies.discrepancy.design.advice import ADVISED, advice, hidden_effects
from spinepipe.studies.discrepancy.design.extra_tests import bench
from spinepipe.studies.discrepancy.design.masked_effects import MaskedEffects, masked_effects
from spinepipe.studies.discrepancy.search.hypothesis import Trials, trials
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors
from spinepipe.studies.discrepancy.search.outcome import outcome
from spinepipe.studies.discrepancy.search.search import search
from spinepipe.studies.discrepancy.search.search_state import Rules, look
from spinepipe.studies.discrepancy.store import at_once
from spinepipe.studies.discrepancy.verdict import VerdictKind
from spinepipe.units import COORDINATES

NEEDED = 5.0
EFFECTS = ["joint_centre_offset", "load_misalignment", "neutral_zone"]
SHIFT_M = np.array([1e-3, 0.0, 0.0])


def all_trials() -> tuple[Trials, ...]:
    return trials(EFFECTS, COORDINATES, SPECIMENS, len(JOINTS))


@pytest.fixture(scope="module")
def hidden() -> MaskedEffects:
    """Centres 1 mm off in all joints, where 2 mm are allowed for."""
    found = masked_effects(
        grounds_of(off_centre(alike(SHIFT_M))), all_trials(), NEEDED, (), at_once
    )
    (one,) = found
    return one


def test_an_effect_that_an_imperfection_hides_is_found_with_that_imperfection(hidden):
    assert (hidden.effect, hidden.kind, hidden.unit) == ("joint_centre_offset", "joint_centre", "m")
    assert hidden.now < NEEDED < hidden.at[0.0]
    assert hidden.now < hidden.at[0.5] < hidden.at[0.25] < hidden.at[0.0]
    assert 0.02 < hidden.needed < 0.5


@sweep("share, evident", [(0.6, True), (1.5, False)])
def test_known_as_well_as_told_the_effect_is_evident(hidden, share, evident):
    """The base is fitted again with other priors, and the whole screen looked at."""
    priors = NuisancePriors(joint_centre=share * hidden.needed * hidden.prior)
    grounds = grounds_of(off_centre(alike(SHIFT_M)), priors)
    screen = look(grounds, all_trials())
    best = next(one for one in screen.effects if one.effect == "joint_centre_offset")
    assert (best.forms[0].log_evidence > NEEDED) is evident


def test_nothing_is_withheld_where_nothing_is_missing():
    grounds = grounds_of(off_centre(alike(0.0 * SHIFT_M)))
    assert masked_effects(grounds, all_trials(), NEEDED, (), at_once) == ()


def test_a_null_says_what_would_have_to_be_known_better():
    grounds = grounds_of(off_centre(alike(SHIFT_M)))
    rules = Rules(all_trials(), COORDINATES, 3.0, 3, 0)
    found = search(grounds, rules, at_once)
    ended = outcome(found)
    assert ended.verdict is VerdictKind.NULL
    hidden = hidden_effects(found, ended, rules, at_once)
    told = advice(found, ended, rules, bench(grounds, None), at_once, hidden)
    (best,) = [one for one in told if one.status == ADVISED]
    assert best.subject == "joint_centre_offset"
    assert best.test.startswith("repeated set-ups: joint_centre known to 0.")
    assert "instead of 2 mm" in best.test
    # centres stay where they are told, whatever run is added
    assert not any(one.status == "offered" for one in told)
