"""Marker bias: what is reported against rotations multiplied out, in and out of tests' scopes.

Catches a bias turned about the wrong axis, or reported outside of its tests.
"""

import numpy as np
import pytest
from effect_slopes import (
    assert_each_test_has_its_own_values,
    assert_sensitivities,
    assert_tangent,
    poses,
    reported,
    slopes,
    system_with,
)
from example_effects import scoped
from sweeps import sweep

from spinepipe.effects import PlaceSpread, create

FORMS = ("offset", "tilt")
BIAS = (0.001, -0.002, 0.0015, 0.03, -0.02, 0.04)
TILTS = (0.03, -0.05, 0.04)


def biased(form: str, joints: tuple[int, ...] = (0, 2), on: bool = True):
    values = {"offset": BIAS, "tilt": TILTS}[form]
    return scoped(
        create("marker_bias", {"form": form}), joints, values if on else (0.0,) * len(values)
    )


def test_offsets_are_added() -> None:
    q = poses()
    seen = create("marker_bias").observe(q, np.tile(BIAS, (len(q), 1)))
    np.testing.assert_array_equal(seen.q, q + np.array(BIAS))


@sweep("on", [True, False])
@sweep("form", FORMS)
def test_derivatives_are_slopes(form: str, on: bool) -> None:
    q, here = poses(), biased(form, on=on)
    effect, values = here.effect, np.tile(here.values[0], (len(q), 1))
    by_q = slopes(lambda at: effect.observe(at, values).q, q)
    np.testing.assert_allclose(effect.observe(q, values).by_coordinate, by_q, rtol=0, atol=1e-9)
    by_parameter = slopes(lambda at: effect.observe(q, at).q, values)
    found = effect.by_parameter(q, values)
    np.testing.assert_allclose(found, by_parameter, rtol=0, atol=1e-9)
    assert np.all(np.abs(found[:-1]).max(axis=(0, 1)) > 1e-3)


@sweep("on", [True, False])
@sweep("form", FORMS)
def test_tangents_and_sensitivities_of_whole_spines(form: str, on: bool) -> None:
    system = system_with(biased(form, on=on))
    assert_tangent(system)
    assert_sensitivities(system)


def test_both_forms_on_top_of_each_other() -> None:
    assert_sensitivities(system_with(biased("offset"), biased("tilt", (1, 2))))


@sweep("form", FORMS)
def test_off_reports_the_truth(form: str) -> None:
    assert {p.off for p in biased(form).effect.parameters} == {0.0}
    plain, found = (reported(system_with(*e)) for e in ((), (biased(form, on=False),)))
    np.testing.assert_allclose(found, plain, rtol=0, atol=1e-15)


def test_only_readings_of_joints_in_scope_change() -> None:
    """Six different offsets at joint 2: the spine itself and the other joints stay."""
    plain, found = reported(system_with()), reported(system_with(biased("offset", (2,))))
    np.testing.assert_allclose(found[:, 2] - plain[:, 2], np.tile(BIAS, (3, 1)), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(found[:, :2], plain[:, :2])


@sweep("form", FORMS)
def test_each_test_has_its_own_values(form: str) -> None:
    assert_each_test_has_its_own_values(biased(form))


def test_forms_and_spreads() -> None:
    with pytest.raises(ValueError, match="form 'gain'; allowed: offset, tilt"):
        create("marker_bias", {"form": "gain"})
    trial = create("marker_bias").trial
    assert [create("marker_bias", dict(v)).form for v in trial.variants] == ["offset", "tilt"]
    assert set(trial.spreads) == {
        PlaceSpread.EACH,
        PlaceSpread.BY_JOINT,
        PlaceSpread.ONE_JOINT,
        PlaceSpread.ONE,
    }
