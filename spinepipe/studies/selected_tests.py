"""Which load steps of a test a study computes, and where its motion begins."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from spinepipe.cohort.load_tests import peak_step
from spinepipe.model import LoadCase, LoadStep


@dataclass(frozen=True)
class SelectedTest:
    """A test of which some steps are computed.

    Attributes
    ----------
    case : the steps to compute.
    from_first : whether motion counts from the first step of the case, which is step 0; otherwise
        from the neutral pose.
    largest : number of the step of the largest load.
    stored : which steps of the case become rows.
    """

    case: LoadCase
    from_first: bool
    largest: int
    stored: slice

    @property
    def steps(self) -> tuple[int, ...]:
        """Numbers of the steps that become rows."""
        return tuple(step.step for step in self.case.steps[self.stored])

    @property
    def needed(self) -> list[int]:
        """Places of these steps and of the first, from which the others are reached."""
        return sorted({0, *range(len(self.case.steps))[self.stored]})


def select_steps(
    case: LoadCase, pressed: bool, all_steps: bool, subtracted: bool = True
) -> SelectedTest:
    """What is computed of a test: all of its load steps, or that of the largest load only.

    Joints have no memory, so of the steps before the largest load those are computed where the load
    turns.

    Parameters
    ----------
    pressed : whether weight or a follower load acts, beside the loads of the case.
    subtracted : whether motion counts from step 0. Where nothing acts in it, that is the neutral
        pose, which need not be computed.
    """
    from_first = subtracted and (pressed or _loaded(case.steps[0]))
    peak = peak_step(case)
    largest = case.steps[peak].step
    if all_steps:
        return SelectedTest(case, from_first, largest, slice(None))
    places = case.leading_to([0, peak] if from_first else [peak], pressed)
    steps = tuple(case.steps[place] for place in places)
    return SelectedTest(
        replace(case, steps=steps), from_first, largest, slice(len(steps) - 1, None)
    )


def first_cycles(cases: Iterable[LoadCase]) -> tuple[LoadCase, ...]:
    """The first cycle of each test, in the order of the tests."""
    first: dict[str, LoadCase] = {}
    for case in cases:
        first.setdefault(case.test, case)
    return tuple(first.values())


def _loaded(step: LoadStep) -> bool:
    """Whether anything acts; loads that balance each other still press and bend."""
    return any(wrench.force.any() or wrench.moment.any() for wrench in step.wrenches)
