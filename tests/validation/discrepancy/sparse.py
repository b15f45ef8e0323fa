"""How often sparse regressions invent a term where nothing is missing: ours beside others.

Cohorts of springs, of the generator that shares no mechanics with the library. All see the same
problem, readings whitened, base and nuisances taken out; columns are the terms of joint laws at
each joint and at all. Others are of scikit-learn and pysindy.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from pysindy.optimizers import STLSQ
from scipy.stats import binomtest
from sklearn.linear_model import LassoCV, LassoLarsIC, OrthogonalMatchingPursuitCV

from spinepipe import cohort as cohorts
from spinepipe.effects.contract import Array
from spinepipe.studies.discrepancy.search.baseline import BaselineFit
from spinepipe.studies.discrepancy.search.formula import (
    EVERYWHERE,
    formula,
    pursuit_problem,
    terms_of,
)
from spinepipe.studies.discrepancy.search.investigation import fit_base, prepare
from spinepipe.studies.discrepancy.store import at_once
from tests.generators.hidden import make
from tests.validation.discrepancy.designs import plain, soiled, with_effects
from tests.validation.discrepancy.row import STUDY

FIRST_SEED, COHORTS = 900_000, 24
"""Of each kind; apart from all seeds that searches are tuned or scored on."""

DRAWS, FALSE_ALARM = 300, 0.01
FOLDS = 5
STLSQ_SDS = 3.0
"""Coefficients below so many SDs of their own are dropped by sequential thresholding."""

KINDS = {"null": "", "square": "quadratic_cross_coupling"}
"""What is hidden; of the square it is known which term is the right one."""


def _lasso(columns: Array, y: Array) -> Array:
    return np.asarray(LassoCV(cv=FOLDS, fit_intercept=False).fit(columns, y).coef_)


def _lasso_bic(columns: Array, y: Array) -> Array:
    model = LassoLarsIC(criterion="bic", fit_intercept=False, noise_variance=1.0)
    return np.asarray(model.fit(columns, y).coef_)


def _matching_pursuit(columns: Array, y: Array) -> Array:
    most = min(10, columns.shape[1])
    model = OrthogonalMatchingPursuitCV(cv=FOLDS, fit_intercept=False, max_iter=most)
    return np.asarray(model.fit(columns, y).coef_)


def _sindy(columns: Array, y: Array) -> Array:
    """Sequentially thresholded least squares of pysindy; columns have length 1, so SDs are 1."""
    model = STLSQ(threshold=STLSQ_SDS, alpha=1.0, unbias=False)
    return np.asarray(model.fit(columns, y[:, None]).coef_).ravel()


OTHERS: dict[str, Callable[[Array, Array], Array]] = {
    "lasso, cross-validated (scikit-learn)": _lasso,
    "lasso, BIC (scikit-learn)": _lasso_bic,
    "matching pursuit, cross-validated (scikit-learn)": _matching_pursuit,
    "STLSQ (pysindy)": _sindy,
}


def grounds_of(seed: int, hidden: str) -> BaselineFit:
    """A base fitted to a cohort: springs, or springs and one thing more, with the usual dirt."""
    recipe = soiled(plain(seed), 0.5)
    if hidden:
        recipe = with_effects(recipe, hidden)
    with TemporaryDirectory() as place:
        make(recipe, Path(place) / "hidden")
        cohort = cohorts.read(Path(place) / "hidden")
    return fit_base(prepare(STUDY, cohort, None), at_once)


def counted(grounds: BaselineFit) -> Mapping[str, tuple[int, str]]:
    """Number of terms that each takes, and the words of its strongest."""
    coordinates = next(iter(grounds.readings.values())).coordinates
    ours = formula(grounds, coordinates, DRAWS, 0, FALSE_ALARM)
    first = "" if ours is None else f"{ours.terms[0].coordinate}: {ours.terms[0].term}"
    found = {"formula (spinepipe)": (0 if ours is None else len(ours.terms), first)}
    problem = pursuit_problem(grounds, terms_of(grounds, coordinates), 0, 0)
    every = [one for one in problem.candidates() if one.specimen == EVERYWHERE]
    columns = np.column_stack([problem.column(one) for one in every])
    columns = columns - problem.shared @ (problem.shared.T @ columns)
    sizes = np.linalg.norm(columns, axis=0)
    there = np.flatnonzero(sizes > 1e-6 * sizes.max())
    for name, regression in OTHERS.items():
        taken = regression(columns[:, there] / sizes[there], problem.errors[:, 0])
        law = problem.terms[every[there[int(np.argmax(np.abs(taken)))]].term]
        words = f"{law.coordinate}: {law.words}" if taken.any() else ""
        found[name] = (int(np.count_nonzero(taken)), words)
    return found


RIGHT = "right_bending: extension^2"


def table(number: int = COHORTS) -> pd.DataFrame:
    """How often each regression takes any term, and the right one first, by what was hidden."""
    rows = []
    for place, (kind, hidden) in enumerate(KINDS.items()):
        seeds = range(FIRST_SEED + 1000 * place, FIRST_SEED + 1000 * place + number)
        found = [counted(grounds_of(seed, hidden)) for seed in seeds]
        for name in found[0]:
            counts = [one[name][0] for one in found]
            some = sum(count > 0 for count in counts)
            ends = binomtest(some, len(counts)).proportion_ci(0.95, "wilson")
            rows.append(
                {
                    "regression": name,
                    "hidden": kind,
                    "cohorts": len(counts),
                    "takes_a_term": some,
                    "low_percent": 100.0 * ends.low,
                    "high_percent": 100.0 * ends.high,
                    "mean_terms": float(np.mean(counts)),
                    "right_term_first": sum(one[name][1] == RIGHT for one in found)
                    if hidden
                    else None,
                }
            )
    return pd.DataFrame(rows)
