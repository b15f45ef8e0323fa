"""Which stiffness a study fits that names none: along what was loaded and measured.

A stiffness along a coordinate that no load acts on keeps its start in any fit; it would look like
an answer. Weights that the study gives count: what has none is not measured, for a fit.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from spinepipe.anatomy.stiffness_range import middle
from spinepipe.cohort import Cohort
from spinepipe.cohort.load_response import UNSURE_M, joint_loads
from spinepipe.cohort.measured import measured_specimen
from spinepipe.documents.yaml_text import read_yaml
from spinepipe.effects.contract import Array
from spinepipe.problems import InputProblem, one_of
from spinepipe.studies.parts import AUTO
from spinepipe.studies.study import STUDIES
from spinepipe.units import COORDINATE_COLUMNS, COORDINATES, TRANSLATIONS

LEAST_SHARE = 0.1
"""A coordinate is loaded where its load would move it by this share of what the largest translation
or rotation is, at usual stiffness."""


def free_coordinates(calibration: Any, cohort: Cohort, tests: Sequence[str] | None) -> Any:
    """The settings of a calibration with coordinates in place of `auto`.

    A free coordinate whose weight the study does not give counts as the settings say, or, where
    they leave it out, with 1 (per mm2 or deg2).

    Parameters
    ----------
    calibration : with ``free`` and ``weights``. tests : that are used; None stands for all.
    """
    if calibration is None or calibration.free != (AUTO,):
        return calibration
    weights = calibration.weights
    given = weights.model_fields_set if "weights" in calibration.model_fields_set else frozenset()
    found = [
        name
        for name in loaded_and_measured(cohort, tests or cohort.tests)
        if name not in given or getattr(weights, name) > 0.0
    ]
    if not found:
        return calibration
    counted = {name: getattr(weights, name) or 1.0 for name in found}
    return calibration.model_copy(
        update={"free": tuple(found), "weights": weights.model_copy(update=counted)}
    )


def loaded_and_measured(cohort: Cohort, tests: Sequence[str]) -> tuple[str, ...]:
    """Coordinates that were read in a joint on which the same test had a load along them."""
    found = np.zeros(len(COORDINATES), dtype=bool)
    if cohort.motion is None or cohort.loads is None or not cohort.has_frames:
        return ()
    for specimen in cohort.specimen_names:
        one = measured_specimen(cohort, specimen, [name for name in cohort.tests if name in tests])
        for cycle in one.tested:
            loaded = _moves(joint_loads(one.frames, cycle.case))
            read = np.isfinite(cycle.readings).any(axis=0)
            found |= (read & (loaded >= LEAST_SHARE)).any(axis=0)
    return tuple(name for name, is_one in zip(COORDINATES, found, strict=True) if is_one)


def _moves(loads: Array) -> Array:
    """(J, 6) how far loads (T, J, 6) would move each coordinate, over the largest of its kind.

    Forces turn a joint whose centre is known to `UNSURE_M` only by at least that arm.
    """
    kinds = len(TRANSLATIONS)
    range_of = np.ptp(loads, axis=0) if len(loads) > 1 else np.abs(loads[0])
    forces = np.linalg.norm(range_of[:, :kinds], axis=1, keepdims=True)
    range_of[:, kinds:] = np.maximum(range_of[:, kinds:], UNSURE_M * forces)
    moved = range_of / np.array([middle(name) for name in COORDINATES])
    for kind in (slice(0, kinds), slice(kinds, None)):
        moved[:, kind] /= moved[:, kind].max() or 1.0
    share: Array = moved
    return share


def settle_calibration(study: Any, cohort: Cohort) -> Any:
    """A study with ``calibration`` and ``tests`` whose `auto` is put into coordinates."""
    calibration = free_coordinates(study.calibration, cohort, study.tests)
    same = calibration is study.calibration
    return study if same else study.model_copy(update={"calibration": calibration})


def unmeasured(root: Path, study: Any, cohort: Cohort) -> tuple[InputProblem, ...]:
    """Coordinates that a study frees by name though nobody measured them: told, not refused.

    Their stiffness may show in what others do, but mostly keeps its start or the bound it hits.
    """
    holder = getattr(study, "calibration", None)
    key = "free" if holder is None else "calibration.free"
    holder = study if holder is None else holder
    if cohort.motion is None or "free" not in getattr(holder, "model_fields_set", ()):
        return ()
    read = cohort.motion[list(COORDINATE_COLUMNS)].notna().any().to_numpy()
    known = [name for name, is_read in zip(COORDINATES, read, strict=True) if is_read]
    nobody = [name for name in holder.free if name in COORDINATES and name not in known]
    if not nobody:
        return ()
    file = STUDIES / f"{study.study}.yaml"
    document, _ = read_yaml(root / file, study.study)
    named: Any = None if document is None else document.data
    for part in key.split("."):
        named = named.get(part) if isinstance(named, dict) else None
    if document is None or named is None:
        return ()  # left to the default, or put there in place of `auto`
    place = (file.as_posix(), document.line_of(key), key)
    found = f"{', '.join(nobody)}, which nobody measured in cohort '{cohort.name}'"
    remedy = "take it out: its stiffness would keep its start or run to a bound"
    return (InputProblem(*place, found, one_of(known), remedy),)
