"""What a study of tracked motions demands of its cohort: each fault with its place and remedy.

Tables are checked whenever the study is read; files of motion, which take longer, when it starts.
"""

from collections.abc import Iterator
from pathlib import Path

from spinepipe.cohort import Cohort
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.motion.passive_elements import passive_elements
from spinepipe.motion.skeleton import BODIES
from spinepipe.problems import InputError, InputProblem, one_of
from spinepipe.studies.places import at, unknown_names
from spinepipe.studies.subjects import MASS_KG, SUBJECTS, subject_of, subject_problems
from spinepipe.studies.tracking.checks_of_trials import (
    recording_problems,
    row_problems,
)
from spinepipe.studies.tracking.forms import MARKER_SET, PASSIVE, RATIOS, TRIALS
from spinepipe.studies.tracking.persons import (
    ratio_sets,
    skeleton_in,
)
from spinepipe.studies.tracking.settings import CONSTRAINED, LEARNT, Tracking

NEEDED = (SUBJECTS, TRIALS, MARKER_SET)

SLICES_SHARE = (0.25, 0.60)
"""Pelvis and slices of the trunk over body mass: 0.42 to 0.45 in the sources; head and arms, which
are hung on T1, would add 0.16 to 0.17."""


def check_tracking(
    document: YamlDocument, study: Tracking, cohort: Cohort
) -> Iterator[InputProblem]:
    """Everything that is wrong with the tables of a cohort."""
    yield from _tables(document, cohort)
    if cohort.vertebrae == BODIES:  # rows of joints are those of the whole trunk
        yield from _approaches(document, study, cohort)
        yield from _own_laws(cohort)
    names = cohort.specimen_names
    yield from unknown_names(
        document, "profiles.specimens", "specimen", study.profiles.specimens, names
    )
    yield from _recorded(cohort)
    if not list(_tables(document, cohort)):
        yield from _bodies(cohort)


def _recorded(cohort: Cohort) -> Iterator[InputProblem]:
    """Persons, trials and markers."""
    further = cohort.further
    if SUBJECTS.stem in further:
        yield from subject_problems(cohort, further[SUBJECTS.stem])
    if TRIALS.stem in further:
        yield from row_problems(cohort)


def check_recordings(
    document: YamlDocument, _study: Tracking, cohort: Cohort, _root: Path
) -> Iterator[InputProblem]:
    """Everything that is wrong with files of motion; nothing where tables cannot be relied on."""
    if not any((*_tables(document, cohort), *_recorded(cohort))) and not any(_bodies(cohort)):
        yield from recording_problems(cohort)


def _tables(document: YamlDocument, cohort: Cohort) -> Iterator[InputProblem]:
    """Files that every study needs, and the chain that the markers are on."""
    place = at(document, "cohort")
    for form in NEEDED:
        if form.stem not in cohort.further:
            found, allowed = f"a cohort without {form.file}", f"a cohort with {form.file}"
            yield InputProblem(*place, found, allowed, f"add {form.file}, or name another cohort")
    if not cohort.has_frames:
        found, allowed = "a cohort without joints", "a cohort with joints.csv or landmarks.csv"
        yield InputProblem(*place, found, allowed, "tell where the joints are")
    if cohort.vertebrae != BODIES:
        found = f"{cohort.vertebrae[0]} to {cohort.vertebrae[-1]}, {len(cohort.vertebrae)} in all"
        allowed = f"all from {BODIES[0]} to {BODIES[-1]}, {len(BODIES)} in all"
        file = f"{cohort.name}/cohort.yaml"
        yield InputProblem(
            file, None, "vertebrae", found, allowed, "list them all, and their joints"
        )


def _approaches(document: YamlDocument, study: Tracking, cohort: Cohort) -> Iterator[InputProblem]:
    """Approaches whose ratios nobody has, or that learn from trials nobody did."""
    try:
        sets = ratio_sets(cohort)
    except InputError as error:
        yield from error.problems
        return
    trials = cohort.further.get(TRIALS.stem)
    kinds = set() if trials is None else set(trials["kind"])
    for index, approach in enumerate(study.approaches):
        place = at(document, f"approaches.{index}")
        name = approach.removeprefix(CONSTRAINED)
        if approach.startswith(CONSTRAINED) and name not in sets:
            found = f"'{approach}', and no ratios '{name}'"
            remedy = f"leave it out, or add the set '{name}' to {cohort.name}/{RATIOS.file}"
            yield InputProblem(*place, found, f"ratios of {', '.join(sets)}", remedy)
        kind = LEARNT.get(approach)
        wanted = ("flexion_extension", "lateral_bending") if kind == "both" else (kind,)
        for lacking in [one for one in wanted if one is not None and one not in kinds]:
            if trials is not None:
                found = f"'{approach}', and no trial of {lacking}"
                yield InputProblem(*place, found, one_of(kinds), "leave it out, or add such trials")


def _own_laws(cohort: Cohort) -> Iterator[InputProblem]:
    """Faults of the passive elements that the cohort brings."""
    try:
        passive_elements(cohort.further.get(PASSIVE.stem), f"{cohort.name}/{PASSIVE.file}")
    except InputError as error:
        yield from error.problems


def _bodies(cohort: Cohort) -> Iterator[InputProblem]:
    """Slices of the trunk that cannot be those of the person."""
    file = f"{cohort.name}/bodies.csv"
    known = set(cohort.further[SUBJECTS.stem]["specimen"])
    for specimen in [name for name in cohort.specimen_names if name in known]:
        subject = subject_of(cohort, specimen)
        if not MASS_KG[0] <= subject.mass_kg <= MASS_KG[1]:
            continue  # told in subjects.csv
        allowed = (
            f"{SLICES_SHARE[0]:.0%} to {SLICES_SHARE[1]:.0%} of {subject.mass_kg:g} kg: "
            "pelvis and slices of the trunk, without head and arms"
        )
        try:
            kg = float(skeleton_in(cohort, specimen, subject).masses.kg.sum())
        except ValueError as error:
            yield InputProblem(file, None, "mass_kg", str(error), allowed, "correct the mass")
            continue
        share = kg / subject.mass_kg
        if not SLICES_SHARE[0] <= share <= SLICES_SHARE[1]:
            found = f"{kg:.1f} kg of '{specimen}' in all, {share:.0%} of the body's mass"
            yield InputProblem(file, None, "mass_kg", found, allowed, "correct the masses")
