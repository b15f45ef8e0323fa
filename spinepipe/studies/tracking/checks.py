"""What a study of tracked motions demands of its cohort: each fault with its place and remedy.

Tables are checked whenever the study is read; files of motion, which take longer, when it starts.
Faults are handed on and not raised: each is an `InputProblem`, whose arguments are file, line,
column or key, what was found, what is allowed, and the remedy.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from spinepipe.cohort import Cohort
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.motion.passive import passive_elements
from spinepipe.motion.points import marker_places
from spinepipe.motion.recorded_motion import RIGID_FROM
from spinepipe.motion.recording import MarkerRecording
from spinepipe.motion.skeleton import BODIES, MarkerSet
from spinepipe.muscles.myo_sim import PACKAGE, REMEDY, VERSION, NoSource, origin_of_myo_sim
from spinepipe.problems import InputError, InputProblem, Spelling, one_of
from spinepipe.studies.checks_of_markers import LoadedTrial
from spinepipe.studies.checks_of_motion import motion_problems
from spinepipe.studies.checks_of_recorded import recorded_problems
from spinepipe.studies.places import lacking_tables, unknown_names
from spinepipe.studies.recordings import TRIALS, read_recording, row_problems, trial_rows
from spinepipe.studies.subjects import MASS_KG, SUBJECTS, subject_of, subject_problems
from spinepipe.studies.tracking.persons import marker_set, ratios_of, skeleton_in
from spinepipe.studies.tracking.settings import CONSTRAINED, LEARNT, Tracking
from spinepipe.studies.tracking.trials import MARKER_SET, PASSIVE, RATIOS, source_kinds
from spinepipe.units import COORDINATES, ROTATIONS

NEEDED = (SUBJECTS, TRIALS, MARKER_SET)
"""Tables that a cohort must have."""

LISTED = 4
"""So many names of further markers are written out in a message; then dots."""

SLICES_SHARE = (0.25, 0.60)
"""Least and largest mass of pelvis and trunk slices together, over body mass.

Wide about 0.42 to 0.45, what the sources give (Pearsall 1996, pelvis: de Leva 1996). Head and arms,
which are hung on T1 later and must not be counted here, would add 0.16 to 0.17.
"""


def check_tracking(
    document: YamlDocument, study: Tracking, cohort: Cohort
) -> Iterator[InputProblem]:
    """Everything that is wrong with the tables of a cohort."""
    if study.marker_set != "own":
        yield from _lifts(document, study, cohort)
        yield from _persons_and_trials(cohort)
        return
    yield from _tables(document, cohort)
    # rows of passive.csv and ratios.csv name joints from L5S1 to T1T2, so they are judged where the
    # chain has all of these; `_tables` tells of one that has not
    if cohort.vertebrae == BODIES:
        yield from _approaches(document, study, cohort)
        try:
            passive_elements(cohort.further.get(PASSIVE.stem), f"{cohort.name}/{PASSIVE.file}")
        except InputError as error:
            yield from error.problems
    names = cohort.specimen_names
    yield from unknown_names(
        document, "profiles.specimens", "specimen", study.profiles.specimens, names
    )
    yield from _persons_and_trials(cohort)
    if not list(_tables(document, cohort)):
        yield from _bodies(cohort)


def _persons_and_trials(cohort: Cohort) -> Iterator[InputProblem]:
    """Faults of subjects.csv and trials.csv, as far as these are there."""
    further = cohort.further
    if SUBJECTS.stem in further:
        yield from subject_problems(cohort, further[SUBJECTS.stem])
    if TRIALS.stem in further:
        yield from row_problems(cohort)


def check_recordings(
    document: YamlDocument, study: Tracking, cohort: Cohort, _root: Path
) -> Iterator[InputProblem]:
    """Everything that is wrong with files of motion; nothing where a table has a fault.

    All kinds of study are handed the same arguments; ``_root`` is not needed here.
    """
    if study.marker_set != "own":
        if not any((*_lifts(document, study, cohort), *_persons_and_trials(cohort))):
            yield from recorded_problems(cohort, study.cutoff_hz)
            yield from _source(document)
        return
    if not any((*_tables(document, cohort), *_persons_and_trials(cohort))) and not any(
        _bodies(cohort)
    ):
        yield from recording_problems(cohort)


def _tables(document: YamlDocument, cohort: Cohort) -> Iterator[InputProblem]:
    """Tables that every study of tracked motions needs, and the chain of joints from S1 to T1."""
    place = document.place_of("cohort")
    yield from lacking_tables(document, NEEDED, cohort)
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


def _lifts(document: YamlDocument, study: Tracking, cohort: Cohort) -> Iterator[InputProblem]:
    """What a study of markers of Plug-in-Gait needs: persons, trials, and ratios that there are."""
    yield from lacking_tables(document, (SUBJECTS, TRIALS), cohort)
    try:
        sets = ratios_of(cohort)
    except InputError as error:
        yield from error.problems
        return
    if study.ratios not in sets:
        found, remedy = f"'{study.ratios}'", f"name one, or add it to {cohort.name}/{RATIOS.file}"
        yield InputProblem(*document.place_of("ratios"), found, one_of(sets), remedy)
    elif not sets[study.ratios][:RIGID_FROM].sum(axis=0).all():
        found = f"'{study.ratios}', which leaves out a rotation"
        allowed = f"shares of {', '.join(ROTATIONS)} below {BODIES[RIGID_FROM]}"
        yield InputProblem(*document.place_of("ratios"), found, allowed, "name another set")


def _source(document: YamlDocument) -> Iterator[InputProblem]:
    """The package that spines are made of, where it is not there or is another one."""
    try:
        origin_of_myo_sim()
    except NoSource as error:
        allowed = f"{PACKAGE} in version {VERSION}"
        yield InputProblem(*document.place_of("marker_set"), error.found, allowed, REMEDY)


def _approaches(document: YamlDocument, study: Tracking, cohort: Cohort) -> Iterator[InputProblem]:
    """Approaches whose ratios are in no table, or that learn from a kind of trial nobody did.

    Ratios share a motion among the joints (`ik_constrained_<set>`); other approaches calibrate
    passive elements on trials of one kind and use them in others.
    """
    try:
        sets = ratios_of(cohort)
    except InputError as error:
        yield from error.problems
        return
    trials = cohort.further.get(TRIALS.stem)
    kinds = set() if trials is None else set(trials["kind"])
    for index, approach in enumerate(study.approaches):
        place = document.place_of(f"approaches.{index}")
        name = approach.removeprefix(CONSTRAINED)
        if approach.startswith(CONSTRAINED) and name not in sets:
            found = f"'{approach}', and no ratios '{name}'"
            remedy = f"leave it out, or add the set '{name}' to {cohort.name}/{RATIOS.file}"
            yield InputProblem(*place, found, f"ratios of {', '.join(sets)}", remedy)
        wanted = source_kinds(approach) if approach in LEARNT and trials is not None else ()
        for lacking in [one for one in wanted if one not in kinds]:
            found = f"'{approach}', and no trial of {lacking}"
            yield InputProblem(*place, found, one_of(kinds), "leave it out, or add such trials")


def _bodies(cohort: Cohort) -> Iterator[InputProblem]:
    """Masses of pelvis and trunk slices that cannot be those of the person, see `SLICES_SHARE`."""
    file = f"{cohort.name}/bodies.csv"
    known = set(cohort.further[SUBJECTS.stem]["specimen"])
    for specimen in [name for name in cohort.specimen_names if name in known]:
        subject = subject_of(cohort, specimen)
        if not MASS_KG[0] <= subject.mass_kg <= MASS_KG[1]:
            continue  # the body mass itself is wrong: `subject_problems` tells it
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


def recording_problems(cohort: Cohort) -> Iterator[InputProblem]:
    """Everything that is wrong with files of motion, of a cohort whose tables are sound."""
    for specimen in cohort.specimen_names:
        markers = marker_set(cohort, specimen)
        skeleton = skeleton_in(cohort, specimen, subject_of(cohort, specimen))
        # (K, 3) m, markers in ground while all coordinates, the pelvis's too, are zero
        rest = np.zeros((1, len(BODIES), len(COORDINATES)))
        neutral = marker_places(skeleton, markers, rest)[0]
        for row in trial_rows(cohort, specimen):
            try:
                read = read_recording(row, cohort.name, cohort.folder)
            except InputError as error:
                yield from error.problems
                continue
            yield from _missing_markers(f"{cohort.name}/{row['file']}", markers, read)
            # the trial is looked at with the markers that its file has
            kept = np.flatnonzero([name in read.names for name in markers.names])
            if not len(kept):
                continue
            part = MarkerSet(
                tuple(markers.names[k] for k in kept),
                markers.body[kept],
                markers.at[kept],
                markers.weight[kept],
                tuple(markers.cluster[k] for k in kept),
            )
            yield from motion_problems(LoadedTrial.of(cohort, row, read, part, neutral[kept]))


def _missing_markers(
    file: str, markers: MarkerSet, read: MarkerRecording
) -> Iterator[InputProblem]:
    """Markers of the set that the file lacks; further ones in the file are a remark."""
    spare = [name for name in read.names if name not in markers.names]
    spelling = Spelling(spare, "rename it in the file, or delete it from the set")
    listed = ", ".join(spare[:LISTED]) + (" ..." if len(spare) > LISTED else "") or "none"
    allowed = f"all markers of {MARKER_SET.file}; further ones are {listed}"
    for name in markers.names:
        if name in read.repeated:
            found, remedy = "more than one marker of this name", "rename all but one in the file"
            yield InputProblem(file, None, name, found, "each marker once", remedy)
        elif name not in read.names:
            yield InputProblem(file, None, name, "no such marker", allowed, spelling.remedy(name))
