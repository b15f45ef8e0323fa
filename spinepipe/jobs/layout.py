"""Which files the results of a study consist of, and which of them make up which table.

Job files are joined block by block before they become one table: a flat fan-in of thousands of
files costs Snakemake quadratic time.
"""

import os
from dataclasses import dataclass

TABLES = ("landmarks", "poses", "calibrations", "simulations")
FIGURES = {"stiffness": "calibrations", "errors": "simulations", "joint_pose": "poses"}
"""Figures and the table each is drawn from."""

_MOST_FILES_PER_BLOCK = 300


@dataclass(frozen=True)
class Layout:
    """The result files of one study, as paths relative to the working directory.

    Attributes
    ----------
    study
        Name of the study.
    specimens
        Names of the specimens of its cohort.
    poses
        Number of sampled joint poses per specimen.
    best_models
        Number of best stiffness sets that are tried on every pose.
    block
        Poses whose job files are joined into one block, fewer if they have too many files.
    """

    study: str
    specimens: tuple[str, ...]
    poses: int
    best_models: int
    block: int

    @property
    def stiffnesses(self) -> list[str]:
        """What a pose is simulated with: its own calibration and the best sets of all poses."""
        return ["calibrated", *(f"best{rank:02d}" for rank in range(1, self.best_models + 1))]

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """All (specimen, block) of a table, blocks numbered `000`, `001`, ..."""
        count = -(-self.poses // self._poses_per_block(table))
        return [(name, f"{block:03d}") for name in self.specimens for block in range(count)]

    def block_files(self, table: str) -> list[str]:
        """The block files of which a table is made."""
        return [self._block_file(table, *block) for block in self.blocks(table)]

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        size = self._poses_per_block(table)
        first = int(block) * size
        poses = [f"{pose:04d}" for pose in range(first, min(first + size, self.poses))]
        if table == "calibrations":
            folder = f"results/{self.study}/calibrations/specimen={specimen}"
            return [f"{folder}/pose={pose}.parquet" for pose in poses]
        folder = f"results/{self.study}/jobs/specimen={specimen}"
        names = self.stiffnesses
        return [
            f"{folder}/pose={pose}/stiffness={name}.parquet" for pose in poses for name in names
        ]

    def results(self) -> list[str]:
        """What a reader of the study wants to have: tables, ranking, model and figures."""
        files = [*(f"{table}.parquet" for table in TABLES), "best.json", "model.yaml"]
        files += [f"figures/{figure}.{kind}" for figure in FIGURES for kind in ("svg", "png")]
        return [f"results/{self.study}/{file}" for file in files]

    def lost(self) -> list[str]:
        """Job files that are missing although a table or block holds their rows.

        Snakemake does not miss a deleted file once the table made of it exists.
        """
        tables = ("calibrations", "simulations")
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
        whole = f"results/{self.study}/{table}.parquet"
        return os.path.exists(whole) or os.path.exists(self._block_file(table, specimen, block))

    def _block_file(self, table: str, specimen: str, block: str) -> str:
        folder = f"results/{self.study}/blocks/{table}"
        return f"{folder}/specimen={specimen}/block={block}.parquet"

    def _poses_per_block(self, table: str) -> int:
        files_per_pose = 1 if table == "calibrations" else len(self.stiffnesses)
        return min(self.block, max(1, _MOST_FILES_PER_BLOCK // files_per_pose))
