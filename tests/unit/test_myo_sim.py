"""The trunk of the package myo-sim: counted, symmetric, of a sane size, or a clear refusal.

Catches a trunk that lost muscles or symmetry when the package's files are read.
"""

from collections import Counter
from importlib.metadata import PackageNotFoundError

import numpy as np
import pytest

from spinepipe.muscles import myo_sim
from spinepipe.muscles.myo_sim import NoSource, origin_of_myo_sim, source_of_myo_sim
from spinepipe.muscles.trunk import BODIES, LEVELS, SLICES, THORAX

MIRROR = np.array([1.0, 1.0, -1.0])

FASCICLES_A_SIDE = {
    "psoas": 11,
    "rectus_abdominis": 1,
    "iliocostalis_lumborum": 4,
    "iliocostalis_thoracis": 8,
    "longissimus_thoracis": 21,
    "longissimus_lumborum": 5,
    "quadratus_lumborum": 18,
    "multifidus": 37,  # 25 of the source, 12 repeated for T12 to T8
    "external_oblique": 6,
    "internal_oblique": 6,
}


@pytest.fixture(scope="module")
def source():
    return source_of_myo_sim()


@pytest.fixture(scope="module")
def trunk(source):
    return source.trunk


def test_every_fascicle_is_in_its_group(trunk) -> None:
    muscles = trunk.muscles
    assert len(muscles) == 234
    assert len(set(muscles.names)) == 234
    for side in ("right", "left"):
        of = Counter(g for g, s in zip(muscles.groups, muscles.sides, strict=True) if s == side)
        assert of == FASCICLES_A_SIDE


def test_points_on_the_thorax_are_shared_between_t12_and_t11(trunk) -> None:
    """14 insertions a side are named for T12 or rib 12; all other points of the source go up."""
    muscles = trunk.muscles
    muscles = muscles.of(np.array(["_at_" not in name for name in muscles.names]))
    on_t12 = muscles.body == BODIES.index("T12")
    assert on_t12.sum() == 28
    assert (muscles.body == THORAX).sum() == 156
    named = [name[:-2] for name, on in zip(muscles.names, on_t12, strict=True) if on.any()]
    assert Counter(named) == dict.fromkeys(
        [
            *("LTpT_T12", "LTpT_R12", "IL_R12"),
            *("QL_mid_L3-12.1", "QL_mid_L3-12.2", "QL_mid_L3-12.3"),
            *("QL_mid_L2-12.1", "QL_mid_L4-12.3", "QL_ant_I.2-T12", "QL_ant_I.3-T12"),
            *("QL_ant_I.2-12.1", "QL_ant_I.3-12.1", "QL_ant_I.3-12.2", "QL_ant_I.3-12.3"),
        ],
        2,
    )


def test_via_points_of_the_back_on_the_thorax_lie_above_t11t12(trunk) -> None:
    """So that none of them belongs to T12."""
    muscles = trunk.muscles
    last = (muscles.body >= 0).sum(axis=1) - 1
    via = (muscles.body == THORAX) & (np.arange(muscles.body.shape[1]) != last[:, None])
    via &= muscles.wraps[:, None]
    assert via.sum() == 70
    assert muscles.point[via][:, 1].min() > trunk.joints[LEVELS.index("T11T12"), 1]


def test_left_is_the_mirror_of_right_within_a_millimetre(trunk) -> None:
    muscles = trunk.muscles
    at = {name: k for k, name in enumerate(muscles.names)}
    right = [k for name, k in at.items() if name.endswith("_r")]
    left = [at[f"{muscles.names[k][:-2]}_l"] for k in right]
    np.testing.assert_array_equal(muscles.body[right], muscles.body[left])
    off = np.abs(muscles.point[right] - muscles.point[left] * MIRROR)
    print(f"largest asymmetry {1e3 * off.max():.4f} mm")
    assert off.max() < 1e-3
    np.testing.assert_allclose(muscles.pcsa[right], muscles.pcsa[left], rtol=1e-12)
    np.testing.assert_array_equal(trunk.shoulders[0], trunk.shoulders[1] * MIRROR)
    np.testing.assert_allclose(trunk.sheath[0], trunk.sheath[1] * MIRROR, atol=1e-3)


def test_muscles_on_the_wrong_side_are_mirrored_and_named(source) -> None:
    assert "rect_abd_r, rect_abd_l, LTpT_T12_l" in source.remarks[0]
    muscles = source.trunk.muscles
    outwards = np.where(np.array(muscles.sides) == "right", 1.0, -1.0)
    assert (muscles.point[:, :, 2].sum(axis=1) * outwards).min() > 0.0


def test_obliques_that_end_on_the_abdomen_hang_in_the_sheath(trunk) -> None:
    muscles = trunk.muscles
    hang = [name for name, is_so in zip(muscles.names, muscles.in_sheath, strict=True) if is_so]
    expected = [f"{name}_{side}" for name in ("EO1", "EO2", "EO3", "EO4") for side in "rl"]
    expected += [f"{name}_{side}" for name in ("IO1", "IO2", "IO3") for side in "rl"]
    assert sorted(hang) == sorted(expected)
    paths = muscles.of(muscles.in_sheath)
    assert ((paths.body >= 0).sum(axis=1) == 2).all()
    for name, body in zip(paths.names, paths.body, strict=True):
        assert tuple(body[:2]) == ((THORAX if name.startswith("EO") else 0), THORAX)


def test_cross_sections_are_forces_over_the_sources_stress(trunk) -> None:
    """Two forces of the file, entered here again: 102.673 N and 296.84 N at 46 N/cm2."""
    found = dict(zip(trunk.muscles.names, trunk.muscles.pcsa, strict=True))
    assert found["Ps_L1_VB_r"] == pytest.approx(102.673 / 46.0 * 1e-4)
    assert found["rect_abd_l"] == pytest.approx(296.8 / 46.0 * 1e-4, rel=1e-3)


def test_fibre_lengths_are_not_taken(source) -> None:
    assert not source.trunk.muscles.fibre.any()
    assert "142 of 210" in source.remarks[2]


def test_multifidus_goes_on_to_t11_with_as_much_of_it_as_at_l1(trunk) -> None:
    """830 mm2 repeated: twice what ends on L1 in the source, both sides."""
    muscles = trunk.muscles
    of = {
        top: sum(
            area
            for name, area in zip(muscles.names, muscles.pcsa, strict=True)
            if name.startswith("MF_m1") and (f"_at_{top}_" in name if top else "_at_" not in name)
        )
        for top in ("", "T12", "T11")
    }
    assert of["T12"] == pytest.approx(of[""], rel=1e-12)
    assert of["T11"] == pytest.approx(of[""], rel=1e-12)
    assert 2e6 * of[""] == pytest.approx(830.0, abs=0.5)


def test_global_extensors_mostly_have_lumbar_via_points(trunk) -> None:
    """So that wrapping has little left to do: all but 6 of 58 are held by the source's points."""
    muscles = trunk.muscles
    held = 0
    for body in muscles.body[muscles.wraps]:
        inner = body[body >= 0][1:-1]
        held += bool(((inner >= 1) & (inner <= 5)).any())
    assert (int(muscles.wraps.sum()), held) == (58, 52)


def test_the_spine_is_where_and_as_tilted_as_one_would_think(trunk) -> None:
    """Places of joints below L4, T12 and T11, from the file's offsets added by hand."""
    np.testing.assert_array_equal(trunk.joints[0], 0.0)
    np.testing.assert_allclose(trunk.joints[1], [0.009, 0.0321, 0.0], atol=1e-12)
    np.testing.assert_allclose(trunk.joints[5], [-0.022, 0.1592, 0.0], atol=1e-12)
    np.testing.assert_allclose(trunk.joints[6], [-0.038, 0.1862, 0.0], atol=1e-12)
    # in an upright man L5S1 leans forwards, the thoracolumbar discs backwards, and steadily between
    tilt = np.degrees(trunk.disc_tilt)
    np.testing.assert_allclose(tilt, [-15.7, -8.3, 4.9, 16.2, 22.9, 27.4, 24.2], atol=0.06)


def test_what_the_slices_the_head_and_the_arms_hang_on(trunk) -> None:
    assert trunk.vertebrae.shape == (len(SLICES), 3)
    assert (np.diff(trunk.vertebrae[:, 1]) < 0.0).all()
    l5 = trunk.vertebrae[SLICES.index("L5")]
    np.testing.assert_allclose(l5, trunk.joints[:2].mean(axis=0), atol=1e-12)
    t1 = trunk.vertebrae[0]
    assert 0.10 < trunk.head[1] - t1[1] < 0.18
    assert 0.15 < trunk.shoulders[0, 2] < 0.20
    assert abs(trunk.shoulders[0, 1] - t1[1]) < 0.05
    assert 0.55 < trunk.arm_length < 0.70


def test_head_and_arms_are_where_the_file_s_offsets_have_them(trunk) -> None:
    """Added by hand. The skull's ellipsoid ends 0.5 + 0.075 + 0.1 m above where the head is joined;
    its centre of mass lies midway from there to the joint above T1."""
    torso = np.array([-0.006, 0.0402, 0.0])
    neck = torso + np.array([-0.005 - 0.01134, 0.395, 0.0])
    vertex = torso + np.array([-0.005, -0.01 + 0.5 + 0.075 + 0.1, 0.0])
    np.testing.assert_allclose(trunk.head, (neck + vertex) / 2.0, atol=1e-12)
    clavicle = [0.022335, 0.41713, 0.025465]
    shoulder = np.add(clavicle, [-0.01433 - 0.00955, 0.02007 - 0.034, 0.1355 + 0.009])
    np.testing.assert_allclose(trunk.shoulders[0], shoulder, atol=1e-12)
    upper = np.linalg.norm([0.0061, -0.2904, -0.0123])
    lower = np.linalg.norm([0.0004 + 0.018, -0.0115 - 0.242, 0.02 + 0.025])
    palm = np.linalg.norm([0.003992 + 0.000477, -0.015054 - 0.039239, 0.002327 + 0.007377])
    assert trunk.arm_length == pytest.approx(upper + lower + palm, rel=1e-9)


def test_the_mark_holds_the_digest_of_the_files() -> None:
    origin = origin_of_myo_sim()
    assert (origin.name, origin.version) == ("myo-sim", "0.2.4")
    # the digest of the files that all figures above were read from
    assert origin.sha256 == "8c531184dc4799943c05538e1513b3ef2c08f5dbeb34e2ec61ee28c07d41197f"


def test_an_absent_package_is_told_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> None:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(myo_sim, "distribution", absent)
    with pytest.raises(NoSource, match=r"not installed.*pip install --no-deps myo-sim==0\.2\.4"):
        source_of_myo_sim()


def test_another_version_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    class Other:
        version = "0.3.0"

    monkeypatch.setattr(myo_sim, "distribution", lambda _: Other)
    with pytest.raises(NoSource, match=r"version 0\.3\.0.*version 0\.2\.4"):
        origin_of_myo_sim()


def test_missing_files_are_named(monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:
    class Hollow:
        version = "0.2.4"

        @staticmethod
        def locate_file(path: str):
            return tmp_path / path

    monkeypatch.setattr(myo_sim, "distribution", lambda _: Hollow)
    with pytest.raises(NoSource, match=r"myotorso_chain\.xml"):
        origin_of_myo_sim()
