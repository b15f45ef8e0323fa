"""What a cohort's tests could tell apart, before residuals are looked at: all of it together."""

from collections.abc import Sequence
from dataclasses import dataclass

from spinepipe.discrepancy.design.confusions import Confusion, confusions, families
from spinepipe.discrepancy.design.extra_tests import NotTestable, bench, not_testable
from spinepipe.discrepancy.design.seen import Design, candidates, seen_in
from spinepipe.discrepancy.design.testable import Judgement, judgements
from spinepipe.discrepancy.forms import Trials
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.tasks import Run
from spinepipe.effects.contract import Array


@dataclass(frozen=True)
class SmallestDetectable:
    """The smallest gap, noise SD, at which an effect would be found."""

    name: str
    gap: float


@dataclass(frozen=True)
class ToldApart:
    """What the tests could tell.

    Attributes
    ----------
    families : sets of effects that cannot be told apart.
    """

    judgements: tuple[Judgement, ...]
    confusions: tuple[Confusion, ...]
    families: tuple[tuple[str, ...], ...]
    not_testable: tuple[NotTestable, ...]

    @property
    def smallest_detectable(self) -> tuple[SmallestDetectable, ...]:
        """Of all effects that the tests can show."""
        return tuple(
            SmallestDetectable(one.effect, one.detectable.gap)
            for one in self.judgements
            if one.testable and one.detectable is not None
        )


def told_apart(
    grounds: Grounds,
    trials: Sequence[Trials],
    needed: float,
    declared: Array | None,
    seed: int,
    run: Run,
) -> ToldApart:
    """What the tests could tell at the base fit, which ``grounds`` stand on.

    Parameters
    ----------
    needed : log evidence that an effect must have: the screen's threshold and margin.
    declared : (6,) m and rad, SD of a single reading, for coordinates that were not read; or None.
    """
    joints = next(iter(grounds.fit.models.values())).n_joints
    of = {name: run(seen_in, grounds, name, trials) for name in grounds.readings}
    design = Design(candidates(trials, joints, grounds.tests), of)
    found = judgements(trials, of, joints, grounds.tests, needed, seed)
    pairs = confusions(design, found)
    missing = run(not_testable, bench(grounds, declared), trials, found, needed, seed)
    return ToldApart(found, pairs, families(pairs), missing)
