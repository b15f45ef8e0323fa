"""The answer for a surgeon: which model reproduces films it has not seen, and how sure that is.

A model is personalised on some films of a patient (fitted) and predicts the others (held out). The
answer hangs on its errors in rotations of segments since the erect film, deg, pooled as a root mean
square over the held-out films of all patients. Differences between models are tested over patients
(table ``statistics``: Wilcoxon's signed rank test, corrected by Holm's method).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import pandas as pd

from spinepipe.report.page.document import Headline, ResultTables
from spinepipe.report.words import capital, count, number
from spinepipe.status import PrescribedStatus, Status
from spinepipe.studies.scoliosis.errors import REFERENCE
from spinepipe.studies.scoliosis.words import TOLD

DECIDING = "rotation"
"""The measure that the answer hangs on, as the column ``measure`` of ``accuracy`` has it."""

SIGNIFICANT = 0.05
"""p-values below this, corrected by Holm's method, are called significant."""

NOT_PERSONAL = "uniform"
"""The model that takes nothing from a patient's films but their shape."""

NO_POSE = (PrescribedStatus.UNSTABLE, PrescribedStatus.NOT_CONVERGED)
"""How a solve may end without a pose. Where the top cannot be put where the film has it
(`UNREACHABLE`) there is a pose, the one that misses it least, and it is held against the film.
"""


@dataclass(frozen=True)
class ModelRanking:
    """Models by their error in a measure on a group of films, the least first.

    Attributes
    ----------
    rows : of the table ``accuracy``, a model each: those of these films and this measure that have
        an error.
    """

    rows: pd.DataFrame

    @classmethod
    def of(cls, accuracy: pd.DataFrame, films: str, measure: str) -> "ModelRanking":
        """From the table ``accuracy``, which may have no rows.

        Parameters
        ----------
        films : ``fitted`` or ``held_out``. measure : a name of `MEASURES`.
        """
        if accuracy.empty:
            return cls(accuracy)
        own = accuracy[(accuracy["films"] == films) & (accuracy["measure"] == measure)]
        return cls(own.dropna(subset=["rmse"]).sort_values("rmse", kind="stable"))

    @property
    def models(self) -> list[str]:
        """Names, the least error first."""
        return [] if self.rows.empty else list(self.rows["model"])

    def error(self, model: str) -> float:
        """Root mean square error of a model, in the unit of the measure (deg or mm)."""
        return float(self.rows.loc[self.rows["model"] == model, "rmse"].iloc[0])

    def sized(self, model: str) -> str:
        """The same in words, with its unit: ``3.2°``."""
        unit = "°" if self.rows["unit"].iloc[0] == "deg" else " mm"
        return f"{number(self.error(model))}{unit}"

    def less(self, model: str, other: str) -> float:
        """Share by which the error of a model is less than that of another; below 0: it is more."""
        return 1.0 - self.error(model) / self.error(other)

    @property
    def noise(self) -> float | None:
        """Error that reading the films alone makes, in the unit of the measure.

        None where neither repeated readings nor the study tell how exactly films are read.
        """
        if self.rows.empty:
            return None
        known = self.rows["reading_noise"].dropna()
        return float(known.iloc[0]) if len(known) else None


def headline(results: ResultTables) -> Headline:
    """The answer, how sure it is, and what casts doubt on it."""
    accuracy, positions = results.table("accuracy"), results.table("positions")
    held_out = ModelRanking.of(accuracy, "held_out", DECIDING)
    doubts = (
        *_doubts(positions, held_out),
        *_of_fits(results.table("laws"), results.table("population")),
    )
    if not held_out.models:
        fitted = ModelRanking.of(accuracy, "fitted", DECIDING)
        return Headline(_without(positions), _of_fitted(fitted), doubts)
    best, *_ = held_out.models
    tests = results.table("statistics")
    ps = {name: p_of(tests, "held_out", DECIDING, best, name) for name in _compared(held_out)}
    sure = (_sure(held_out, ps), above_noise(held_out))
    return Headline(_answer(held_out, ps), " ".join(part for part in sure if part), doubts)


def _compared(standing: ModelRanking) -> list[str]:
    """The models that the best one is held against: the next best first, then the reference.

    The reference is the model that Jalalian 2017 compares with (`REFERENCE`). It is not
    added where it is one of the two best itself.
    """
    others = standing.models[1:]
    return [*others[:1], *(name for name in others[1:] if name == REFERENCE)]


def _without(positions: pd.DataFrame) -> str:
    """Why nothing can be said of films that models have not seen."""
    if positions.empty or positions["fitted"].all():
        return (
            "Nothing is held out: no patient has a film besides erect and bending, so nothing can "
            "be said of positions that a model has not seen."
        )
    return "No model has a pose on all held-out films of any patient."


def _of_fitted(fitted: ModelRanking) -> str:
    """The best model on films that it was fitted to, where none are held out."""
    if not fitted.models:
        return ""
    best = fitted.models[0]
    free = int(fitted.rows["free_parameters"].iloc[0])
    return (
        f"On the films that models were personalised on, {TOLD[best]} has the least error of "
        f"rotations, {fitted.sized(best)}, with {count(free, 'parameter')} taken from these films; "
        "that it would hold elsewhere does not follow."
    )


def _answer(held_out: ModelRanking, ps: Mapping[str, float | None]) -> str:
    """The best model, and its error beside those of others.

    Parameters
    ----------
    ps : p of the best model against each of `_compared`, the next best first; see `p_of`.
    """
    best, *_ = held_out.models
    # only a difference from the next best that is significant lets it be called the best
    p = next(iter(ps.values()), None)
    told = (
        f"{capital(TOLD[best])} has the least error of rotations on positions that it has not seen"
    )
    if p is not None and p < SIGNIFICANT:
        told = f"{capital(TOLD[best])} reproduces rotations of segments best on positions that it "
        told += "has not seen"
    told = f"{told}: rotations are off by {held_out.sized(best)} (root mean square)"
    if not ps:
        return f"{told}. There is no other model to compare it with."
    compared = []
    for other, which in zip(ps, ("the next, ", ""), strict=False):
        share = 100.0 * held_out.less(best, other)
        less = "as much as" if share <= 0.0 else f"{number(share, 2)} % less than"
        compared.append(f"{less} {which}{TOLD[other]} ({held_out.sized(other)})")
    answer = f"{told}, {' and '.join(compared)}."
    if p is not None and p >= SIGNIFICANT:
        answer += " From the next it cannot be told apart."
    if best == NOT_PERSONAL:
        answer += " Nothing that the others take from the bending films makes them better than it."
    return answer


def _sure(held_out: ModelRanking, ps: Mapping[str, float | None]) -> str:
    """Whether the best model differs from those it is held against, over patients.

    Parameters
    ----------
    ps : as of `_answer`.
    """
    if not ps:
        return ""
    patients = count(int(held_out.rows["n_patients"].min()), "patient")
    if not any(p is not None for p in ps.values()):
        return (
            f"Whether the difference is more than chance over {patients} is not known: there is no "
            "test of it."
        )
    which = ("the next", *(TOLD[name] for name in list(ps)[1:]))
    told = []
    for name, p in zip(which, ps.values(), strict=True):
        found = "significant" if p is not None and p < SIGNIFICANT else "not significant"
        verdict = "not tested" if p is None else f"{found} (p {number(p, 2)})"
        told.append(f"from {name} it is {verdict}")
    return (
        f"The difference over {patients}, by paired Wilcoxon tests corrected by Holm's method: "
        f"{', '.join(told)}."
    )


def above_noise(standing: ModelRanking) -> str:
    """Whether the least error is more than what reading films makes; for rotations, deg."""
    best = standing.models[0]
    if standing.noise is None:
        return (
            "How exactly the films are read is not known, so no error can be held against what "
            "reading alone makes."
        )
    alone = f"Reading the films alone makes {number(standing.noise, 2)}°"
    if standing.error(best) > standing.noise:
        return f"{alone}; the error is above that, so the model itself is off."
    near = [name for name in standing.models if standing.error(name) <= standing.noise]
    if len(near) == len(standing.models):
        return f"{alone}; no model is above that, so these films hardly tell models apart."
    return f"{alone}; {count(len(near), 'model is', 'models are')} not above that."


def p_of(statistics: pd.DataFrame, films: str, measure: str, one: str, other: str) -> float | None:
    """p of the paired Wilcoxon test of two models over patients, corrected by Holm's method.

    None without a test. Which model is named first does not matter.

    Parameters
    ----------
    statistics : the table; a family is all pairs of models on one group of films and one measure.
    """
    if statistics.empty:
        return None
    rows = statistics[statistics["family"] == f"{films}/{measure}"]
    pair = {one, other}
    known = rows[rows["response"].isin(pair) & rows["factor"].isin(pair)]["p_holm"].dropna()
    return float(known.iloc[0]) if len(known) else None


def _doubts(positions: pd.DataFrame, held_out: ModelRanking) -> list[str]:
    """What should be looked at before the answer is believed: poses that were not found, and models
    that are compared on unlike patients for that reason.

    Parameters
    ----------
    positions : of fitted and held-out films.
    """
    if positions.empty:
        return []
    doubts = []
    lost = positions[positions["status"].isin([status.value for status in NO_POSE])]
    if len(lost):
        patients, were = lost["specimen"].nunique(), "was" if len(lost) == 1 else "were"
        doubts.append(
            f"Look at this first: {len(lost)} of {count(len(positions), 'pose')} {were} not found, "
            f"in {count(patients, 'patient')}; errors leave these patients out."
        )
    counts = [] if held_out.rows.empty else sorted(set(held_out.rows["n_patients"]))
    if len(counts) > 1:
        doubts.append(
            f"Models are compared on unlike patients: some have all poses of {counts[0]}, others "
            f"of {counts[-1]}."
        )
    return doubts


def _of_fits(laws: pd.DataFrame, population: pd.DataFrame) -> Iterator[str]:
    """Doubts about the fits: multipliers held at their bound, a population that did not converge.

    The reference model has a multiplier of stiffness for each region; over that of the last region
    it lies between 1/10 and 10 (Petit 2004, `FARTHEST_MULTIPLIER`). ``tangent_fitted`` fits all
    patients in rounds, each with what the round before says of the population, until that stands
    still.

    Parameters
    ----------
    laws, population : tables of these names.
    """
    if "fit_status" in laws:
        fits = laws[laws["model"] == REFERENCE].drop_duplicates("specimen")
        held = int((fits["fit_status"] == Status.CONVERGED_AT_BOUND.value).sum())
        if held:
            yield (
                f"In {held} of {count(len(fits), 'patient')} {TOLD[REFERENCE]} ends at the bound "
                "of its multipliers, a factor of 10: what others are compared with is decided by "
                "the bound there."
            )
    if "status" in population and (population["status"] == Status.NOT_CONVERGED.value).any():
        yield "The population of tangent_fitted did not stand still within its rounds."
