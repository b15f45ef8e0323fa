"""Which files the results of a study consist of, and which of them make up which table.

Job files are joined block by block before they become one table: a flat fan-in of thousands of
files costs Snakemake quadratic time.
"""

import os
from dataclasses import dataclass
from functools import cached_property

from spinepipe.report.published import paper_of
from spinepipe.studies import JointPoseSensitivity

ALWAYS = (
    *("landmarks", "poses", "calibrations", "simulations", "success", "counts", "summary"),
    *("statistics", "agreement", "variance_shares", "importance"),
)
"""Tables that every study has."""

COMPARED = (
    *("summary", "counts", "statistics", "importance", "variance_shares", "success_by_method"),
    *("bootstrap", "required_precision", "landmark_precision", "landmarks"),
    *("calibrations", "simulations", "success"),
)
"""Tables that are compared with the paper's."""

METHODS = (
    "exact",
    "forward_run_default_step",
    "forward_run_sane_step",
    "forward_run_raw_units",
)
"""Ways of fitting that are compared."""

FIGURES: dict[str, tuple[str, ...]] = {
    "stiffness": ("calibrations",),
    "errors": ("simulations",),
    "agreement": ("agreement", "simulations", "success"),
    "joint_pose": ("poses",),
    "pose_against_stiffness": ("variance_shares", "importance"),
    "landmark_precision": ("landmark_precision", "required_precision"),
    "bootstrap": ("bootstrap",),
    "success_by_method": ("success_by_method", "method_fits"),
}
"""Figures and the tables each is drawn from."""

_MOST_FILES_PER_BLOCK = 300
_FILES_PER_BLOCK = 100


@dataclass(frozen=True)
class Layout:
    """The result files of one study, as paths relative to the working directory.

    Attributes
    ----------
    study
        The study.
    specimens
        Names of the specimens of its cohort.
    rebuilt
        Whether its cohort was rebuilt from the paper that results are compared with.
    """

    study: JointPoseSensitivity
    specimens: tuple[str, ...]
    rebuilt: bool

    @classmethod
    def of(cls, study: JointPoseSensitivity, cohort: str, specimens: tuple[str, ...]) -> "Layout":
        """The files of a study of a cohort of that name."""
        return cls(study, specimens, paper_of(cohort) is not None)

    @property
    def folder(self) -> str:
        """Where all results of the study are."""
        return f"results/{self.study.study}"

    @cached_property
    def stiffnesses(self) -> list[str]:
        """What a pose is simulated with: its own calibration and the best sets of all poses."""
        best = range(1, self.study.best_models + 1)
        return ["calibrated", *(f"best{rank:02d}" for rank in best)]

    @cached_property
    def bootstraps(self) -> list[str]:
        """Folders and names of all bootstrap fits of a specimen."""
        parts = {"start": self.study.start_bootstrap, "damping": self.study.damping_bootstrap}
        return [
            f"bootstrap={name}/loading={loading}/set={number:03d}"
            for name, part in parts.items()
            for loading in part.loadings
            for number in range(part.sets)
        ]

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        parts = {
            ("bootstrap",): self._count("bootstrap"),
            ("method_fits", "success_by_method"): self._count("method_fits"),
            ("precision_errors", "landmark_precision", "required_precision"): self._count(
                "precision_errors"
            ),
            ("against_gould_2024a",): int(self.rebuilt),
        }
        return (*ALWAYS, *(name for names, count in parts.items() if count for name in names))

    @property
    def figures(self) -> tuple[str, ...]:
        """The figures that this study has."""
        return tuple(name for name, tables in FIGURES.items() if set(tables) <= set(self.tables))

    def table_files(self, names: tuple[str, ...]) -> list[str]:
        """Files of tables, of those that the study has."""
        return [f"{self.folder}/{name}.parquet" for name in names if name in self.tables]

    def report_tables(self) -> list[str]:
        """The tables that the report shows or speaks of."""
        return self.table_files(self.tables)

    def figure_files(self) -> list[str]:
        """The figures that the report holds."""
        return [f"{self.folder}/figures/{figure}.svg" for figure in self.figures]

    def captions(self) -> list[str]:
        """What is said below each figure."""
        return [f"workflow/report/{figure}.rst" for figure in self.figures]

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """All (specimen, block) of a table, blocks numbered `000`, `001`, ..."""
        count = -(-self._count(table) // self._per_block(table))
        return [(name, f"{block:03d}") for name in self.specimens for block in range(count)]

    def block_files(self, table: str) -> list[str]:
        """The block files of which a table is made."""
        return [self._block_file(table, *block) for block in self.blocks(table)]

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        size = self._per_block(table)
        first = int(block) * size
        numbers = range(first, min(first + size, self._count(table)))
        return [self._job_file(table, specimen, number) for number in numbers]

    def results(self) -> list[str]:
        """What a reader of the study wants to have: report, tables, ranking, model and figures."""
        files = [*(f"{table}.parquet" for table in self.tables), "best.json", "model.yaml"]
        files += [f"figures/{figure}.{kind}" for figure in self.figures for kind in ("svg", "png")]
        return [f"{self.folder}/{file}" for file in [*files, "report.html"]]

    def lost(self) -> list[str]:
        """Job files that are missing although a table or block holds their rows.

        Snakemake does not miss a deleted file once the table made of it exists.
        """
        tables = (name for name in _JOBS if self._count(name))
        return [file for table in tables for file in self._absent(table, joined=True)]

    def simulations_to_do(self) -> int:
        """Number of simulations that have no file yet."""
        return len(self._absent("simulations", joined=False))

    def _absent(self, table: str, joined: bool) -> list[str]:
        """Missing job files of a table; with `joined` of those blocks only that are in a table."""
        return [
            file
            for specimen, block in self.blocks(table)
            if not joined or self._is_joined(table, specimen, block)
            for file in self.job_files(table, specimen, block)
            if not os.path.exists(file)
        ]

    def _is_joined(self, table: str, specimen: str, block: str) -> bool:
        whole = f"{self.folder}/{table}.parquet"
        return os.path.exists(whole) or os.path.exists(self._block_file(table, specimen, block))

    def _block_file(self, table: str, specimen: str, block: str) -> str:
        return f"{self.folder}/blocks/{table}/specimen={specimen}/block={block}.parquet"

    def _count(self, table: str) -> int:
        """Number of job files of a table per specimen."""
        study = self.study
        return {
            "calibrations": study.poses,
            "simulations": study.poses * len(self.stiffnesses),
            "bootstrap": len(self.bootstraps),
            "method_fits": min(study.methods.poses, study.poses) * len(METHODS),
            "precision_errors": len(study.landmark_precision.sd_mm)
            * (study.landmark_precision.poses > 0),
        }[table]

    def _per_block(self, table: str) -> int:
        """Number of job files that are joined at a time."""
        if table not in ("calibrations", "simulations"):
            return _FILES_PER_BLOCK
        files = 1 if table == "calibrations" else len(self.stiffnesses)
        return files * min(self.study.block, max(1, _MOST_FILES_PER_BLOCK // files))

    def _job_file(self, table: str, specimen: str, number: int) -> str:
        return (
            f"{self.folder}/{_JOBS[table]}/specimen={specimen}/{self._job(table, number)}.parquet"
        )

    def _job(self, table: str, number: int) -> str:
        """Place of a job file in its specimen's folder."""
        match table:
            case "calibrations":
                return f"pose={number:04d}"
            case "simulations":
                pose, which = divmod(number, len(self.stiffnesses))
                return f"pose={pose:04d}/stiffness={self.stiffnesses[which]}"
            case "bootstrap":
                return self.bootstraps[number]
            case "method_fits":
                pose, which = divmod(number, len(METHODS))
                return f"pose={pose:04d}/method={METHODS[which]}"
            case "precision_errors":
                return f"sd_mm={self.study.landmark_precision.sd_mm[number]:.15g}"
        raise ValueError(f"{table} is not made of job files")


_JOBS = {
    "calibrations": "calibrations",
    "simulations": "jobs",
    "bootstrap": "bootstrap",
    "method_fits": "methods",
    "precision_errors": "precision",
}
"""Folder of the job files of each table that is made of them."""
