"""What a run says: records as Snakemake sends them, and the lines that come of them.

Catches jobs behind a checkpoint that are forgotten, a failed job that is not named or named though
its second try went well, a refusal told once per job, and words where Snakemake is to speak.
"""

import logging
from enum import Enum
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_logger_plugin_spinepipe import LogHandler

Quiet = Enum("Quiet", "RULES HOST")
AS_IN_PROFILE = {"quiet": {Quiet.HOST}, "dryrun": False, "verbose": False, "debug_dag": False}
OF_RUN: dict[str, Any] = {"stats": {"fit": 10, "toy_report": 1, "total": 11}}


class Run:
    """A run whose records are sent by hand."""

    def __init__(self, **settings: Any) -> None:
        asked = SimpleNamespace(**{**AS_IN_PROFILE, "show_failed_logs": False, **settings})
        self.handler = LogHandler(asked, None)
        self.now = 0.0

    def send(self, event: LogEvent | None = None, msg: str = "", **fields: Any) -> None:
        record = logging.makeLogRecord({"msg": msg, "event": event, "created": self.now, **fields})
        self.handler.handle(record)

    def begin(self, cores: int | None = 2) -> None:
        where = {"cores": cores} if cores else {"nodes": 100}
        self.send(LogEvent.RESOURCES_INFO, **where)
        self.send(LogEvent.RUN_INFO, **OF_RUN)

    def start(self, number: int, rule: str = "fit", output: str = "x.parquet") -> None:
        wildcards = {"study": "s", "pose": f"{number}"}
        self.send(
            LogEvent.JOB_INFO, jobid=number, rule_name=rule, wildcards=wildcards, output=[output]
        )

    def finish(self, number: int, done: int, total: int = 11) -> None:
        self.send(LogEvent.JOB_FINISHED, job_id=number)
        self.send(LogEvent.PROGRESS, done=done, total=total)

    def fail(self, number: int, why: str | None = None) -> None:
        log = [f"{number}.log"]
        self.send(LogEvent.JOB_ERROR, jobid=number, rule_name="fit", rule_msg=why, log=log)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder in which a run of jobs is known to take a second each."""
    monkeypatch.chdir(tmp_path)
    Path(".snakemake").mkdir()
    Path("workflow").mkdir()
    Path("workflow/job_seconds.csv").write_text("rule,seconds\nfit,1\ntoy_report,2\nlater,1\n")


Said = pytest.CaptureFixture[str]


def test_first_line_progress_and_address_of_a_report(capsys: Said) -> None:
    run = Run()
    run.begin()
    assert capsys.readouterr().err == "toy: 11 jobs, about 6 s\n"
    run.start(1)
    run.now = 1.0
    run.finish(1, done=1)
    assert capsys.readouterr().err == ""
    run.start(2)
    run.now = 2.0
    run.finish(2, done=2)
    assert capsys.readouterr().err == "2 of 11 jobs  ·  5 s left  ·  s: fit\n"
    run.start(3, "toy_report", "results/s/report.html")
    run.finish(3, done=3)
    address = Path("results/s/report.html").absolute().as_uri()
    assert capsys.readouterr().err == f"s: {address}\n"
    run.handler.close()
    assert "fit" in Path(".snakemake/job_seconds.csv").read_text()


def test_jobs_that_a_checkpoint_adds_take_time(capsys: Said) -> None:
    run = Run()
    run.begin()
    run.start(1, "later")
    run.now = 3.0
    run.finish(1, done=1, total=111)
    assert capsys.readouterr().err.endswith("1 of 111 jobs  ·  2 min left  ·  s: later\n")


def test_of_submitted_jobs_no_time_is_told_nor_kept(capsys: Said) -> None:
    run = Run()
    run.begin(cores=None)
    run.start(1)
    run.now = 3.0
    run.finish(1, done=1)
    assert capsys.readouterr().err == "toy: 11 jobs\n1 of 11 jobs  ·  s: fit\n"
    run.handler.close()
    assert not Path(".snakemake/job_seconds.csv").exists()


def test_failed_jobs_say_their_own_words_and_are_named_at_the_end(capsys: Said) -> None:
    run = Run()
    run.begin()
    capsys.readouterr()
    Path("2.log").write_text("no such spine")
    raised = (
        'RuleException:\nJobFailed in file "a.smk", line 3:\njob fit: no such spine\n'
        '  log: 2.log\n  File "a.smk", line 3, in __rule_fit'
    )
    run.start(9)
    run.send(LogEvent.ERROR, raised)
    assert capsys.readouterr().err == "job fit: no such spine\n  log: 2.log\n"
    run.send(LogEvent.ERROR, "MissingInputException: x")
    assert capsys.readouterr().err == "MissingInputException: x\n"
    for number in range(2, 9):
        run.start(number)
        run.fail(number)
    run.fail(9)
    run.start(9)
    run.finish(9, done=1)
    run.handler.close()
    run.handler.close()
    said = capsys.readouterr().err.splitlines()
    assert said[:2] == ["7 jobs failed:", "  fit study=s pose=2 (log: 2.log)"]
    assert said[5:] == [
        *("  fit study=s pose=6", "  and 2 more"),
        "Run the same command again: what is finished is kept.",
    ]


def test_what_the_queue_refuses_is_told_once_per_rule_or_group(capsys: Said) -> None:
    run = Run()
    run.begin(cores=None)
    for number in (1, 2, 3):
        run.start(number)
        run.fail(number, "invalid time limit")
        run.send(LogEvent.GROUP_ERROR, groupid="moves", job_error_info=[{}])
    run.handler.close()
    said = capsys.readouterr().err
    assert said.count("Error in rule fit: invalid time limit") == 1
    assert said.count("Error in group moves: it was not submitted.") == 1
    assert "rule fit: 3 times in all\ngroup moves: 3 times in all\n3 jobs failed:" in said


def test_warnings_and_words_without_an_event_are_passed_on(capsys: Said) -> None:
    run = Run()
    run.send(None, "Building DAG of jobs...", levelno=logging.INFO)
    run.send(None, "Select jobs to execute...", levelno=logging.INFO)
    run.send(None, "Job rate limit reached, waiting for free slots.", levelno=logging.INFO)
    run.send(None, "Something is odd", levelno=logging.WARNING)
    run.send(LogEvent.JOB_STARTED, "Execute 2 jobs...")
    assert capsys.readouterr().err == "Building DAG of jobs...\nSomething is odd\n"


@pytest.mark.parametrize(
    "asked", [{"dryrun": True}, {"verbose": True}, {"quiet": {Quiet.RULES, Quiet.HOST}}]
)
def test_who_asks_for_words_of_snakemake_gets_no_others(asked: Any, capsys: Said) -> None:
    run = Run(**asked)
    assert not run.handler.writes_to_stream
    run.begin()
    run.handler.close()
    assert capsys.readouterr().err == ""
