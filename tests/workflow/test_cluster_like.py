"""A study run as on a cluster: submitted jobs are processes of their own that share a folder.

The profile for Slurm is used as it is, with an executor that submits to a shell script instead.
What would be caught: rules that only work in the process that has planned them, a job that starts
Snakemake more than once, a profile that speaks of rules that are no more.
"""

import re
import shutil
import sys
from pathlib import Path

import pytest
import yaml
from small_project import STARTS, Project

from spinepipe.studies.registry import kind_names

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
SUBMIT = """\
#!/bin/sh
# Stands in for a queue: the job script runs in a session of its own, as nobody's child.
setsid sh "$1" > "queue/$(basename "$1").log" 2>&1 < /dev/null &
echo $!
"""
# Which process reads the Snakefile: one for each time Snakemake is started.
NOTE = "\nPath('queue', f'{os.getpid()}.start').touch()\n"
BLOCK = "range_of_motion/blocks/range_of_motion/specimen-b/block-000.parquet"


def with_queue(project: Project) -> Project:
    project.path("queue").mkdir()
    snakefile = project.path("Snakefile")
    snakefile.write_text(snakefile.read_text() + NOTE)
    submit = project.path("submit.sh")
    submit.write_text(SUBMIT)
    submit.chmod(0o755)
    return project


def run_on_cluster(project: Project, target: str) -> str:
    """What a project is asked for, its jobs submitted; returns what Snakemake said.

    Snakemake's job scripts do not quote the path of Python: it is reached by one without blanks.
    """
    environment = project.folder.parent / "environment"
    environment.symlink_to(sys.prefix)
    done = project.snakemake(
        *(target, "--profile", "profiles/slurm", "--executor", "cluster-generic"),
        *("--cluster-generic-submit-cmd", "./submit.sh", "--jobs", "2", "--cores", "2"),
        *("--seconds-between-status-checks", "1", "--latency-wait", "10"),
        python=str(environment / "bin" / "python"),
    )
    logs = "\n".join(path.read_text() for path in project.path("queue").glob("*.log"))
    assert done.returncode == 0, done.stdout + logs
    STARTS.extend(["submitted"] * (starts(project) - 1))
    return done.stdout


def starts(project: Project) -> int:
    return len(list(project.path("queue").glob("*.start")))


def lose_block(project: Project) -> None:
    """One block and the job files that it holds."""
    project.path(f"results/{BLOCK}").unlink()
    for stiffness in ("00", "01"):
        move = f"range_of_motion/jobs/specimen-b/pose-0000/stiffness-{stiffness}.parquet"
        project.path(f"results/{move}").unlink()


def test_submitted_jobs_make_the_same_files_and_start_snakemake_once(
    eight: Project, tmp_path: Path
) -> None:
    cluster = with_queue(eight.copy(tmp_path / "project"))
    lose_block(cluster)
    said = run_on_cluster(cluster, f"results/{BLOCK}")
    assert cluster.contents() == eight.contents()
    assert len(re.findall("Submitted job", said)) == 1
    assert starts(cluster) == 1 + 1


@pytest.mark.full
def test_what_the_queue_refuses_is_told_once(eight: Project, tmp_path: Path) -> None:
    """Each job is tried three times."""
    cluster = with_queue(eight.copy(tmp_path / "project"))
    lose_block(cluster)
    cluster.path("submit.sh").write_text("#!/bin/sh\necho invalid time limit\nexit 1\n")
    done = cluster.snakemake(
        *(f"results/{BLOCK}", "--profile", "profiles/slurm", "--executor", "cluster-generic"),
        *("--cluster-generic-submit-cmd", "./submit.sh", "--jobs", "2", "--cores", "2"),
        *("--latency-wait", "1"),
    )
    assert done.returncode != 0
    assert len(re.findall("Error in rule moves_block", done.stdout)) == 1, done.stdout
    assert "rule moves_block: 3 times in all" in done.stdout
    assert "invalid time limit" in done.stdout
    assert "Traceback" not in done.stdout


@pytest.mark.full
def test_a_whole_study_comes_out_the_same(eight: Project, tmp_path: Path) -> None:
    cluster = with_queue(eight.copy(tmp_path / "project"))
    shutil.rmtree(cluster.path("results/range_of_motion"))
    said = run_on_cluster(cluster, "results/range_of_motion/report.html")
    assert all(eight.contents()[name] == found for name, found in cluster.contents().items())
    assert starts(cluster) == len(re.findall("Submitted job", said)) + 1


def test_the_profile_speaks_of_rules_that_exist() -> None:
    settings = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text())
    written = "\n".join(path.read_text() for path in ROOT.glob("workflow/rules/*.smk"))
    rules = set(re.findall(r"^ *rule (\w+):", written, re.MULTILINE))
    assert {"moves_block", "responses_block"} <= rules
    rules |= {f"{kind}_table" for kind in kind_names()}
    assert set(settings["set-resources"]) <= rules
