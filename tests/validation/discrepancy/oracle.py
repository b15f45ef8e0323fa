"""What anybody could name: how far the truth is ahead of its best rival on data without noise.

Readings are replaced by what was true of them; their noise counts as it did. The truth and its
rivals are fitted as a search fits them, and m is the log evidence by which the truth is ahead of
the best set of names without it. Noise scatters m by sqrt(2 m): a cohort is nameable with the
probability that more than `NEEDED` of it is left.
"""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.stats import norm

from spinepipe import cohort as cohorts
from spinepipe.progress import Progress
from spinepipe.studies.discrepancy.search.investigation import Prepared, fit_base
from spinepipe.studies.discrepancy.search.posterior import Posterior, names_of
from spinepipe.studies.discrepancy.search.readings import (
    SpecimenReadings,
    specimen_readings,
)
from spinepipe.studies.discrepancy.search.search_state import Rules
from spinepipe.studies.discrepancy.search.something_else import TABLE
from spinepipe.studies.discrepancy.store import at_once
from tests.generators.hidden import KNOWN, Truth, make

NEEDED = 3.0
"""Log evidence of odds of 20 to 1."""

MOST_FITS = 40


def oracle(ready: Prepared, rules: Rules, truth: Truth) -> dict[str, Any]:
    """How far the truth is ahead, and how probable it is that noise leaves enough of that.

    Parameters
    ----------
    ready : the study with readings as they were made, noise included.
    """
    names = frozenset(hidden.name for hidden in truth.recipe.hidden)
    if not names or not names <= set(KNOWN):
        return {}
    with TemporaryDirectory() as place:
        make(replace(truth.recipe, noise="none"), Path(place) / "hidden")
        cohort = cohorts.read(Path(place) / "hidden")
    clean = replace(ready, readings=tuple(true_readings(one, cohort) for one in ready.readings))
    posterior = Posterior(fit_base(clean, at_once), replace(rules, most_fits=MOST_FITS))
    posterior.explore(at_once, Progress())
    own, rivals = -np.inf, [0.0]  # nothing missing is a rival too
    for one in posterior.fitted.values():
        if all(form.name != TABLE for form in one.forms):
            if names_of(one.forms) == names:
                own = max(own, one.log_evidence)
            elif not names <= names_of(one.forms):
                rivals.append(one.log_evidence)
    ahead = float(max(own - max(rivals), -1e6))
    if ahead <= 0.0:
        return {"ahead": ahead, "nameable": 0.0}
    return {"ahead": ahead, "nameable": float(norm.cdf((ahead - NEEDED) / np.sqrt(2.0 * ahead)))}


def true_readings(one: SpecimenReadings, without_noise: cohorts.Cohort) -> SpecimenReadings:
    """The readings as they truly were, in every cycle that was read."""
    names = [test.case.test for test in one.tests]
    asked = sorted(dict.fromkeys(names))
    true = specimen_readings(without_noise, one.specimen, asked, one.coordinates).tests
    tests = [
        replace(read, cycles=np.where(np.isfinite(read.cycles), clean.cycles, np.nan))
        for read, clean in zip(one.tests, true, strict=True)
    ]
    return replace(one, tests=tuple(tests))
