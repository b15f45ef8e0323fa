"""Where a table is worth a fit, how far it goes and which stays, by evidence that is made up."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects import PlaceSpread
from spinepipe.studies.discrepancy.search import residual_model as tables
from spinepipe.studies.discrepancy.search.hypothesis import CandidateForm, Variant
from spinepipe.studies.discrepancy.search.lack_of_fit import LackOfFitTest

JOINTS = ("L5S1", "L4L5")


def readings(*motion: float, counts: Sequence[int] | None = None) -> Any:
    """A test whose extension was as large as that, NaN or more where nothing was read."""
    mean = np.zeros((len(motion), 1, 6))
    mean[:, 0, 3] = motion
    count = np.ones((len(motion), 1, 6), dtype=int)
    count[:, 0, 3] = counts or [1] * len(motion)
    return SimpleNamespace(tests=(SimpleNamespace(mean=mean, count=count),))


def grounds(specimens: Mapping[str, Any] | None = None, joints: int = 2, **fit: Any) -> Any:
    given = specimens or {"a": readings(0.1), "b": readings(0.2)}
    model = SimpleNamespace(joints=JOINTS[:joints], n_joints=joints)
    nothing = {name: (np.zeros((1, 1, 6)),) for name in given}
    predicted = fit.pop("predicted", nothing)
    fitted = SimpleNamespace(models=dict.fromkeys(given, model), predicted=predicted, **fit)
    return SimpleNamespace(readings=given, fit=fitted, setting=None)


# Where


def lack(evidence: float, null: Sequence[float], family: str = "own", **more: Any) -> LackOfFitTest:
    spread = more.get("spread", PlaceSpread.SHARED)
    return LackOfFitTest(evidence, np.array(null), family, "extension", spread, 0.0, {})


def forms(of: LackOfFitTest | None = None, *terms: Any, at: Any = None) -> list[CandidateForm]:
    basis: Any = SimpleNamespace(at={} if of is None else {"extension": of})
    found: Any = SimpleNamespace(terms=terms) if terms else None
    return list(tables._forms(at or grounds(), basis, found, 0.01))


def test_a_table_is_tried_where_the_generic_basis_is_evident_over_the_own_motion() -> None:
    """Very strong, and above what the null shows once in a hundred."""
    quiet, loud = np.zeros(500), np.linspace(0.0, 10.0, 1001)
    assert forms(lack(5.1, quiet))
    assert forms(lack(5.0, quiet)) == []
    assert forms(lack(9.91, loud))
    assert forms(lack(9.89, loud)) == []
    assert forms(lack(90.0, quiet, "neighbour")) == []


@sweep(
    "spread, joints, specimens, expected",
    [
        (PlaceSpread.SHARED, 2, "a", [PlaceSpread.SHARED]),
        (PlaceSpread.SHARED, 2, "ab", [PlaceSpread.SHARED, PlaceSpread.BY_SPECIMEN]),
        (
            PlaceSpread.BY_JOINT,
            2,
            "ab",
            [PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.BY_SPECIMEN],
        ),
        (PlaceSpread.BY_JOINT, 1, "ab", [PlaceSpread.SHARED, PlaceSpread.BY_SPECIMEN]),
        (
            PlaceSpread.EACH,
            2,
            "ab",
            [PlaceSpread.SHARED, PlaceSpread.BY_JOINT, PlaceSpread.BY_SPECIMEN, PlaceSpread.EACH],
        ),
    ],
)
def test_a_table_differs_where_there_is_something_that_can(
    spread: PlaceSpread, joints: int, specimens: str, expected: list[PlaceSpread]
) -> None:
    at = grounds({name: readings(0.1) for name in specimens}, joints)
    found = forms(lack(90.0, np.zeros(500), spread=spread), at=at)
    assert [one.spread for one in found] == expected
    assert {one.joint for one in found} == {None}


def term(joint: str, specimen: str, *of: str) -> Any:
    return SimpleNamespace(joint=joint, specimen=specimen, coordinate="extension", of=of)


def test_a_term_of_a_formula_is_tabulated_at_its_place_over_each_of_its_motions() -> None:
    def place(*of: Any) -> list[tuple[str, PlaceSpread, int | None, str | None]]:
        return [
            (str(dict(one.variant.options)["over"]), one.spread, one.joint, one.specimen)
            for one in forms(None, *of)
        ]

    assert place(term("*", "*", "extension", "extension")) == [
        (tables.ITSELF, PlaceSpread.SHARED, None, None)
    ]
    assert place(term("L4L5", "*", "extension")) == [
        (tables.ITSELF, PlaceSpread.ONE_JOINT, 1, None)
    ]
    assert place(term("L5S1", "b", "extension")) == [(tables.ITSELF, PlaceSpread.ONE, 0, "b")]
    assert place(term("*", "a", "right_bending")) == [
        ("right_bending", PlaceSpread.SHARED, None, "a"),
        (tables.ITSELF, PlaceSpread.SHARED, None, "a"),
    ]
    assert place(term("*", "*")) == []  # neither a rate nor a drift is a table


def test_a_table_goes_as_far_as_all_specimens_move() -> None:
    """As read, or in the model; to three digits."""

    def reach(at: Any) -> Any:
        return dict(tables._variant(at, "extension", "extension").options)["reach"]

    assert reach(grounds({"a": readings(0.1, -0.21234), "b": readings(0.3)})) == 0.212
    assert reach(grounds({"a": readings(0.1, 9.0, counts=[1, 0])})) == 0.1
    predicted = np.zeros((2, 1, 6))
    predicted[1, 0, 3] = -0.4
    assert reach(grounds({"a": readings(0.1)}, predicted={"a": (predicted,)})) == 0.4


# Which


def form(
    coordinate: str = "extension", spread: PlaceSpread = PlaceSpread.SHARED, **place: Any
) -> CandidateForm:
    options = (("coordinate", coordinate), ("over", tables.ITSELF), ("reach", 0.2))
    return CandidateForm(Variant("tabulated_law", options), spread, **place)


def best(
    monkeypatch: pytest.MonkeyPatch, evidence: Sequence[float | None], proven: Mapping[float, Any]
) -> float | None:
    """Evidence of the table that is taken; by evidence, whether it beats the base and tells."""
    given = iter(evidence)

    def fitted(grounds: Any, form: CandidateForm) -> Any:
        one = next(given)
        return None if one is None else (one, one)

    def proof(before: Any, after: float) -> Any:
        beats, tells = proven[after]
        return SimpleNamespace(beats_base=beats, tells=tells)

    monkeypatch.setattr(tables, "_fitted", fitted)
    monkeypatch.setattr(tables, "proof_of_terms", proof)
    found: Any = tables._best(grounds(), [form()] * len(evidence))
    return None if found is None else float(found[0])


def test_the_table_with_most_evidence_of_those_that_predict_is_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sure, no, untold = (True, True), (False, True), (False, False)
    assert best(monkeypatch, [7.0, 9.0], {7.0: sure, 9.0: sure}) == 9.0
    assert best(monkeypatch, [7.0, 9.0], {7.0: sure, 9.0: no}) == 7.0
    assert best(monkeypatch, [7.0, None], {7.0: untold}) == 7.0
    assert best(monkeypatch, [7.0, 9.0], {7.0: no, 9.0: no}) is None
    assert best(monkeypatch, [None], {}) is None


@pytest.mark.parametrize("worth", range(5))
def test_three_tables_at_most_enter_one_for_each_law(
    worth: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of four laws, each in two ways to differ; of those that are left the first is taken."""
    laws = [
        form(f"c{number}", spread)
        for number in range(4)
        for spread in (PlaceSpread.SHARED, PlaceSpread.ONE_JOINT)
    ]
    asked: list[int] = []

    def taken(at: Any, left: Sequence[CandidateForm]) -> Any:
        asked.append(len(left))
        after = SimpleNamespace(fit=None, number=len(asked))
        return (after, left[0]) if len(asked) <= worth else None

    monkeypatch.setattr(tables, "_forms", lambda *_: laws)
    monkeypatch.setattr(tables, "_best", taken)
    monkeypatch.setattr(tables, "whole_gap", lambda at, fit: SimpleNamespace(gap=0.25))
    monkeypatch.setattr(tables, "proof_of_terms", lambda *_: SimpleNamespace(closed=0.75))
    before = grounds()
    after, table = tables.fit_tables(before, None, None, 0.01)  # type: ignore[arg-type]
    entered = min(worth, 3)
    assert asked == [8, 6, 4, 2][: min(worth + 1, 3)]
    assert (table is None) is (worth == 0)
    if table is None:
        assert after is before
    else:
        assert after.number == entered  # type: ignore[attr-defined]
        where = "; ".join(f"c{number} at every joint" for number in range(entered))
        assert (table.place, table.gap, table.held_out_closed) == (where, 0.25, 0.75)


def test_without_evidence_or_fit_a_table_is_not_worth_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Very strong is a log evidence of 5."""
    before = SimpleNamespace(chi2=100.0, poses=None)
    at: Any = SimpleNamespace(fit=before, setting=None, suppose=lambda supposed: supposed)
    at.at = lambda fit: ("at", fit.chi2)
    monkeypatch.setattr(tables, "standing", lambda fit: ("stands",))
    asked: list[Any] = []

    def evidence(fit: Any, number: int, gain: float) -> float:
        asked.append((number, gain))
        return float(fit.evidence)

    monkeypatch.setattr(tables, "laplace", evidence)
    for usable, size, found in ((True, 5.01, True), (True, 5.0, False), (False, 90.0, False)):
        fit = SimpleNamespace(usable=usable, chi2=60.0, evidence=size)
        monkeypatch.setattr(tables, "joint_fit", lambda *_, fit=fit: fit)
        assert tables._fitted(at, form()) == ((size, ("at", 60.0)) if found else None)
    assert asked == [(1, 40.0)] * 2  # of the effects in the fit, the last


def test_where_a_table_is_is_told_in_words() -> None:
    at = grounds()
    assert tables._where(at, form("right_bending")) == "right bending at every joint"
    one = form(spread=PlaceSpread.ONE, joint=1, specimen="b")
    assert tables._where(at, one) == "extension at L4L5 of b"
    each = form(spread=PlaceSpread.EACH)
    assert tables._where(at, each) == f"extension at every joint, {PlaceSpread.EACH.value}"
    options = (("coordinate", "extension"), ("over", "left_rotation"), ("reach", 0.2))
    other = CandidateForm(Variant("tabulated_law", options), PlaceSpread.SHARED)
    assert tables._where(at, other) == "extension over left rotation at every joint"
