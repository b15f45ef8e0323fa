"""What a value is moved in, where its region is looked for, and when its fit is taken as it is."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2 as chi2_of
from sweeps import sweep

from spinepipe.calibration.descent import Point
from spinepipe.calibration.profile import Best, profile_in_turn
from spinepipe.effects import PlaceSpread
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search import regions
from spinepipe.studies.discrepancy.search.hypothesis import ActiveTerm, CandidateForm, Variant
from spinepipe.studies.discrepancy.search.regions import OPEN, _Ruler

STIFFNESS = 500.0
CONTACT = Variant("facet_contact", (("coordinate", "extension"), ("side", "positive")))

# Rulers


def test_most_values_are_moved_as_they_are() -> None:
    ruler = _Ruler()
    assert (ruler.move(3.0), ruler.mark(3.0), ruler.slope(3.0)) == (3.0, 3.0, 1.0)
    assert ruler.limits(3.0, -7.0, 9.0) == (-7.0, 9.0)


@sweep("move", [-499.0, 0.0, 1200.0])
def test_a_stiffness_is_moved_by_its_logarithm(move: float) -> None:
    """The unknown is what was added to 500 N m/rad."""
    ruler, size = _Ruler(-STIFFNESS), 1e-4
    mark = ruler.mark(move)
    assert mark == pytest.approx(np.log(STIFFNESS + move))
    assert ruler.move(mark) == pytest.approx(move, abs=1e-9)
    rise = ruler.move(mark + size) - ruler.move(mark - size)
    assert ruler.slope(mark) == pytest.approx(rise / (2.0 * size), rel=1e-6)


def test_a_stiffness_of_less_than_a_thousandth_is_none() -> None:
    """Fitted at 600: from 0.6 on; from a bound on where that is higher."""
    ruler = _Ruler(-STIFFNESS)
    low, high = ruler.limits(100.0, -STIFFNESS, 1500.0)
    assert np.exp([low, high]) == pytest.approx([0.6, 2000.0])
    low, _ = ruler.limits(100.0, -450.0, 1500.0)
    assert np.exp(low) == pytest.approx(50.0)


def ruled(name: str, start: float, moved: float, variant: Variant = CONTACT) -> _Ruler:
    parameters = variant.create().parameters
    column = [p.name for p in parameters].index(name)
    values = np.array([p.default for p in parameters])
    values[column] = start
    supposed = (ActiveTerm(CandidateForm(variant, PlaceSpread.SHARED), values),)
    unknowns = (SimpleNamespace(supposed=0, column=column),)
    hypothesis = SimpleNamespace(unknowns=unknowns, supposed=supposed)
    return regions._ruler(SimpleNamespace(hypothesis=hypothesis, x=[moved]), 0)  # type: ignore[arg-type]


def test_the_stiffness_of_a_contact_has_the_ruler_of_logarithms() -> None:
    assert ruled("stiffness", STIFFNESS, 100.0) == _Ruler(-STIFFNESS)
    assert ruled("stiffness", STIFFNESS, -STIFFNESS) == _Ruler()  # of nothing there is none
    assert ruled("gap", 0.02, 0.001) == _Ruler()
    zone = Variant("neutral_zone", (("coordinate", "extension"),))
    assert ruled("stiffness_ratio", 0.5, 0.1, zone) == _Ruler()
    assert ruled("width", 0.03, 0.1, zone) == _Ruler()


# Without its own prior


def test_only_its_own_prior_is_taken_off() -> None:
    """Two rows of readings, then a prior for each of three unknowns; the second is asked for."""
    rng = np.random.default_rng(20011)
    residual, jacobian = rng.normal(size=5), rng.normal(size=(5, 3))
    asked: list[Array] = []

    def compressed(x: Array) -> tuple[Array, Array]:
        asked.append(x.copy())
        return residual, jacobian

    points: Any = SimpleNamespace(compressed=compressed)
    ruler, y = _Ruler(-2.0), np.array([0.3, np.log(5.0), 0.7])
    found = regions._without_own_prior(points, 1, ruler)(y)
    assert found is not None
    assert asked[0] == pytest.approx([0.3, 3.0, 0.7])
    assert found[0].tolist() == [*residual[:3], 0.0, residual[4]]
    expected = jacobian * [1.0, 5.0, 1.0]
    expected[3] = 0.0
    assert found[1] == pytest.approx(expected)
    assert np.count_nonzero(residual) == 5  # what was kept is left alone
    assert y[1] == np.log(5.0)
    points.compressed = lambda x: None
    assert regions._without_own_prior(points, 1, ruler)(y) is None


# Where the readings would have it


def fit_of(x: Sequence[float], sd: float = 1.0, low: float = -1e9, high: float = 1e9) -> Any:
    unknowns = [SimpleNamespace(low=low, high=high, mean=0.0, sd=sd, step=0.1) for _ in x]
    hypothesis = SimpleNamespace(unknowns=unknowns)
    at_bound = np.zeros(len(x), dtype=bool)
    return SimpleNamespace(hypothesis=hypothesis, x=np.array(x), at_bound=at_bound, status="")


def straight(sd: float, centre: float = 1.2, asked: list[float] | None = None) -> Point:
    """One unknown that readings have at a centre, with that SD; noise of 8 besides."""

    def point(y: Array) -> tuple[Array, Array]:
        if asked is not None:
            asked.append(float(y[0]))
        return np.array([(y[0] - centre) / sd, 8.0]), np.array([[1.0 / sd], [0.0]])

    return point


def likeliest(fit: Any, point: Point, ruler: _Ruler | None = None) -> Best:
    found = regions._likeliest(fit, point, 0, ruler or _Ruler())
    assert found is not None
    return found


@sweep("sd, x", [(0.0499, 1.0), (0.0501, 1.2)])
def test_a_value_that_its_prior_drew_away_by_a_twentieth_of_its_sd_is_fitted_anew(
    sd: float, x: float
) -> None:
    """A prior of SD 1 about 0 pulls a value of 1 by SD^2 of the readings: SD of it in SDs."""
    assert likeliest(fit_of([1.0]), straight(sd)).x[0] == pytest.approx(x, abs=1e-4)


def test_a_value_is_fitted_anew_where_its_fit_was_not_free() -> None:
    for spoilt in ({"at_bound": np.array([True])}, {"status": "given up"}):
        fit = fit_of([1.0])
        vars(fit).update(spoilt)
        assert likeliest(fit, straight(0.01)).x[0] == pytest.approx(1.2, abs=1e-4)
    assert likeliest(fit_of([1.0]), straight(0.01)).x[0] == 1.0


def test_a_region_is_looked_for_within_bounds_and_two_hundred_prior_sds() -> None:
    found = likeliest(fit_of([1.0], sd=2.0), straight(1e-3))
    assert (found.lower[0], found.upper[0]) == (1.0 - 400.0, 1.0 + 400.0)
    found = likeliest(fit_of([1.0], sd=2.0, low=-3.0, high=5.0), straight(1e-3))
    assert (found.lower[0], found.upper[0]) == (-3.0, 5.0)
    found = likeliest(fit_of([1.0], sd=2.0, low=-3.0, high=5.0), straight(1e-3), _Ruler(-4.0))
    assert np.exp([found.lower[0], found.upper[0]]) == pytest.approx([1.0, 9.0])
    assert found.x[0] == pytest.approx(np.log(5.0))
    assert found.scale[0] == pytest.approx(0.1 / 5.0)  # a step of the same size


def test_a_prior_pulls_a_stiffness_along_its_ruler() -> None:
    """At 10 a step of the logarithm is ten of the stiffness: told ten times as well, and pulled."""
    for sd, x in ((0.0499, 10.0), (0.0501, 12.0)):
        point = straight(sd / 10.0, np.log(12.0))  # of the logarithm
        found = likeliest(fit_of([6.0], sd=np.sqrt(6.0)), point, _Ruler(-4.0))
        assert np.exp(found.x[0]) == pytest.approx(x, rel=1e-3)


def test_where_no_pose_stands_there_is_no_region() -> None:
    assert regions._likeliest(fit_of([1.0]), lambda y: None, 0, _Ruler()) is None


def test_one_look_a_side_is_enough_where_all_is_straight() -> None:
    """1.96 SDs away; ends are known to a fiftieth of that."""
    asked: list[float] = []
    best = likeliest(fit_of([1.0], sd=9.0), straight(1e-3, 1.0, asked))
    asked.clear()
    found = profile_in_turn(best, straight(1e-3, 1.0, asked), [0])
    assert len(asked) == 2
    way = 1.96e-3
    assert [found.low[0], found.high[0]] == pytest.approx([1.0 - way, 1.0 + way], abs=0.02 * way)


@sweep("chi2", [900.0, 1.0, 0.01])
def test_the_others_are_fitted_to_a_fiftieth_of_the_rise_that_ends_a_region(chi2: float) -> None:
    """Beside the noise, of which there may be less than one."""
    enough = regions._enough(np.array([np.sqrt(chi2)]))
    rise = chi2_of(1).ppf(0.95)
    assert enough.cost * max(chi2, 1.0) == pytest.approx(rise / 50.0)
    assert 0.0 < enough.slope < enough.step < 1e-3


# A region


def region(monkeypatch: pytest.MonkeyPatch, **seen: Any) -> Any:
    """Of an unknown at 3, on a ruler of logarithms from -2 on."""
    values = {"low": np.log(4.0), "high": np.log(7.0), "open_below": False, "open_above": False}
    told = {name: np.array([value]) for name, value in (values | seen).items()}
    profiled = SimpleNamespace(**told)
    profiled.lower_cost = seen.get("lower_cost", False)
    points: Any = SimpleNamespace(begin_at=lambda fit: None)
    monkeypatch.setattr(regions, "Points", lambda *_: points)
    monkeypatch.setattr(regions, "_ruler", lambda *_: _Ruler(-2.0))
    monkeypatch.setattr(regions, "_likeliest", lambda *_: "best")
    monkeypatch.setattr(regions, "profile_in_turn", lambda *_: profiled)
    fit: Any = SimpleNamespace(usable=True, hypothesis=None, poses=None, x=np.array([3.0]))
    return regions.region(fit, None, 0)  # type: ignore[arg-type]


def test_ends_are_in_the_unknown_and_hold_its_value(monkeypatch: pytest.MonkeyPatch) -> None:
    found = region(monkeypatch)
    assert (found.low, found.high) == pytest.approx((2.0, 5.0))
    found = region(monkeypatch, low=np.log(6.0))
    assert (found.low, found.high) == pytest.approx((3.0, 5.0))
    found = region(monkeypatch, high=np.log(4.5))
    assert (found.low, found.high) == pytest.approx((2.0, 3.0))


def test_an_open_end_is_none_and_a_better_fit_opens_both(monkeypatch: pytest.MonkeyPatch) -> None:
    below = region(monkeypatch, open_below=True)
    assert (below.low, below.open_below, below.open_above) == (None, True, False)
    assert below.high == pytest.approx(5.0)
    above = region(monkeypatch, open_above=True)
    assert (above.high, above.open_below, above.open_above) == (None, False, True)
    assert region(monkeypatch, lower_cost=True) == OPEN
    assert (OPEN.low, OPEN.high, OPEN.open_below, OPEN.open_above) == (None, None, True, True)
