"""Sensitivities to loads and joint poses are slopes of motion solved afresh.

Catches a wrong derivative by load, joint pose or stiffness.
"""

import numpy as np
import pytest
from example_effects import (
    CubicStiffening,
    JointCentreOffset,
    Laxity,
    loaded,
    scoped,
    slope,
    spine,
)

from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array
from spinepipe.model import LoadCase, LoadStep, SpineModel
from spinepipe.statics import (
    System,
    by_parameters,
    follow,
    free_parameters,
    with_parameters,
)
from spinepipe.world import Chain

LAWS = (
    scoped(CubicStiffening(), (0, 2)),
    scoped(Laxity(), (1,)),
    scoped(JointCentreOffset(), (0, 2), (0.008, -0.006)),
)
EFFECTS = [pytest.param((), id="springs"), pytest.param(LAWS, id="laws and geometry")]


def pose_of(model: SpineModel, case: LoadCase) -> Array:
    """(n,) pose at the end of a case."""
    return follow(System(Chain(model), model, case))[-1].equilibrium.q


def assert_close(found: Array, expected: Array) -> None:
    # poses are solved to 1e-13; what is left is the difference's own error
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_stiffness_shared_by_joints_and_joint_by_joint() -> None:
    model = spine(3, effects=LAWS)
    case = loaded(model, 2)
    system = System(Chain(model), model, case)
    solved = follow(system)
    names = ["extension_nm_per_rad", "superior_n_per_m"]
    shared = free_parameters(model, 0, names, "per_specimen")
    single = free_parameters(model, 0, names, "per_joint")
    assert [p.label for p in shared] == names
    assert [p.label for p in single][:2] == [f"{names[0]}@L3L4", f"{names[0]}@L2L3"]
    by_shared, by_single = (by_parameters(system, solved, free)[-1] for free in (shared, single))
    # unknowns are logarithms: a shared one moves all, so derivatives add up
    np.testing.assert_allclose(by_single.reshape(18, 2, 3).sum(axis=2), by_shared, atol=1e-15)
    for column, unit in enumerate(np.eye(2)):

        def motion(h: float, along: Array = unit) -> Array:
            return pose_of(with_parameters(model, shared, h * along), case)

        assert_close(by_shared[:, column], slope(motion, 0.02))


def test_unknown_parameters_and_groupings_are_refused() -> None:
    with pytest.raises(ValueError, match="no parameter 'stiffness'"):
        free_parameters(spine(1), 0, ["stiffness"], "per_joint")
    with pytest.raises(ValueError, match="per_specimen or per_joint"):
        free_parameters(spine(1), 0, ["extension_nm_per_rad"], "per_level")


def test_a_step_without_equilibrium_has_no_sensitivity() -> None:
    model = spine(2)
    press = Wrench(1, model.bodies[1].com, np.array([0.0, -5e4, 0.0]), np.zeros(3))
    system = System(Chain(model), model, LoadCase("press", 1, (LoadStep(4, (press,)),)))
    solved = follow(system)
    with pytest.raises(ValueError, match="step 4 has no equilibrium"):
        by_parameters(system, solved, ())
