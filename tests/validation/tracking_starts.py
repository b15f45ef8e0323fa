"""Whether searches of tracking end in one place: all shipped calibrations, begun from elsewhere."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion.trajectory import SMALL, OptimalMotions, solve
from spinepipe.progress import Progress
from spinepipe.studies.tracking.approaches import (
    calibration_objective,
    first_guess,
    sample_at_nodes,
)
from spinepipe.studies.tracking.persons import person_of
from spinepipe.studies.tracking.settings import LEARNT, Tracking
from spinepipe.studies.tracking.trials import trials_of_law

STUDY = "tracking_phantom"
DRAWN = 2
"""Starts with elements drawn from their prior, of which far ones are never met by the study."""

SAME = 0.05
"""Of a logarithm of stiffness: two searches that end nearer each other have found one optimum."""

Row = dict[str, Any]


def table() -> pd.DataFrame:
    """A row for each person and calibration."""
    root = str(Path(__file__).parents[2])
    study, cohort = study_of_kind(Tracking, root, STUDY)
    cases = [(who, law) for who in cohort.specimen_names for law in LEARNT]
    rows = []
    for who, law in Progress(lambda line: print(line, flush=True)).through(cases, "calibrations"):
        person = person_of(cohort, who, cohort.folder, study.scaling)
        ask, names = calibration_objective(study, person), trials_of_law(cohort, who, law)
        trials = [one for one in person.trials if one.name in names]
        known = [first_guess(ask, sample_at_nodes(study, person, one)) for one in trials]
        seen, begin = [one for one, _ in known], [start for _, start in known]
        first = solve(ask, seen, begin)
        again = solve(ask, seen, first.coefficients, first.parameters)
        rng = np.random.default_rng(37)
        prior = np.repeat([ask.sizes.size, ask.sizes.shape], ask.parameters // 2)
        straight = [np.where(np.arange(18)[:, None] == 0, one, 0.0) for one in begin]
        others = [solve(ask, seen, straight)]
        for _ in range(DRAWN):
            others.append(solve(ask, seen, begin, prior * rng.normal(size=len(prior))))
        rows.append({"specimen": who, "law": law} | _row(first, again, others))
    return pd.DataFrame(rows)


def _row(first: OptimalMotions, again: OptimalMotions, others: list[OptimalMotions]) -> Row:
    found = [first, again, *others]
    ended = [one for one in found if one.status.usable]
    optima = list(_apart(ended))
    return {
        "starts": len(found),
        "converged": len(ended),
        "optima": len(optima),
        "cost": first.cost,
        "least_cost": min(one.cost for one in ended),
        "largest_cost": max(one.cost for one in ended),
        "gained_again": first.cost - again.cost,
        "stiffness_again": float(np.exp(np.abs(again.parameters - first.parameters).max())),
        "steps": first.steps,
    }


def _apart(found: list[OptimalMotions]) -> Iterator[OptimalMotions]:
    """One of each optimum, the lowest first."""
    known: list[OptimalMotions] = []
    for one in sorted(found, key=lambda one: one.cost):
        if all(np.abs(one.parameters - other.parameters).max() > SAME for other in known):
            known.append(one)
            yield one


HEAD = (
    "Calibrations of the shipped study, each from five starts: postures of each frame by itself, "
    "as the study has it; its own answer; joints that do not turn; and the first postures with "
    f"{DRAWN} draws of all elements from their prior (SD of A 0.7, of B 0.35, in logarithms). Two "
    f"ends are two optima where a logarithm of stiffness differs by more than {SAME:g}. A search "
    f"ends where an undamped step is predicted to gain less than {SMALL:g}. gained_again, "
    "stiffness_again: what the search gains from its own answer, and the factor by which it moves "
    "A or B."
)
