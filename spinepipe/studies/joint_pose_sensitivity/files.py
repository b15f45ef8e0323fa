"""The result files of a joint-pose study: its tables, and the job files that they are joined of."""

from dataclasses import dataclass
from functools import cached_property

from spinepipe.cohort import Cohort
from spinepipe.comparison.papers import beside
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.settings import (
    METHODS,
    SETS_PER_BATCH,
    JointPoseSensitivity,
)
from spinepipe.studies.study_files import MOST_FILES_PER_BLOCK, Figure, StudyFiles

ALWAYS = (
    *("landmarks", "poses", "calibrations", "simulations", "success", "counts", "summary"),
    *("statistics", "agreement", "variance_shares", "importance"),
)
"""Tables that every study has."""

POSTERIOR = ("posterior", "posterior_motion", "pose_weights")
"""Tables that the job of the posterior writes."""

IN_BLOCKS = {
    "calibrations": ("calibrate", "calibrations"),
    "simulations": ("simulate", "jobs"),
    "bootstrap": ("bootstrap", "bootstrap"),
    "method_fits": ("fit_by_method", "methods"),
    "precision_errors": ("landmark_errors", "precision"),
}
"""Tables joined block by block: the job that writes their files, and the folder of these."""

BY_SPECIMEN = {
    "landmarks": "sample_landmarks",
    "poses": "build_models",
    "spread_over_landmark_sd": "spread_over_landmark_sd",
    "stiffness_over_load_point": "over_load_point",
    **dict.fromkeys(POSTERIOR, "posterior"),
}
"""Tables joined from one file per specimen, and the job that writes it."""

_FILES_PER_BLOCK = 100


@dataclass(frozen=True)
class JointPoseFiles(StudyFiles):
    """The result files of one study.

    Attributes
    ----------
    rebuilt
        Whether its cohort was rebuilt from a paper whose numbers are at hand.
    """

    joined = (*IN_BLOCKS, *BY_SPECIMEN)
    full = (
        *("method_fits", "success_by_method", "precision_errors", "landmark_precision"),
        *("required_precision", "spread_over_landmark_sd", *POSTERIOR, "against_gould_2024a"),
    )
    drawings = (
        Figure(
            *("stiffness", "Stiffness, and what it depends on", "charts:stiffness"),
            ("calibrations", "success"),
            also=("load_point_effect",),
        ),
        Figure(
            *("load_point", "Stiffness over where the load acts", "charts:load_point"),
            ("stiffness_over_load_point",),
        ),
        Figure(
            *(
                "pose_against_stiffness",
                "What errors come from",
                "charts_of_motion:errors_by_source",
            ),
            ("variance_shares",),
        ),
        Figure(
            *("agreement", "Agreement with measured motion", "charts_of_motion:agreement"),
            ("simulations", "success"),
        ),
        Figure(
            *("joint_pose", "How far palpation moves joint frames", "charts_of_motion:frames"),
            ("poses", "success"),
        ),
        Figure(
            *("bootstrap", "Other starts, damping and loading", "charts:bootstrap"),
            ("bootstrap", "calibrations", "success"),
        ),
        Figure(
            *("posterior", "With landmarks as unknowns too", "charts:posterior"),
            ("posterior",),
        ),
        Figure(
            *("landmark_precision", "How precise landmarks must be", "charts_of_motion:precision"),
            ("landmark_precision",),
        ),
    )

    study: JointPoseSensitivity
    rebuilt: bool

    @classmethod
    def of(cls, study: JointPoseSensitivity, cohort: Cohort) -> "JointPoseFiles":
        """The files of a study of a cohort."""
        rebuilt = GOULD_2024A.stands_for(cohort.name) and beside()
        return cls(study, cohort.specimen_names, rebuilt)

    @cached_property
    def _places(self) -> dict[str, list[str]]:
        """Of each table that is joined in blocks, its job files in a specimen's folder."""
        study = self.study
        own, stiffness = [f"pose-{pose:04d}" for pose in range(study.poses)], ["calibrated"]
        stiffness += [f"best{rank:02d}" for rank in range(1, study.best_models + 1)]
        bootstraps = (("start", study.start_bootstrap), ("damping", study.damping_bootstrap))
        precision = study.landmark_precision
        return {
            "calibrations": own,
            "simulations": [f"{pose}/stiffness-{name}" for pose in own for name in stiffness],
            "bootstrap": [
                f"bootstrap-{name}/loading-{loading}/batch-{number:05d}"
                for name, part in bootstraps
                for loading in part.loadings
                for number in range(-(-part.sets // SETS_PER_BATCH))
            ],
            "method_fits": [
                f"{pose}/method-{name}" for pose in own[: study.methods.poses] for name in METHODS
            ],
            "precision_errors": [f"sd_mm-{sd:.15g}" for sd in precision.sd_mm if precision.poses],
        }

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        study, made = self.study, self.made_of_jobs
        asked = {
            ("bootstrap",): "bootstrap" in made,
            ("method_fits", "success_by_method"): "method_fits" in made,
            ("precision_errors", "landmark_precision", "required_precision"): (
                "precision_errors" in made
            ),
            POSTERIOR: study.posterior.draws > 0,
            ("against_gould_2024a",): self.rebuilt,
            ("spread_over_landmark_sd",): study.landmark_precision.poses > 0,
            ("stiffness_over_load_point", "load_point_effect"): study.load_point.asked,
        }
        return (*ALWAYS, *(name for names, is_asked in asked.items() if is_asked for name in names))

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables of this study that are made of job files."""
        return tuple(name for name, places in self._places.items() if places)

    @property
    def by_specimen(self) -> tuple[str, ...]:
        """What is sampled, and what one job of a specimen makes."""
        return tuple(name for name in BY_SPECIMEN if name in self.tables)

    @property
    def others(self) -> tuple[str, ...]:
        """The ranking and the base model."""
        return "best.json", "model.yaml"

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        return IN_BLOCKS[table][0] if table in IN_BLOCKS else BY_SPECIMEN[table]

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """All (specimen, block) of a table, blocks numbered `000`, `001`, ..."""
        count = -(-len(self._places[table]) // self._per_block(table))
        return [(name, f"{block:03d}") for name in self.specimens for block in range(count)]

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        size = self._per_block(table)
        places = self._places[table][int(block) * size : (int(block) + 1) * size]
        folder = f"{self.folder}/{IN_BLOCKS[table][1]}/specimen-{specimen}"
        return [f"{folder}/{place}.parquet" for place in places]

    def blocks_of_calibrations(self, specimen: str) -> list[str]:
        """The blocks that hold the calibrations of a specimen."""
        blocks = (one for one in self.blocks("calibrations") if one[0] == specimen)
        return [self.block_file("calibrations", *one) for one in blocks]

    def _per_block(self, table: str) -> int:
        """Number of job files that are joined at a time: those of whole poses where they differ."""
        if table not in ("calibrations", "simulations"):
            return _FILES_PER_BLOCK
        of_a_pose = len(self._places[table]) // self.study.poses
        return of_a_pose * min(self.study.block, max(1, MOST_FILES_PER_BLOCK // of_a_pose))
