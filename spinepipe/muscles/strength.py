"""How much muscle stress a task takes, how much of a person's strength, and what is left of it.

A task that the stress asked for does not hold is solved again at the least stress that does, as far
as trunks go (Burkhart 2018). In a given posture that stress is a linear programme; forces press the
spine and so move the fascicles, so stress and posture are found in turn. Tissue that is stretched
keeps its force meanwhile: it is no stiffer because muscles contract harder.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.optimize import linprog

from spinepipe.effects.contract import Array
from spinepipe.facts import several
from spinepipe.muscles.forces import Demand, least_slack_forces
from spinepipe.muscles.muscle_equilibrium import SolvedTask, SolverOptions, solve_task
from spinepipe.muscles.person import Person, above
from spinepipe.muscles.task import Task
from spinepipe.muscles.trunk import EXTENSION, LEVELS
from spinepipe.status import Balanced

_PEOPLE = several(__name__, "trunk_muscle_stress")
LOWEST_PA, HIGHEST_PA = _PEOPLE["range"]
(MEAN_PA,) = _PEOPLE["mean"]
"""Largest active stress of trunk extensors, over persons."""


_ABOVE_LEAST, _STEP, _NEAR = 1.01, 1.01, 1.03
"""Stress that is tried next over the least one of this posture; at least so much over one that did
not do; and how near to it one that does is near enough."""

_FAR = 2.0
"""Times what trunks have: no other posture makes up for so much."""

_MOST_SOLVES = 8

_NO_FINITE_PA = 1e9
"""A thousand times what muscles have: what rounding makes of lever arms of nought."""

_MPA = 1e-6

Least = Literal["sought", "of_posture", "untold"]


@dataclass(frozen=True, eq=False)
class HeldTask:
    """A task at the stress that was asked for, or at what it takes.

    Attributes
    ----------
    solved : at the stress that holds it; where none does, as `asked`.
    asked : at the stress that was asked for.
    person, task : at the stress of `solved`, for whatever is asked of them further.
    least_pa : least largest active stress that holds it, Pa, in the posture of `solved`; of a task
        that is not held in the last one that was tried. None: no finite stress does, or it is
        not told.
    short_of, short_at : what a task that is not held lacks, arms or strength, and the joint where
        most is lacking; else None.
    solves : how often the task was solved.
    """

    solved: SolvedTask
    asked: SolvedTask
    person: Person
    task: Task
    least_pa: float | None
    short_of: str | None = None
    short_at: str | None = None
    solves: int = 1


def hold_task(
    person: Person,
    task: Task,
    options: SolverOptions,
    least: Least = "of_posture",
    nearby: SolvedTask | None = None,
    highest_pa: float = HIGHEST_PA,
) -> HeldTask:
    """A task with the forces that hold it, at the stress asked for or the least above that does.

    Parameters
    ----------
    least : whether the least stress is sought where less than what was asked for does, or told of
        the posture that was found, or not told there.
    nearby : a task much like it, such as the frame before, whose forces shorten the way.
    highest_pa : stress up to which it is tried.

    Raises
    ------
    ValueError
        For a load that the arms do not reach.
    """
    asked = solve_task(person, task, options, nearby=nearby)
    now = HeldTask(asked, asked, person, task, None)
    # with L5S1 balanced alone, what other joints ask for is not to be made
    done = options.lowest_alone or (_is_held(now, options) and least != "sought")
    if done and least == "untold":
        return now
    now = replace(now, least_pa=_least_pa(asked, options))
    if done:
        return now
    best, unsettled, too_little, solves = None, None, 0.0, 1
    while solves < _MOST_SOLVES:
        stress = np.inf if now.least_pa is None else _ABOVE_LEAST * now.least_pa
        # so near the least stress hardly any forces will do, and rounds may swing: a little more is
        # tried then
        held = _is_held(now, options)
        if held and (now.solved is asked or now.solved.status is Balanced.CONVERGED):
            best = now
        else:
            unsettled = now if held else unsettled
            too_little = now.task.stress_pa
            if now.least_pa is None or stress > _FAR * highest_pa:
                break
        stress = min(max(stress, _STEP * too_little), max(highest_pa, task.stress_pa))
        if stress <= too_little or (best is not None and stress * _NEAR >= best.task.stress_pa):
            break
        now, solves = _at(person, task, stress, options, now), solves + 1
    best = best or unsettled
    if best is None:
        return replace(_not_held(now, person, task), solves=solves)
    takes = min(best.task.stress_pa, best.least_pa or np.inf)
    if best.task.stress_pa <= task.stress_pa:
        return HeldTask(asked, asked, person, task, takes, solves=solves)
    solved = above_asked(best.solved, task, best.task)
    return replace(best, solved=solved, least_pa=takes, solves=solves)


def above_asked(solved: SolvedTask, asked: Task, held: Task) -> SolvedTask:
    """Forces of a task held at more stress than was asked for, with a status that says so."""
    if solved.status is not Balanced.CONVERGED or held.stress_pa <= asked.stress_pa:
        return solved
    stress = (
        f"at {_MPA * held.stress_pa:.2f} MPa of muscle stress, {_MPA * asked.stress_pa:g} allowed"
    )
    message = "; ".join(part for part in (stress, solved.message) if part)
    return replace(solved, status=Balanced.CONVERGED_ABOVE, message=message)


def _at(
    person: Person, task: Task, stress_pa: float, options: SolverOptions, before: HeldTask
) -> HeldTask:
    """The task at another stress, stretched tissue as it was."""
    # the force of what is stretched is told in shares of strength
    factor = person.passive.factor * task.stress_pa / stress_pa
    who = replace(person, passive=replace(person.passive, factor=factor))
    harder = replace(task, stress_pa=stress_pa)
    solved = solve_task(who, harder, options, nearby=before.solved)
    return HeldTask(solved, before.asked, who, harder, _least_pa(solved, options))


def _not_held(last: HeldTask, person: Person, task: Task) -> HeldTask:
    """A task that all the stress of trunks does not hold: as it was asked for, and why."""
    asked, demand = last.asked, last.solved.demand
    if last.least_pa is not None and last.least_pa <= HIGHEST_PA:  # rounds that found no end
        return HeldTask(asked, asked, person, task, last.least_pa)
    if last.least_pa is None:
        freely = least_slack_forces(replace(demand, most=np.full(len(demand.most), np.inf)))
        slack, short_of = demand.required - demand.arms @ freely, "arms"
    else:
        slack, short_of = last.solved.found.slack, "strength"
    at = LEVELS[int(np.argmax(np.abs(slack.reshape(-1, 3)).max(axis=1)))]
    why = f"no muscle forces of any size make what {at} asks for"
    if last.least_pa is not None:
        why = (
            f"takes {_MPA * last.least_pa:.3g} MPa of muscle stress, most of all for {at}, "
            f"and trunks have {_MPA * HIGHEST_PA:g} at most"
        )
    # where no forces hold, those that leave least over may go to and fro
    message = f"{asked.message}; {why}"
    solved = replace(asked, status=Balanced.BEYOND_STRENGTH, message=message)
    return HeldTask(solved, asked, person, task, last.least_pa, short_of, at)


def _is_held(one: HeldTask, options: SolverOptions) -> bool:
    """Whether muscles make all moments, but for what may be left over."""
    return float(np.abs(one.solved.found.slack).max()) <= options.slack_nm


def _least_pa(solved: SolvedTask, options: SolverOptions) -> float | None:
    """Least stress, Pa, that holds a task where the spine is, if need be with what is left over."""
    demand, slack = solved.demand, solved.found.slack
    if np.abs(slack).max() <= options.slack_nm:
        demand = replace(demand, required=demand.required - slack)
    return stress_needed(demand, solved.stretched)


def stress_needed(demand: Demand, stretched: Array) -> float | None:
    """Least largest active stress, Pa, whose forces meet a demand; None: no finite one does.

    Parameters
    ----------
    stretched : (M,) N, share of the forces that does not change with the stress.
    """
    # moments grow t times while muscles stay as strong: they take the stress over t
    active = replace(demand, least=demand.least - stretched, most=demand.most - stretched)
    asked = demand.required - demand.arms @ stretched
    grown = most_along(active, asked, np.zeros(len(asked)), demand.sheath @ stretched)
    stress = float((active.most / demand.pcsa).max())
    return stress / grown if grown is not None and grown > stress / _NO_FINITE_PA else None


def load_factor(solved: SolvedTask) -> float | None:
    """How many times the loads could be as large before no forces hold them; None: not even none.

    Weight, hands, exertion and pressure grow alike; posture and joints stay as they are.
    """
    loads = solved.applied
    _, turning = above(loads.forces, loads.moments, solved.poses.centres)
    joints = np.einsum("kij,kj->ki", solved.poses.discs, solved.joint_moments)
    return most_along(solved.demand, -turning.ravel(), -joints.ravel())


def capacity_left(solved: SolvedTask) -> Array | None:
    """(7,) N m, flexion moment that could be added at each level alone; None beyond strength."""
    if not solved.found.enough:
        return None
    found, made = np.zeros(len(LEVELS)), solved.demand.required - solved.found.slack
    for level, disc in enumerate(solved.poses.discs):
        direction = np.zeros(made.shape)
        direction[3 * level : 3 * level + 3] = disc[:, EXTENSION]
        found[level] = most_along(solved.demand, direction, made) or 0.0
    return found


def most_along(
    demand: Demand, direction: Array, start: Array, drawn: Array | None = None
) -> float | None:
    """Largest t with which forces can make `start` + t `direction`, (L,) N m; None: not even none.

    With the demand itself as the direction and nought as the start it is the factor by which the
    demand may grow; with a single row it is the moment left there.

    Parameters
    ----------
    drawn : (2,) N, what draws at the sheath of either side t times; nothing by default.
    """
    many = len(demand.pcsa)
    beside = np.zeros(2) if drawn is None else drawn
    solved = linprog(
        np.concatenate([np.zeros(many), [-1.0]]),
        A_eq=np.column_stack([demand.arms, -direction]),
        b_eq=start,
        A_ub=np.column_stack([-demand.sheath, -beside]),
        b_ub=np.zeros(2),
        bounds=[*zip(demand.least, demand.most, strict=True), (0.0, 1e4)],
        method="highs",
    )
    return float(solved.x[-1]) if solved.status == 0 and solved.x is not None else None
