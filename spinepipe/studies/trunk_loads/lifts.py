"""Job: the frames of a recorded lift of one person, each held where it is, with its inertia.

What parts of the body load the spine with is what the inverse dynamics of the motion has; muscles
and joints are in balance with it frame by frame. A frame begins from the forces of the one before.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spinepipe.cohort import Cohort
from spinepipe.effects.contract import Array
from spinepipe.frames import rotation_zxy
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.motion import skeleton
from spinepipe.motion.recorded_motion import RecordedMotion
from spinepipe.motion.standing_spine import standing_spine
from spinepipe.muscles.muscle_equilibrium import L4L5, SolvedTask, SolverOptions
from spinepipe.muscles.person import Person
from spinepipe.muscles.strength import HIGHEST_PA, HeldTask, Least, hold_task
from spinepipe.muscles.task import Instant, Task
from spinepipe.muscles.trunk import BODIES, LEVELS, body_of
from spinepipe.progress import Progress
from spinepipe.sensitivity_analysis.global_indices.design import draw
from spinepipe.status import HELD
from spinepipe.studies.recorded_motion import recorded_motion
from spinepipe.studies.recordings import motion_digests
from spinepipe.studies.trunk_loads.persons import (
    UprightPerson,
    Values,
    extra_inputs,
    solver_options,
)
from spinepipe.studies.trunk_loads.postures import leaning_deg
from spinepipe.studies.trunk_loads.rows import Row, TaskOutcome, level_rows, path_rows
from spinepipe.studies.trunk_loads.sampling import censored_quantile, values_at
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.studies.trunk_loads.tables import PER_LIFT
from spinepipe.tables import from_rows, write
from spinepipe.units import DEG_PER_RAD, MM_PER_M

LIFTED = "load"
"""Part of a recorded motion that is no part of the body."""

MOST_DRAWN = 25
"""Frames of the animation; more are thinned out evenly, but for the one with the largest load."""


def run(root: str, study: str, specimen: str, trial: str, **paths: str) -> None:
    """Write the rows of a lift, a file for each table."""
    settings, cohort = study_of_kind(TrunkLoads, root, study)
    progress = Progress(lambda line: print(f"{study}: {line}", file=sys.stderr, flush=True))
    stands = UprightPerson.of_cohort(settings, cohort, specimen)
    motion = lift_of(cohort, specimen, trial, stands.person)
    rows = rows_of(settings, stands, motion, progress)
    place = {"specimen": specimen, "trial": trial}
    others = [*extra_inputs(settings, cohort), *motion_digests(cohort, specimen)]
    made_by = provenance("lift", settings, cohort, [specimen], others)
    for table in PER_LIFT:
        told = [place | row for row in rows[table.name]]
        whole = [{c.name: row.get(c.name) for c in table.columns} for row in told]
        write(from_rows(table, whole), paths[table.name], made_by)


def lift_of(cohort: Cohort, specimen: str, trial: str, person: Person) -> RecordedMotion:
    """A recorded lift of the spine whose joints and slices the muscles hold."""
    trunk, upright = person.lines.trunk, person.upright
    spine = standing_spine(person.subject, trunk, person.chain, upright, person.masses)
    return recorded_motion(cohort, specimen, trial, spine)


def rows_of(
    settings: TrunkLoads, stands: UprightPerson, motion: RecordedMotion, progress: Progress
) -> dict[str, list[Row]]:
    """Rows of each table, by its name."""
    asked, options = settings.motions, solver_options(settings)
    frames = np.arange(0, len(motion.time_s), asked.every, dtype=np.int64)
    tasks = tasks_of(motion, frames, 1e6 * asked.largest_stress_mpa)
    person, found = stands.person, dict[str, list[Row]]()
    outcomes = [
        TaskOutcome(person, task, one.solved, one.solved.message, held=one)
        for task, one in zip(tasks, held_in_turn(person, tasks, options), strict=True)
    ]
    times = motion.time_s[frames].tolist()
    found["lift_loads"] = [
        {"time_s": time} | row
        for time, outcome in zip(times, outcomes, strict=True)
        for row in _load_rows(outcome)
    ]
    found["lift_frames"] = list(_frame_rows(motion, frames, outcomes))
    peak = max(range(len(frames)), key=lambda k: _compression(outcomes[k].solved))
    drawn = {*np.linspace(0, len(frames) - 1, min(len(frames), MOST_DRAWN)).round().astype(int)}
    found["lift_paths"] = [
        {"time_s": times[k]} | row for k in sorted({*drawn, peak}) for row in path_rows(outcomes[k])
    ]
    sampled = sorted({*range(0, len(frames), asked.samples_every), peak})
    known = _samples(settings, stands, motion, frames[sampled], progress)
    found["lift_bands"] = list(band_rows(motion.time_s[frames[sampled]], *known))
    return found


def tasks_of(
    motion: RecordedMotion,
    frames: NDArray[np.int64],
    stress_pa: float,
    values: Values | None = None,
) -> list[Task]:
    """Frames of a motion as tasks.

    Parameters
    ----------
    frames : (N,) their numbers. stress_pa : largest active stress.
    values : uncertain inputs: lean of trunk and pelvis, strength, pressure in the belly. Loads stay
        where they were seen.
    """
    known = values or {}
    rows = [skeleton.BODIES.index(name) for name in BODIES]
    carriers = np.array([body_of(name) for name in motion.loads.carriers])
    pelvis, trunk = (known.get(f"{part}_extension_deg", 0.0) for part in ("pelvis", "trunk"))
    turned = motion.rotations[:, rows]
    bent = np.swapaxes(turned[:, -1], -1, -2) @ turned[:, 0]  # the trunk against the pelvis
    flexion_deg = DEG_PER_RAD * np.arctan2(bent[:, 1, 0], bent[:, 0, 0])
    leaning = {
        f: [
            rotation_zxy(rad, 0, 0)
            for rad in leaning_deg(pelvis, trunk, flexion_deg[f]) / DEG_PER_RAD
        ]
        for f in frames.tolist()
    }
    at = motion.loads.at - motion.l5s1[:, None]
    return [
        Task(
            name=motion.name,
            number=None,
            turned=np.zeros((len(BODIES), 3)),
            from_upright=True,
            pressure_pa=1e3 * known.get("pressure_kpa", 0.0),
            stress_pa=stress_pa + 1e6 * known.get("largest_stress_mpa", 0.0),
            instant=Instant(
                np.array(leaning[f]) @ turned[f],
                carriers,
                at[f],
                motion.loads.forces[f],
                motion.loads.moments[f],
            ),
        )
        for f in frames
    ]


def held_in_turn(
    person: Person,
    tasks: Sequence[Task],
    options: SolverOptions,
    least: Least = "of_posture",
    highest_pa: float = HIGHEST_PA,
) -> Iterator[HeldTask]:
    """Tasks that follow each other closely, each begun where the one before ended."""
    before = None
    for task in tasks:
        held = hold_task(person, task, options, least, before, highest_pa)
        before = held.solved
        yield held


def _load_rows(outcome: TaskOutcome) -> Iterator[Row]:
    solved, pressure = outcome.solved, outcome.pressure
    assert solved is not None
    assert pressure is not None
    least = outcome.held.least_pa if outcome.held else None
    of_all = {"least_stress_mpa": least and 1e-6 * least, "message": outcome.message}
    for row in level_rows(outcome):
        own = {"pressure_mpa": 1e-6 * pressure.pa, "inside_eq_6": bool(pressure.inside)}
        own = own if row["level"] == LEVELS[L4L5] else {}
        yield row | of_all | own


def _frame_rows(
    motion: RecordedMotion, frames: NDArray[np.int64], outcomes: Sequence[TaskOutcome]
) -> Iterator[Row]:
    names = motion.loads.names
    lifted = names.index(LIFTED) if LIFTED in names else None
    for f, outcome in zip(frames.tolist(), outcomes, strict=True):
        row: Row = {"time_s": float(motion.time_s[f])}
        if lifted is not None:
            place = MM_PER_M * (motion.loads.at[f, lifted] - motion.l5s1[f])
            row |= dict(zip(("x_mm", "y_mm", "z_mm"), place.tolist(), strict=True))
            row["load_n"] = -float(motion.loads.forces[f, lifted, 1])
        yield row | {"iterations": len(outcome.solved.rounds) if outcome.solved else None}


def _compression(solved: SolvedTask | None) -> float:
    """N, of L4L5; of frames that are not held nought."""
    if solved is None or solved.status not in HELD:
        return 0.0
    return float(solved.compression[L4L5])


def _samples(
    settings: TrunkLoads,
    stands: UprightPerson,
    motion: RecordedMotion,
    frames: NDArray[np.int64],
    progress: Progress,
) -> tuple[Array, Array]:
    """(S, N, 7) N compression of persons drawn by the uncertain inputs, and (S, N) Pa, largest
    stress that muscles were allowed; infinite where the frame is not held.

    The person did lift: who is drawn too weak for it has the loads at the stress that it takes.
    """
    asked, options = settings.motions, solver_options(settings)
    drawn = list[Values]()
    if asked.samples:
        factors = list(settings.uncertain.factors)
        design = draw("latin_hypercube", factors, asked.samples, settings.uncertain.seed)
        drawn = [dict(zip(factors, row, strict=True)) for row in values_at(settings, design)]
    compression = np.zeros((len(drawn), len(frames), len(LEVELS)))
    stress = np.full(compression.shape[:2], np.inf)
    numbered = progress.through(list(enumerate(drawn)), f"{motion.name}: persons drawn")
    for s, values in numbered:
        person = stands.varied(values)
        sized = of_mass(motion, person.subject.mass_kg / stands.subject.mass_kg)
        tasks = tasks_of(sized, frames, 1e6 * asked.largest_stress_mpa, values)
        for f, one in enumerate(held_in_turn(person, tasks, options, "untold", np.inf)):
            if one.solved.status in HELD:
                compression[s, f], stress[s, f] = one.solved.compression, one.task.stress_pa
    return compression, stress


def of_mass(motion: RecordedMotion, times: float) -> RecordedMotion:
    """The motion of a person so many times as heavy, with the same load in the hands."""
    factor = np.where(np.array(motion.loads.names) == LIFTED, 1.0, times)[:, None]
    loads = motion.loads
    return replace(
        motion,
        loads=replace(loads, forces=factor * loads.forces, moments=factor * loads.moments),
    )


def band_rows(times: Array, compression: Array, stress: Array) -> Iterator[Row]:
    if not len(stress):
        return
    for k, time in enumerate(times.tolist()):
        held = np.isfinite(stress[:, k])
        lost = int((~held).sum())
        for level, name in enumerate(LEVELS):
            known = compression[held, k, level]
            ends = [censored_quantile(known, lost, p) for p in (0.025, 0.5, 0.975)]
            yield {
                "time_s": time,
                "level": name,
                **dict(zip(("low", "median", "high"), ends, strict=True)),
                "n_samples": len(known),
                "n_failed": lost,
                "n_above": int((stress[held, k] > HIGHEST_PA).sum()),
            }
