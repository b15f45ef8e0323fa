"""Why the report of a study is not up to date: settings, data, code or libraries that changed.

Each table says what it was made of, and the report has all settings of the study as they were.
"""

import html
import re
from collections.abc import Iterator
from pathlib import Path

import yaml

from spinepipe.jobs.digest import provenance, versions
from spinepipe.jobs.expected import Expected
from spinepipe.marks import DamagedFile
from spinepipe.report.overview.side_by_side import settings_that_differ
from spinepipe.report.words import count
from spinepipe.studies.registry import kind_of
from spinepipe.tables import read_metadata

_SETTINGS = re.compile(r"<pre>(study: .*?)</pre>", re.DOTALL)
"""Where a report has them, see `study_page.html`."""


def reasons(expected: Expected) -> list[str]:
    """Why results are not what study, data and code of now would make, in sentences.

    None where the report is up to date.
    """
    if expected.is_up_to_date:
        return []
    root, files = Path(expected.root), expected.files
    missing = [path for path in files.results() if not (root / path).exists()]
    if len(missing) == len(files.results()):
        return ["it was not run"]
    told = list(_settings(root / files.page(), expected))
    changed: dict[str, list[str]] = {}
    for path in files.results():
        if path.endswith(".parquet") and path not in missing:
            for what in _of_table(expected, Path(path).stem, root / path):
                changed.setdefault(what, []).append(Path(path).stem)
    told += [f"{what}: {', '.join(tables)}" for what, tables in changed.items()]
    if missing:
        told.append(f"{count(len(missing), 'result')} of {len(files.results())} are not there")
    return told or ["the code that draws its figures or writes its report has changed"]


def _settings(page: Path, expected: Expected) -> Iterator[str]:
    """Settings that differ from those of the report; defaults of now are told as well."""
    found = _SETTINGS.search(page.read_text("utf-8")) if page.is_file() else None
    if found is not None:
        before = yaml.safe_load(html.unescape(found[1]))
        for one in settings_that_differ(before, expected.study.model_dump(mode="json"), True):
            yield f"config/studies/{expected.study.study}.yaml: {one.name} {one.a} → {one.b}"


def _of_table(expected: Expected, name: str, path: Path) -> Iterator[str]:
    """What a table was made of that is not so any more."""
    study, cohort = expected.study, expected.cohort
    try:
        before = read_metadata(path)
    except DamagedFile:
        yield "damaged, and computed again"
        return
    whole = {"data_digest": cohort.digest, "cohort_digest": cohort.digest}
    if "cohort_digest" in before and before["cohort_digest"] != whole["cohort_digest"]:
        yield f"data of the cohort {cohort.name} changed since"
    maker = [job for job in kind_of(study.kind).jobs if name in (*job.writes, *job.makes)]
    if maker and "code_digest" in before and maker[0].header_alone is False:
        now = provenance(maker[0].name, study, cohort)
        if before["code_digest"] != now["code_digest"]:
            yield "code changed since"
    others = {key: value for key, value in versions().items() if before.get(key, value) != value}
    for key, value in others.items():
        yield f"{key.removeprefix('version_')} was {before[key]} and is {value}"
