"""An investigation from beginning to end: base, search, data errors, proof, verdict."""

from dataclasses import dataclass, replace

from spinepipe.cohort import Cohort
from spinepipe.discrepancy.found import Found, Rules
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.mistakes.data_errors import suspected_errors
from spinepipe.discrepancy.mistakes.suspected import SuspectedError
from spinepipe.discrepancy.outcome import Outcome, outcome
from spinepipe.discrepancy.prepared import measured, prepared
from spinepipe.discrepancy.proof.held_out import Asked, HeldOut, held_out
from spinepipe.discrepancy.search import search
from spinepipe.discrepancy.tasks import Run
from spinepipe.model.file import ModelFile
from spinepipe.studies import Discrepancy


@dataclass(frozen=True)
class Investigation:
    """What was found, what speaks for it, and what it comes to."""

    grounds: Grounds
    rules: Rules
    found: Found
    errors: tuple[SuspectedError, ...]
    proof: HeldOut
    ended: Outcome

    def as_told(self) -> "Investigation":
        """With the base in the place of a model whose effects the verdict does not stand for."""
        if self.ended.named or self.ended.tied:
            return self
        found = replace(self.found, final=self.found.base, final_gap=self.found.base_gap)
        return replace(self, found=found, proof=self.proof.of_base())


def investigate(
    study: Discrepancy, cohort: Cohort, file: ModelFile | None, run: Run
) -> Investigation:
    """All that decides the verdict of a study.

    Parameters
    ----------
    file : the model file that the study starts from, if it does.

    Raises
    ------
    NoBase
        When the base has no fit.
    """
    grounds, rules = prepared(study, cohort, file, run)
    found = search(grounds, rules, run)
    errors = suspected_errors(grounds, measured(study, cohort), run)
    asked = Asked(study.held_out.tests, study.held_out.specimens, study.held_out.refit)
    proof = held_out(found, asked, run)
    ended = outcome(found, study.margin, proof, errors)
    return Investigation(grounds, rules, found, errors, proof, ended)
