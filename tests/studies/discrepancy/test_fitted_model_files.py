"""Fitted models as files: read back, they move as the fit's own do; values in units of tables."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import spring_chain_cases as chains
from search_cases import JOINTS, Array
from sweeps import sweep

from spinepipe.cohort.specimen import cables
from spinepipe.effects import PlaceSpread
from spinepipe.model import ScopedEffect
from spinepipe.model.file import effects_for, read_model, write_model
from spinepipe.statics import with_parameters
from spinepipe.studies.discrepancy.search.baseline import base_parameters
from spinepipe.studies.discrepancy.search.hypothesis import (
    ActiveTerm,
    CandidateForm,
    Hypothesis,
    HypothesisMember,
    Unknown,
    Variant,
    hypothesis,
)
from spinepipe.studies.discrepancy.search.joint_fit import JointFit
from spinepipe.studies.discrepancy.search.model_files import fitted_values, in_tables, model_file
from spinepipe.studies.discrepancy.search.prediction import Simulated
from spinepipe.units import ROTATIONS

NAMES = ("a", "b")
LAXITY = Variant("local_laxity", ())
ASYMMETRY = Variant("flexion_extension_asymmetry", ())
OFFSET = Variant("load_offset", ())


def fitted(*supposed: ActiveTerm) -> JointFit:
    """Models moved at random from where their fit starts, as if it had ended there."""
    models = {name: chains.model(name, chains.STIFFNESS, JOINTS) for name in NAMES}
    base = {name: base_parameters(model, "per_joint", ROTATIONS) for name, model in models.items()}
    started = hypothesis(models, base, supposed, tuple(chains.AXES), 100.0)
    x = np.random.default_rng(2).uniform(0.01, 0.05, len(started.unknowns))
    ended = {
        name: with_parameters(member.model, member.free, x[list(member.numbers)])
        for name, member in started.members.items()
    }
    bound = np.zeros(len(x), dtype=bool)
    return JointFit(started, x, ended, 1.0, {}, {}, {}, {}, bound, "")


def motion(model: object) -> Array:
    """(T, J, 6) of all tests behind one another."""
    simulated = Simulated(model, chains.cases(joints=JOINTS), False, ())  # type: ignore[arg-type]
    return np.concatenate(simulated.at(np.zeros(0)).readings)


def one(variant: Variant, spread: PlaceSpread, *place: object) -> ActiveTerm:
    start = variant.off((0.0,) * len(variant.shapes))
    return ActiveTerm(CandidateForm(variant, spread, *place), start)  # type: ignore[arg-type]


SUPPOSED = {
    "nothing": (),
    "shared": (one(ASYMMETRY, PlaceSpread.SHARED),),
    "by specimen": (one(ASYMMETRY, PlaceSpread.BY_SPECIMEN),),
    "by joint": (one(ASYMMETRY, PlaceSpread.BY_JOINT),),
    "each": (one(ASYMMETRY, PlaceSpread.EACH),),
    "one joint": (one(ASYMMETRY, PlaceSpread.ONE_JOINT, 1),),
    "one joint of the first": (one(LAXITY, PlaceSpread.ONE, 1, "a"),),
    "one joint of the last": (one(LAXITY, PlaceSpread.ONE, 2, "b"),),
    "by test": (one(OFFSET, PlaceSpread.BY_TEST),),
    "shared load": (one(OFFSET, PlaceSpread.SHARED),),
    "several": (
        one(LAXITY, PlaceSpread.ONE, 0, "b"),
        one(OFFSET, PlaceSpread.BY_TEST),
        one(OFFSET, PlaceSpread.SHARED),
        one(LAXITY, PlaceSpread.ONE, 1, "a"),
        one(Variant("facet_contact", ()), PlaceSpread.EACH),
    ),
}


@sweep("name", SUPPOSED)
def test_files_read_back_move_as_the_fit_does(name: str, tmp_path: Path) -> None:
    fit = fitted(*SUPPOSED[name])
    write_model(model_file(fit, "m", "chains"), tmp_path / "model.yaml")
    file = read_model(tmp_path / "model.yaml")
    for specimen in NAMES:
        model = fit.models[specimen]
        again = model.with_effects(effects_for(file, specimen, model.joints))
        np.testing.assert_array_equal(motion(again), motion(model))
        acting = any(one.form.acts_in(specimen) for one in SUPPOSED[name])
        away = motion(model) - motion(model.with_effects(model.effects[:1]))
        assert (np.abs(away[..., 3:]).max() > 1e-4) == acting


def test_a_base_may_have_an_effect_in_one_specimen_alone(tmp_path: Path) -> None:
    fit = fitted(one(OFFSET, PlaceSpread.SHARED))
    model = fit.models["b"]
    lax = ScopedEffect(LAXITY.create(), (1,), np.array([[0.4]]))
    bushing, *behind = model.effects
    models = {**fit.models, "b": model.with_effects((bushing, lax, *behind))}
    file = model_file(replace(fit, models=models), "m", "chains", (("*",), ("b",)))
    write_model(file, tmp_path / "model.yaml")
    file = read_model(tmp_path / "model.yaml")
    for specimen in NAMES:
        again = model.with_effects(effects_for(file, specimen, model.joints))
        np.testing.assert_array_equal(motion(again), motion(models[specimen]))


def test_follower_loads_of_the_cohort_are_left_out_of_the_file(tmp_path: Path) -> None:
    """They come between base and what is supposed; whoever reads the file has the cohort."""
    fit = fitted(one(OFFSET, PlaceSpread.SHARED))
    pressed = {
        name: model.with_effects(
            (model.effects[0], *cables({"flexion": 100.0}, model.n_joints), *model.effects[1:])
        )
        for name, model in fit.models.items()
    }
    given = dict.fromkeys(NAMES, 1)
    file = model_file(replace(fit, models=pressed), "m", "chains", given=given)
    write_model(file, tmp_path / "pressed.yaml")
    write_model(model_file(fit, "m", "chains"), tmp_path / "free.yaml")
    written = [(tmp_path / f"{name}.yaml").read_text() for name in ("pressed", "free")]
    assert written[0] == written[1]


def test_specimens_differ_where_the_fit_says_so() -> None:
    file = model_file(fitted(one(ASYMMETRY, PlaceSpread.EACH)), "m", "chains")
    rows = {(row.specimen, row.joint): row.parameters for row in file.effects[1].values}
    assert set(rows) == {(s, j) for s in NAMES for j in chains.JOINTS[:JOINTS]}
    assert len({row["asymmetry"] for row in rows.values()}) == 2 * JOINTS
    (shared,) = (
        model_file(fitted(one(ASYMMETRY, PlaceSpread.SHARED)), "m", "chains").effects[1].values
    )
    assert (shared.specimen, shared.joint) == ("*", "*")


# Values in units of tables -----------------------------------------------------------------------


def fit_of(variant: Variant, column: int, start: float, move: float, at_bound: bool) -> JointFit:
    """A fit that moved one parameter from its start."""
    values = np.array([p.default for p in variant.create().parameters])
    values[column] = start
    u = Unknown("", 0, column, ("a", "L4L5"), True, -9.0, 9.0, 0.0, 1.0)
    supposed = (ActiveTerm(CandidateForm(variant, PlaceSpread.ONE, 1, "a"), values),)
    member = HypothesisMember(chains.model("a", chains.STIFFNESS), (), (0,))
    started = Hypothesis({"a": member}, (u,), supposed)
    bound = np.array([at_bound])
    return JointFit(started, np.array([move]), {}, 1.0, {}, {}, {}, {}, bound, "")


DEG = 180.0 / np.pi
Z = 1.959964
VALUES = {
    "rad": (
        Variant("load_misalignment", ()),
        1,
        0.01,
        0.02,
        0.005,
        (0.03 * DEG, (0.03 - 0.005 * Z) * DEG, (0.03 + 0.005 * Z) * DEG),
        "deg",
    ),
    "m": (
        Variant("facet_contact", (("coordinate", "anterior"),)),
        1,
        5e-4,
        1e-3,
        1e-4,
        (1.5, 1.5 - 0.1 * Z, 1.5 + 0.1 * Z),
        "mm",
    ),
    "m/rad": (
        Variant("joint_centre_migration", ()),
        0,
        0.0,
        0.05,
        0.01,
        (50.0 / DEG, (50.0 - 10.0 * Z) / DEG, (50.0 + 10.0 * Z) / DEG),
        "mm/deg",
    ),
    "log": (
        Variant("level_dependence", ()),
        0,
        2.0,
        np.log(1.5),
        0.1,
        (3.0, 3.0 * np.exp(-0.1 * Z), 3.0 * np.exp(0.1 * Z)),
        "1",
    ),
    "log rad": (
        Variant("neutral_zone", ()),
        1,
        0.03,
        -np.log(2.0),
        0.2,
        (0.015 * DEG, 0.015 * DEG * np.exp(-0.2 * Z), 0.015 * DEG * np.exp(0.2 * Z)),
        "deg",
    ),
    "N m": (
        Variant("load_offset", ()),
        0,
        0.0,
        -0.3,
        0.1,
        (-0.3, -0.3 - 0.1 * Z, -0.3 + 0.1 * Z),
        "N m",
    ),
}
"""Effect, column, start, move, SD of the move; value, ends 1.96 SD away, by hand; their unit."""


@sweep("name", VALUES)
def test_values_and_ends_in_units_of_tables(name: str) -> None:
    variant, column, start, move, se, expected, unit = VALUES[name]
    fit = fit_of(variant, column, start, move, at_bound=False)
    (found,) = fitted_values(fit, 0)
    assert found.name == variant.create().parameters[column].name
    ends = [in_tables(fit, 0, move + side * Z * se) for side in (-1.0, 1.0)]
    assert (found.value, ends[0][0], ends[1][0]) == pytest.approx(expected, rel=1e-6)
    assert (found.unit, found.place, found.at_bound) == (unit, ("a", "L4L5"), False)
    assert {told for _, told in ends} == {unit}


def test_values_end_at_bounds() -> None:
    """A joint loses 0 to 95 % of its resistance."""
    fit = fit_of(LAXITY, 0, 0.3, 0.65 + 1e-9, at_bound=True)
    (found,) = fitted_values(fit, 0)
    assert found.value == 0.95
    assert found.at_bound
    assert in_tables(fit, 0, -0.4) == (0.0, "1")
