"""Numbers read off fitted curves against closed forms: values, intervals, what is left out."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from search_cases import exponential, grounds_of, one_sided, readings
from spring_chain_cases import Yield

from spinepipe.calibration.profile import NORMAL_95
from spinepipe.effects import PlaceSpread
from spinepipe.studies.discrepancy.curve_numbers import (
    LoadRange,
    field_number_rows,
    reaches,
    unit_of,
)
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm, Variant
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, joint_fit
from spinepipe.studies.discrepancy.search.model_files import covariance
from spinepipe.units import DEG_PER_RAD

RATE = 9.0
LAWS: dict[str, Yield] = {"flexion": exponential(RATE)}
STIFFENING = CandidateForm(
    Variant("nonlinear_stiffening", (("coordinate", "extension"), ("shape", "exponential"))),
    PlaceSpread.SHARED,
)
ASYMMETRY = CandidateForm(
    Variant("flexion_extension_asymmetry", (("coordinate", "extension"),)), PlaceSpread.SHARED
)
COUPLING = CandidateForm(
    Variant("bending_rotation_coupling", (("pair", ("right_bending", "left_rotation")),)),
    PlaceSpread.SHARED,
)

Found = dict[tuple[str, ...], dict[str, Any]]


@cache
def fits(form: CandidateForm, truth: str) -> tuple[JointFit, JointFit]:
    """Without and with the form, of readings that stiffen or that differ by side."""
    hidden = LAWS if truth == "stiffening" else {"flexion": one_sided(0.3)}
    grounds = grounds_of(readings(3, hidden))
    off = form.variant.off((0.0,) * len(form.variant.shapes))
    start = np.where(off == 0.0, 0.05, off)
    fit = joint_fit(grounds.suppose((ActiveTerm(form, start),)), grounds.setting, grounds.fit.poses)
    assert fit.usable
    return grounds.fit, fit


def loads(fit: JointFit, low: float, high: float) -> dict[tuple[str, str], LoadRange]:
    joints = next(iter(fit.models.values())).joints
    return {(joint, "extension"): LoadRange(low, high) for joint in joints}


def read(
    form: CandidateForm, truth: str, low: float = -6.0, high: float = 6.0
) -> dict[tuple[str, ...], dict]:
    base, fit = fits(form, truth)
    rows = field_number_rows(base, fit, [form], loads(fit, low, high))
    return {(r["model"], r["specimen"], r["joint"], r["number"]): r for r in rows}


def test_stiffness_and_its_interval_are_those_of_the_closed_form() -> None:
    """An exponential law: slope at rest k, at load M it is k + b M."""
    _, fit = fits(STIFFENING, "stiffening")
    found = read(STIFFENING, "stiffening")
    joint = fit.models["a"].joints[1]
    unknowns = fit.hypothesis.unknowns
    k_at = next(
        n
        for n, u in enumerate(unknowns)
        if u.supposed is None and "a" in u.place and "extension" in u.label
    )
    b_at = next(n for n, u in enumerate(unknowns) if u.supposed == 0 and u.is_strength)
    k = fit.models["a"].effects[0].values[1, 3]
    rise = float(fit.models["a"].effects[-1].values[0, 0])
    spread = covariance(fit)
    for number, moment in (("stiffness_at_zero", 0.0), ("stiffness_at_plus", 5.0)):
        row = found["with_effects", "a", joint, number]
        slope = np.zeros(len(unknowns))
        slope[k_at], slope[b_at] = k, moment
        away = NORMAL_95 * np.sqrt(slope @ spread @ slope) / DEG_PER_RAD
        value = (k + rise * moment) / DEG_PER_RAD
        assert row["unit"] == "N m/deg"
        assert row["value"] == pytest.approx(value, rel=1e-3)  # the law is rounded at rest
        assert row["high"] - row["value"] == pytest.approx(away, rel=2e-3)
        assert row["value"] - row["low"] == pytest.approx(away, rel=2e-3)


def test_a_mean_over_specimens_has_what_its_specimens_share() -> None:
    found = read(STIFFENING, "stiffening")
    joint = fits(STIFFENING, "stiffening")[1].models["a"].joints[0]
    mean = found["with_effects", "*", joint, "stiffness_at_plus"]
    own = [found["with_effects", name, joint, "stiffness_at_plus"] for name in ("a", "b")]
    assert mean["specimens"] == 2
    assert mean["value"] == pytest.approx(np.mean([row["value"] for row in own]))
    half = [row["high"] - row["value"] for row in own]
    assert np.hypot(*half) / 2.0 < mean["high"] - mean["value"] <= sum(half) / 2.0


def test_the_base_beside_it_has_one_stiffness() -> None:
    found = read(STIFFENING, "stiffening")
    of_base = [row for key, row in found.items() if key[:2] == ("base", "a")]
    assert {row["number"] for row in of_base} == {
        *("stiffness_at_zero", "stiffness_at_minus", "stiffness_at_plus"),
        *("motion_at_minus", "motion_at_plus"),
    }
    slopes = [row["value"] for row in of_base if row["number"].startswith("stiffness")]
    assert np.ptp(slopes) < 1e-9


def test_sides_of_an_asymmetry_are_told_apart() -> None:
    found = read(ASYMMETRY, "sides")
    joint = fits(ASYMMETRY, "sides")[1].models["a"].joints[0]
    plus, minus = (
        found["with_effects", "*", joint, f"stiffness_at_{side}"]["value"]
        for side in ("plus", "minus")
    )
    assert (plus - minus) / (plus + minus) == pytest.approx(0.3, abs=0.03)


def test_nothing_is_told_of_a_side_that_no_test_loads() -> None:
    numbers = {key[3] for key in read(STIFFENING, "stiffening", low=-0.1)}
    assert {"stiffness_at_zero", "stiffness_at_plus"} <= numbers
    assert not any(name.endswith("minus") or name == "zone" for name in numbers)


def test_smaller_loads_are_told_as_they_are() -> None:
    found = read(STIFFENING, "stiffening", low=-2.5, high=2.5)
    assert {row["load"] for row in found.values()} == {2.5}


def test_a_law_that_leaves_the_curve_as_it_is_has_no_numbers() -> None:
    base, fit = fits(COUPLING, "stiffening")
    tested = loads(fit, -6.0, 6.0)
    tested |= {(joint, "right_bending"): reach for (joint, _), reach in tested.items()}
    assert field_number_rows(base, fit, [COUPLING], tested) == []


def test_loads_are_those_listed_or_measured_on_a_rig() -> None:
    rows = [
        {"joint": "L4L5", "coordinate": "extension", "unit": "deg", "load": 5.0, "measured": 9.0},
        {"joint": "L4L5", "coordinate": "anterior", "unit": "N", "load": 0.0, "measured": -80.0},
    ]
    assert reaches(rows) == {
        ("L4L5", "extension"): LoadRange(0.0, 5.0),
        ("L4L5", "anterior"): LoadRange(-80.0, 0.0),
    }


def test_units_are_those_of_the_field() -> None:
    assert unit_of("stiffness_at_zero", "extension") == ("N m/deg", 1.0 / DEG_PER_RAD)
    assert unit_of("stiffness_at_plus", "anterior") == ("N/mm", 1e-3)
    assert unit_of("loop_area", "extension") == ("N m deg", DEG_PER_RAD)
    assert unit_of("loop_area", "anterior") == ("J", 1.0)
    assert unit_of("drift_per_decade", "right") == ("1", 1.0)
