"""Imperfections of shear tests, in closed form: couplings of what is read, forces off their way."""

from itertools import combinations

import numpy as np
import pytest
import spring_chain_cases as chains
from sweeps import sweep

from spinepipe.effects import Wrench
from spinepipe.model import LoadCase, LoadStep
from spinepipe.studies.discrepancy.search.nuisance import (
    NuisancePriors,
    as_si,
    nuisance_columns,
    nuisance_labels,
    nuisance_signatures,
)
from spinepipe.studies.discrepancy.search.prediction import SolvedSpecimen
from spinepipe.studies.discrepancy.settings import Nuisance
from spinepipe.units import COORDINATES, ROTATIONS, TRANSLATIONS

FORCE = 100.0
STIFFNESS = np.array([[9e4, 5e5, 1e5, 60.0, 70.0, 180.0]])
NONE = dict.fromkeys(
    ("joint_centre", "posture", "law_axes", "registration", "load_axis", "load_gain"), 0.0
) | {"off_diagonal": 0.0, "rotation_order": 0.0}


def shear(force: float = FORCE, moment: float = 0.0) -> LoadCase:
    wrench = Wrench(0, np.zeros(3), np.array([force, 0.0, 0.0]), np.array([0.0, 0.0, moment]))
    return LoadCase("shear", 1, (LoadStep(0, ()), LoadStep(1, (wrench,))))


def solved(case: LoadCase) -> SolvedSpecimen:
    """One joint at the origin with the stiffnesses above, no weight."""
    model = chains.model("a", STIFFNESS[0, 3:], joints=1)
    bushing = model.effects[0]
    return SolvedSpecimen(
        model.with_effects((type(bushing)(bushing.effect, (0,), STIFFNESS),)), [case], False
    )


def moved(priors: NuisancePriors, case: LoadCase, coordinates: tuple[str, ...]) -> np.ndarray:
    """(6, k) motion of the loaded step by one prior SD of each nuisance."""
    return nuisance_signatures(solved(case), priors, coordinates)[0][1, 0]


def test_couplings_of_all_that_is_read_and_of_nothing_else() -> None:
    priors = NuisancePriors(**NONE | {"off_diagonal": 0.02})
    for read in (ROTATIONS, TRANSLATIONS, COORDINATES, ("anterior",), ("extension", "anterior")):
        columns = nuisance_columns(priors, STIFFNESS, [shear()], read)
        pairs = {dict(c.variant.options)["pair"] for c in columns}
        assert pairs == set(combinations([c for c in COORDINATES if c in read], 2))
        assert len(nuisance_labels(priors, STIFFNESS, [shear()], read)) == 2 * len(columns)


def test_a_coupling_of_translations_is_a_share_of_their_stiffnesses() -> None:
    """Superior motion is -c F / (k1 k2), c = 0.02 sqrt(k1 k2); once alone and once shared."""
    found = moved(NuisancePriors(**NONE | {"off_diagonal": 0.02}), shear(), TRANSLATIONS)
    size = -0.02 * FORCE / np.sqrt(STIFFNESS[0, 0] * STIFFNESS[0, 1])
    superior = found[1][np.abs(found[1]) > 0.0]
    np.testing.assert_allclose(superior, [size, size], rtol=1e-9)


def test_a_force_off_its_way_by_a_degree() -> None:
    """About z it pushes up by F tilt, about y it pushes to the left by F tilt."""
    tilt = np.deg2rad(1.0)
    found = moved(NuisancePriors(**NONE | {"load_axis": tilt}), shear(), TRANSLATIONS)
    superior, right = (row[np.abs(row) > 1e-12] for row in found[1:3])
    np.testing.assert_allclose(superior, [FORCE * tilt / STIFFNESS[0, 1]], rtol=1e-9)
    np.testing.assert_allclose(right, [-FORCE * tilt / STIFFNESS[0, 2]], rtol=1e-9)


@sweep("force, count", [(0.0, 2), (FORCE, 5)])
def test_forces_turn_by_themselves_where_there_are_any(force: float, count: int) -> None:
    priors = NuisancePriors(**NONE | {"load_axis": 0.02})
    labels = nuisance_labels(priors, STIFFNESS, [shear(force, 2.0)], ROTATIONS)
    assert len(labels) == count
    assert sum("of forces" in one.component for one in labels) == count - 2
    assert {one.kind for one in labels} == {"load_axis"}


# As large as studies declare


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
