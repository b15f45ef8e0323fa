"""The model file: effects by name with scope and values, refused when anything in it is off.

Catches a model file that is accepted though it is wrong, or written otherwise than read.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from example_effects import CubicStiffening, FollowerLoad, JointCentreOffset
from sweeps import sweep

from spinepipe.effects import register, registry
from spinepipe.model.file import ModelFile, effects_for, read_model, write_model
from spinepipe.problems import InputError

JOINTS = ("L3L4", "L2L3", "L1L2")

TEXT = """\
model: for a test
cohort: small
effects:
- effect: linear_bushing
  values:
  - {extension_nm_per_rad: 40.0}
  - {joint: L2L3, extension_nm_per_rad: 35.5}
  - {specimen: b, extension_nm_per_rad: 80.25}
- effect: cubic_for_a_test
  options: {coordinate: left_rotation}
  scope: {specimens: [a], joints: [L1L2, L3L4], tests: [twist]}
  values:
  - {rise: 1234.5}
- effect: centre_for_a_test
- effect: follower_for_a_test
  options: {body: 2, point: [0.0, 0.1, 0.0]}
"""


@pytest.fixture(autouse=True)
def own_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    """A copy of the registry with three test effects."""
    monkeypatch.setattr(registry, "_CLASSES", dict(registry._CLASSES))
    register("cubic_for_a_test")(CubicStiffening)
    register("centre_for_a_test")(JointCentreOffset)
    register("follower_for_a_test")(FollowerLoad)


def read(folder: Path, text: str = TEXT) -> ModelFile:
    path = folder / "model.yaml"
    path.write_text(text, encoding="utf-8")
    return read_model(path)


def refusal(folder: Path, old: str, new: str) -> str:
    """What is said of the file with one change."""
    assert old in TEXT
    with pytest.raises(InputError) as caught:
        read(folder, TEXT.replace(old, new))
    return str(caught.value)


def test_effects_come_with_their_options_scope_and_values(tmp_path: Path) -> None:
    springs, cubic, centre, follower = effects_for(read(tmp_path), "a", JOINTS)
    assert springs.joints == (0, 1, 2)
    np.testing.assert_array_equal(springs.values[:, 3], [40.0, 35.5, 40.0])
    assert cubic.effect == CubicStiffening("left_rotation")
    assert (cubic.joints, cubic.tests) == ((0, 2), ("twist",))
    np.testing.assert_array_equal(cubic.values, [[1234.5], [1234.5]])
    assert cubic.in_scope("twist")
    assert not cubic.in_scope("flexion")
    np.testing.assert_array_equal(centre.values, np.zeros((3, 2)))
    np.testing.assert_array_equal(follower.values, [[60.0]])


def test_the_last_row_that_fits_counts_and_scope_leaves_specimens_out(tmp_path: Path) -> None:
    springs, *others = effects_for(read(tmp_path), "b", JOINTS)
    np.testing.assert_array_equal(springs.values[:, 3], [80.25] * 3)
    assert [scope.effect.name for scope in others] == ["joint_centre_offset", "follower_load"]


def test_a_written_file_reads_back_the_same(tmp_path: Path) -> None:
    model = read(tmp_path)
    exact = model.model_dump()
    exact["effects"][1]["values"] = [{"specimen": "*", "joint": "*", "rise": 0.1 + 1e3 / 3.0}]
    model = ModelFile.model_validate(exact)
    write_model(model, tmp_path / "again.yaml")
    assert read_model(tmp_path / "again.yaml") == model
    assert sorted(p.name for p in tmp_path.iterdir()) == ["again.yaml", "model.yaml"]


@sweep(
    "old, new, expected",
    [
        ("rise: 1234.5", "rise: 1.0e+7", r"effects\.1\.values\.rise.*allowed: 1 to 1e\+06"),
        ("rise: 1234.5", "rise: 0.5", r"found 0\.5; allowed: 1 to"),
        ("rise: 1234.5", "rise: .nan", "found nan"),
        ("rise: 1234.5", "rise: much", "found 'much'"),
        ("rise: 1234.5", "rice: 1.0", r"effects\.1\.values\.rice.*allowed: rise"),
        ("coordinate: left", "direction: left", r"no option 'direction'.*coordinate"),
        ("effect: cubic_for", "effect: cubical_for", r"unknown effect 'cubical_for.*linear_b"),
        ("tests: [twist]", "tests: [twist, twist]", r"scope\.tests.*'twist' stands there twice"),
        ("tests: [twist]", "trials: [twist]", r"effects\.1\.scope\.trials"),
        ("cohort: small", "cohort: [small]", "cohort.*string"),
        ("model: for a test", "model: [", "YAML"),
        ("model: for a test", "model: fоr a test", "model: found .*CYRILLIC|alphabet"),
        ("model: for a test", "model: <b>test</b>", "model: found .*; allowed: at most"),
        ("cohort: small\n", "", "cohort: found nothing: the key is missing"),
    ],
)
def test_bad_files_are_refused_with_place_and_remedy(tmp_path, old, new, expected) -> None:
    said = refusal(tmp_path, old, new)
    assert "model.yaml" in said
    assert re.search(expected, said), said


def test_all_problems_are_told_at_once(tmp_path: Path) -> None:
    text = TEXT.replace("1234.5", "-1.0").replace("35.5", "0.0").replace("80.25", "-2.0")
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert len(caught.value.problems) == 3


def test_a_missing_file_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.yaml"):
        read_model(tmp_path / "nowhere.yaml")


@sweep("old, new", [("joints: [L1L2, L3L4]", "joints: [L9L9]"), ("joint: L2L3", "joint: L9L9")])
def test_a_joint_that_does_not_exist_is_refused(tmp_path, old, new) -> None:
    model = read(tmp_path, TEXT.replace(old, new))
    with pytest.raises((InputError, ValueError), match="L9L9"):
        effects_for(model, "a", JOINTS)


def test_an_option_left_out_that_the_effect_needs_is_an_input_error(tmp_path: Path) -> None:
    refusal(tmp_path, "options: {body: 2, point: [0.0, 0.1, 0.0]}", "options: {body: 2}")
