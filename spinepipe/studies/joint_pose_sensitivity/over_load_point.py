"""Job: the stiffness of one specimen with the load at each point of a grid, its own joint poses.

Motion tells where a load acted only as far as the cost rises elsewhere, all stiffnesses fitted
anew: the grid is a profile of the cost over the load point. The cost is the sum of squared errors
of motion, mm and degrees, by the study's weights. Load points whose cost has risen by no more than
the scatter of the readings explains are allowed: an F test, with the degrees of freedom that are
left when the load point, too, is an unknown.

Shifts are in ground axes, mm, anterior and superior positive, beside ``load_point_shift_mm``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from scipy.stats import f

from spinepipe.calibration import fit
from spinepipe.cohort.measured import measured_specimen
from spinepipe.designs import specimen_seed
from spinepipe.jobs.digest import provenance
from spinepipe.model import RefusedModel
from spinepipe.status import Status
from spinepipe.studies.joint_pose_sensitivity.inputs import study_and_cohort
from spinepipe.studies.joint_pose_sensitivity.problem import calibration_problem, fit_rows
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import STIFFNESS_OVER_LOAD_POINT
from spinepipe.tables import from_rows, write
from spinepipe.units import MM_PER_M

LEVEL = 0.95
"""Confidence level of the region of load points that the readings allow."""


def run(root: str, study: str, specimen: str, output: str) -> None:
    """Write the rows of one specimen: one, or one per joint, for each load point of the grid."""
    settings, cohort = study_and_cohort(root, study)
    asked = settings.load_point
    points = tuple(product(asked.anterior_mm, asked.superior_mm))
    tried = [_rows(root, settings, specimen, *point) for point in points]
    unknowns = sum(len(shifts) > 1 for shifts in (asked.anterior_mm, asked.superior_mm))
    # joints of a load point are fitted together: the first row has the cost of all
    flags = allowed([rows[0] for rows in tried], unknowns)
    rows = [{**row, "allowed": flag} for at, flag in zip(tried, flags, strict=True) for row in at]
    # rows of a fit that was refused lack columns: empty cells
    names = [column.name for column in STIFFNESS_OVER_LOAD_POINT.columns]
    whole = [{**dict.fromkeys(names), **row} for row in rows]
    made_by = provenance("over_load_point", settings, cohort, [specimen])
    write(from_rows(STIFFNESS_OVER_LOAD_POINT, whole), output, made_by)


def allowed(fits: Sequence[Mapping[str, Any]], unknowns: int) -> list[bool | None]:
    """Which load points the readings allow, None where that cannot be told.

    Parameters
    ----------
    fits : of each point its ``cost`` (None where there is no fit) and ``degrees_of_freedom``,
        readings less fitted stiffnesses.
    unknowns : how many coordinates of the load point the grid varies, 0 to 2; with 0 there is no
        telling.

    The least cost is that of the best point of the grid, which may be a little above the true one.
    """
    known = [one for one in fits if one["cost"] is not None]
    if not known:
        return [None] * len(fits)
    best = min(known, key=lambda one: one["cost"])
    least, left = float(best["cost"]), int(best["degrees_of_freedom"]) - unknowns
    if left < 1 or unknowns < 1:
        return [None] * len(fits)
    # profile likelihood, the variance of readings unknown: at the true load point
    # (cost - least) / unknowns over least / left has an F distribution (unknowns, left), exactly
    # where motion is linear in all unknowns and errors are normal and independent
    highest = least * (1.0 + unknowns * float(f.ppf(LEVEL, unknowns, left)) / left)
    return [None if one["cost"] is None else bool(one["cost"] <= highest) for one in fits]


def _rows(
    root: str, settings: JointPoseSensitivity, specimen: str, anterior: float, superior: float
) -> list[dict[str, Any]]:
    """Rows of the fit with every load point of the specimen moved, mm; as of `fit_rows`.

    The joint poses are the cohort's own. A model that is refused has rows without numbers.
    """
    _, cohort = study_and_cohort(root, settings.study)
    options = settings.calibration
    # one seed for all points: fits differ by the load, and not by where they start
    seed = specimen_seed(settings.seed, f"load_point/{specimen}")
    try:
        stated = np.array(settings.load_point_shift_mm.in_order())
        shift = (stated + np.array([anterior, superior, 0.0])) / MM_PER_M
        tested = measured_specimen(cohort, specimen, settings.tests or cohort.tests, shift).tested
        problem = replace(calibration_problem(root, settings, specimen), cases=tested)
        found = fit(problem, options.starts, seed, options.identifiable_below, profiled=True)
        rows = fit_rows(problem, found, options.grouping)
    except RefusedModel as error:
        ended = {"cost": None, "degrees_of_freedom": 0, "status": Status.REFUSED.value}
        names = ("*",) if options.grouping == "per_specimen" else cohort.joint_names
        rows = [{"joint": name, **ended, "message": str(error)} for name in names]
    key = {"specimen": specimen, "anterior_shift_mm": anterior, "superior_shift_mm": superior}
    return [{**key, **row} for row in rows]
