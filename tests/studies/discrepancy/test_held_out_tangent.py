"""The linear models of folds: slopes of re-solved motion, nuisances, terms of the surrogate."""

import numpy as np
import pytest
from held_out_cases import JOINTS, MOMENTS_NM, SD, found, grounds, read

from spinepipe.statics import with_parameters
from spinepipe.studies.discrepancy.proof.fold_linear import surrogate, tangent
from spinepipe.studies.discrepancy.search.nuisance import NuisancePriors, nuisance_signatures
from spinepipe.studies.discrepancy.search.prediction import Simulated, SolvedSpecimen

STEPS = len(MOMENTS_NM)


def test_the_tangent_is_the_slope_of_re_solved_motion() -> None:
    readings = read({"a": 40.0, "b": 60.0}, ("flexion", "bending"), zone=True)
    final = found(grounds(readings, NuisancePriors()), True).final
    near = tangent(final, 1.0).members["b"]
    member, size = final.fit.hypothesis.members["b"], 1e-5
    x = final.fit.x[list(member.numbers)]
    for number in range(len(x)):
        ends = []
        for sign in (1.0, -1.0):
            model = with_parameters(
                member.model, member.free, x + sign * size * np.eye(len(x))[number]
            )
            ends.append(Simulated(model, readings[1].cases, False, ()).at(np.zeros(0)).readings)
        for by_x, high, low in zip(near.by_x, *ends, strict=True):
            slope = (high - low) / (2.0 * size)
            assert by_x[..., 3:, number] == pytest.approx(slope[..., 3:], abs=1e-6)
            assert (by_x[..., :3, number] == 0.0).all()  # not read


def test_nuisances_of_the_tangent_have_the_covariance_of_their_priors() -> None:
    readings = read({"a": 40.0}, ("flexion", "bending"), zone=False)
    priors = NuisancePriors()
    base = grounds(readings, priors)
    columns = np.concatenate(
        [
            one[..., 3:, :].reshape(-1, one.shape[-1])
            for one in tangent(base, 1.0).members["a"].nuisances
        ]
    )
    # linearised at the fit before nuisances were allowed for: 1e-4 away
    cases = readings[0].cases
    solved = SolvedSpecimen(base.fit.models["a"], cases, False)
    moved_by = nuisance_signatures(solved, priors)
    given = np.concatenate([one[..., 3:, :].reshape(-1, one.shape[-1]) for one in moved_by])
    assert columns @ columns.T == pytest.approx(given @ given.T, rel=1e-3, abs=(1e-2 * SD) ** 2)


def test_the_surrogate_is_the_base_with_terms_of_all_joints_and_of_each() -> None:
    readings = read({"a": 40.0, "b": 60.0}, ("flexion", "bending"), zone=False)
    base = grounds(readings)
    model = surrogate(base, 1.0)
    known = len(base.fit.x)
    one = model.members["a"]
    first, added = one.by_x[0], len(model.mean) - known
    own = added * JOINTS // (JOINTS + 1)
    # terms of a kind stand together, a column for each joint
    each = first[..., 3 : 3 + own].reshape(STEPS, JOINTS, 6, -1, JOINTS)
    assert first[..., 3 + own :] == pytest.approx(each.sum(axis=-1))
    assert (model.sd[known:] == 1.0).all()
    assert np.isinf(model.high[known:]).all()
    assert one.numbers[3:].tolist() == model.members["b"].numbers[3:].tolist()
