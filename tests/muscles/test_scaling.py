"""Scaling: the reference person changes nothing, ratios are exact, points move off the spine."""

from dataclasses import fields, replace
from math import exp
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from trunk_to_scale import made_up_trunk

from spinepipe.muscles.regressions import PACKAGED, Regressions, packaged, read_regressions
from spinepipe.muscles.scaling import (
    ScaleFactors,
    applied_ratios,
    beam_ratios,
    line_of_vertebrae,
    nearest_vertebra,
    scale_trunk,
    t11t12_over_t12l1,
)
from spinepipe.muscles.subject import REFERENCE, Subject
from spinepipe.muscles.trunk import NO_BODY, SLICES, Trunk
from spinepipe.problems import InputError

EXACT = 1e-15
"""Lengths are below 1 m, so this is a few units in the last place."""

TALL = replace(REFERENCE, height_m=1.25 * REFERENCE.height_m)
"""A ratio of heights without rounding."""

HEADER = "muscle,level,quantity,form,intercept,sex,age,height,weight,source\n"
STILL = "".join(
    f"*,*,{quantity},linear,7,0,0,0,0,made up\n"
    for quantity in ("ap_distance", "ml_distance", "pcsa", "rib_cage_area")
)
"""Regressions that give everybody the same."""

NO_RIBS = "".join(line for line in STILL.splitlines(keepends=True) if "rib_cage" not in line)


def table(tmp_path: Path, *rows: str, base: str = STILL) -> Regressions:
    path = tmp_path / "regressions.csv"
    path.write_text(HEADER + base + "".join(f"{row},made up\n" for row in rows))
    return read_regressions(path, path.name)


def arrays(trunk: Trunk) -> dict[str, np.ndarray]:
    of_trunk = {f.name: getattr(trunk, f.name) for f in fields(trunk)}
    of_muscles = {f.name: getattr(trunk.muscles, f.name) for f in fields(trunk.muscles)}
    return {k: np.asarray(v) for k, v in (of_trunk | of_muscles).items() if k != "muscles"}


@pytest.mark.parametrize("name", PACKAGED)
def test_the_reference_person_has_the_reference_trunk_to_the_last_bit(name: str) -> None:
    trunk = made_up_trunk()
    found = arrays(scale_trunk(trunk, REFERENCE, REFERENCE, packaged(name)))
    assert all(np.array_equal(found[k], value) for k, value in arrays(trunk).items())


def test_bones_discs_head_arms_and_fibres_grow_with_height(tmp_path: Path) -> None:
    trunk = made_up_trunk()
    found = scale_trunk(trunk, TALL, REFERENCE, table(tmp_path))
    for name in ("joints", "disc_height", "vertebrae", "head", "shoulders", "arm_length"):
        np.testing.assert_allclose(
            getattr(found, name), 1.25 * np.asarray(getattr(trunk, name)), rtol=EXACT, atol=0
        )
    np.testing.assert_array_equal(found.muscles.fibre, 1.25 * trunk.muscles.fibre)
    np.testing.assert_array_equal(found.disc_tilt, trunk.disc_tilt)
    np.testing.assert_array_equal(found.disc_area, trunk.disc_area)
    np.testing.assert_array_equal(found.muscles.pcsa, trunk.muscles.pcsa)


def test_muscle_points_rise_with_height_and_keep_their_distance_from_the_vertebrae(
    tmp_path: Path,
) -> None:
    trunk = made_up_trunk()
    found = scale_trunk(trunk, TALL, REFERENCE, table(tmp_path))
    real = trunk.muscles.body != NO_BODY
    before, after = trunk.muscles.point[real], found.muscles.point[real]
    np.testing.assert_allclose(after[:, 1], 1.25 * before[:, 1], rtol=0, atol=EXACT)
    np.testing.assert_allclose(
        (after - line_of_vertebrae(found, after[:, 1]))[:, [0, 2]],
        (before - line_of_vertebrae(trunk, before[:, 1]))[:, [0, 2]],
        rtol=0,
        atol=EXACT,
    )
    assert not found.muscles.point[~real].any(), "past the end of a path"


def test_each_direction_follows_its_own_regression_of_that_muscle_at_that_level(
    tmp_path: Path,
) -> None:
    trunk = made_up_trunk()
    known = table(
        tmp_path,
        "longissimus,T12,ap_distance,linear,0,0,0,0,2",
        "longissimus,*,ml_distance,power,0,0,0,0,2",
        "*,T12,ap_distance,linear,0,0,1,0,0",
    )
    heavy = replace(REFERENCE, mass_kg=1.5 * REFERENCE.mass_kg)
    found = scale_trunk(trunk, heavy, REFERENCE, known)
    at = trunk.muscles.names.index("longissimus_r")
    before, after = trunk.muscles.point[at], found.muscles.point[at]
    line = line_of_vertebrae(trunk, before[:, 1])
    level = [[*SLICES, "S1"][k] for k in nearest_vertebra(trunk, before[:, 1])]
    assert level.count("T12") == 1
    ahead = [1.5 if name == "T12" else 1.0 for name in level]
    np.testing.assert_allclose(after[:, 0] - line[:, 0], ahead * (before - line)[:, 0], atol=EXACT)
    np.testing.assert_allclose(after[:, 2] - line[:, 2], 2.25 * (before - line)[:, 2], atol=EXACT)
    others = np.arange(5) != at
    np.testing.assert_array_equal(found.muscles.point[others], trunk.muscles.point[others])


def test_cross_sections_follow_their_muscle_and_stated_factors_come_on_top(
    tmp_path: Path,
) -> None:
    trunk = made_up_trunk()
    known = table(tmp_path, "rectus_abdominis,*,pcsa,exponential,3,0,-0.01,0,0")
    old = replace(REFERENCE, age_years=REFERENCE.age_years + 10.0)
    factors = ScaleFactors(pcsa_times=2.0, disc_area_times=1.5)
    found = scale_trunk(trunk, old, REFERENCE, known, factors)
    expected = 2.0 * np.array([1, 1, exp(-0.1), 1, 1]) * trunk.muscles.pcsa
    np.testing.assert_allclose(found.muscles.pcsa, expected, rtol=1e-14)
    np.testing.assert_array_equal(found.disc_area, 1.5 * trunk.disc_area)


def test_a_cross_section_follows_the_vertebra_nearest_to_its_middle(tmp_path: Path) -> None:
    """Half way up multifidus is 40 mm, at L5; longissimus 160 mm, L1; obliques 200 mm, T11."""
    trunk = made_up_trunk()
    heavy = replace(REFERENCE, mass_kg=1.5 * REFERENCE.mass_kg)
    rows = [f"*,{level},pcsa,power,0,0,0,0,{k}" for k, level in ((1, "L5"), (2, "L1"), (3, "T11"))]
    found = scale_trunk(trunk, heavy, REFERENCE, table(tmp_path, *rows))
    times = dict(zip(trunk.muscles.names, found.muscles.pcsa / trunk.muscles.pcsa, strict=True))
    expected = {"multifidus_r": 1.5, "longissimus_r": 1.5**2, "oblique_r": 1.5**3}
    assert {name: times[name] for name in expected} == pytest.approx(expected)


def test_what_ends_in_the_rectus_sheath_moves_with_the_sheath(tmp_path: Path) -> None:
    trunk = made_up_trunk()
    sheath = trunk.sheath.copy()
    sheath[0, 1] = trunk.muscles.point[3, 1]
    known = table(
        tmp_path,
        "rectus_abdominis,*,ap_distance,power,0,0,0,0,1",
        "external_oblique,*,ap_distance,power,0,0,0,0,3",
    )
    heavy = replace(REFERENCE, mass_kg=1.2 * REFERENCE.mass_kg)
    found = scale_trunk(replace(trunk, sheath=sheath), heavy, REFERENCE, known)
    np.testing.assert_array_equal(found.muscles.point[3, 1], found.sheath[0, 1])
    assert found.muscles.point[3, 0, 0] != trunk.muscles.point[3, 0, 0]


def test_a_mirrored_trunk_scales_to_the_mirrored_trunk() -> None:
    mirror = np.array([1.0, 1.0, -1.0])
    trunk = made_up_trunk()
    trunk = replace(trunk, vertebrae=trunk.vertebrae * [1, 1, 0], joints=trunk.joints * [1, 1, 0])
    other = replace(trunk, muscles=replace(trunk.muscles, point=mirror * trunk.muscles.point))
    woman = Subject("female", 60.0, 1.62, 80.0)
    found, mirrored = (
        scale_trunk(t, woman, REFERENCE, packaged()).muscles.point for t in (trunk, other)
    )
    np.testing.assert_array_equal(mirrored, mirror * found)


def test_every_ratio_that_is_used_is_told(tmp_path: Path) -> None:
    trunk = made_up_trunk()
    known = table(
        tmp_path,
        "multifidus,*,pcsa,linear,0,0,0,0,1",
        "psoas,*,pcsa,linear,0,0,0,0,3",
        "*,*,rib_cage_area,linear,0,0,0,0,1",
        base=NO_RIBS,
    )
    heavy = Subject("male", 41.8, 1.25 * 1.730, 1.5 * 75.1)
    found = {(r.quantity, r.of): r.ratio for r in applied_ratios(trunk, heavy, REFERENCE, known)}
    assert found == {
        ("lengths and disc heights", "all"): pytest.approx(1.25),
        ("ap_distance", "all"): 1.0,
        ("ml_distance", "all"): 1.0,
        ("pcsa", "all"): 1.0,
        ("pcsa", "multifidus"): pytest.approx(1.5),
        ("disc_area", "all"): pytest.approx(1.5),
        ("axial_stiffness", "all"): pytest.approx(1.2),
        ("angular_stiffness", "all"): pytest.approx(1.8),
    }


def test_joints_are_beams(tmp_path: Path) -> None:
    known = table(tmp_path, "*,*,rib_cage_area,power,0,0,0,0,1", base=NO_RIBS)
    other = Subject("male", 41.8, 2 * 1.730, 3 * 75.1)
    found = beam_ratios(other, REFERENCE, known)
    assert (found.area, found.height) == (pytest.approx(3.0), pytest.approx(2.0))
    assert (found.axial, found.angular) == (pytest.approx(1.5), pytest.approx(4.5))


def test_t11t12_is_t12l1_by_area_and_height_and_stiffer_in_bending_alone() -> None:
    trunk = made_up_trunk()
    trunk = replace(
        trunk,
        disc_area=np.array([9, 9, 9, 9, 9, 4, 3]) * 1e-4,
        disc_height=np.array([9, 9, 9, 9, 9, 8, 5]) * 1e-3,
    )
    found = t11t12_over_t12l1(trunk)
    assert found.axial == pytest.approx(0.75 / 0.625)
    assert found.torsion == pytest.approx(0.5625 / 0.625)
    assert found.angular == pytest.approx(1.2 * 0.5625 / 0.625)
    assert t11t12_over_t12l1(trunk, 1.0).angular == found.torsion


def test_packaged_trends_are_the_published_ones() -> None:
    """Entered again: per cent per kg, cm, year; men 26 % more at the same size; rib cage, cm2."""
    known = packaged("ct_trends")
    per_kg = replace(REFERENCE, mass_kg=REFERENCE.mass_kg + 1.0)
    per_cm = replace(REFERENCE, height_m=REFERENCE.height_m + 0.01)
    per_year = replace(REFERENCE, age_years=REFERENCE.age_years + 1.0)
    woman = replace(REFERENCE, sex="female")
    rounded = pytest.approx
    for quantity, changes in {
        "ap_distance": (0.3, 0.1, 0.0),
        "ml_distance": (0.3, 0.1, 0.0),
        "pcsa": (0.8, -0.05, -0.8),
    }.items():
        row = known.row(quantity)
        found = [100 * (row.ratio(s, REFERENCE) - 1) for s in (per_kg, per_cm, per_year)]
        assert found == rounded(changes, abs=0.004)
    men_over_women = np.sqrt(39.4 / 31.8 * 45.6 / 35.6)
    assert 1 / known.row("pcsa").ratio(woman, REFERENCE) == rounded(men_over_women, abs=1e-4)
    area = known.row("rib_cage_area").value(REFERENCE)
    assert area == rounded(172.698 + 44.2022 + 36.814 - 158.503 + 393.152, abs=0.01)


@pytest.mark.parametrize("sex", ["male", "female"])
def test_each_form_is_what_its_line_says(tmp_path: Path, sex: Literal["male", "female"]) -> None:
    """Five coefficients of which none is nought or one, written out from the module's words."""
    person = Subject(sex, 40.0, 1.60, 70.0)
    male = 1.0 if sex == "male" else 0.0
    written = {
        "linear": 3.0 + 0.5 * male + 0.3 * 40.0 - 0.02 * 160.0 + 0.1 * 70.0,
        "exponential": exp(3.0 + 0.5 * male + 0.3 * 40.0 - 0.02 * 160.0 + 0.1 * 70.0),
        "power": exp(3.0 + 0.5 * male) * 40.0**0.3 * 160.0**-0.02 * 70.0**0.1,
    }
    for form, expected in written.items():
        rows = table(tmp_path, f"psoas,L3,pcsa,{form},3,0.5,0.3,-0.02,0.1")
        assert rows.row("pcsa", "psoas", "L3").value(person) == pytest.approx(expected, rel=1e-13)


def test_the_row_that_names_most_applies_and_a_muscle_before_a_level(tmp_path: Path) -> None:
    places = (("psoas", "L3"), ("psoas", "*"), ("*", "L3"), ("*", "*"))
    known = table(
        tmp_path,
        *(f"{m},{lv},pcsa,linear,{k},0,0,0,0" for k, (m, lv) in enumerate(places[:3], start=1)),
    )
    asked = (("psoas", "L3"), ("psoas", "L4"), ("multifidus", "L3"), ("multifidus", "L4"))
    found = [known.row("pcsa", *one) for one in asked]
    assert [(row.muscle, row.level) for row in found] == list(places)
    told = ["psoas at L3", "psoas", "all at L3", "all"]
    assert [row.of for row in found] == told


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("*,T13,pcsa,linear,1,0,0,0,0", "T13"),
        ("*,L3,psca,linear,1,0,0,0,0", "did you mean 'pcsa'?"),
        ("*,L3,pcsa,cubic,1,0,0,0,0", "cubic"),
        ("*,L3,pcsa,linear,one,0,0,0,0", "'one'"),
        ("*,L3,pcsa,linear,nan,0,0,0,0", "finite"),
        ("*,L3,rib_cage_area,linear,1,0,0,0,0", "rib_cage_area"),
        ("*,*,pcsa,linear,1,0,0,0,0", "the other is line 4"),
        (",*,pcsa,linear,1,0,0,0,0", "muscle"),
    ],
)
def test_a_faulty_row_is_told(tmp_path: Path, row: str, told: str) -> None:
    with pytest.raises(InputError, match=r"regressions\.csv") as caught:
        table(tmp_path, row)
    assert told in str(caught.value)


def test_a_table_without_a_quantity_or_a_column_is_told(tmp_path: Path) -> None:
    without = STILL.replace("*,*,pcsa,linear,7,0,0,0,0,made up\n", "")
    with pytest.raises(InputError, match="no row for pcsa"):
        table(tmp_path, base=without)
    path = tmp_path / "short.csv"
    path.write_text("muscle,level,quantity\n*,*,pcsa\n")
    with pytest.raises(InputError, match="intercept"):
        read_regressions(path, path.name)
    with pytest.raises(InputError, match=r"absent\.csv"):
        read_regressions(tmp_path / "absent.csv", "absent.csv")


def test_a_person_beyond_a_linear_regression_is_told(tmp_path: Path) -> None:
    known = table(tmp_path, "multifidus,*,pcsa,linear,-80,0,0,0,1.1")
    light = replace(REFERENCE, mass_kg=45.0)
    with pytest.raises(ValueError, match=r"pcsa for multifidus is -30\.5 .* 45\.0 kg"):
        scale_trunk(made_up_trunk(), light, REFERENCE, known)


@pytest.mark.parametrize(
    ("sex", "age", "height_cm", "mass_kg", "area_cm2"),
    [("female", 28.769, 164.872, 60.600, 364.225), ("male", 31.668, 177.745, 78.145, 491.031)],
)
def test_the_rib_cage_of_mean_persons_is_the_mean_rib_cage(
    sex: Literal["male", "female"], age: float, height_cm: float, mass_kg: float, area_cm2: float
) -> None:
    """Least squares with sex as predictor runs through both groups' means (Heinz 2003).

    Means are rounded to 0.001 and coefficients to six figures: 0.02 cm2 at most.
    """
    mean = Subject(sex, age, height_cm / 100.0, mass_kg)
    found = packaged("ct_trends").row("rib_cage_area").value(mean)
    assert found == pytest.approx(area_cm2, abs=0.02)
