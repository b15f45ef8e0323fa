"""Motion of a cohort under its loads, as a model predicts it."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from spinepipe.api.arrays import MOTION_KEYS, MOTION_UNITS, arrays
from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames, load_cases, spine_model
from spinepipe.effects.contract import Array
from spinepipe.model import RefusedModel
from spinepipe.model.file import ModelFile, effects_for
from spinepipe.status import Status
from spinepipe.studies.cohort_stiffness.predict import motions
from spinepipe.studies.parts import Damping
from spinepipe.units import COORDINATE_COLUMNS, from_si


def simulate(
    model: ModelFile,
    cohort: Cohort,
    *,
    specimens: Sequence[str] | None = None,
    tests: Sequence[str] | None = None,
) -> xr.Dataset:
    """Equilibria of a model under the loads of a cohort, as they would be measured.

    Parameters
    ----------
    model : such as ``calibrate(cohort).model``, or `spinepipe.model.file.read_model` of a file.
    cohort : whose joint frames and loads are used.
    specimens, tests : all of the cohort by default.

    Returns
    -------
    Dataset
        Over specimen, test, cycle, step and joint: six coordinates of motion (mm and deg, from
        step 0 where the cohort's are), ``status`` and ``message``. A cycle without an equilibrium
        has its status and no numbers. ``.to_dataframe()`` gives rows.

    Examples
    --------
    >>> import spinepipe as sp
    >>> disc = sp.read_cohort("config/cohorts/l4l5_disc")
    >>> fit = sp.calibrate(disc, free=["extension"], tests=["extension"], leave_out=None)
    >>> motion = sp.simulate(fit.model, disc, specimens=disc.specimen_names[:1])
    >>> dict(motion.sizes)
    {'specimen': 1, 'test': 4, 'cycle': 1, 'step': 5, 'joint': 1}
    >>> motion["extension_deg"].attrs["units"], set(motion["status"].values.flat)
    ('deg', {'converged'})
    """
    rows = [
        row
        for specimen in specimens or cohort.specimen_names
        for row in _rows(model, cohort, specimen, tests or cohort.tests)
    ]
    return arrays(pd.DataFrame(rows), MOTION_KEYS, MOTION_UNITS)


def _rows(
    model: ModelFile, cohort: Cohort, specimen: str, tests: Sequence[str]
) -> Iterator[dict[str, Any]]:
    cases = load_cases(cohort, specimen, tests, np.zeros(3))
    effects = effects_for(model, specimen, cohort.joint_names)
    ended: list[tuple[Array | None, Status, str]] = []
    refusal = "the model has no effect for this specimen"
    if effects:
        frames, damping = joint_frames(cohort, specimen), np.array(Damping().in_order())
        try:
            spine = spine_model(cohort, specimen, frames, effects, damping)
            ended = motions(spine, cases, cohort.zeroed_at_step_0)
        except RefusedModel as error:
            refusal = str(error)
    ended = ended or [(None, Status.REFUSED, refusal)] * len(cases)
    for case, (motion, status, message) in zip(cases, ended, strict=True):
        shown = np.full((len(case.steps), len(cohort.joint_names), 6), np.nan)
        if motion is not None:
            shown = from_si(motion)
        for step, joints in zip(case.steps, shown.tolist(), strict=True):
            for joint, values in zip(cohort.joint_names, joints, strict=True):
                yield {
                    "specimen": specimen,
                    "test": case.test,
                    "cycle": case.cycle,
                    "step": step.step,
                    "joint": joint,
                    **dict(zip(COORDINATE_COLUMNS, values, strict=True)),
                    "status": status.value,
                    "message": message,
                }
