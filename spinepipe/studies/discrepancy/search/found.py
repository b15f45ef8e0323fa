"""What a search may do, and where it ended."""

from dataclasses import dataclass

from spinepipe.discrepancy.forms import Trials
from spinepipe.discrepancy.gaps import Gap
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.hypothesis import Supposed
from spinepipe.discrepancy.lack_of_fit import LackOfFit
from spinepipe.discrepancy.refit import Refit
from spinepipe.discrepancy.screen import Screen


@dataclass(frozen=True)
class Rules:
    """What a search may do. ``draws`` of the null; ``margin`` of log evidence over a rival."""

    trials: tuple[Trials, ...]
    coordinates: tuple[str, ...]
    false_alarm: float
    draws: int
    margin: float
    most_effects: int
    seed: int


@dataclass(frozen=True)
class Rival:
    """Another effect in the place of a named one, and by how much evidence it is behind."""

    name: str
    margin: float


@dataclass(frozen=True)
class Standing:
    """A form that stands in the final model.

    Attributes
    ----------
    log_evidence : beside the others. alone : of its effect on the first screen, beside none.
    over_stiffness : how far its evidence is above that of a stiffness of its own for each joint of
        each specimen, where the form differs between joints as well; None elsewhere.
    """

    supposed: Supposed
    log_evidence: float
    alone: float
    gain: float
    rivals: tuple[Rival, ...]
    over_stiffness: float | None

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.supposed.form.name


@dataclass(frozen=True)
class Stage:
    """One look at the effects, with the refits that followed.

    ``name`` : number of the round, or whose place all others were tried in.
    """

    name: str
    screen: Screen
    refits: tuple[Refit, ...] = ()


@dataclass(frozen=True)
class Found:
    """Where a search ended.

    Attributes
    ----------
    base, final : the grounds with the base alone and with what stands. standing : what stands.
    lack : the generic basis beside the final model.
    generic_threshold : evidence of the generic basis that the null seldom exceeds.
    """

    base: Grounds
    final: Grounds
    standing: tuple[Standing, ...]
    stages: tuple[Stage, ...]
    lack: LackOfFit
    generic_threshold: float
    base_gap: Gap
    final_gap: Gap
