"""The effects of the model file that a study builds on, and what must be told of them."""

import hashlib
from functools import lru_cache
from pathlib import Path

from spinepipe.cohort import Cohort
from spinepipe.jobs.inputs import Stamp, stamp
from spinepipe.jobs.provenance import provenance
from spinepipe.model import ScopedEffect
from spinepipe.model.file import ModelFile, read_model
from spinepipe.studies import CohortStiffness
from spinepipe.studies.base_model import beside_bushings, made_by, own_values

SEEN = "the base model's effects have values found on this specimen, for the file has none for all"
NOT_HELD_OUT = (
    "Besides the bushings, effects of the model file {file} act in all models. Their values are "
    "the file's in every bar: those for all specimens where it has such, else those for the "
    "specimen itself. Readings that they were found on count as held out here for stiffness only."
)


@lru_cache(maxsize=8)
def _model(where: Stamp) -> ModelFile:
    return read_model(where[0])


def _of_study(root: str, study: CohortStiffness) -> ModelFile | None:
    return None if study.base is None else _model(stamp(study.base.path(Path(root))))


def base_effects(
    root: str, study: CohortStiffness, cohort: Cohort, specimen: str, left_out: bool = False
) -> tuple[ScopedEffect, ...]:
    """Effects that act on a specimen besides bushings; ``left_out`` as in `effects_for`."""
    model = _of_study(root, study)
    return () if model is None else beside_bushings(model, specimen, cohort.joint_names, left_out)


def seen_note(root: str, study: CohortStiffness, cohort: Cohort, specimen: str) -> str:
    """What must be told of a left-out specimen whose effects have values found on itself."""
    model = _of_study(root, study)
    return SEEN if model and own_values(model, specimen, cohort.joint_names) else ""


def given_digest(root: str, study: CohortStiffness) -> str:
    """Digest of a model file that no study of this project makes, else empty.

    A file that is made in the run that uses it has no content when digests are taken; Snakemake
    sees by itself that it is new.
    """
    if study.base is None or made_by(study.base.path(Path(root)), Path(root)):
        return ""
    return _digest(root, study)


def origin(job: str, root: str, study: CohortStiffness, cohort: Cohort) -> dict[str, str]:
    """Metadata of a file, see `provenance`, with the digest of the model file."""
    whole = provenance(f"cohort_stiffness.{job}", study, cohort)
    return whole if study.base is None else {**whole, "base_model_digest": _digest(root, study)}


def _digest(root: str, study: CohortStiffness) -> str:
    assert study.base is not None
    return hashlib.sha256(study.base.path(Path(root)).read_bytes()).hexdigest()
