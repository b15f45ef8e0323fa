"""What a run says: what is ahead, every few seconds the time left, which jobs failed.

It imports nothing of spinepipe: Snakemake imports it before the Snakefile says which copy of
spinepipe counts. Who asks for Snakemake's words (`-n`, `--verbose`, `--quiet`) gets them from
Snakemake's own handler. A program that starts Snakemake, such as `spinepipe run`, sets the variable
`SPINEPIPE_EVENTS` and gets a JSON object a line instead, also of a dry run.
"""

import json
import os
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from snakemake_logger_plugin_spinepipe.time_left import TimeLeft, duration, job_seconds

EVENTS = "SPINEPIPE_EVENTS"
"""Environment variable: the study that is run, or anything where there are several."""

SECONDS_BETWEEN_LINES = 2.0
MOST_FAILED_NAMED = 5
UNSAID = (
    *("Assuming unrestricted", "Using shell", "Group jobs: inactive", "Select jobs"),
    *("Job rate limit reached", "Trying to restart job"),
    *("Cannot restore", "Restored previous", "Removing output files of failed job"),
)
WHERE_RAISED = ("RuleException", "JobFailed in ", '  File "')
"""Lines about a failed job that are Snakemake's, not the job's own."""

REFUSED = (
    "it was not submitted. `--verbose` shows the call, which tells why if you run it; remedies: "
    'docs/cluster.md, "What the queue refuses".'
)
"""Of a group: Snakemake drops what the queue said."""


class LogHandler(LogHandlerBase):
    """Gets the records of Snakemake's logger, one after the other in a thread of its own."""

    def __post_init__(self) -> None:
        asked = self.common_settings
        others = asked.dryrun or asked.verbose or asked.debug_dag or asked.show_failed_logs
        quiet = {choice.name for choice in asked.quiet or ()}
        touches = {"-t", "--touch"} & set(sys.argv)  # takes no time worth to be kept
        submitted = "SPINEPIPE_RUN" in os.environ  # inherited from the run that submits
        self._events = EVENTS in os.environ and not (asked.verbose or submitted)
        self._speaks = self._events or (quiet <= {"HOST"} and not (others or touches))
        self._dry = asked.dryrun
        self._root = Path.cwd()
        self._cores: int | None = None  # where jobs are submitted: nobody knows how long they wait
        self._time_left = TimeLeft({})
        self._planned: Counter[str] = Counter()
        self._started: Counter[str] = Counter()
        self._newest = ""  # rule of the last job that was not planned at the start
        self._jobs: dict[int, Any] = {}
        self._failed: dict[int, Any] = {}
        self._submitted_failed: Counter[str] = Counter()
        self._last, self._line_at = "", 0.0  # job that finished last; when a line was written

    @property
    def writes_to_stream(self) -> bool:
        """Whether it speaks; else Snakemake does."""
        return self._speaks

    writes_to_file = has_filter = has_formatter = needs_rulegraph = False

    def emit(self, record: Any) -> None:
        """Write what there is to say of a record."""
        try:
            if self._speaks and (text := self._told(record)):
                self._write(text)
        except Exception:  # it would end the thread, and with it all words
            self.handleError(record)

    def close(self) -> None:
        """Say which jobs failed, and keep what jobs took for the next run."""
        if self._speaks:
            self._speaks = False  # Python closes it again at exit
            self._write("\n".join(self._at_the_end()))
            if self._cores and not self._dry:
                self._time_left.keep(self._root)
        super().close()

    def _write(self, text: str) -> None:
        if self._events and not text.startswith("{"):
            text = json.dumps({"event": "text", "text": text}) if text else ""
        sys.stderr.write(f"{text}\n" if text else "")
        sys.stderr.flush()

    def _told(self, record: Any) -> str | None:
        match getattr(record, "event", None):
            case LogEvent.RESOURCES_INFO:
                self._cores = getattr(record, "cores", self._cores)
            case LogEvent.RUN_INFO:
                return self._ahead(record)
            case LogEvent.JOB_INFO:
                self._start(record)
                if self._events:
                    told = {"rule": record.rule_name, "study": record.wildcards.get("study", "")}
                    return json.dumps({"event": "job", **told})
            case LogEvent.JOB_FINISHED:
                return self._finish(record)
            case LogEvent.PROGRESS:
                return self._progress(record)
            case LogEvent.ERROR:
                words = own_words(record.msg)
                return json.dumps({"event": "error", "text": words}) if self._events else words
            case LogEvent.JOB_ERROR:
                self._failed[record.jobid] = record
                if self._events:
                    name = self._named(record.jobid, record)
                    return json.dumps({"event": "failed", "job": name, "why": record.rule_msg})
                if record.rule_msg:  # submitted, and not in a group
                    return self._news(f"rule {record.rule_name}", record.rule_msg)
            case LogEvent.GROUP_ERROR:
                submitted = getattr(record, "external_jobid", None)
                why = f"submitted job {submitted} failed, see its log." if submitted else REFUSED
                return self._news(f"group {record.groupid}", why)
            case None if not record.msg.startswith(UNSAID):
                return record.msg
        return None

    def _ahead(self, record: Any) -> str:
        """Of which kinds of studies reports are made, how many jobs, how long that takes."""
        stats = getattr(record, "per_rule_job_counts", None) or record.stats
        self._planned = Counter({rule: count for rule, count in stats.items() if rule != "total"})
        known, study = job_seconds(self._root), os.environ.get(EVENTS, "")
        own = {rule: known[f"{study}:{rule}"] for rule in stats if f"{study}:{rule}" in known}
        self._time_left, self._line_at = TimeLeft({**known, **own}), record.created
        if self._events:
            return json.dumps({"event": "plan", "jobs": self._planned.total(), **self._left()})
        kinds = [
            rule.removesuffix("_report") + (f" ({count})" if count > 1 else "")
            for rule, count in self._planned.items()
            if rule.endswith("_report")
        ]
        jobs = f"{self._planned.total():,} jobs{self._time(', about {}')}"
        return ": ".join(filter(None, [", ".join(kinds), jobs]))

    def _left(self, later: int = 0) -> dict[str, float]:
        """Seconds left, for a program; nothing where nobody knows."""
        totals = self._planned + Counter({self._newest: later})
        return {"left": self._time_left.seconds(totals, self._cores)} if self._cores else {}

    def _time(self, words: str, later: int = 0) -> str:
        """Words about the time left; `later` jobs were made known by a checkpoint."""
        if not self._cores:
            return ""
        return words.format(duration(self._left(later)["left"]))

    def _start(self, job: Any) -> None:
        if job.jobid not in self._jobs:
            self._started[job.rule_name] += 1
            if self._started[job.rule_name] > self._planned[job.rule_name]:
                self._planned[job.rule_name] += 1
                self._newest = job.rule_name
        self._jobs[job.jobid] = job

    def _finish(self, record: Any) -> str | None:
        job = self._jobs[record.job_id]
        self._failed.pop(record.job_id, None)
        study = job.wildcards.get("study", "")
        self._time_left.finish(job.rule_name, record.created - job.created, study)
        self._last = ": ".join(filter(None, [study, job.rule_name]))
        pages = [Path(self._root, path) for path in job.output or () if path.endswith(".html")]
        if self._events:
            return None
        # the first one: what else a job of a page writes leads to it
        return "\n".join(f"{study}: {page.as_uri()}" for page in pages[:1])

    def _progress(self, record: Any) -> str | None:
        if self._events:
            now = {"done": record.done, "total": record.total, "last": self._last}
            later = record.total - self._planned.total()
            return json.dumps({"event": "progress", **now, **self._left(later)})
        if record.created - self._line_at < SECONDS_BETWEEN_LINES:
            return None
        self._line_at = record.created
        left = self._time("  ·  {} left", record.total - self._planned.total())
        return f"{record.done:,} of {record.total:,} jobs{left}  ·  {self._last}"

    def _news(self, name: str, why: str) -> str | None:
        """The first failure of a submitted job of its rule or group; others are counted."""
        self._submitted_failed[name] += 1
        return f"Error in {name}: {why}" if self._submitted_failed[name] == 1 else None

    def _at_the_end(self) -> list[str]:
        """Name failed jobs once more, of many the first ones: their words are far up."""
        told = [f"{name}: {n} times in all" for name, n in self._submitted_failed.items() if n > 1]
        if len(self._failed) > 1:
            shown = list(self._failed.items())[:MOST_FAILED_NAMED]
            more = len(self._failed) - len(shown)
            told += [f"{len(self._failed)} jobs failed:"]
            told += [f"  {self._named(number, error)}" for number, error in shown]
            told += [f"  and {more} more"] if more else []
            told += ["Run the same command again: what is finished is kept."]
        return told

    def _named(self, number: int, error: Any) -> str:
        """Rule, wildcards and logs of a failed job; no log was written of one that never ran."""
        wildcards = self._jobs[number].wildcards if number in self._jobs else {}
        logs = [f"(log: {path})" for path in error.log or () if os.path.isfile(path)]
        named = (f"{name}={value}" for name, value in wildcards.items())
        return " ".join([error.rule_name, *named, *logs])


def own_words(text: str) -> str:
    """What a failed job says itself; any other error as it is."""
    if "JobFailed in " not in text:
        return text
    return "\n".join(line for line in text.splitlines() if not line.startswith(WHERE_RAISED))
