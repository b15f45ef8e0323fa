"""The page of all studies of a project, ``results/index.html``: what each of them says.

It is written anew at the end of each run, from what is stored. No page and no table hangs on it.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any
from urllib.parse import quote

import spinepipe
from spinepipe.cohort.columns import COHORT_YAML
from spinepipe.documents.csv_table import read_rows
from spinepipe.documents.yaml_text import read_yaml
from spinepipe.files import appearing, files_in, folders_in
from spinepipe.marks import DamagedFile
from spinepipe.problems import InputError
from spinepipe.report.conclusions import Told
from spinepipe.report.overview.stored import (
    StoredFiles,
    stored_conclusions,
    stored_files,
)
from spinepipe.report.page.study_page import SIGNS, rendered, tag
from spinepipe.report.words import count
from spinepipe.studies.read import ENDING, read_selection
from spinepipe.studies.registry import kind_names, kind_of
from spinepipe.studies.study import STUDIES, cohort_folder
from spinepipe.studies.tables import CONCLUSIONS

INDEX = Path("results") / "index.html"

TEMPLATES = "spinepipe.report.overview"

_NO_STUDY = "its study file is gone"
_STATES = {
    "up to date": "ok",
    "changed since": "check",
    "failed": "stop",
    "not finished": "check",
    "not checked": "soft",
    "not run": "soft",
    "unsound": "stop",
    _NO_STUDY: "check",
}
"""What is said of a study's results, and how urgent that is."""


@dataclass(frozen=True)
class Entry:
    """A study on the page.

    Attributes
    ----------
    address : of its report, from the page of all. question : the heading that it stands below.
    data : its cohort in a few words. tag : whether anybody was measured; empty where not known.
    state : one of `_STATES`. trouble : what keeps it from being up to date, in a sentence.
    log : address of the log of a failed job, or empty.
    """

    name: str
    address: str
    question: str
    data: str
    tag: str
    state: str
    trouble: str
    log: str
    told: tuple[Told, ...]
    files: StoredFiles

    @property
    def answer(self) -> str:
        """The sentence that answers the question; empty where none is stored."""
        return next((one.text for one in self.told if one.place == "answer"), "")

    @property
    def key(self) -> str:
        """The first of the key numbers and what it is; empty where there is none."""
        for one in (one for one in self.told if one.place == "key"):
            values = map("{}".format, one.values.values())
            return ": ".join([*islice(values, 1), one.text])
        return ""

    @property
    def level(self) -> str:
        """How urgent its state is."""
        return _STATES[self.state]

    @property
    def lights(self) -> list[tuple[str, str, int]]:
        """Level, sign and number of its quality lights, of levels that have any."""
        found = Counter(one.level for one in self.told if one.place == "light")
        return [(level, sign, found[level]) for level, sign in SIGNS.items() if found[level]]

    @property
    def size(self) -> str:
        """Of all its files."""
        return f"{max(self.files.bytes / 1e6, 0.1):,.{0 if self.files.bytes >= 1e7 else 1}f} MB"

    @property
    def day(self) -> str:
        """Of its newest table; empty where there is none."""
        return "" if self.files.newest is None else f"{self.files.newest:%-d %b %Y}"


def write_index(root: Path, up_to_date: Mapping[str, bool | None]) -> Path:
    """Write the page of all studies of a project and return its path.

    Parameters
    ----------
    root : folder of the Snakefile.
    up_to_date : of studies of which it was asked whether the results are those of settings, data
        and code of now; None where study or cohort are not sound. Others are "not checked".
    """
    entries = [entry(root, name, up_to_date) for name in _names(root)]
    run = [one for one in entries if one.state != "not run"]
    groups: dict[str, list[Entry]] = {}
    for one in run:
        groups.setdefault(one.question, []).append(one)
    states = Counter(one.state for one in entries)
    newest = max((one for one in run if one.files.newest), key=_newest, default=None)
    page = rendered(
        "index.html",
        (TEMPLATES,),
        title="spinepipe: all studies",
        groups=groups,
        not_run=[one for one in entries if one.state == "not run"],
        eyebrow=" · ".join([_summary(states), *([newest.day] if newest else [])]),
        version=spinepipe.__version__,
        levels=SIGNS,
    )
    with appearing(root / INDEX) as temporary:
        temporary.write_text(page, "utf-8")
    return root / INDEX


def _newest(one: Entry) -> Any:
    return one.files.newest


def _summary(states: Mapping[str, int]) -> str:
    total = sum(states.values())
    if set(states) == {"up to date"}:
        return f"{count(total, 'study', 'studies')}, all up to date"
    told = [f"{states[state]} {state}" for state in _STATES if states.get(state)]
    return ": ".join(filter(None, [count(total, "study", "studies"), ", ".join(told)]))


def _names(root: Path) -> Iterable[str]:
    """Studies in the order of ``config.yaml``, others after them, last those without a file."""
    known = [path.stem for path in files_in(root / STUDIES, ENDING)]
    try:
        chosen = read_selection(root)
        first = [*chosen.studies, *chosen.full]
    except InputError:
        first = []
    left = [path.name for path in folders_in(root / INDEX.parent) if _has_results(path)]
    return dict.fromkeys([*first, *known, *left])


def _has_results(folder: Path) -> bool:
    """Whether it is the folder of a study, and no other one among results."""
    return any((folder / name).is_file() for name in ("report.html", f"{CONCLUSIONS.name}.parquet"))


def entry(root: Path, name: str, up_to_date: Mapping[str, bool | None]) -> Entry:
    """What is known of a study; parameters as of `write_index`."""
    folder, settings = root / INDEX.parent / name, _yaml(root / STUDIES / f"{name}{ENDING}")
    files, trouble, log = stored_files(folder), "", ""
    kind, cohort = settings.get("kind"), settings.get("cohort")
    known = isinstance(kind, str) and kind in kind_names()
    try:
        told = stored_conclusions(folder)
    except DamagedFile as damage:
        told, trouble = (), str(damage).replace(f"{root}/", "")
    state = _state(files, bool(settings), up_to_date.get(name, ...))
    if state == "unsound":
        trouble = f"The study or its cohort is not sound: spinepipe check {name} says why."
    if state == "failed" and files.failure:
        more = files.failure.count - 1
        trouble = files.failure.why + (f" (and {count(more, 'job')} more)" if more else "")
        log = quote(files.failure.log.as_posix())
    data, source = _cohort(root, cohort) if isinstance(cohort, str) and cohort else ("", "")
    return Entry(
        name=name,
        address=f"{quote(name, safe='')}/report.html" if files.page else "",
        question=kind_of(str(kind)).question if known else "Other questions",
        data=data,
        tag=source,
        state=state,
        trouble=trouble,
        log=log,
        told=told,
        files=files,
    )


def _state(files: StoredFiles, has_study: bool, up_to_date: Any) -> str:
    """One of `_STATES`; ``up_to_date`` is ``...`` where it was not asked."""
    if up_to_date is True:
        return "up to date"
    if files.failure:
        return "failed"
    if up_to_date is None:
        return "unsound"
    if not files.page:
        return "not finished" if files.newest else "not run"
    if not has_study:
        return _NO_STUDY
    return "changed since" if up_to_date is False else "not checked"


def _yaml(path: Path) -> Mapping[str, Any]:
    """Keys of a file, sound or not; none where it cannot be read."""
    document = read_yaml(path, path.name)[0] if path.is_file() else None
    return {} if document is None else document.data


def _cohort(root: Path, name: str) -> tuple[str, str]:
    """A cohort in a few words, and whether anybody was measured: from its header, not checked."""
    folder = cohort_folder(name, root)
    header = _yaml(folder / COHORT_YAML)
    if not header:
        return "", ""
    made_up, rebuilt = (header.get(key) is True for key in ("made_up", "rebuilt"))
    return _size(folder, header), tag(made_up, rebuilt)


def _size(folder: Path, header: Mapping[str, Any]) -> str:
    """``3 specimens, T12–S1``."""
    levels: Sequence[Any] = header.get("vertebrae") or ()
    path = folder / "specimens.csv"
    rows = read_rows(path, path.name)[0] if path.is_file() else None
    told = [count(len(rows.cells), "specimen")] if rows else []
    if isinstance(levels, list) and len(levels) > 1:
        told.append(f"{levels[-1]}–{levels[0]}")
    return ", ".join(told)
