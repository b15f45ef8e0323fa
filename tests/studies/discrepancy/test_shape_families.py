"""Laws that span published forms: how they are tried, where a fit may end, what other formulas say.

The motion of the searched chains comes from laws that the library does not have.
"""

from dataclasses import replace

import numpy as np
import pytest
import spring_chain_cases as chains
from scipy.optimize import brentq
from search_cases import Array, searched
from sweeps import sweep
from test_fitted_model_files import fitted, one

from spinepipe.effects import PlaceSpread, create, registered
from spinepipe.model.file import EffectEntry, ModelFile, Values, effects_for
from spinepipe.studies.discrepancy.search.hypothesis import Variant, shape_grid, trials
from spinepipe.studies.discrepancy.search.refit import _degenerate
from spinepipe.studies.discrepancy.verdict import VerdictKind
from spinepipe.units import COORDINATES, ROTATIONS


def variants(name: str, read: tuple[str, ...]) -> list[dict[str, object]]:
    """Options of the variants of an effect that are tried where these coordinates are read."""
    return [dict(v.options) for v in trials([name], read, ["a"], 2)[0].variants]


@sweep(
    "name, options, points",
    [
        ("neutral_zone", {}, 3),
        ("neutral_zone", {"zone": "off_centre"}, 2),
        ("nonlinear_stiffening", {"shape": "bilinear"}, 2),
        ("facet_contact", {}, 3),
        ("hysteresis", {"law": "jenkins"}, 1),
        ("creep", {}, 3),
    ],
)
def test_a_family_is_tried_at_one_of_its_forms(name: str, options: dict, points: int) -> None:
    assert len(shape_grid(Variant(name, tuple(options.items())))) == points


def test_variants_act_on_what_is_read() -> None:
    for name in ("neutral_zone", "facet_contact", "hysteresis", "creep", "nonlinear_stiffening"):
        assert {o["coordinate"] for o in variants(name, ("anterior",))} == {"anterior"}
        assert {o["coordinate"] for o in variants(name, COORDINATES)} == set(COORDINATES)


def test_groups_are_tried_where_each_kind_is_read() -> None:
    def groups(*read: str) -> set[object]:
        return {o["coordinate"] for o in variants("level_dependence", read)} - set(COORDINATES)

    assert groups("anterior") == set()
    assert groups("extension", "right_bending") == {"rotations"}
    assert groups("anterior", "extension") == {"rotations", "all"}


def test_pairs_are_tried_where_each_kind_is_read() -> None:
    def pairs(*read: str) -> int:
        return len(variants("bending_rotation_coupling", read))

    assert (pairs("anterior"), pairs("extension"), pairs(*ROTATIONS), pairs(*COORDINATES)) == (
        *(2, 2),
        *(3, 15),
    )
    assert pairs("anterior", "extension") == 5


def test_an_end_of_a_family_is_a_form_of_its_own() -> None:
    """A stop without a gap is no stop; a linear one is."""
    stop = one(Variant("facet_contact", ()), PlaceSpread.SHARED)
    fit = fitted(stop)
    columns = {p.name: c for c, p in enumerate(stop.form.variant.create().parameters)}
    for name, refused in (("gap", True), ("exponent", False), ("stiffness", False)):
        ends = [u.supposed == 0 and u.column == columns[name] for u in fit.hypothesis.unknowns]
        assert _degenerate(replace(fit, at_bound=np.array(ends)), 0) is refused


@sweep(
    "name, given, value",
    [
        ("neutral_zone", {"stiffness_ratio": 0.4, "width": 0.02}, 30.0),
        ("facet_contact", {"stiffness": 80.0, "gap": 0.03}, 1.0),
        ("creep", {"fraction": 0.2, "time": 50.0}, 0.0),
    ],
)
def test_files_from_before_mean_the_law_of_then(name: str, given: dict, value: float) -> None:
    entry = EffectEntry(effect=name, values=(Values(**given),))
    (scoped,) = effects_for(ModelFile(model="m", cohort="c", effects=(entry,)), "a", ("L4L5",))
    assert scoped.values.tolist() == [[*given.values(), value]]


def test_a_zone_from_before_is_nearly_the_rounded_corner_of_then() -> None:
    """It was ``|u| - 1`` beyond, with a parabola over a tenth of the width to each side."""
    q, carried = np.zeros((2, 401, 6))
    q[:, 3] = np.linspace(-0.08, 0.08, 401)
    carried[:, 3] = 50.0 * q[:, 3]
    u = np.abs(q[:, 3]) / 0.02
    into = np.clip(u - 0.9, 0.0, 0.2)
    over = into**2 / 0.4 + np.maximum(u - 1.1, 0.0)
    before = -0.7 * 50.0 * 0.02 * np.sign(q[:, 3]) * (u - over)
    law = create("neutral_zone")
    found = law.respond(q, np.tile([0.3, 0.02, 30.0], (401, 1)), carried).load[:, 3]
    np.testing.assert_allclose(found, before, rtol=0, atol=0.003 * 0.7 * 50.0 * 0.02)


def test_every_shape_is_tried_within_its_bounds() -> None:
    for name, cls in registered().items():
        trial = getattr(cls, "trial", None)
        for options in trial.variants if trial else ():
            for p in create(name, dict(options)).parameters:
                assert p.tried
                assert not p.family or p.off is None, (name, p.name)
                assert p.low <= p.in_a_file <= p.high, (name, p.name)


# Searches -----------------------------------------------------------------------------------------

FEW = ("hysteresis", "load_offset", "neutral_zone", "nonlinear_stiffening")
SLOW = tuple(np.linspace(-7.5, 7.5, 13)[[6, *range(6), *range(7, 13)]])
ROUND = tuple(np.interp(np.arange(21), [0, 5, 15, 20], [0.0, 7.5, -7.5, 0.0]))


def smooth_zone(joint: int, moments: Array, k: float) -> Array:
    """``k q - 0.6 k w tanh(q / w)``, w = 1.2 deg."""
    w = np.deg2rad(1.2)

    def left(q: float, moment: float) -> float:
        return k * q - 0.6 * k * w * float(np.tanh(q / w)) - moment

    return np.array([brentq(left, -1.0, 1.0, args=(m,), xtol=1e-14) for m in moments])


def sliders(joint: int, moments: Array, k: float) -> Array:
    """Four springs in line with sliders, 1 N m in all, that yield from 0.3 to 1.2 deg."""
    yields = np.deg2rad([0.3, 0.5, 0.8, 1.2])
    q, h, found = 0.0, np.zeros(4), []
    for moment in moments:
        turned = brentq(
            lambda by, q=q, h=h, m=moment: (
                k * (q + by) + np.clip(h + by / yields, -1.0, 1.0).mean() - m
            ),
            *(-1.0, 1.0),
            xtol=1e-14,
        )
        q, h = q + turned, np.clip(h + turned / yields, -1.0, 1.0)
        found.append(q)
    return np.array(found)


@pytest.mark.slow
@sweep(
    "law, levels, name",
    [(smooth_zone, SLOW, "neutral_zone"), (sliders, ROUND, "hysteresis")],
)
def test_another_formula_of_the_same_physics_has_its_name(law, levels, name: str) -> None:
    given = chains.readings(2, {"flexion": law}, ("a", "b"), levels=levels, joints=3)
    result = searched(given, effects=FEW)
    assert result.ended.verdict is VerdictKind.NAMED
    assert {effect.name for effect in result.ended.named} == {name}
    assert result.found.base_gap.gap > 1.0
    assert result.found.final_gap.gap < 0.5
