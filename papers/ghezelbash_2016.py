"""Selectors for Ghezelbash et al. 2016, doi 10.1007/s10237-016-0792-3, beside its volunteers.

Our geometry, muscles and passive curves are others than the paper's, which does not print its own.
Tasks carry the numbers of its Table 1. Two tables are no results: `asked`, the rows of tasks.csv,
and `subjects`, those of subjects.csv.
"""

from itertools import permutations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from papers.run import Computed, NotComputed, StudyRun
from papers.selectors import named

VOLUNTEER = "volunteer"
"""Who stands for the man whose pressures Wilke 2001 measured."""

HEAVIER, LIGHTER = "ng_2002", "arjmand_2009"
PERSONS = (HEAVIER, "ouaaid_2013", VOLUNTEER, LIGHTER)
"""Columns A to D of Table 2, and curves of Fig 9; D's flexion is that of Fig 6."""

BODIES = ["T11", "T12", "L1", "L2", "L3", "L4", "L5", "S1"]
SAME_ANGLE_DEG = 0.05
TRIFLE = 1e-6
"""Of forces at a bound, relative: what a solver leaves."""


# --- a person's tasks -----------------------------------------------------------------------------


def _numbered(run: StudyRun, number: float, table: str = "tasks", **where: Any) -> pd.DataFrame:
    """Rows of the tasks of a number of Table 1, at least one."""
    rows = run.rows(table, **where)
    chosen = rows[_numbers(rows) == number]
    if chosen.empty:
        raise NotComputed(f"this run's table {table} has no task {number:g} of Table 1")
    return chosen


def _numbers(rows: pd.DataFrame) -> "pd.Series[float]":
    return pd.to_numeric(rows["number"], errors="coerce").astype(float)


def _whole(rows: pd.DataFrame, column: str) -> "pd.Series[float]":
    """A column of numbers of which none is empty."""
    values = pd.to_numeric(rows[column], errors="coerce").astype(float)
    if values.isna().any():
        lacking = rows[values.isna()].iloc[0]
        told = str(lacking.get("message") or "") or f"status {lacking.get('status', 'not told')}"
        raise NotComputed(f"{column} is empty for task {lacking['task']}: {told}")
    return values


def _settled(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows whose forces are sound, at least one."""
    sound = rows[rows["status"] == "converged"]
    if sound.empty:
        raise NotComputed(f"task {rows.iloc[0]['task']} ended with {rows.iloc[0]['status']}")
    return sound


def _sideways(run: StudyRun, degrees: float) -> "pd.Series[Any]":
    """The volunteer's task 9 at an angle, to either side."""
    rows = _numbered(run, 9.0, specimen=VOLUNTEER)
    turned = pd.to_numeric(rows["trunk_right_bending_deg"]).abs()
    chosen = rows[(turned - degrees).abs() < SAME_ANGLE_DEG]
    if chosen.empty:
        raise NotComputed(f"this run's table tasks has no lateral bending of {degrees:g} deg")
    return chosen.iloc[0]


def _forward(run: StudyRun, person: str) -> pd.DataFrame:
    """A person's sound tasks of forward flexion with empty hands, by growing `flexion_deg`.

    Task 7, and the upright and the full posture that it starts and ends with (tasks 1 and 5).
    """
    _numbered(run, 7.0, specimen=person)
    rows = run.rows("tasks", specimen=person)
    chosen = _settled(rows[_numbers(rows).isin([1.0, 5.0, 7.0])])
    chosen = chosen.assign(flexion_deg=-_whole(chosen, "trunk_extension_deg"))
    return chosen.drop_duplicates("flexion_deg").sort_values("flexion_deg")


def task(
    run: StudyRun,
    number: float,
    column: str,
    table: str = "tasks",
    scale: float = 1.0,
    **where: Any,
) -> Computed:
    """A number of the first task of a number: persons are asked the same, so any will do."""
    row = _numbered(run, number, table, **where).iloc[[0]]
    note = f"ours: of {where['specimen']}" if where else ""
    return Computed(scale * float(_whole(row, column).iloc[0]) + 0.0, note=note)  # no minus nought


def task_says(run: StudyRun, number: float, column: str, text: str) -> Computed:
    """Whether tasks.csv has a text for the first task of a number."""
    return Computed(float(_numbered(run, number, "asked").iloc[0][column] == text))


def hand_load(run: StudyRun, number: float) -> Computed:
    """Load in the hands in the first task of a number, kg."""
    return task(run, number, "hand_load_kg")


def tasks_of_number(run: StudyRun, number: float) -> Computed:
    """How many tasks have a number."""
    return Computed(float(_numbered(run, number)["task"].nunique()))


# --- Fig 5: pressure in the disc L4L5 -------------------------------------------------------------


def pressure_error(
    run: StudyRun, number: float, tier: str, sideways: float | None = None
) -> Computed:
    """Computed less measured pressure of the volunteer's task, MPa, of confirmed measurements."""
    rows = _numbered(run, number, specimen=VOLUNTEER) if sideways is None else None
    name = str((_sideways(run, sideways or 0.0) if rows is None else rows.iloc[0])["task"])
    row = run.row("pressures", tier=tier, task=name)
    computed = run.number("pressures", "computed_mpa", tier=tier, task=name)
    if row["status"] != "converged":
        raise NotComputed(f"task {name} ended with {row['status']}")
    measured, status = float(row["measured_mpa"]), str(row["measured_status"])
    told = f"ours: {computed:.3g} MPa computed, {measured:.3g} MPa measured"
    if status == "from_memory":
        raise NotComputed(f"the measured value is not confirmed; {told} from memory")
    return Computed(computed - measured, note=f"{told} ({status}, {row['measured_source']})")


def agreement(run: StudyRun, column: str, tier: str) -> Computed:
    """Correlation, or root mean square error, of pressures, where all tasks are held."""
    if loose := run.number("agreement", "n_not_held", tier=tier):
        raise NotComputed(f"{loose:g} of its tasks are not held by the muscles")
    value = run.number("agreement", column, tier=tier)
    note = f"ours: over {run.number('agreement', 'n_tasks', tier=tier):g} tasks"
    if column != "r":
        return Computed(value, note=note)
    row = run.row("agreement", tier=tier)
    low, high = (None if pd.isna(row[end]) else float(row[end]) for end in ("r_low", "r_high"))
    return Computed(value, low, high, f"{note}; ends: 95 % interval (Fisher)")


# --- Fig 6: global extensors in forward flexion ---------------------------------------------------


def _course(run: StudyRun, group: str) -> pd.DataFrame:
    """Forces of a muscle's two sides, N, by flexion from upright to full (task 5), settled."""
    _settled(_numbered(run, 5.0, specimen=LIGHTER))
    tasks = _forward(run, LIGHTER).set_index("task")["flexion_deg"]
    rows = run.rows("muscles", specimen=LIGHTER, group=group)
    rows = rows[rows["task"].isin(tasks.index)]
    if rows["task"].nunique() < max(len(tasks), 3):
        raise NotComputed(f"this run's table muscles has no {group} in some task of flexion")
    forces = pd.DataFrame(
        {
            "active": _whole(rows, "force_n") - _whole(rows, "passive_n"),
            "passive": _whole(rows, "passive_n"),
            "contact": _whole(rows, "contact_n"),
        }
    )
    return forces.groupby(rows["task"].map(tasks)).sum().sort_index()


def peaks_between(run: StudyRun, group: str) -> Computed:
    """Whether the active force is largest between upright and full flexion."""
    force = _course(run, group)["active"]
    return Computed(float(force.iloc[1:-1].max() > max(force.iloc[0], force.iloc[-1])))


def left_at_full_flexion(run: StudyRun, group: str) -> Computed:
    """Active force at full flexion over its largest, percent."""
    force = _course(run, group)["active"]
    if force.max() <= 0.0:
        raise NotComputed("the muscle pulls at no angle")
    return Computed(100.0 * float(force.iloc[-1] / force.max()))


def largest_at_full_flexion(run: StudyRun, group: str, force: str) -> Computed:
    """Whether a force is largest at full flexion."""
    course = _course(run, group)[force]
    return Computed(float(course.iloc[-1] > 0.0 and course.iloc[-1] >= course.max()))


# --- Fig 9: loads of four persons in forward flexion ----------------------------------------------


class _Apart(NamedTuple):
    """Where two persons' loads differ most: flexion, deg, both loads, N, and of how many angles."""

    flexion_deg: float
    one_n: float
    other_n: float
    n_angles: int


def _loads(run: StudyRun, column: str, persons: tuple[str, ...]) -> pd.DataFrame:
    """Loads by angles of flexion that two persons share, the heavier's first."""
    loads = []
    for person in persons:
        rows = _forward(run, person)
        loads.append(_whole(rows, column).set_axis(rows["flexion_deg"].round(6)))
    both = pd.concat(loads, axis=1, join="inner")
    if len(both) < 2:
        raise NotComputed(f"{' and '.join(persons)} share fewer than two angles of flexion")
    return both


def _apart(run: StudyRun, column: str, persons: tuple[str, ...]) -> _Apart:
    both = _loads(run, column, persons)
    loads = both.to_numpy(float)
    at = int((loads[:, 0] - loads[:, 1]).argmax())
    one, other = (float(load) for load in loads[at])
    return _Apart(float(both.index[at]), one, other, len(both))


def persons_apart(run: StudyRun, column: str, of: str, pair: bool = True) -> Computed:
    """Loads of two persons where they differ most: `percent`, difference `n`, or the `lighter`'s.

    Of the heavier and the lighter of the paper's pair, or of all pairs of the four.
    """
    pairs = [(HEAVIER, LIGHTER)] if pair else list(permutations(PERSONS, 2))
    found = max(
        (_apart(run, column, two) for two in pairs), key=lambda one: one.one_n - one.other_n
    )
    note = (
        f"ours: {found.one_n:.4g} and {found.other_n:.4g} N at {found.flexion_deg:g} deg of "
        f"flexion, where they differ most of {found.n_angles} angles that settled"
    )
    difference = found.one_n - found.other_n
    if of != "percent":
        return Computed(difference if of == "n" else found.other_n, note=note)
    if found.other_n <= 0.0:
        raise NotComputed(f"the load that is compared with is {found.other_n:.3g} N")
    return Computed(100.0 * difference / found.other_n, note=note)


def heavier_bears_more(run: StudyRun, column: str) -> Computed:
    """Share of angles at which the heavier of the pair bears more, percent."""
    loads = _loads(run, column, (HEAVIER, LIGHTER)).to_numpy(float)
    share = 100.0 * float((loads[:, 0] > loads[:, 1]).mean())
    return Computed(share, note=f"ours: {len(loads)} angles")


def grows_with_flexion(run: StudyRun, column: str) -> Computed:
    """Whether the pair differs more at the largest angle than upright."""
    loads = _loads(run, column, (HEAVIER, LIGHTER)).to_numpy(float)
    size = np.abs(loads[:, 0] - loads[:, 1])
    return Computed(float(size[-1] > size[0]))


# --- upright, and forces within their bounds ------------------------------------------------------


def _upright(run: StudyRun, person: str) -> "pd.Series[float]":
    rows = run.rows("upright", specimen=person)
    found = pd.to_numeric(rows["upright_deg"]).astype(float).set_axis(rows["body"])
    lacking = [body for body in BODIES if body not in found.index or pd.isna(found[body])]
    if lacking:
        raise NotComputed(f"this run's table upright has no rotation of {lacking[0]} of {person}")
    return found[BODIES]


def upright(run: StudyRun, person: str, body: str) -> Computed:
    """Rotation of a body, deg."""
    return Computed(float(_upright(run, person)[body]))


def ordered_upright(run: StudyRun, person: str) -> Computed:
    """Whether bodies are turned the more backwards the lower they lie."""
    return Computed(float((np.diff(_upright(run, person)) > 0.0).all()))


def spread_upright(run: StudyRun) -> Computed:
    """Largest difference among four persons, deg."""
    apart = np.ptp([_upright(run, person) for person in PERSONS], axis=0)
    return Computed(float(apart.max()), note=f"ours: at {BODIES[int(apart.argmax())]}")


def turned_from_start(run: StudyRun) -> Computed:
    """Largest rotation of a body from the start of Eq 2, deg."""
    rows = run.rows("upright")
    return Computed(float((rows["upright_deg"] - rows["start_deg"]).abs().max()))


def moments_over_start(run: StudyRun) -> Computed:
    """Sum of moments upright over that at the start of Eq 2, the worst of all persons."""
    columns = ["moment_before_nm", "moment_after_nm"]
    rows = run.rows("upright").dropna(subset=columns)
    sums = rows[columns].abs().groupby(rows["specimen"]).sum()
    if sums.empty or (sums["moment_before_nm"] == 0.0).any():
        raise NotComputed("no moments stand at the start of Eq 2")
    return Computed(float((sums["moment_after_nm"] / sums["moment_before_nm"]).max()))


def largest_slack(run: StudyRun) -> Computed:
    """Largest moment that no muscle holds in tasks 1 to 9, N m."""
    rows = run.rows("tasks")
    rows = rows[_numbers(rows).between(1.0, 9.0)]
    if rows.empty:
        raise NotComputed("this run's table tasks has none of tasks 1 to 9")
    slack = _whole(rows, "largest_slack_nm")
    worst = rows.iloc[int(slack.to_numpy().argmax())]
    return Computed(float(slack.max()), note=f"ours: task {worst['task']} of {worst['specimen']}")


def out_of_bounds(run: StudyRun) -> Computed:
    """Fascicles that pull less than passively, or actively beyond the largest stress."""
    stress = run.rows("tasks").set_index(["specimen", "task"])["largest_stress_mpa"]
    rows = run.rows("muscles").dropna(subset=["force_n", "passive_n"])
    if rows.empty:
        raise NotComputed("no fascicle of this run has a force")
    allowed = stress.reindex(pd.MultiIndex.from_frame(rows[["specimen", "task"]])).to_numpy(float)
    largest = allowed * rows["pcsa_mm2"].to_numpy(float)  # MPa mm2 are N
    active = (rows["force_n"] - rows["passive_n"]).to_numpy(float)
    beyond = (active < -TRIFLE * largest) | (active > (1.0 + TRIFLE) * largest)
    return Computed(float(beyond.sum()), note=f"ours: of {len(rows)} forces")


SELECTORS = named(
    *(task, task_says, hand_load, tasks_of_number, pressure_error, agreement, peaks_between),
    *(left_at_full_flexion, largest_at_full_flexion, persons_apart, heavier_bears_more),
    *(grows_with_flexion, upright, ordered_upright, spread_upright, turned_from_start),
    *(moments_over_start, largest_slack, out_of_bounds),
)
