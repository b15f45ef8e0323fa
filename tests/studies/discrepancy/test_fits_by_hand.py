"""Fits and the base they stand on, by predictions and runs that are made up."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.calibration.descent import OFF_THE_PATH
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search import baseline as grounded
from spinepipe.studies.discrepancy.search import joint_fit as fits
from spinepipe.studies.discrepancy.search.baseline import NoBase
from spinepipe.studies.discrepancy.search.hypothesis import HypothesisMember
from spinepipe.studies.discrepancy.search.joint_fit import JointFit, Points, joint_fit
from spinepipe.studies.discrepancy.search.prediction import NoEquilibrium
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings

# Fits: two specimens with an unknown of their own each and one that they share

NUMBERS = {"a": (0, 2), "b": (2, 1)}
WEIGHT = 3.0
"""One over the noise SD of what is read."""

RNG = np.random.default_rng(20041)
DESIGN = {name: RNG.normal(size=(7, 2)) for name in NUMBERS}
READ = {name: RNG.normal(size=7) for name in NUMBERS}
PRIOR_SD, PRIOR_MEAN = np.array([0.5, 2.0, 1.0]), np.array([0.3, -0.2, 0.1])


class Straight:
    """Predictions that are straight in the unknowns; none where the first is above a limit."""

    def __init__(self, subjects: Any, zeroed: bool, near: Any) -> None:
        self.looked, self.falls_above, self.leads = 0, np.inf, True

    def at(self, x: dict[str, Array]) -> dict[str, Any]:
        self.looked += 1
        if x["a"][0] > self.falls_above:
            raise NoEquilibrium("falls")
        return {
            name: SimpleNamespace(
                readings=[DESIGN[name] @ own], by_x=[DESIGN[name]], poses=[np.zeros(1)]
            )
            for name, own in x.items()
        }

    def leads_to(self, x: Any, predicted: Any) -> bool:
        return self.leads


def whitened(rows: Sequence[Array]) -> Array:
    return WEIGHT * rows[0]


def hypothesis(low: float = -9.0, high: float = 9.0) -> Any:
    members: dict[str, Any] = {
        name: HypothesisMember(name, (), numbers)  # type: ignore[arg-type]
        for name, numbers in NUMBERS.items()
    }
    unknowns = [
        SimpleNamespace(sd=sd, mean=mean, low=low, high=high, step=0.1)
        for sd, mean in zip(PRIOR_SD, PRIOR_MEAN, strict=True)
    ]
    return SimpleNamespace(members=members, unknowns=unknowns)


def setting() -> Any:
    readings: dict[str, Any] = {
        name: SpecimenReadings(name, (), (SimpleNamespace(mean=one, case=None),))  # type: ignore[arg-type]
        for name, one in READ.items()
    }
    return SimpleNamespace(
        readings=readings, whitenings=dict.fromkeys(READ, whitened), zeroed=False
    )


@pytest.fixture(autouse=True)
def straight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fits, "JointPrediction", Straight)
    monkeypatch.setattr(fits, "with_parameters", lambda model, free, x: (model, tuple(x)))


def stacked() -> tuple[Array, Array]:
    """Readings of both in noise SD: design (14, 3) and what was read."""
    design = np.zeros((14, 3))
    design[:7, [0, 2]], design[7:, [2, 1]] = DESIGN["a"], DESIGN["b"]
    return WEIGHT * design, WEIGHT * np.concatenate([READ["a"], READ["b"]])


def solution() -> Array:
    design, read = stacked()
    rows = np.vstack([design, np.diag(1.0 / PRIOR_SD)])
    found: Array = np.linalg.lstsq(rows, np.concatenate([read, PRIOR_MEAN / PRIOR_SD]))[0]
    return found


def test_a_fit_is_that_of_least_squares_with_its_priors() -> None:
    fit = joint_fit(hypothesis(), setting())
    design, read = stacked()
    assert fit.x == pytest.approx(solution(), abs=1e-4)
    assert fit.chi2 == pytest.approx(np.sum((design @ fit.x - read) ** 2))
    assert (fit.status, fit.usable, fit.at_bound.tolist()) == ("", True, [False] * 3)
    assert fit.whole_jacobian() == pytest.approx(design)
    assert fit.models["b"] == ("b", (fit.x[2], fit.x[1]))


def test_few_rows_have_the_cost_and_the_slope_of_all_readings() -> None:
    points = Points(hypothesis(), setting(), None)
    design, read = stacked()
    x = np.array([0.7, -1.1, 0.4])
    found = points.compressed(x)
    assert found is not None
    residual, jacobian = found
    assert len(residual) == 2 * 3 + 3
    left, prior = design @ x - read, (x - PRIOR_MEAN) / PRIOR_SD
    assert residual @ residual == pytest.approx(left @ left + prior @ prior)
    slope = design.T @ left + prior / PRIOR_SD
    assert jacobian.T @ residual == pytest.approx(slope)
    assert jacobian.T @ jacobian == pytest.approx(design.T @ design + np.diag(PRIOR_SD**-2.0))


def test_a_point_is_looked_at_once_and_says_why_where_it_falls() -> None:
    points = Points(hypothesis(), setting(), None)
    here, there = np.zeros(3), np.ones(3)
    first = points.at(here)
    assert points.at(here.copy()) is first
    assert points.together.looked == 1  # type: ignore[attr-defined]
    points.at(there)
    points.at(here)
    assert points.together.looked == 3  # type: ignore[attr-defined]
    points.together.falls_above = 0.5  # type: ignore[attr-defined]
    assert points.compressed(2.0 * there) is None
    assert points.trouble == "falls"


@sweep("at", range(3))
def test_a_fit_at_a_bound_says_so(at: int) -> None:
    limit = 0.5 * float(solution()[at])
    given = hypothesis()
    setattr(given.unknowns[at], "high" if limit > 0.0 else "low", limit)
    fit = joint_fit(given, setting())
    assert fit.x[at] == pytest.approx(limit, abs=1e-6)
    assert fit.at_bound.tolist() == [number == at for number in range(3)]


def test_a_fit_begins_inside_its_bounds() -> None:
    fit = joint_fit(hypothesis(low=2.0), setting())
    assert fit.x == pytest.approx([2.0] * 3, abs=1e-6)
    assert fit.at_bound.all()
    fit = joint_fit(hypothesis(high=-2.0), setting())
    assert fit.x == pytest.approx([-2.0] * 3, abs=1e-6)
    assert fit.at_bound.all()


def test_without_a_pose_or_off_the_load_path_there_is_no_fit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Falls(Straight):
        def __init__(self, *given: Any) -> None:
            super().__init__(*given)
            self.falls_above = -1.0

    class Snaps(Straight):
        def __init__(self, *given: Any) -> None:
            super().__init__(*given)
            self.leads = False

    for kind, why in ((Falls, "falls"), (Snaps, OFF_THE_PATH)):
        monkeypatch.setattr(fits, "JointPrediction", kind)
        fit = joint_fit(hypothesis(), setting())
        assert (fit.usable, fit.status, fit.chi2) == (False, why, np.inf)
        assert fit.models == {"a": "a", "b": "b"}
        assert not fit.at_bound.any()


def test_where_a_fit_ended_need_not_be_looked_at_again() -> None:
    fit = joint_fit(hypothesis(), setting())
    points = Points(hypothesis(), setting(), None)
    points.begin_at(fit)
    assert points.compressed(fit.x) is not None
    assert points.together.looked == 0  # type: ignore[attr-defined]


# The base


def ended(status: str = "", usable: bool = True, x: float = 0.0) -> JointFit:
    found: Any = SimpleNamespace(
        status=status, usable=usable, models={"a": status}, poses=status, x=np.array([0.0, x])
    )
    return found


class InTurn:
    """Fits that end one after the other as told."""

    def __init__(self, *fits: JointFit) -> None:
        self.left, self.asked = list(fits), list[Any]()

    def __call__(self, function: Any, /, *args: Any) -> JointFit:
        self.asked.append(args)
        return self.left.pop(0)


def based(monkeypatch: pytest.MonkeyPatch, *ended: JointFit) -> tuple[JointFit, InTurn]:
    monkeypatch.setattr(grounded, "replace", lambda one, **changes: SimpleNamespace(**changes))
    monkeypatch.setattr(grounded, "SolvedSpecimen", lambda model, cases, zeroed: None)
    run = InTurn(*ended)
    models: Any = SimpleNamespace(members={"a": SimpleNamespace(model="start")})
    return grounded._base_fit(models, setting(), run), run


def test_the_base_is_fitted_on_from_where_it_ended_until_it_has_arrived(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    far = [ended(f"far {n}") for n in range(4)]
    last = ended()
    found, run = based(monkeypatch, *far, last)
    assert found is last
    assert [one[0].members["a"].model for one in run.asked[1:]] == [one.status for one in far]
    assert [one[2] for one in run.asked[1:]] == [one.status for one in far]
    assert based(monkeypatch, last)[0] is last


def test_a_base_that_does_not_arrive_or_stand_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(NoBase, match="far"):
        based(monkeypatch, *[ended("far")] * 9)
    with pytest.raises(NoBase, match="falls"):
        based(monkeypatch, ended("far"), ended("falls", usable=False))


@pytest.mark.parametrize(
    ("moves", "fitted"),
    [((0.09,), 1), ((-0.11, 0.09), 2), ((0.3, -0.11, 0.0), 3), ((0.2,) * 9, 5)],
)
def test_nuisances_are_taken_again_until_the_base_stays_within_a_tenth(
    moves: Sequence[float], fitted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the logarithm of stiffness; five times at most."""
    ends = iter([ended(x=9.0), *(ended(x=one) for one in moves)])
    asked: list[Any] = []

    def base_fit(models: Any, setting: Any, run: Any) -> JointFit:
        asked.append(models)
        return next(ends)

    monkeypatch.setattr(grounded, "_base_fit", base_fit)
    monkeypatch.setattr(grounded, "_plain", lambda readings, noise: {"a": None})
    monkeypatch.setattr(grounded, "SolvedSpecimen", lambda *_: None)
    monkeypatch.setattr(grounded, "nuisance_signatures", lambda *_: ())
    monkeypatch.setattr(grounded, "with_nuisances", lambda plain, moved: moved)
    monkeypatch.setattr(grounded, "hypothesis", lambda models, *_: models)
    noise: Any = SimpleNamespace(source=grounded.REPEATS, zeroed=False)
    start = grounded.BaselineModels({}, {}, 9.0)
    one: Any = SimpleNamespace(specimen="a", cases=(), coordinates=())
    found = grounded.fit_baseline([one], noise, None, start, None)  # type: ignore[arg-type]
    assert len(asked) == 1 + fitted
    assert found.fit.x[1] == moves[fitted - 1]
    assert found.start.models is found.fit.models
