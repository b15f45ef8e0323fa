"""The kind cohort_stiffness: how stiffness differs between specimens, levels and load cases."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.comparison.papers import beside, hangs_on
from spinepipe.schema import all_declared
from spinepipe.studies.base_checks import BaseCheck
from spinepipe.studies.cohort_stiffness.checks import check_cohort_stiffness, check_one_stiffening
from spinepipe.studies.cohort_stiffness.gould_2024b import GOULD_2024B
from spinepipe.studies.cohort_stiffness.representations import NUISANCE, POOLED, finest
from spinepipe.studies.cohort_stiffness.settings import (
    ALL,
    NOBODY,
    CohortStiffness,
    joint_label,
    load_sets,
    representations_of,
    tests_of,
)
from spinepipe.studies.kind import Job, Kind, ignoring
from spinepipe.studies.study_files import Figure, StudyFiles

OF_EXPERIMENTS = ("load_displacement", "helical_axes")
"""What laboratories report, one job per specimen."""

OF_JOBS = ("stiffness", "errors", "fits", "nuisances", "sign_checks", "pooling", *OF_EXPERIMENTS)
"""Tables joined from job files."""

_ANALYSES = (
    Job("mae", "", ("errors",), ("mae",)),
    Job("ranking", "", ("errors", "fits", "pooling"), ("ranking",)),
    Job("covariates", "", ("stiffness",), ("covariates",)),
    Job("statistics", "significance", ("errors", "fits"), ("statistics",)),
    Job("findings", "", ("stiffness", "errors", "statistics", "pooling"), ("findings",)),
    Job(
        "against_gould_2024b",
        "",
        ("stiffness", "fits", "errors", "mae", "statistics"),
        ("against_gould_2024b",),
        also=hangs_on("gould_2024b"),
    ),
)
"""What is computed from tables."""

EVERYONE, POOLED_BLOCK = "everyone", "pooled"
"""Place of the block of the pooled fits, which are of no single specimen."""

_MADE_BY = {
    "literature": "literature",
    "fits": "fit",
    "left_out": "left_out",
    "pooled": "pool",
    "experiment": "experiment",
}
"""The job that writes the files in each folder."""

_SINGLE_BLOCK = "000"


@dataclass(frozen=True)
class CohortLayout(StudyFiles):
    """The result files of one cohort study.

    Attributes
    ----------
    tests : load cases of the study. rebuilt : whether the cohort stands for that of a
        paper whose numbers are at hand.
    representations : those of the study that the cohort has published values for.
    """

    joined = OF_JOBS
    drawings = (
        Figure(
            "stiffness_by_level",
            "Fitted stiffness of every specimen, level by level",
            "figures.stiffness_by_level:stiffness_by_level_figure",
            ("stiffness",),
        ),
        Figure(
            "error_map",
            "Errors by specimen and level",
            "figures.error_map:error_map_figure",
            ("errors", "sign_checks"),
        ),
        Figure(
            "held_out_error",
            "Errors of fitted and of held-out motion",
            "figures.held_out_error:held_out_error_figure",
            ("errors",),
        ),
        Figure(
            "load_case_stiffness",
            "Stiffness fitted to one load case",
            "figures.load_case_stiffness:load_case_stiffness_figure",
            ("stiffness", "errors", "statistics"),
        ),
        Figure(
            "range_of_motion",
            "Range of motion, measured and simulated",
            "figures.range_of_motion:range_of_motion_figure",
            ("load_displacement",),
        ),
    )

    study: CohortStiffness
    tests: tuple[str, ...]
    rebuilt: bool
    representations: tuple[str, ...]

    @classmethod
    def of(cls, study: CohortStiffness, cohort: Cohort) -> "CohortLayout":
        """The files of a study of a cohort."""
        rebuilt = GOULD_2024B.stands_for(cohort.name) and beside()
        described = representations_of(study, cohort.joint_names)
        return cls(study, cohort.specimen_names, tests_of(study, cohort), rebuilt, described)

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        pooled = ("pooling",) if self._pooled_ones else ()
        beside = ("nuisances",) if self._with_nuisances else ()
        own = ("stiffness", "fits", "errors", *beside, "sign_checks", *pooled, *OF_EXPERIMENTS)
        return (*own, *(job.name for job in _ANALYSES if self._asked(job.name)))

    def _asked(self, analysis: str) -> bool:
        """Whether this study has a table that is computed from tables."""
        if analysis == "covariates":
            return bool(self.study.covariates)
        return self.rebuilt or not analysis.startswith("against")

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables of this study that are made of job files."""
        return tuple(table for table in OF_JOBS if table in self.tables)

    @cached_property
    def load_sets(self) -> tuple[str, ...]:
        """What stiffness is fitted to."""
        return load_sets(self.study, self.tests)

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        folder = path.removeprefix(f"{self.folder}/").split("/")[0]
        return _MADE_BY[folder]

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """One block per specimen, and one of the pooled fits."""
        nobody = table == "pooling" or (table == "fits" and not self._single)
        own = [] if nobody else [(name, _SINGLE_BLOCK) for name in self.specimens]
        alone = table in ("nuisances", "sign_checks", *OF_EXPERIMENTS)
        whole = not alone and self._pooled_ones
        return [*own, *([(EVERYONE, POOLED_BLOCK)] if whole else [])]

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        if block == POOLED_BLOCK:
            return [f"{self.folder}/pooled/{place}/{table}.parquet" for place in self._pooled()]
        if table in OF_EXPERIMENTS:
            return [f"{self.folder}/experiment/specimen={specimen}/{table}.parquet"]
        if table == "nuisances":
            places = [f"fits/specimen={specimen}/{place}" for place in self._fits(beside=True)]
            return [f"{self.folder}/{place}/{table}.parquet" for place in places]
        places = [f"literature/specimen={specimen}"] if table != "fits" else []
        if table in ("stiffness", "errors", "fits"):
            places += [f"fits/specimen={specimen}/{place}" for place in self._fits()]
        if table in ("stiffness", "errors"):
            places += [f"left_out/specimen={specimen}/{place}" for place in self._left_out()]
        return [f"{self.folder}/{place}/{table}.parquet" for place in places]

    def fits_of_others(self, specimen: str, representation: str, fitted_to: str) -> list[str]:
        """Stiffness files of the other specimens' own fits."""
        place = f"representation={representation}/fitted_to={fitted_to}/stiffness.parquet"
        return [
            f"{self.folder}/fits/specimen={name}/{place}"
            for name in self.specimens
            if name != specimen
        ]

    def simulated_fit(self, specimen: str) -> list[str]:
        """The stiffness file of a specimen's own fit that its tests are simulated with, if any."""
        name = finest(self.representations)
        if name is None:
            return []
        place = f"representation={name}/fitted_to={joint_label(self.tests)}"
        return [f"{self.folder}/fits/specimen={specimen}/{place}/stiffness.parquet"]

    @property
    def _single(self) -> tuple[str, ...]:
        """Representations fitted specimen by specimen."""
        return tuple(name for name in self.representations if name not in POOLED)

    @property
    def _pooled_ones(self) -> tuple[str, ...]:
        """Representations fitted to all specimens at once."""
        return tuple(name for name in self.representations if name in POOLED)

    @property
    def _with_nuisances(self) -> tuple[str, ...]:
        """Representations with errors of joint centres and axes fitted beside."""
        return tuple(name for name in self.representations if name in NUISANCE)

    def _fits(self, beside: bool = False) -> list[str]:
        """Places of the fits of a specimen; ``beside`` : of those with nuisances alone."""
        return [
            f"representation={representation}/fitted_to={label}"
            for representation in (self._with_nuisances if beside else self._single)
            for label in self.load_sets
        ]

    @property
    def _held_out(self) -> bool:
        """Whether specimens are predicted from the others."""
        return self.study.cross_validation.specimens and len(self.specimens) > 1

    def _left_out(self) -> list[str]:
        if not self._held_out:
            return []
        return [
            f"representation={representation}/fitted_to={label}"
            for representation in self._single
            for label in self._without_case_folds()
        ]

    def _without_case_folds(self) -> tuple[str, ...]:
        """The load sets that leave no load case out."""
        return tuple(label for label in self.load_sets if label == ALL or label in self.tests)

    def _pooled(self) -> list[str]:
        folds = [(label, NOBODY) for label in self.load_sets]
        if self._held_out:
            labels = self._without_case_folds()
            folds += [(label, name) for label in labels for name in self.specimens]
        return [
            f"representation={representation}/fitted_to={label}/without={without}"
            for representation in self._pooled_ones
            for label, without in folds
        ]


def _fits_of_others(expected: Any, place: Mapping[str, str]) -> list[str]:
    """Marks of the fits of which the left-out specimen takes the median."""
    where = (place[name] for name in ("specimen", "representation", "fitted_to"))
    return [expected.of_part("stiffness", fit) for fit in expected.files.fits_of_others(*where)]


def _simulated_fit(expected: Any, place: Mapping[str, str]) -> list[str]:
    """The mark of the fit that the tests of a specimen are simulated with."""
    files = expected.files.simulated_fit(place["specimen"])
    return [expected.of_part("stiffness", file) for file in files]


_HELD_OUT = ("representations", "cross_validation", "covariates", "significance")
_FITTING = ("seed", "steps", "cost", "measurement_sd", "bound_factor", "starts")
"""Settings by what they decide: what is held out and compared, and how stiffness is fitted."""

KIND = Kind(
    settings=CohortStiffness,
    files=CohortLayout,
    checks=(check_cohort_stiffness,),
    checks_of_files=(BaseCheck(own_bushings=True), check_one_stiffening),
    tables=all_declared(__file__),
    jobs=(
        Job("fit", many=True, ignores=ignoring(*_HELD_OUT), reads_base=True),
        Job("literature", ignores=ignoring(*_HELD_OUT, *_FITTING, "nuisance"), reads_base=True),
        Job("left_out", ignores=ignoring(*_HELD_OUT), reads_base=True, also=_fits_of_others),
        Job(
            "pool",
            ignores=ignoring(*_HELD_OUT, "seed", "starts", "level_stiffness", "nuisance"),
            reads_base=True,
        ),
        Job(
            "experiment",
            ignores=ignoring("cross_validation", "significance"),
            reads_base=True,
            also=_simulated_fit,
        ),
        *_ANALYSES,
    ),
    exports="export:exported",
)
