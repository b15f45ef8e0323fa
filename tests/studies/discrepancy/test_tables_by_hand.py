"""Which tables are tried, how far they go, and which stays, by fits that are made up."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import PlaceSpread
from spinepipe.effects.tabulated_law import ITSELF
from spinepipe.studies.discrepancy.search import residual_model
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Variant
from spinepipe.studies.discrepancy.search.something_else import tables
from spinepipe.studies.discrepancy.verdict_unnamed import Tabulated

EACH_MOTION = ("extension", "right_bending")


def readings(*motion: float, unread: int = 0) -> Any:
    """A test whose extension was as large as that; the last steps have no reading of it."""
    mean = np.zeros((len(motion), 1, 6))
    mean[:, 0, 3] = motion
    count = np.ones((len(motion), 1, 6), dtype=int)
    count[len(motion) - unread :, 0, 3] = 0
    return SimpleNamespace(tests=(SimpleNamespace(mean=mean, count=count),))


def grounds(
    specimens: Mapping[str, Any], joints: int = 2, predicted: Mapping[str, Any] | None = None
) -> Any:
    model = SimpleNamespace(n_joints=joints)
    nothing = {name: (np.zeros((1, 1, 6)),) for name in specimens}
    fit = SimpleNamespace(models=dict.fromkeys(specimens, model), predicted=predicted or nothing)
    return SimpleNamespace(readings=specimens, fit=fit)


@sweep(
    "joints, specimens, expected",
    [
        (1, "a", [PlaceSpread.SHARED]),
        (1, "ab", [PlaceSpread.SHARED, PlaceSpread.BY_SPECIMEN]),
        (2, "a", [PlaceSpread.SHARED, PlaceSpread.BY_JOINT]),
        (2, "ab", [PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.BY_SPECIMEN]),
    ],
)
def test_a_table_differs_where_there_is_something_that_can(
    joints: int, specimens: str, expected: list[PlaceSpread]
) -> None:
    """Each coordinate is loaded over its own motion and over each other one."""
    tried = tables(grounds({name: readings(0.1) for name in specimens}, joints), EACH_MOTION)
    options = [dict(one.options) for one in tried.variants]
    assert [(one["coordinate"], one["over"]) for one in options] == [
        ("extension", ITSELF),
        ("extension", "right_bending"),
        ("right_bending", "extension"),
        ("right_bending", ITSELF),
    ]
    for variant in tried.variants:
        assert [one.spread for one in tried.forms if one.variant == variant] == expected


def test_a_table_goes_as_far_as_all_specimens_move() -> None:
    """As read, or in the model; to three digits."""

    def reach(at: Any) -> Any:
        (variant,) = tables(at, ("extension",)).variants
        return dict(variant.options)["reach"]

    assert reach(grounds({"a": readings(0.1, -0.21234), "b": readings(0.3)})) == 0.212
    assert reach(grounds({"a": readings(0.1, 9.0, unread=1)})) == 0.1
    moved = np.zeros((2, 1, 6))
    moved[1, 0, 3] = -0.4
    assert reach(grounds({"a": readings(0.1)}, predicted={"a": (moved,)})) == 0.4
    assert reach(grounds({"a": readings(57.3)})) == 1.0  # in a wrong unit: as far as a table goes


def form(
    coordinate: str, over: str = ITSELF, spread: PlaceSpread = PlaceSpread.SHARED
) -> CandidateForm:
    options = (("coordinate", coordinate), ("over", over), ("reach", 0.2))
    return CandidateForm(Variant("tabulated_law", options), spread)


NAMED = CandidateForm(Variant("load_offset", ()), PlaceSpread.SHARED)
TABLES = [form("right_bending"), form("extension", "left_rotation", PlaceSpread.EACH)]


@pytest.mark.parametrize(
    ("tells", "beats", "stays"),
    [(True, True, True), (True, False, False), (False, False, True)],
)
def test_tables_stay_unless_they_predict_what_is_left_out_no_better(
    tells: bool, beats: bool, stays: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    supposed = [SimpleNamespace(form=one) for one in (NAMED, *TABLES)]
    after = SimpleNamespace(fit=SimpleNamespace(hypothesis=SimpleNamespace(supposed=supposed)))
    found: Any = SimpleNamespace(final="final", with_tables=after)
    proof = SimpleNamespace(tells=tells, beats_base=beats, closed=0.75)
    monkeypatch.setattr(residual_model, "whole_gap", lambda at, fit: SimpleNamespace(gap=0.25))
    ended = residual_model.model_residual(found, lambda *_: proof)  # type: ignore[arg-type]
    place = (
        "right bending at every joint; extension over left rotation at every joint, "
        f"{PlaceSpread.EACH.value}"
    )
    assert ended.table == (Tabulated(place, 0.25, 0.75) if stays else None)
    assert ended.grounds == (after if stays else "final")


def test_without_tables_the_model_is_that_of_the_search() -> None:
    found: Any = SimpleNamespace(final="final", with_tables=None)
    ended = residual_model.model_residual(found, None)  # type: ignore[arg-type]
    assert (ended.table, ended.grounds) == (None, "final")
