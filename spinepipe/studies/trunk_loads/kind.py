"""The kind trunk_loads: muscle forces, joint loads and disc pressure of persons in tasks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.comparison.papers import beside, hangs_on
from spinepipe.schema import all_declared
from spinepipe.studies.kind import Job, Kind, ignoring
from spinepipe.studies.recordings import MOVING, RECORDED, TRIALS, motion_digests
from spinepipe.studies.study_files import Figure, StudyFiles, files_of_block, numbered_blocks
from spinepipe.studies.subjects import SUBJECTS
from spinepipe.studies.trunk_loads.checks import check_lifts, check_source, check_trunk
from spinepipe.studies.trunk_loads.forms import GEOMETRY_FORMS, TASKS
from spinepipe.studies.trunk_loads.persons import extra_inputs
from spinepipe.studies.trunk_loads.sampling import batches, sampled_specimens
from spinepipe.studies.trunk_loads.settings import TrunkLoads, reproduces

PER_PERSON = (
    *("tasks", "levels", "muscles", "paths", "iterations"),
    *("upright", "masses", "scaling", "remarks"),
)
"""Tables with one job file for each person."""

PER_LIFT = ("lift_loads", "lift_frames", "lift_bands", "lift_paths")
"""Tables with one job file for each person and recorded lift."""

OF_TASKS = ("tasks", "levels", "muscles", "paths", "iterations", "simplified")
"""Tables that a cohort without tasks has not."""

TUNED = ("pressures", "tuning", "agreement")

_SPREAD = Job("spread", "", ("tasks", "responses"), ("intervals", "drivers"))
_AGAINST = Job(
    "against_ghezelbash_2016",
    "",
    ("tasks", "levels", "muscles", "upright", "pressures", "agreement"),
    ("against_ghezelbash_2016",),
    also=hangs_on("ghezelbash_2016"),
)

FULL = ("simplified", *TUNED, *_AGAINST.writes)
"""Wrong simplifications, what is tuned to a volunteer, and the paper, which does both."""


@dataclass(frozen=True)
class TrunkFiles(StudyFiles):
    """The result files of one study of trunk loads.

    Attributes
    ----------
    rebuilt : whether the cohort stands for that of a paper whose numbers are at hand.
    tasked : whether it has tasks. lifts : trials whose frames are tasks, by person.
    """

    full = FULL
    joined = (*PER_PERSON, "simplified", "responses", *PER_LIFT)
    drawings = (
        Figure(
            "pressure_against_measured",
            "Pressure in and compression of L4–L5",
            "charts:pressures",
            ("tasks",),
            ("intervals",),
        ),
        Figure(
            "tuned_pressures", "Pressures before and after fitting", "charts:tuned", ("pressures",)
        ),
        Figure(
            "lift_loads",
            "Load over a lift",
            "charts_of_lifts:over_time",
            ("lift_loads", "lift_frames", "lift_bands"),
        ),
        Figure("strength", "Muscle stress that tasks take", "charts_of_trust:strength", ("tasks",)),
        Figure(
            "drivers",
            "Where the spread of the loads comes from",
            "charts_of_trust:drivers",
            ("intervals", "drivers", "design", "responses"),
        ),
        Figure(
            "extensors",
            "Long back muscles while bending forwards",
            "charts:extensors",
            ("tasks", "muscles"),
        ),
        Figure(
            "load_over_flexion",
            "Load while bending forwards",
            "charts:over_flexion",
            ("tasks",),
            ("intervals",),
        ),
        Figure(
            "load_by_level",
            "Load on every joint",
            "charts:by_level",
            ("tasks", "levels"),
            ("intervals",),
        ),
        Figure(
            "cost_of_simplifications",
            "What simplifications change",
            "charts_of_trust:simplifications",
            ("simplified",),
        ),
    )

    study: TrunkLoads
    rebuilt: bool
    tasked: bool
    lifts: Mapping[str, tuple[str, ...]]

    @classmethod
    def of(cls, study: TrunkLoads, cohort: Cohort) -> "TrunkFiles":
        """The files of a study of a cohort."""
        names, trials = cohort.specimen_names, cohort.further.get("trials")
        known = (
            set() if trials is None else set(zip(trials["specimen"], trials["trial"], strict=True))
        )
        lifts = {
            name: tuple(trial for trial in study.motions.trials if (name, trial) in known)
            for name in names
        }
        shown = reproduces(cohort.name) and beside()
        return cls(study, names, shown, "tasks" in cohort.further, lifts)

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that this study has."""
        tuned = TUNED if self.study.volunteer else ()
        samples = ("design", "responses", *_SPREAD.writes) if self.study.uncertain.tasks else ()
        against = _AGAINST.writes if self.rebuilt else ()
        whole = (*PER_PERSON, "simplified", *tuned, *samples, *against)
        lifts = PER_LIFT if any(self.lifts.values()) else ()
        return (*(name for name in whole if self.tasked or name not in OF_TASKS), *lifts)

    @property
    def made_of_jobs(self) -> tuple[str, ...]:
        """The tables that are made of job files."""
        return tuple(table for table in self.joined if table in self.tables)

    def job_of(self, table: str, path: str) -> str:
        """The job that writes a file of which a table is made."""
        jobs = {"simplified": "simplify", "responses": "respond", **dict.fromkeys(PER_LIFT, "lift")}
        return jobs.get(table, "hold")

    def blocks(self, table: str) -> list[tuple[str, str]]:
        """One block per person, of samples as many as it takes."""
        if table in PER_LIFT:
            return numbered_blocks([name for name, trials in self.lifts.items() if trials], 1)
        if table != "responses":
            return numbered_blocks(self.specimens, 1)
        sampled = sampled_specimens(self.study, self.specimens)
        return numbered_blocks(sampled, batches(self.study))

    def job_files(self, table: str, specimen: str, block: str) -> list[str]:
        """The job files of which a block is made."""
        place = f"{self.folder}/jobs/{table}/specimen-{specimen}"
        if table in PER_LIFT:
            return [f"{place}/trial-{trial}.parquet" for trial in self.lifts[specimen]]
        if table == "responses":
            sampled = sampled_specimens(self.study, self.specimens)
            numbers = files_of_block(block, len(sampled), batches(self.study))
            return [f"{place}/batch-{number:05d}.parquet" for number in numbers]
        return [f"{place}.parquet"]


def _source(expected: Any, _place: Mapping[str, str]) -> list[str]:
    """The marks of the trunk's source."""
    return extra_inputs(expected.study, expected.cohort)


def _source_and_design(expected: Any, place: Mapping[str, str]) -> list[str]:
    """The marks of the trunk's source and of the drawn inputs."""
    return [*_source(expected, place), expected.of_job("draw", {})]


def _source_and_motion(expected: Any, place: Mapping[str, str]) -> list[str]:
    """The marks of the trunk's source and of the person's recordings."""
    return [*_source(expected, place), *motion_digests(expected.cohort, place["specimen"])]


def settle_lifts(study: TrunkLoads, cohort: Cohort) -> TrunkLoads:
    """A study that leaves it to the cohort which lifts it has: without tasks all that move."""
    further, told = cohort.further, "trials" in study.motions.model_fields_set
    if told or TASKS.stem in further or TRIALS.stem not in further:
        return study
    rows = further[TRIALS.stem]
    moving = tuple(dict.fromkeys(rows["trial"][rows["kind"].isin(MOVING)].astype(str)))
    motions = study.motions.model_copy(update={"trials": moving})
    return study.model_copy(update={"motions": motions})


_NO_TASK_OF_ITS_OWN = ignoring("uncertain", "volunteer", "simplified_tasks", "motions")

KIND = Kind(
    question="Loads in daily tasks",
    settings=TrunkLoads,
    files=TrunkFiles,
    checks=(check_trunk,),
    checks_at_start=(check_source, check_lifts),
    tables=all_declared(__file__),
    jobs=(
        Job("hold", ignores=_NO_TASK_OF_ITS_OWN, also=_source),
        Job(
            "simplify",
            ignores=ignoring("uncertain", "volunteer", "drawn_tasks", "motions"),
            also=_source,
        ),
        Job(
            "tune",
            makes=TUNED,
            ignores=ignoring("uncertain", "drawn_tasks", "simplified_tasks", "motions"),
            also=_source,
        ),
        Job("draw", "draw_design", makes=("design",), header_alone=True),
        Job(
            "respond",
            in_blocks="responses",
            ignores=ignoring("volunteer", "drawn_tasks", "simplified_tasks", "motions"),
            also=_source_and_design,
        ),
        Job(
            "lift",
            "lifts",
            ignores=ignoring(
                *("volunteer", "drawn_tasks", "simplified_tasks", "trunk_angle"),
                motions={"trials"},
                uncertain={"tasks", "specimens", "samples", "samples_per_target"},
            ),
            also=_source_and_motion,
        ),
        _SPREAD,
        _AGAINST,
    ),
    forms=(SUBJECTS, TASKS, *RECORDED, *GEOMETRY_FORMS),
    settled=settle_lifts,
    doubts="checks:doubts",
    why_no_export="a task is solved for muscle forces in a given posture, and muscles are not "
    "written: the source package of the trunk is the model to take elsewhere",
)
