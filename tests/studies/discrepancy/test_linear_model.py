"""What a part of the readings says of the rest, against covariance matrices written out."""

import numpy as np
import pytest
from sweeps import sweep

from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.proof.linear_model import LinearModel, SpecimenRows, Trained

pytestmark = pytest.mark.numeric

ROWS = 30
LEFT_OUT = np.arange(ROWS) % 3 == 0


def linear_model(low: float = -np.inf, high: float = np.inf) -> LinearModel:
    """Two specimens with two unknowns in common and one of their own, and three nuisances each."""
    rng = np.random.default_rng(7)
    members = {
        name: SpecimenRows(
            rng.normal(size=(ROWS, 3)),
            rng.normal(size=(ROWS, 3)),
            rng.normal(size=ROWS),
            np.array([0, 1, own]),
        )
        for name, own in (("a", 2), ("b", 3))
    }
    sd = rng.uniform(0.5, 2.0, 4)
    return LinearModel(members, rng.normal(size=4), sd, np.full(4, low), np.full(4, high))


def dense(model: LinearModel) -> tuple[Array, Array, Array]:
    """Mean (60,) and covariance (60, 60) of all readings before any is seen, and these."""
    wide = np.zeros((2 * ROWS, 10))
    for number, one in enumerate(model.members.values()):
        at = slice(number * ROWS, (number + 1) * ROWS)
        wide[at, one.numbers] = one.by_x
        wide[at, 4 + 3 * number + np.arange(3)] = one.by_z
    mean = wide[:, :4] @ model.mean
    covariance = np.eye(2 * ROWS) + wide @ np.diag([*model.sd**2, *np.ones(6)]) @ wide.T
    return mean, covariance, np.concatenate([one.missed for one in model.members.values()])


def test_the_training_conditions_a_normal_distribution() -> None:
    model = linear_model()
    trained = Trained(model, dict.fromkeys("ab", ~LEFT_OUT))
    mean, covariance, seen = dense(model)
    train = np.flatnonzero(np.tile(~LEFT_OUT, 2))
    for number, name in enumerate("ab"):
        out = number * ROWS + np.flatnonzero(LEFT_OUT)
        gain = np.linalg.solve(covariance[np.ix_(train, train)], covariance[np.ix_(train, out)]).T
        missed = seen[out] - mean[out] - gain @ (seen - mean)[train]
        assert trained.missed(name, LEFT_OUT) == pytest.approx(missed)
        left = covariance[np.ix_(out, out)] - gain @ covariance[np.ix_(train, out)]
        (told,), count = trained.told(name, LEFT_OUT, missed)
        assert count == len(out)
        assert told @ told == pytest.approx(missed @ np.linalg.solve(left, missed))


def test_what_the_training_leaves_open_is_taken_out() -> None:
    """An unknown that moves left-out readings alone, and by more than their noise."""
    model = linear_model()
    model.members["a"].by_x[~LEFT_OUT, 2] = 0.0
    trained = Trained(model, dict.fromkeys("ab", ~LEFT_OUT))
    missed = trained.missed("a", LEFT_OUT)
    more = missed + 7.0 * model.members["a"].by_x[LEFT_OUT, 2]
    (one, other), count = trained.told("a", LEFT_OUT, missed, more)
    assert count == LEFT_OUT.sum() - 1
    assert np.linalg.norm(one - other) < 0.2 * np.linalg.norm(more - missed)


@sweep("limit", [0.01, 1e9])
def test_unknowns_stay_inside_their_bounds(limit: float) -> None:
    free = Trained(linear_model(), dict.fromkeys("ab", ~LEFT_OUT)).x
    x = Trained(linear_model(-limit, limit), dict.fromkeys("ab", ~LEFT_OUT)).x
    assert np.abs(x).max() <= limit
    assert (limit == 1e9) == (x == pytest.approx(free))
