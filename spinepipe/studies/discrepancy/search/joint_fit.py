"""Fits of a hypothesis to all specimens at once, in whitened readings; weak priors, bounds."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.calibration.descent import OFF_THE_PATH, DescentTolerances, descend
from spinepipe.calibration.loss import counted
from spinepipe.effects.contract import Array
from spinepipe.model import RefusedModel, SpineModel
from spinepipe.statics import with_parameters
from spinepipe.studies.discrepancy.search.hypothesis import Hypothesis
from spinepipe.studies.discrepancy.search.prediction import (
    JointPrediction,
    NoEquilibrium,
    Predicted,
    PredictedSpecimen,
)
from spinepipe.studies.discrepancy.search.readings import SpecimenReadings
from spinepipe.studies.discrepancy.search.whitening import Whitening

SETTLED = DescentTolerances(cost=1e-5, step=1e-6, slope=1e-10, evaluations=20)
"""Chi2 settles to a share at which a log evidence is right to 0.01 or so."""


@dataclass(frozen=True)
class Setting:
    """What fits of one study share.

    Attributes
    ----------
    readings, whitenings : by specimen.
    """

    readings: Mapping[str, SpecimenReadings]
    whitenings: Mapping[str, Whitening]
    zeroed: bool


@dataclass(frozen=True)
class JointFit:
    """Where a fit ended.

    Attributes
    ----------
    x : (m,) unknowns, moves from the hypothesis' start. models : by specimen, with fitted values.
    chi2 : sum of squared whitened residuals. residuals, jacobians : by specimen, whitened (N,) and
        (N, own unknowns). predicted, poses : by specimen, per test (T, J, 6) and (T, n).
    at_bound : (m,) bool. status : empty where all went well, else why not.
    """

    hypothesis: Hypothesis
    x: Array
    models: Mapping[str, SpineModel]
    chi2: float
    residuals: Mapping[str, Array]
    jacobians: Mapping[str, Array]
    predicted: Mapping[str, tuple[Array, ...]]
    poses: Mapping[str, tuple[Array, ...]]
    at_bound: NDArray[np.bool_]
    status: str

    @property
    def usable(self) -> bool:
        """Whether there is a fit at all."""
        return bool(self.residuals)

    def whole_jacobian(self) -> Array:
        """(N, m) of all specimens, in their order."""
        members, count = self.hypothesis.members, len(self.x)
        return np.concatenate(
            [members[name].among_all(own, count) for name, own in self.jacobians.items()]
        )


Near = Mapping[str, tuple[Array, ...]] | None

Evaluated = tuple[dict[str, Array], dict[str, Array], dict[str, Predicted]]
"""By specimen: whitened residuals (N,), their Jacobian by own unknowns (N, k), the prediction."""


class Points:
    """A hypothesis at any values of its unknowns; the last point is kept."""

    def __init__(self, hypothesis: Hypothesis, setting: Setting, near: Near) -> None:
        self.hypothesis, self.setting = hypothesis, setting
        subjects = {
            name: PredictedSpecimen(member.model, setting.readings[name].cases, member.free)
            for name, member in hypothesis.members.items()
        }
        self.together = JointPrediction(subjects, setting.zeroed, near)
        self.sd = np.array([u.sd for u in hypothesis.unknowns])
        self.mean = np.array([u.mean for u in hypothesis.unknowns])
        self.known: dict[bytes, Evaluated] = {}
        self.trouble = ""

    def begin_at(self, fit: "JointFit") -> None:
        """What a fit in the same setting has where it ended need not be solved again."""
        self.known = {fit.x.tobytes(): (dict(fit.residuals), dict(fit.jacobians), {})}

    def at(self, x: Array) -> Evaluated | None:
        """What there is at x (m,); None where there is no equilibrium, ``trouble`` says why."""
        key = x.tobytes()
        if key in self.known:
            return self.known[key]
        try:
            predictions = self.together.at(self.own(x))
        except (NoEquilibrium, RefusedModel) as trouble:
            self.trouble = str(trouble)
            return None
        residuals, jacobians = {}, {}
        for name, predicted in predictions.items():
            white = self.setting.whitenings[name]
            errors = white(self.setting.readings[name].errors(predicted.readings))
            residuals[name], slopes = counted(errors)
            jacobians[name] = slopes[:, None] * white(predicted.by_x)
        self.known = {key: (residuals, jacobians, predictions)}
        return self.known[key]

    def own(self, x: Array) -> dict[str, Array]:
        """The unknowns of each specimen."""
        return {name: x[list(one.numbers)] for name, one in self.hypothesis.members.items()}

    def compressed(self, x: Array) -> tuple[Array, Array] | None:
        """Residual and Jacobian of the same cost, a few rows per specimen, priors behind."""
        found = self.at(x)
        if found is None:
            return None
        rows, targets = [], []
        for name, member in self.hypothesis.members.items():
            # [J r] = Q R: R has the same sums of squares in as few rows as there are unknowns
            own = np.column_stack([found[1][name], found[0][name]])
            triangle = np.linalg.qr(own).R
            rows.append(member.among_all(triangle[:, :-1], len(x)))
            targets.append(triangle[:, -1])
        rows.append(np.diag(1.0 / self.sd))
        targets.append((x - self.mean) / self.sd)
        return np.concatenate(targets), np.concatenate(rows)


def joint_fit(hypothesis: Hypothesis, setting: Setting, near: Near = None) -> JointFit:
    """The hypothesis at its most likely point; weak priors on what no reading tells.

    Parameters
    ----------
    near : poses of a fit that the first ones are looked for near by.
    """
    points = Points(hypothesis, setting, near)
    low = np.array([u.low for u in hypothesis.unknowns])
    high = np.array([u.high for u in hypothesis.unknowns])
    start = np.clip(np.zeros(len(low)), low, high)
    begun = points.compressed(start)
    if begun is None:
        return _nowhere(hypothesis, start, points.trouble)
    scale = np.array([u.step for u in hypothesis.unknowns])
    ended = descend(points.compressed, start, (low, high), scale, len(begun[0]), SETTLED)
    status = "" if ended.arrived else SETTLED.given_up
    # a descent keeps strictly inside its bounds: this close, one is reached
    x, at_bound = ended.x, (ended.x - low < 1e-6) | (high - ended.x < 1e-6)
    found = points.at(x)
    # followed from near poses, a fit may end on a branch that the load path never comes to
    if found is None or not points.together.leads_to(points.own(x), found[2]):
        return _nowhere(hypothesis, x, OFF_THE_PATH)
    residuals, jacobians, predicted = found
    models = {
        name: with_parameters(member.model, member.free, x[list(member.numbers)])
        for name, member in hypothesis.members.items()
    }
    chi2 = float(sum(r @ r for r in residuals.values()))
    readings = {name: one.readings for name, one in predicted.items()}
    poses = {name: one.poses for name, one in predicted.items()}
    return JointFit(
        hypothesis, x, models, chi2, residuals, jacobians, readings, poses, at_bound, status
    )


def _nowhere(hypothesis: Hypothesis, x: Array, why: str) -> JointFit:
    models = {name: member.model for name, member in hypothesis.members.items()}
    nothing = np.zeros(len(x), dtype=bool)
    return JointFit(hypothesis, x, models, np.inf, {}, {}, {}, {}, nothing, why)
