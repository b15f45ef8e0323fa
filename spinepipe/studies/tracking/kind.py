"""The kind tracking: motions of the spine from markers on the skin, and what they tell of it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.comparison.papers import beside, hangs_on
from spinepipe.schema import all_declared
from spinepipe.studies.kind import Job, Kind, ignoring
from spinepipe.studies.recordings import TRIALS, motion_digests
from spinepipe.studies.study import Study
from spinepipe.studies.study_files import Figure, StudyFiles, numbered_blocks
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.tracking.checks import check_recordings, check_tracking
from spinepipe.studies.tracking.profile import PROFILED, REGIONS
from spinepipe.studies.tracking.settings import Tracking
from spinepipe.studies.tracking.trials import (
    FORMS,
    approaches_on_trials,
    calibration_of,
    digests_of_lifts,
)


def _digests_of_lifts(expected: Any, _place: Mapping[str, str]) -> list[str]:
    """Of the recorded motion of all persons, and of the trunk that they are given."""
    return digests_of_lifts(expected.cohort)


OF_LIFTS = ("joint_moments", "moment_agreement")
"""Tables of a study of markers of Plug-in-Gait; it has no others."""

_LIFTS = Job(
    "joint_moments",
    "",
    (),
    OF_LIFTS,
    ignores=ignoring(
        *(
            name
            for name in Tracking.model_fields
            if name not in {*Study.model_fields, "kind", "marker_set", "cutoff_hz", "ratios"}
        )
    ),
    also=_digests_of_lifts,
)

_ANALYSES = (
    Job("ranges", "", ("tracked",), ("ranges",)),
    Job("sharing", "", ("tracked",), ("sharing",)),
    Job("similarity", "sharing:similarity", ("tracked",), ("similarity",)),
    Job("errors", "", ("tracked", "sizes"), ("errors",)),
    Job("accuracy", "", ("errors",), ("accuracy",)),
    Job(
        "against_wang_2021",
        "",
        (
            *("accuracy", "errors", "ranges", "sharing", "similarity", "fits", "stiffness"),
            "clusters",
        ),
        ("against_wang_2021",),
        also=hangs_on("wang_2021"),
    ),
)

_OF_MOTIONS = ("tracked", "fits", "drawn")
_OF_PROFILES = ("profiles", "profile_points")
_OF_RECORDINGS = ("clusters", "remarks", "sizes")

FULL = ("weights",)
"""Motions anew with loads counting more and less."""


@dataclass(frozen=True)
class TrackingFiles(StudyFiles):
    """The result files of one study of tracked motions.

    Attributes
    ----------
    taken : calibration that each motion takes over, by specimen, trial and approach; None for none.
    """

    full = FULL
    joined = (*_OF_MOTIONS, "stiffness", *_OF_PROFILES, *_OF_RECORDINGS, "weights")
    drawings = (
        Figure(
            "moments",
            "Net moment over time, computed and measured",
            "charts_of_moments:moments",
            ("joint_moments", "moment_agreement"),
        ),
        Figure("approach_errors", "Errors of approaches", "charts:approach_errors", ("errors",)),
        Figure("error_by_level", "Errors by level", "charts:error_by_level", ("errors",)),
        Figure(
            "motion_sharing",
            "How lumbar joints share a motion",
            "charts:motion_sharing",
            ("sharing",),
            ("errors",),
        ),
        Figure(
            "kinematics",
            "How lumbar joints turn",
            "charts:kinematics",
            ("tracked",),
            ("errors", "similarity"),
        ),
        Figure(
            "stiffness_profiles",
            "Whether markers tell stiffness",
            "charts_of_stiffness:stiffness_profiles",
            ("profile_points", "profiles"),
        ),
        Figure(
            "stiffness_by_level",
            "Calibrated stiffness beside the prior",
            "charts_of_stiffness:stiffness_by_level",
            ("stiffness",),
        ),
    )

    study: Tracking
    taken: Mapping[tuple[str, str, str], str | None]

    @classmethod
    def of(cls, study: Tracking, cohort: Cohort) -> "TrackingFiles":
        """The files of a study of a cohort."""
        names = cohort.specimen_names
        taken: dict[tuple[str, str, str], str | None] = {
            (name, trial, approach): calibration_of(cohort, name, trial, approach)
            for name in names
            for trial, approach in (
                approaches_on_trials(study, cohort, name) if study.marker_set == "own" else ()
            )
        }
        return cls(study, names, taken)

    @property
    def laws(self) -> tuple[tuple[str, str], ...]:
        """(specimen, calibration), each once."""
        return tuple(dict.fromkeys((key[0], law) for key, law in self.taken.items() if law))

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        if self.study.marker_set != "own":
            return OF_LIFTS
        laws = ("stiffness",) if self.laws else ()
        made = (name for job in _ANALYSES for name in job.writes)
        analysed = (name for name in made if beside() or not name.startswith("against"))
        return (*_OF_MOTIONS, *laws, *_OF_PROFILES, *_OF_RECORDINGS, "weights", *analysed)

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables that are made of job files."""
        return tuple(table for table in self.joined if table in self.tables)

    def law_files(self, specimen: str, trial: str, approach: str) -> list[str]:
        """The calibration that a motion takes over."""
        law = self.taken[specimen, trial, approach]
        return [] if law is None else [f"{self._of('stiffness', specimen)}/law-{law}.parquet"]

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        jobs = {"stiffness": "calibrate", "weights": "weigh"}
        jobs |= dict.fromkeys(_OF_PROFILES, "profile")
        jobs |= dict.fromkeys(_OF_RECORDINGS, "examine")
        return jobs.get(table, "track")

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """One block per person."""
        named = self.specimens
        if table in _OF_PROFILES:
            named = self.study.profiles.specimens or self.specimens[:1]
        elif table == "weights":
            named = self.specimens[:1]
        return numbered_blocks(named, 1)

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        place = self._of(table, specimen)
        return [f"{place}{part}.parquet" for part in self._parts(table, specimen)]

    @property
    def others(self) -> tuple[str, ...]:
        """Skeletons and motions as OpenSim reads them."""
        if self.study.marker_set != "own":
            return ()
        skeletons = (f"opensim/{name}.osim" for name in self.specimens)
        return (*skeletons, *(f"opensim/{'/'.join(key)}.mot" for key in self.taken))

    def _of(self, table: str, specimen: str) -> str:
        return f"{self.folder}/jobs/{table}/specimen-{specimen}"

    def _parts(self, table: str, specimen: str) -> Iterator[str]:
        """What a person's job files are of."""
        if table in _OF_MOTIONS:
            for who, trial, approach in self.taken:
                if who == specimen:
                    yield f"/trial-{trial}/approach-{approach}"
        elif table == "stiffness":
            yield from (f"/law-{law}" for who, law in self.laws if who == specimen)
        elif table in _OF_PROFILES:
            for region, coordinate in product(REGIONS, PROFILED):
                yield f"/region-{region}/coordinate-{coordinate}"
        else:
            yield ""


def settle_markers(study: Tracking, cohort: Cohort) -> Tracking:
    """A study that leaves it to the cohort which markers it has."""
    told = "marker_set" in study.model_fields_set
    own = {*cohort.further, *(["joints"] if cohort.joints is not None else [])}
    if told or own & {"marker_set", "joints"} or TRIALS.stem not in own:
        return study
    return study.model_copy(update={"marker_set": "plug_in_gait"})


def _digests_of_motion(expected: Any, place: Mapping[str, str]) -> list[str]:
    """Of the recorded motion of a person, as declared jobs are asked for it."""
    return motion_digests(expected.cohort, place["specimen"])


def _digests_of_tracking(expected: Any, place: Mapping[str, str]) -> list[str]:
    """Of motion, and of the calibration that the approach takes over."""
    found = _digests_of_motion(expected, place)
    law = calibration_of(expected.cohort, place["specimen"], place["trial"], place["approach"])
    if law is None:
        return found
    return [*found, expected.of_job("calibrate", {"specimen": place["specimen"], "law": law})]


def _digests_of_export(expected: Any, place: Mapping[str, str]) -> list[str]:
    """Of the tracked motion that is written for another program."""
    return [expected.of_job("track", place)]


_COUNTED = ignoring("approaches", "profiles", "trade_off", "drawn_approaches")
_ASKED = tuple(
    name for name in Tracking.model_fields if name not in {*Study.model_fields, "kind", "scaling"}
)
"""Settings that decide how motions are found, not who was recorded."""


KIND = Kind(
    question="Motion from skin markers",
    settings=Tracking,
    files=TrackingFiles,
    checks=(check_tracking,),
    checks_at_start=(check_recordings,),
    tables=all_declared(__file__),
    jobs=(
        Job("calibrate", ignores=_COUNTED, also=_digests_of_motion),
        Job(
            "track",
            many=True,
            ignores=ignoring("approaches", "profiles", "trade_off"),
            also=_digests_of_tracking,
        ),
        Job(
            "profile",
            ignores=ignoring("approaches", "trade_off", "drawn_approaches", "intervals"),
            also=_digests_of_motion,
        ),
        Job(
            "weigh",
            ignores=ignoring("approaches", "profiles", "drawn_approaches"),
            also=_digests_of_motion,
        ),
        Job("examine", ignores=ignoring(*_ASKED, "scaling"), also=_digests_of_motion),
        Job(
            "skeleton",
            "opensim:skeleton",
            ignores=ignoring(*_ASKED),
            makes=("opensim/{specimen}.osim",),
            also=_digests_of_motion,
        ),
        Job(
            "motion",
            "opensim:motion",
            many=True,
            ignores=ignoring(*_ASKED, "scaling"),
            makes=("opensim/{specimen}/{trial}/{approach}.mot",),
            also=_digests_of_export,
        ),
        *_ANALYSES,
        _LIFTS,
    ),
    exports="opensim:exported",
    forms=(SUBJECTS, *FORMS),
    settled=settle_markers,
    told_by_check="examine:told",
    doubts="plausibility:doubts",
)
