"""What a kind of study is: settings, checks, tables, jobs and figures in one declaration.

The declaration of a kind is `KIND` in ``spinepipe/studies/<kind>/kind.py``. Functions are named,
not imported, so that reading the declaration loads no mechanics and no drawing, and so that the
digest of a job follows its own file alone.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.documents.form import TableForm
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.problems import InputProblem
from spinepipe.schema import Table
from spinepipe.studies.study import Study
from spinepipe.studies.study_files import Figure, StudyFiles

Check = Callable[[YamlDocument, Any, Cohort], Iterator[InputProblem]]
"""What is asked of a study file, the study and its cohort."""

CheckOfFiles = Callable[[YamlDocument, Any, Cohort, Path], Iterator[InputProblem]]
"""The same, with the folder of the Snakefile, from which paths count."""


@dataclass(frozen=True)
class Job:
    """A function that writes result files of a study.

    Attributes
    ----------
    name : what rules, logs and digests call it.
    at : ``file:function`` in the folder of the kind, by default the file of the job's own name and
        `run`.
    reads : for a job that makes tables of tables, the tables it is computed from, of those that
        the study has; a name with a dot is another result file, handed over as an argument of its
        own.
    writes : the tables it makes of them.
    ignores : settings that it does not look at: their names, with what of each is ignored. All
        others count, so that one added later is not overlooked.
    makes : of a job with a rule of its own, the results that it writes as a whole: tables, and
        other files by their names with a dot.
    header_alone : whether it reads no specimen; else it reads the one that its files are of, or all
        where they are of none.
    reads_base : whether it reads the model file that the study builds on.
    many : whether it comes by the hundreds, so that workers import it beforehand.
    in_blocks : the table of its files, where these come by the thousands and are made block by
        block, each in one process: the function takes ``parts``, paths with the wildcards of each.
    also : what else it reads that decides, such as marks of other files; asked with what is
        expected of the study (`spinepipe.jobs.expected`) and the job's wildcards.
    """

    name: str
    at: str = ""
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    ignores: Mapping[str, Any] = field(default_factory=dict)
    makes: tuple[str, ...] = ()
    header_alone: bool = False
    reads_base: bool = False
    many: bool = False
    in_blocks: str = ""
    also: Callable[[Any, Mapping[str, str]], list[str]] | None = None

    @property
    def module(self) -> str:
        """The file in the folder of the kind, as a dotted name."""
        return (self.at or self.name).partition(":")[0]

    @property
    def function(self) -> str:
        """The function in it."""
        return self.at.partition(":")[2] or "run"


@dataclass(frozen=True)
class WantedFiles:
    """Which model of a study is asked for.

    Attributes
    ----------
    root : folder of the Snakefile. results : of the study.
    specimen : whose model.
    pose : number of a sampled joint pose; None for the cohort's own.
    start : whether with the stiffness where fits start, and not with a fitted one.
    representation : of stiffness, by name; None for the one that the study's results recommend.
    point_mm : from each joint's origin, where its matrix is told; None for OpenSim's file.
    test : whose loads and motion are wanted too; None for no test.
    """

    root: Path
    results: Path
    specimen: str
    pose: int | None = None
    start: bool = False
    representation: str | None = None
    point_mm: tuple[float, float, float] | None = None
    test: str | None = None


@dataclass(frozen=True)
class Kind:
    """All that the core asks a kind of study.

    Attributes
    ----------
    settings : what its study files hold.
    files : the result files of a study of a cohort; they name its figures.
    checks : what it demands of its cohort; each asked whatever the others find.
    checks_of_files : what it demands of further files.
    checks_at_start : what it needs of the machine; asked before it starts, when all else is sound.
    tables : the tables it can make.
    jobs : what computes them.
    ignored_by_figures : settings that no figure looks at.
    makes_models : the job that writes model files on which other studies may build.
    exports : ``file:function`` of what makes OpenSim's document of a specimen; called with study,
        cohort and what is `WantedFiles`, it returns `spinepipe.studies.exports.Exported`.
    why_no_export : where it has none, why, as a sentence.
    forms : files of a cohort's folder that it reads besides those of every cohort.
    holds : whether it solves tests in which a rig fixes joint coordinates (supports.csv).
    settled : gives the study with what its file leaves to the cohort in place; asked before the
        checks, so that all else sees what is meant.
    told_by_check : ``file:function`` of what `spinepipe check` says of a sound study besides;
        called with study, cohort and the folder of the Snakefile, it returns words, and what it
        warns of.
    explains : ``file:function`` of what `spinepipe why` says; called with the folder of a study's
        results and a name, it yields lines.
    before_data : ``file:function`` of what `spinepipe new study --design` says; called with study,
        cohort, the folder of the Snakefile, cycles of each test, misfits, and where the table goes,
        it yields lines.
    starter : further lines of a new study file, with what stands in them as a remark.
    cost : how much a study as `starter` has it computes, in words; empty where it hangs on data.
    question : what its studies ask, in a few words: the heading above them on the page of all.
    doubts : ``file:function`` of what most likely is wrong with files that it alone reads; called
        with a cohort that has any of them, it yields doubts.
    """

    settings: type[Study]
    files: type[StudyFiles]
    checks: tuple[Check, ...]
    tables: tuple[Table, ...]
    jobs: tuple[Job, ...]
    checks_of_files: tuple[CheckOfFiles, ...] = ()
    checks_at_start: tuple[CheckOfFiles, ...] = ()
    ignored_by_figures: tuple[str, ...] = ()
    makes_models: str | None = None
    exports: str | None = None
    why_no_export: str = ""
    forms: tuple[TableForm, ...] = ()
    holds: bool = False
    settled: Callable[[Any, Cohort], Any] | None = None
    told_by_check: str | None = None
    doubts: str | None = None
    explains: str | None = None
    before_data: str | None = None
    starter: str = ""
    cost: str = ""
    question: str = "Other questions"

    def job(self, name: str) -> Job:
        """The job of that name."""
        return next(job for job in self.jobs if job.name == name)

    def maker(self, result: str) -> Job:
        """The job that writes a table, or another file by its name with a dot, as a whole."""
        return next(job for job in self.jobs if result in (*job.writes, *job.makes))

    def table(self, name: str) -> Table:
        """The table of that name."""
        return next(table for table in self.tables if table.name == name)

    def figure(self, name: str) -> Figure:
        """The figure of that name."""
        return next(figure for figure in self.figures if figure.name == name)

    @property
    def figures(self) -> tuple[Figure, ...]:
        """Its figures, in the order of the report."""
        return self.files.drawings

    @property
    def joined(self) -> tuple[str, ...]:
        """Tables joined from files that jobs with rules of their own make, a file each."""
        in_blocks = {job.in_blocks for job in self.jobs}
        return tuple(name for name in self.files.joined if name not in in_blocks)

    @property
    def analyses(self) -> tuple[Job, ...]:
        """Jobs that make tables of tables."""
        return tuple(job for job in self.jobs if job.writes)


def ignoring(*names: str, **parts: Any) -> dict[str, Any]:
    """What a job ignores: whole settings by name, of others the parts given."""
    return {**dict.fromkeys(names, True), **parts}
