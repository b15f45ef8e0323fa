"""The kind cohort_stiffness: how stiffness differs between specimens, levels and load cases."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.comparison.papers import beside, hangs_on
from spinepipe.schema import all_declared
from spinepipe.studies.base_checks import BaseCheck
from spinepipe.studies.cohort_stiffness.checks import check_cohort_stiffness, check_one_stiffening
from spinepipe.studies.cohort_stiffness.representations import NUISANCE, POOLED, finest
from spinepipe.studies.cohort_stiffness.settings import (
    ALL,
    GOULD_2024B,
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

PREDICTED = "predicted_stiffness"
"""Stiffness of left-out specimens, of job files whose rows are those of ``stiffness``."""

OF_JOBS = (
    *("stiffness", PREDICTED, "errors", "fits", "nuisances", "sign_checks", "pooling"),
    *OF_EXPERIMENTS,
)
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
            "stiffness_by_specimen",
            "Stiffness of every specimen",
            "charts:stiffness_by_specimen",
            ("stiffness",),
        ),
        Figure(
            "stiffness_by_level",
            "Stiffness level by level",
            "charts:stiffness_by_level",
            ("stiffness",),
        ),
        Figure(
            "held_out_error",
            "Errors of fitted motion and of motion left out",
            "charts:held_out_error",
            ("ranking",),
        ),
        Figure(
            "load_case_stiffness",
            "Stiffness fitted to one load case",
            "charts:load_case_stiffness",
            ("stiffness", "sign_checks"),
        ),
        Figure(
            "range_of_motion",
            "Range of motion, measured and modelled",
            "charts:range_of_motion",
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
        pooled = ("pooling",) if self._pooled else ()
        nuisances = ("nuisances",) if self._with_nuisances else ()
        predicted = (PREDICTED,) if self._held_out else ()
        own = ("stiffness", "fits", "errors", *nuisances, "sign_checks", *pooled, *OF_EXPERIMENTS)
        lacking = set() if self.rebuilt else {"against_gould_2024b"}
        lacking |= set() if self.study.covariates else {"covariates"}
        return (*own, *predicted, *(job.name for job in _ANALYSES if job.name not in lacking))

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
        return _MADE_BY[path.removeprefix(f"{self.folder}/").split("/")[0]]

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """One block per specimen, and one of the pooled fits."""
        nobody = table == "pooling" or (table in ("fits", PREDICTED) and not self._single)
        own = [] if nobody else [(name, _SINGLE_BLOCK) for name in self.specimens]
        alone = table in ("nuisances", "sign_checks", *OF_EXPERIMENTS)
        pooled = [] if alone or not self._pooled else [(EVERYONE, POOLED_BLOCK)]
        return [*own, *pooled]

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        own = f"specimen-{specimen}"
        if block == POOLED_BLOCK:
            folds = [(label, NOBODY) for label in self.load_sets if table != PREDICTED]
            if self._held_out and table != "stiffness":
                folds += product(self._without_case_folds, self.specimens)
            places = [
                f"pooled/representation-{representation}/fitted_to-{label}/without-{one}"
                for representation in self._pooled
                for label, one in folds
            ]
        elif table in OF_EXPERIMENTS:
            places = [f"experiment/{own}"]
        elif table == "nuisances":
            places = _fitted(f"fits/{own}", self._with_nuisances, self.load_sets)
        else:
            places = [f"literature/{own}"] if table not in ("fits", PREDICTED) else []
            if table not in ("sign_checks", PREDICTED):
                places += _fitted(f"fits/{own}", self._single, self.load_sets)
            if table in (PREDICTED, "errors") and self._held_out:
                places += _fitted(f"left_out/{own}", self._single, self._without_case_folds)
        table = "stiffness" if table == PREDICTED else table
        return [self._file(place, table) for place in places]

    def fits_of_others(self, specimen: str, representation: str, fitted_to: str) -> list[str]:
        """Stiffness files of the other specimens' own fits."""
        return [
            self._file(place, "stiffness")
            for name in self.specimens
            if name != specimen
            for place in _fitted(f"fits/specimen-{name}", [representation], [fitted_to])
        ]

    def simulated_fit(self, specimen: str) -> list[str]:
        """The stiffness file of a specimen's own fit that its tests are simulated with, if any."""
        name = finest(self.representations)
        if name is None:
            return []
        (place,) = _fitted(f"fits/specimen-{specimen}", [name], [joint_label(self.tests)])
        return [self._file(place, "stiffness")]

    def _file(self, place: str, table: str) -> str:
        job, _, of = place.partition("/")
        return f"{self.folder}/{job}/{table}/{of}.parquet"

    @property
    def _single(self) -> tuple[str, ...]:
        """Representations fitted specimen by specimen."""
        return tuple(name for name in self.representations if name not in POOLED)

    @property
    def _pooled(self) -> tuple[str, ...]:
        """Representations fitted to all specimens at once."""
        return tuple(name for name in self.representations if name in POOLED)

    @property
    def _with_nuisances(self) -> tuple[str, ...]:
        """Representations with errors of joint centres and axes fitted beside."""
        return tuple(name for name in self.representations if name in NUISANCE)

    @property
    def _held_out(self) -> bool:
        """Whether specimens are predicted from the others."""
        return self.study.cross_validation.specimens and len(self.specimens) > 1

    @property
    def _without_case_folds(self) -> tuple[str, ...]:
        """The load sets that leave no load case out."""
        return tuple(label for label in self.load_sets if label == ALL or label in self.tests)


def _fitted(folder: str, representations: Iterable[str], labels: Iterable[str]) -> list[str]:
    """Places of what is fitted of a specimen: each representation to each load set."""
    return [
        f"{folder}/representation-{representation}/fitted_to-{label}"
        for representation, label in product(representations, labels)
    ]


def _fits_of_others(expected: Any, place: Mapping[str, str]) -> list[str]:
    """Marks of the fits of which the left-out specimen takes the median."""
    where = (place[name] for name in ("specimen", "representation", "fitted_to"))
    return [expected.of_part("stiffness", fit) for fit in expected.files.fits_of_others(*where)]


def _simulated_fit(expected: Any, place: Mapping[str, str]) -> list[str]:
    """The mark of the fit that the tests of a specimen are simulated with."""
    files = expected.files.simulated_fit(place["specimen"])
    return [expected.of_part("stiffness", file) for file in files]


_CURVES = ("neutral_zone", "neutral_zone_below_nm_per_deg")
_HELD_OUT = ("representations", "cross_validation", "covariates", "significance", *_CURVES)
_FITTING = ("seed", "steps", "cost", "measurement_sd", "bound_factor", "starts")
"""Settings by what they decide: what is held out and compared, and how stiffness is fitted."""

KIND = Kind(
    question="How stiff are the joints?",
    cost="a fit for each model; comparisons need 3 specimens",
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
