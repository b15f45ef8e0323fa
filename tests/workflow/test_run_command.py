"""`spinepipe run`, `plan` and `why` on a project whose jobs take milliseconds.

Catches a run that ends with the wrong code or without its words, a stopped one that loses what was
finished, and a plan that is not what the run then does.
"""

import json
import shutil
import signal
import time
from collections.abc import Mapping
from typing import Any

import pytest
import yaml
from small_project import Project
from toy import STUDY

from spinepipe.cli.slurm import ADDED_TO, slurm_profile

pytestmark = pytest.mark.slow

ACCIDENT = """

whole_run_job = run_job


def run_job(job, rule, wildcards, *others):
    if rule == "count_joints" and wildcards.get("specimen") == "c":
        job = "accident:happens"
    whole_run_job(job, rule, wildcards, *others)
"""
"""Added to the Snakefile: the job of one of six specimens is another one."""


def ended(project: Project, *arguments: str) -> tuple[int, str, str]:
    """Exit code and both streams of a command."""
    process = project.started(*arguments)
    out, err = process.communicate(timeout=1200)
    assert "Traceback" not in err, err
    return process.returncode, out, err


def accident(project: Project, does: str) -> None:
    project.path("accident.py").write_text(f"def happens(**_):\n    {does}\n")
    snakefile = project.path("Snakefile")
    snakefile.write_text(snakefile.read_text() + ACCIDENT)
    shutil.rmtree(project.path("results"))


def test_a_run_does_what_its_plan_says_and_then_all_is_up_to_date(toy_copy: Project) -> None:
    code, out, _ = ended(toy_copy, "run")
    assert (code, out.splitlines()[0]) == (0, "All studies of config/config.yaml are up to date.")
    toy_copy.edit(f"config/studies/{STUDY}.yaml", "times: 2", "times: 3")
    code, out, _ = ended(toy_copy, "why", STUDY)
    assert f"  config/studies/{STUDY}.yaml: times 2 → 3" in out.splitlines()
    code, out, _ = ended(toy_copy, "plan", STUDY, "--json")
    (plan,) = json.loads(out)
    assert {part["part"]: part["jobs"] for part in plan["jobs"]}["count_joints"] == 6
    jobs = sum(part["jobs"] for part in plan["jobs"])
    code, out, err = ended(toy_copy, "run", "-j", "2")
    assert code == 0
    assert err.startswith(f"{jobs} jobs, about ")
    assert f"Report: results/{STUDY}/report.html" in out
    assert out.splitlines()[-1] == f"Next: spinepipe why {STUDY} --quality"
    assert ended(toy_copy, "why", STUDY)[1].startswith("Up to date.")
    (plan,) = json.loads(ended(toy_copy, "plan", STUDY, "--json")[1])
    assert plan["up_to_date"]


def test_a_failed_job_ends_with_its_own_words_and_3(toy_copy: Project) -> None:
    accident(toy_copy, "raise ValueError('no such spine')")
    code, _, err = ended(toy_copy, "run", STUDY, "--keep-going", "-j1")
    assert code == 3
    log = f"results/{STUDY}/logs/count_joints/specimen-c.log"
    told = (
        f"error: job count_joints study={STUDY} specimen=c: ValueError: no such spine\n  log: {log}"
    )
    assert told in err
    assert err.splitlines()[-1].endswith("are kept. After mending, the same command goes on.")
    _, out, _ = ended(toy_copy, "why", STUDY)
    assert out.startswith(f"Failed: job count_joints study={STUDY} specimen=c: ValueError")


def test_a_stopped_run_keeps_what_is_finished(toy_copy: Project) -> None:
    """The one job left says that it is at work, and never ends by itself."""
    accident(toy_copy, "open('at_work', 'w').close(); __import__('time').sleep(1000)")
    process = toy_copy.started("run", STUDY, "--keep-going", "-j2")
    while not toy_copy.path("at_work").exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=1200)
    assert process.returncode == 130
    assert "jobs are kept; the same command goes on." in err.splitlines()[-1]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["run", "countd"], f'error: there is no study "countd"\n  did you mean {STUDY}?\n'),
        (["plan", STUDY, "--effort", "full"], f"error: {STUDY} is a study of kind joint_count"),
        (["run", STUDY, "--", "-n"], "error: a run that computes nothing\n  spinepipe plan"),
        (["plan", STUDY, "--", "-n"], "error: plan hands nothing to Snakemake"),
    ],
)
def test_what_cannot_be_run(toy: Project, arguments: list[str], told: str) -> None:
    code, _, err = ended(toy, *arguments)
    assert code == 2
    assert err.startswith(told)


@pytest.mark.parametrize(
    ("typed", "also", "changed"),
    [
        ([], [], {}),
        (["--verbose", "--set-resources", "tune:runtime=5"], [], {"tune": {"runtime": 5}}),
        (["--set-resources=tune:mem_mb=7 * attempt"], [], {"tune": {"mem_mb": "7 * attempt"}}),
        ([], ["slurm_account=me"], {"default-resources": {"slurm_account": "me"}}),
        (["--groups", "a=x", "b=x"], [], {"groups": {"a": "x", "b": "x"}}),
    ],
)
def test_options_of_a_run_are_added_to_the_profile_for_slurm(
    toy: Project, typed: list[str], also: list[str], changed: Mapping[str, Any]
) -> None:
    """Snakemake alone puts a list of the command line in the place of the profile's."""
    before = yaml.safe_load(toy.path("profiles/slurm/config.yaml").read_text())
    rest = slurm_profile(toy.folder, typed, also)
    assert rest == [*(["--verbose"] * ("--verbose" in typed)), "--profile", str(ADDED_TO.parent)]
    after = yaml.safe_load(toy.path(str(ADDED_TO)).read_text())
    for key, value in changed.items():
        of = "set-resources" if key == "tune" else None
        (before[of] if of else before).setdefault(key, {}).update(value)
    assert after == before
