"""A study run as on a cluster: submitted jobs are processes of their own that share a folder.

The profile for Slurm is used as it is, with an executor that submits to a shell script instead.
What would be caught: rules that only work in the process that has planned them, jobs of a group
that start Snakemake one by one, a profile that speaks of rules that are no more.
"""

import re
import shutil
import sys
from pathlib import Path

import pytest
import yaml
from small_project import STARTS, Project

from spinepipe.studies.registry import kind_names, kind_of

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
BLOCK = "range_of_motion/blocks/range_of_motion/specimen=b/block=000.parquet"


def with_queue(project: Project) -> Project:
    project.path("queue").mkdir()
    snakefile = project.path("Snakefile")
    snakefile.write_text(snakefile.read_text() + NOTE)
    submit = project.path("submit.sh")
    submit.write_text(SUBMIT)
    submit.chmod(0o755)
    return project


def run_on_cluster(project: Project, target: str, moves: int) -> str:
    """What a project is asked for, its jobs submitted; returns what Snakemake said.

    Snakemake's job scripts do not quote the path of Python: it is reached by one without blanks.
    """
    environment = project.folder.parent / "environment"
    environment.symlink_to(sys.prefix)
    done = project.snakemake(
        *(target, "--profile", "profiles/slurm", "--executor", "cluster-generic"),
        *("--cluster-generic-submit-cmd", "./submit.sh", "--jobs", "2", "--cores", "2"),
        *("--group-components", f"moves={moves}"),
        *("--seconds-between-status-checks", "1", "--latency-wait", "10"),
        python=str(environment / "bin" / "python"),
    )
    logs = "\n".join(path.read_text() for path in project.path("queue").glob("*.log"))
    assert done.returncode == 0, done.stdout + logs
    STARTS.extend(["submitted"] * (starts(project) - 1))
    return done.stdout


def starts(project: Project) -> int:
    return len(list(project.path("queue").glob("*.start")))


def test_submitted_jobs_make_the_same_files_and_start_snakemake_once(
    eight: Project, tmp_path: Path
) -> None:
    """Sixteen moves are one submitted job, the block that joins them another."""
    cluster = with_queue(eight.copy(tmp_path / "project"))
    shutil.rmtree(cluster.path("results/range_of_motion/jobs/specimen=b"))
    cluster.path(f"results/{BLOCK}").unlink()
    said = run_on_cluster(cluster, f"results/{BLOCK}", moves=16)
    assert cluster.contents() == eight.contents()
    assert len(re.findall("Submitted group job", said)) == 1
    assert len(re.findall("Submitted (?:group )?job", said)) == 2
    assert starts(cluster) == 2 + 1


@pytest.mark.full
def test_what_the_queue_refuses_is_told_once(eight: Project, tmp_path: Path) -> None:
    """A group and a job by itself, each tried three times."""
    cluster = with_queue(eight.copy(tmp_path / "project"))
    shutil.rmtree(cluster.path("results/range_of_motion/jobs/specimen=b"))
    cluster.path(f"results/{BLOCK}").unlink()
    cluster.path("submit.sh").write_text("#!/bin/sh\necho invalid time limit\nexit 1\n")
    for told in ("group moves", "rule range_of_motion_block"):
        done = cluster.snakemake(
            *(f"results/{BLOCK}", "--profile", "profiles/slurm", "--executor", "cluster-generic"),
            *("--cluster-generic-submit-cmd", "./submit.sh", "--jobs", "2", "--cores", "2"),
            *("--group-components", "moves=16", "--latency-wait", "1"),
        )
        assert done.returncode != 0
        assert len(re.findall(f"Error in {told}", done.stdout)) == 1, done.stdout
        assert f"{told}: 3 times in all" in done.stdout
        assert ("invalid time limit" in done.stdout) == told.startswith("rule")
        assert "Traceback" not in done.stdout
        moved = "results/range_of_motion/jobs/specimen=b"
        shutil.copytree(eight.path(moved), cluster.path(moved), dirs_exist_ok=True)


@pytest.mark.full
def test_a_whole_study_comes_out_the_same(eight: Project, tmp_path: Path) -> None:
    cluster = with_queue(eight.copy(tmp_path / "project"))
    shutil.rmtree(cluster.path("results/range_of_motion"))
    said = run_on_cluster(cluster, "results/range_of_motion/report.html", moves=16)
    assert all(eight.contents()[name] == found for name, found in cluster.contents().items())
    # Moves of each specimen; and one of summaries, figures and report.
    assert len(re.findall("Submitted group job", said)) == 2 + 1
    assert starts(cluster) == len(re.findall("Submitted (?:group )?job", said)) + 1


def test_the_profile_speaks_of_rules_that_exist() -> None:
    settings = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text())
    written = "\n".join(path.read_text() for path in ROOT.glob("workflow/rules/*.smk"))
    rules = set(re.findall(r"^ *(?:rule|checkpoint) (\w+):", written, re.MULTILINE))
    assert {"move", "respond"} <= rules
    pages = {f"{kind}_{made}" for kind in kind_names() for made in ("figure", "report")}
    rules |= pages | {f"{kind}_{made}" for kind in kind_names() for made in ("block", "table")}
    rules |= {f"{kind}_{job.name}" for kind in kind_names() for job in kind_of(kind).analyses}
    assert set(settings["groups"]) | set(settings["set-resources"]) <= rules
    assert set(settings["group-components"]) <= set(settings["groups"].values())
    assert {settings["groups"].get(rule) for rule in pages} == {"pages"}
