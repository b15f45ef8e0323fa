"""What tests could tell apart: closed forms of one joint, and what is known by algebra."""

import numpy as np
import pytest
from scipy.stats import norm
from sweeps import sweep
from testable_cases import (
    NEEDED,
    NO_NUISANCE,
    STIFFNESS,
    grounds_of,
    judged,
    only,
    revealed,
    tried_in,
)

from spinepipe.effects import PlaceSpread
from spinepipe.studies.discrepancy.design.distinguishability import (
    TIMES,
    confusions,
    distinguishability,
    targets,
    usual_targets,
)
from spinepipe.studies.discrepancy.design.signatures import cohort_signatures
from spinepipe.studies.discrepancy.design.testable import judgements
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.screen import SIZES
from spinepipe.studies.discrepancy.store import at_once

ASYMMETRY = only("flexion_extension_asymmetry", coordinate="extension")


def one_joint(moments, sd: float = 1e-6) -> BaselineFit:
    return grounds_of(1, moments, ("flexion",), zeroed=False, sd=sd, priors=NO_NUISANCE)


@sweep("moments", [(0.0, 2.0, 4.0, -2.0), (0.0, 1.0, 3.0, -3.0, -1.0)])
def test_base_takes_up_what_a_straight_line_explains_of_an_absolute_value(moments):
    """One joint: motion M/k, base moves it by -M/k, asymmetry by -|M|/k."""
    m = np.array(moments)
    expected = np.sum(m * np.abs(m)) ** 2 / np.sum(m**2) ** 2
    found = judged(one_joint(moments), [ASYMMETRY])[ASYMMETRY.effect]
    assert found.best.absorbed == pytest.approx(expected, abs=1e-3)
    assert found.best.absorbed_by_base == pytest.approx(expected, abs=1e-3)


def test_detectable_effects_have_the_evidence_needed_nine_times_in_ten():
    """Evidence of one strength is the ratio of two normal densities of its moment."""
    moments = np.array([0.0, 1.0, 2.0, 4.0, -3.0, -1.0])
    found = judged(one_joint(moments, 2e-3), [ASYMMETRY])[ASYMMETRY.effect].detectable
    motion = moments / STIFFNESS[3] / 2e-3
    per_prior_sd = 0.2 * np.abs(motion)
    left = per_prior_sd - motion * (motion @ per_prior_sd) / (motion @ motion)
    gram = left @ left
    z = np.random.default_rng(1).standard_normal(20_000)
    b = found.times * gram + np.sqrt(gram) * z  # typical: one prior SD
    there = np.mean([norm.pdf(b, scale=np.sqrt(gram + t**2 * gram**2)) for t in SIZES], axis=0)
    often = np.mean(np.log(there) - norm.logpdf(b, scale=np.sqrt(gram)) > NEEDED)
    assert often == pytest.approx(0.9, abs=0.04)
    assert found.gap == pytest.approx(found.times * np.sqrt(gram / (3 * 6 - 1)), rel=0.01)


def test_an_offset_explains_what_a_constant_does_of_an_absolute_value():
    """Moments on both sides alike: base is orthogonal to both effects."""
    m = np.array([1.0, 2.0, 4.0, -1.0, -2.0, -4.0])
    expected = np.sum(np.abs(m)) ** 2 / (len(m) * np.sum(m**2))
    grounds = one_joint(m)
    tried = (ASYMMETRY, only("load_offset"))
    design = cohort_signatures(grounds, tried)
    pairs = confusions(design, usual_targets(design, judgements(design, NEEDED)))
    share = {(one.effect, one.other): one.share for one in pairs}
    assert share["flexion_extension_asymmetry", "load_offset"] == pytest.approx(expected, abs=2e-3)
    about_z = (1.0 / STIFFNESS[3]) ** 2 / np.sum(1.0 / STIFFNESS[3:] ** 2)
    back = share["load_offset", "flexion_extension_asymmetry"]
    assert back == pytest.approx(expected * about_z, abs=0.02)


def test_an_effect_has_its_own_name_nine_times_in_ten_from_the_gap_that_is_told():
    """Drawn readings of an asymmetry, and the evidence as a ratio of normal densities of them."""
    moments = np.array([1.0, 2.0, 4.0, -1.0, -2.0, -5.0])
    grounds = one_joint(moments, 2e-3)
    offset = only("load_offset")
    design = cohort_signatures(grounds, (ASYMMETRY, offset))
    found = usual_targets(design, judgements(design, NEEDED))
    gap = next(one.gap for one in confusions(design, found) if one.other == "load_offset")
    # in noise SD: the base moves by -M/k, the asymmetry by -|M|/k, the offset by M0/k in each axis
    motion = moments / STIFFNESS[3] / 2e-3
    strength = offset.variants[0].create().parameters[0]
    law, *shifts = (0.2 * np.abs(motion), *np.ones((3, 6)) / STIFFNESS[3:, None])
    shifts = [strength.prior_scale / 2e-3 * one for one in shifts]
    law, shifts[0] = (one - motion * (motion @ one) / (motion @ motion) for one in (law, shifts[0]))
    drawn = np.random.default_rng(2).standard_normal((3, 20_000, 6))
    drawn[0] += gap * np.sqrt(3 * 6 - 1) / np.linalg.norm(law) * law

    def evidence(signatures):
        total = np.zeros((len(SIZES), 20_000))
        for seen, one in zip(drawn, signatures, strict=False):
            b, gram = seen @ one, one @ one
            there = [norm.logpdf(b, scale=np.sqrt(gram + t**2 * gram**2)) for t in SIZES]
            total += there - norm.logpdf(b, scale=np.sqrt(gram))
        return np.log(np.mean(np.exp(total), axis=0))

    often = np.mean(evidence([law]) - evidence(shifts) > 3.0)
    assert often == pytest.approx(0.9, abs=0.05)


def test_pure_moments_and_rotations_do_not_tell_where_the_centre_is():
    grounds = grounds_of()
    found = judged(grounds, ["joint_centre_offset"])["joint_centre_offset"]
    assert not found.testable
    assert found.why == "it leaves no trace in these readings"
    assert "translations read as well" in revealed(grounds, "joint_centre_offset")


def test_preload_stiffening_takes_a_second_preload():
    words = revealed(grounds_of(), "preload_stiffening")
    assert "follower load of 400 N" in words


def test_levels_differ_only_against_a_base_that_shares_stiffness():
    free = grounds_of(grouping="per_joint")
    found = judged(free, ["level_dependence"])["level_dependence"]
    assert not found.testable
    assert found.best.absorbed_by_base > 0.999
    assert revealed(free, "level_dependence") == ""
    assert judged(grounds_of(), ["level_dependence"])["level_dependence"].testable


def test_a_laxity_is_looked_for_in_one_place():
    grounds = grounds_of(specimens=2)
    found = judged(grounds, ["local_laxity"])["local_laxity"]
    assert found.testable
    assert found.best.form.spread is PlaceSpread.ONE


def test_unloading_tells_hysteresis_from_a_neutral_zone():
    """Known from a trial: on the loading branch alone one explains 0.9 of the other."""
    up = (0.0, 0.75, 1.5, 3.0, 4.5, 6.0, 7.5)
    pair = "hysteresis", "neutral_zone"

    def share(moments: tuple[float, ...]) -> float:
        grounds = grounds_of(2, moments, ("flexion",))
        told = distinguishability(grounds, tried_in(grounds, pair), NEEDED, None, at_once)
        return next(c.share for c in told.confusions if (c.effect, c.other) == pair)

    assert share(up) > 0.85
    assert share((*up, *up[-2::-1])) < 0.5


def test_creep_takes_times():
    grounds = grounds_of(seconds=None)
    found = judged(grounds, ["creep"])["creep"]
    assert not found.testable
    assert "held for 10 min" in revealed(grounds, "creep")
    assert judged(grounds_of(), ["creep"])["creep"].testable


def test_what_is_told_apart_holds_every_effect_once():
    grounds = grounds_of(joints=2, tests=("flexion",))
    effects = ["facet_contact", "joint_centre_offset", "neutral_zone"]
    told = distinguishability(grounds, tried_in(grounds, effects), NEEDED, None, at_once)
    hidden = {one.name for one in told.not_testable}
    assert hidden == {"joint_centre_offset"}
    assert {one.name for one in told.smallest_detectable} == set(effects) - hidden
    for one in told.smallest_detectable:
        assert one.by_name is not None
        assert one.by_name >= one.gap > 0.0
    assert {(one.effect, one.other) for one in told.confusions} == {
        ("facet_contact", "neutral_zone"),
        ("neutral_zone", "facet_contact"),
    }
    assert all(0.0 <= one.share <= 1.0 for one in told.confusions)


def test_where_nothing_on_the_menu_helps_no_advice_is_given():
    """A test nearly without load shows no stop, whatever single thing is added."""
    grounds = grounds_of(joints=1, moments=(0.0, 1e-3), tests=("flexion",))
    assert revealed(grounds, "facet_contact") == ""


def test_of_what_leaves_no_trace_others_explain_nothing():
    """Planned tests are asked of all effects, also of those that they cannot show."""
    grounds = grounds_of()
    tried = tried_in(grounds, ["joint_centre_offset", "flexion_extension_asymmetry"])
    design = cohort_signatures(grounds, tried)
    found = judgements(design, NEEDED)
    (traceless,) = (number for number, one in enumerate(found) if not one.testable)
    (told,) = targets(design, found, [(traceless, found[traceless].best)], [TIMES])
    assert told.shares == {"flexion_extension_asymmetry": 0.0}
    assert told.told_from("flexion_extension_asymmetry") is None
