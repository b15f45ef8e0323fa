"""A search at work: its rules, how its pieces are run, and what it has looked at so far."""

from spinepipe.discrepancy.found import Rules, Stage
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.hypothesis import Supposed
from spinepipe.discrepancy.joint_fit import JointFit, joint_fit
from spinepipe.discrepancy.lack_of_fit import LackOfFit, lack_of_fit
from spinepipe.discrepancy.refit import Refit, refit, refits
from spinepipe.discrepancy.rounds import look
from spinepipe.discrepancy.screen import Screen
from spinepipe.discrepancy.tasks import Run


class Inquiry:
    """Looks, refits and fits by the rules; ``stages`` is the log."""

    def __init__(self, rules: Rules, run: Run) -> None:
        self.rules, self.run = rules, run
        self.stages: list[Stage] = []

    @property
    def first(self) -> Stage:
        """The first look, beside the base alone."""
        return self.stages[0]

    @property
    def rounds(self) -> int:
        """Rounds so far in which effects could enter."""
        return sum(stage.name.isdigit() for stage in self.stages)

    @property
    def rivalries(self) -> int:
        """Times so far that all others were tried in an effect's place."""
        return len(self.stages) - self.rounds

    def look(self, grounds: Grounds) -> Screen:
        """A screen; the null's draws are those of the first, beside the base alone."""
        rules = self.rules
        threshold = self.first.screen.threshold if self.stages else None
        draws = (rules.draws, rules.false_alarm, rules.seed)
        return self.run(look, grounds, rules.trials, *draws, threshold)

    def lack(self, grounds: Grounds) -> LackOfFit:
        """The generic basis beside the grounds' fit."""
        rules = self.rules
        return self.run(lack_of_fit, grounds, rules.coordinates, rules.draws, rules.seed)

    def refits(self, grounds: Grounds, screen: Screen) -> tuple[Refit, ...]:
        """The forms that lead a screen, refitted; best first."""
        return refits(grounds, screen, self.rules.trials, self.run)

    def refit(self, grounds: Grounds, one: Supposed) -> Refit:
        """One form beside those of the grounds' fit."""
        trials = next(t for t in self.rules.trials if t.effect == one.form.name)
        return refit(grounds, one, trials, self.run)

    def beside(self, base: Grounds, current: Grounds, others: tuple[Supposed, ...]) -> Grounds:
        """Grounds with these of the current effects alone; the base where they have no fit."""
        if not others:
            return base
        fit: JointFit = self.run(joint_fit, current.suppose(others), base.setting)
        return base.at(fit) if fit.usable else base
