"""A small study of which only two tables are made: all that is behind them, in seconds."""

from pathlib import Path

from small_project import Project, Shared, copy_project

STUDY = """\
study: small
kind: joint_pose_sensitivity
cohort: palanca_l1l4
seed: 1
loading: equilibrium
poses: 4
best_models: 2
block: 2
calibration:
  bound_factor: 100
  weights:
    {anterior: 10, superior: 100, right: 1, extension: 1, right_bending: 0, left_rotation: 0}
"""
TABLES = tuple(f"results/small/{name}.parquet" for name in ("simulations", "agreement"))


def simulation(pose: int, stiffness: str) -> str:
    """A job file below results."""
    return f"small/jobs/specimen=s01/pose={pose:04d}/stiffness={stiffness}.parquet"


def project_with_tables(shared: Shared, folder: Path) -> Project:
    """A copy of its own of the project with these tables."""

    def build(folder: Path) -> Project:
        project = copy_project(folder)
        project.path("config/studies/small.yaml").write_text(STUDY)
        project.run(*TABLES)
        return project

    return shared.project("tables", build).copy(folder / "project")
