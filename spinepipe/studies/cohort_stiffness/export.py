"""The model of a specimen with its fitted stiffness, as `spinepipe export` writes it."""

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.cohort.specimen import joint_frames
from spinepipe.problems import InputError, one_of
from spinepipe.status import NOT_FITTED, USABLE
from spinepipe.studies.cohort_stiffness.point_matrix import matrix_table
from spinepipe.studies.cohort_stiffness.problem import (
    base_effects,
    base_of,
    start_stiffness,
    stiff_model,
    with_stiffness,
)
from spinepipe.studies.cohort_stiffness.representations import IN_WORDS, NUISANCE, STIFFENING
from spinepipe.studies.cohort_stiffness.settings import (
    ALL,
    CohortStiffness,
    representations_of,
    tests_of,
)
from spinepipe.studies.cohort_stiffness.tables import STIFFNESS
from spinepipe.studies.exports import Exported, problem, refuse, required_result
from spinepipe.studies.kind import WantedFiles
from spinepipe.studies.opensim_files import opensim_document
from spinepipe.tables import read_frame

CRITERIA = ("left_out_specimen", "left_out_case", "fitted")
"""What recommends a representation: motion that no fit has seen, as far as any was held out."""


def exported(study: CohortStiffness, cohort: Cohort, wanted: WantedFiles) -> Exported:
    """OpenSim's document of the model, or its matrices as CSV; in words which stiffness it has.

    Coordinates that were not fitted keep the published value.

    Raises
    ------
    InputError
        Where the study has no such representation, no results, or no fit of the specimen.
    """
    refuse(wanted, "representation", "point_mm", "test")
    every = representations_of(study, cohort.joint_names)
    known = tuple(one for one in every if one not in NUISANCE)  # the file has joints as stated
    name = wanted.representation
    if name is not None and name not in known:
        remedy = "choose one of them, or leave the option out"
        raise InputError([problem("--representation", name, one_of(known), remedy)])
    why = ""
    if name is None:
        name, why = (known[0], "") if wanted.start else _recommended(wanted, known)
    k = start_stiffness(study, cohort, name)
    told = "start of the study" if wanted.start else f"fitted, {IN_WORDS[name]}{why}"
    if not wanted.start:
        rows = _fitted(study, cohort, wanted, name)
        k = with_stiffness(k, cohort.joint_names, rows.dropna(subset="stiffness"))
        kept = int(rows["stiffness"].isna().sum())
        told += f" ({kept} of {len(rows)} as published: no reading tells of them)" * bool(kept)
    if name in STIFFENING and not wanted.start:
        told += ", at rest: that it grows with motion is not in the file"
    if wanted.point_mm is not None:
        rows = pd.DataFrame(columns=STIFFNESS.names) if wanted.start else rows
        table = matrix_table(rows, k, cohort.joint_names, wanted.point_mm)
        where = "({:g}, {:g}, {:g}) mm from its origin".format(*wanted.point_mm)
        return Exported(
            table.to_csv(index=False), f"6 x 6 stiffness of each joint about {where}, {told}"
        )
    others = base_effects(base_of(str(wanted.root), study), cohort, wanted.specimen)
    frames = joint_frames(cohort, wanted.specimen)
    model = stiff_model(cohort, wanted.specimen, frames, k, others)
    return opensim_document(model, f"the cohort's own joints, stiffness: {told}", cohort, wanted)


def _recommended(wanted: WantedFiles, known: tuple[str, ...]) -> tuple[str, str]:
    """The representation that is best on held-out motion, and why it is taken, in words."""
    ranking = read_frame(required_result(wanted.results / "ranking.parquet"))
    own = ranking[ranking["representation"].isin(known)]
    for criterion in CRITERIA:
        rows = own[own["criterion"] == criterion].dropna(subset=["rank"])
        if len(rows):
            best = rows.sort_values("rank", kind="stable").iloc[0]
            words = criterion.replace("_", "-")
            return str(best["representation"]), f" (first by {words} error)"
    return known[-1], ""


def _fitted(study: CohortStiffness, cohort: Cohort, wanted: WantedFiles, name: str) -> pd.DataFrame:
    """Rows of the specimen's own fit to all its load cases.

    Raises
    ------
    InputError
        Where there is no fit to use.
    """
    rows = read_frame(required_result(wanted.results / "stiffness.parquet"))
    tests = tests_of(study, cohort)
    own = rows[
        (rows["specimen"] == wanted.specimen)
        & (rows["representation"] == name)
        & (rows["source"] == "own")
        & (rows["fitted_to"] == (ALL if len(tests) > 1 else tests[0]))
    ]
    fitted = own[own["status"].isin(USABLE) & own["stiffness"].notna()]
    if fitted.empty or len(fitted) + (own["status"] == NOT_FITTED).sum() < len(own):
        messages = [str(text) for text in own["message"].unique() if text]
        why = f": {'; '.join(messages)}" if messages else ""
        found = f"no fit of {wanted.specimen} by {name}{why}"
        remedy = "choose another --representation, or add --start"
        raise InputError([problem("SPECIMEN", found, "a specimen that was fitted", remedy)])
    return own
