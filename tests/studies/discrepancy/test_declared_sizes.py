"""Sizes that studies declare, in SI: of imperfections, and of the noise of one reading."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spinepipe.studies.discrepancy.search import investigation
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors, as_si
from spinepipe.studies.discrepancy.settings import Nuisance


def test_imperfections_are_as_large_as_a_study_has_them_that_says_nothing() -> None:
    """Two mm; two degrees of posture, one of all else; 2 % of loads and of stiffness."""
    usual = as_si(Nuisance().model_dump())
    assert vars(usual) == pytest.approx(vars(NuisancePriors()))
    assert usual.joint_centre == pytest.approx(0.002)
    assert np.rad2deg(usual.posture) == pytest.approx(2.0)
    one_degree = (usual.law_axes, usual.registration, usual.load_axis)
    assert np.rad2deg(one_degree) == pytest.approx([1.0] * 3)
    assert (usual.load_gain, usual.off_diagonal, usual.rotation_order) == (0.02, 0.02, 0.5)


def test_each_size_is_told_by_its_own_name() -> None:
    names = list(Nuisance.model_fields)
    for name in names:
        found = vars(as_si(dict.fromkeys(names, 0.0) | {name: 3.0}))
        (field,) = [one for one, size in found.items() if size != 0.0]
        assert name.startswith(field)
        unit = {"mm": 0.003, "deg": np.deg2rad(3.0)}.get(name.removeprefix(f"{field}_"), 3.0)
        assert found[field] == pytest.approx(unit)


def test_a_study_says_before_its_cohort_how_large_the_noise_is() -> None:
    """0.5 mm and 0.2 deg, translations first."""
    own = SimpleNamespace(translation_mm=0.5, rotation_deg=0.2)
    other = SimpleNamespace(translation_mm=9.0, rotation_deg=9.0)

    def declared(study: Any, cohort: Any) -> Any:
        return investigation._declared_sd(
            SimpleNamespace(measurement_sd=study),  # type: ignore[arg-type]
            SimpleNamespace(measurement_sd=cohort),  # type: ignore[arg-type]
        )

    expected = [5e-4] * 3 + [np.deg2rad(0.2)] * 3
    assert declared(own, other) == pytest.approx(expected)
    assert declared(None, own) == pytest.approx(expected)
    assert declared(None, None) is None
