"""Job: does stiffness go with what is known of the specimens, such as age, sex and degeneration?

Specimens are the sample, not joints: levels are taken out of the logarithms first, and one value
per specimen is regressed on its covariates. With every joint known, effects and errors are those of
a mixed model with a random specimen, and Student's t is exact.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from spinepipe.decomposition import lstsq, svd
from spinepipe.effects.contract import Array
from spinepipe.jobs.digest import provenance
from spinepipe.jobs.inputs import study_of_kind
from spinepipe.statistics import corrected
from spinepipe.status import joined
from spinepipe.studies.cohort_stiffness.representations import (
    ASKED_FOR,
    OF_JOINTS,
    POOLED,
    SHARED,
)
from spinepipe.studies.cohort_stiffness.settings import SEXES, CohortStiffness
from spinepipe.studies.cohort_stiffness.stages import own_fits
from spinepipe.studies.cohort_stiffness.tables import COVARIATES_TABLE
from spinepipe.tables import from_rows, read_frames, write

Row = dict[str, Any]

BESIDE = 4
"""Specimens needed beside one per covariate: the mean, and three degrees of freedom."""

FEWEST_OF_A_SEX = 2
"""With one of a sex, the effect of sex would be what that one specimen is like."""

CLOSE = 1e-6
"""Covariates of which less than this is left beside the others cannot be told apart."""

STEPS = {
    "age_years": (10.0, "10 years"),
    "sex": (1.0, "male against female"),
    "height_m": (0.1, "10 cm"),
    "mass_kg": (10.0, "10 kg"),
    "degeneration_grade": (1.0, "one grade"),
}
"""What one step of a covariate is, in its own unit and in words."""

_PLAIN = tuple(
    name for name in (*OF_JOINTS, *SHARED) if name not in POOLED and name not in ASKED_FOR
)
"""Fitted specimen by specimen: pooled ones are drawn towards each other, whoever they are."""

NO_FITS = "no stiffness fitted specimen by specimen in this study"

_NUMBERS = (
    *("factor", "low", "high", "log_effect", "standard_error"),
    *("degrees_of_freedom", "inflation", "unexplained", "p", "p_holm"),
)


def run(root: str, study: str, tables: list[str], output: str) -> None:
    """Write ``covariates.parquet``."""
    settings, cohort = study_of_kind(CohortStiffness, root, study)
    rows = covariate_rows(
        read_frames(tables)["stiffness"],
        cohort.specimens,
        settings.covariates or (),
        settings.significance,
    )
    origin = provenance("covariates", settings, cohort)
    write(from_rows(COVARIATES_TABLE, rows), output, origin)


def covariate_rows(
    stiffness: pd.DataFrame, specimens: pd.DataFrame, names: Sequence[str], significance: float
) -> list[Row]:
    """Rows of the table ``covariates``.

    Parameters
    ----------
    stiffness : table of that name. specimens : rows of ``specimens.csv``.
    names : covariates, taken together. significance : p below which a test decides.
    """
    known = numbers_of(specimens, names)
    own = own_fits(stiffness)
    here = next((name for name in _PLAIN if (own["representation"] == name).any()), "")
    rows: list[Row] = []
    for coordinate in stiffness["coordinate"].unique():
        chosen = own[(own["representation"] == here) & (own["coordinate"] == coordinate)]
        told = {"coordinate": str(coordinate), "representation": here}
        rows += [{**row, **told} for row in _regression(chosen, known, here in SHARED)]
    holm = corrected([row["p"] for row in rows], "holm")
    for row, p in zip(rows, holm, strict=True):
        decided = "refused" if p is None else "yes" if p < significance else "undecided"
        row |= {"p_holm": p, "holds": decided}
    return rows


def numbers_of(specimens: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """Covariates as numbers in steps, by specimen; NaN where a specimen's is not known."""
    found = {}
    for name in names:
        values = specimens[name]
        if name == "sex":
            values = values.map(lambda sex: SEXES.get(str(sex).strip().lower()))
        found[name] = values.astype(float) / STEPS[name][0]
    return pd.DataFrame(found).set_axis(specimens["specimen"].astype(str))


def _regression(chosen: pd.DataFrame, known: pd.DataFrame, shared: bool) -> list[Row]:
    """One row per covariate of a coordinate, without what all coordinates share."""
    sure = chosen[chosen["identifiable"].astype(bool) & chosen["stiffness"].notna()]
    lost = len(chosen) - len(sure)
    note = f"without {lost} of {len(chosen)} values that are not identifiable" if lost else ""
    if shared:  # the joints have one value between them
        sure, note = sure.drop_duplicates("specimen"), ""
    effects = specimen_effects(sure)
    complete = known.dropna()
    names = [one for one in effects.index if one in complete.index]
    missing = sorted({*effects.index} - {*names})
    note = joined(note, f"no covariates of {', '.join(missing)}" if missing else "")
    x = complete.loc[names]
    refusals = _refusals(x, list(known.columns)) if len(chosen) else {}
    rest = [name for name in known.columns if name not in refusals]
    needed = len(rest) + BESIDE
    row: Row = {"specimens": len(names), "needed": needed, **dict.fromkeys(_NUMBERS)}
    why = NO_FITS if chosen.empty else _why_not(x[rest], needed)
    found = {} if why or not rest else regress(effects.loc[names].to_numpy(float), x[rest])
    return [
        {
            **row,
            "covariate": name,
            "step": STEPS[name][1],
            **found.get(name, {}),
            "message": joined(refusals.get(name, why), note),
        }
        for name in known.columns
    ]


def _refusals(x: pd.DataFrame, names: Sequence[str]) -> Mapping[str, str]:
    """Covariates that these specimens say nothing of, and why."""
    found = {}
    for name in names:
        values = x[name].to_numpy(float)
        if len(values) and np.ptp(values) <= CLOSE:
            found[name] = "the same in all specimens"
        elif name == "sex" and min(np.sum(values == 0.0), np.sum(values == 1.0)) < FEWEST_OF_A_SEX:
            found[name] = f"fewer than {FEWEST_OF_A_SEX} specimens of one sex"
    return found


def _why_not(x: pd.DataFrame, needed: int) -> str:
    """Why a regression on these covariates is refused; empty where it is not."""
    k = x.shape[1]
    if len(x) < needed:
        what = "1 covariate" if k == 1 else f"{k} covariates"
        return f"{len(x)} specimens, and {what} together need {needed}"
    if k and (_alone(x.to_numpy(float)) < CLOSE).any():
        return "covariates go together so closely that they cannot be told apart"
    return ""


def _alone(x: Array) -> Array:
    """(k,) share of each covariate's variance (n, k) that the others do not make."""
    # 1 - R2 of each on the others: the inverse of its variance inflation factor.
    centred = x - x.mean(axis=0)
    shares = []
    for column in range(x.shape[1]):
        target, others = centred[:, column], np.delete(centred, column, axis=1)
        left = target - (others @ lstsq(others, target)[0] if others.shape[1] else 0.0)
        shares.append(float(left @ left) / float(target @ target))
    return np.array(shares)


def specimen_effects(values: pd.DataFrame) -> pd.Series:
    """Logarithm of stiffness by specimen with the levels taken out, about 0 at the mean level.

    Specimens and levels are fitted to all values together, so that a missing level biases nobody;
    specimens that share no level with the others are left out.
    """
    values = values[values["specimen"].isin(_connected(values))]
    specimens = list(dict.fromkeys(values["specimen"].astype(str)))
    levels = list(dict.fromkeys(values["joint"]))
    if not specimens:
        return pd.Series(dtype=float)
    by_specimen = values["specimen"].astype(str).to_numpy()[:, None] == np.array(specimens)
    by_level = values["joint"].to_numpy()[:, None] == np.array(levels)
    # Two-way fixed effects; the first level has none of its own, so that each specimen's effect is
    # its mean there.
    design = np.hstack([by_specimen, by_level[:, 1:]]).astype(float)
    logarithms = np.log(values["stiffness"].to_numpy(float))
    solution, _ = lstsq(design, logarithms)
    return pd.Series(solution[: len(specimens)], index=specimens)


def _connected(values: pd.DataFrame) -> set[str]:
    """The largest group of specimens that levels hold together."""
    # Connected components of the graph of specimens and the levels they were read at: effects of
    # specimens in different ones cannot be compared.
    groups: list[tuple[set[str], set[str]]] = []
    for specimen, part in values.groupby("specimen", sort=False):
        names, levels = {str(specimen)}, set(part["joint"])
        apart = []
        for group in groups:
            if group[1] & levels:
                names |= group[0]
                levels |= group[1]
            else:
                apart.append(group)
        groups = [*apart, (names, levels)]
    return max((names for names, _ in groups), key=len, default=set())


def regress(y: Array, x: pd.DataFrame) -> dict[str, Row]:
    """Numbers of each covariate from one line through all specimens; y: (specimens,).

    Ordinary least squares by the singular values of the centred design, the mean first.
    """
    covariates = x.to_numpy(float)
    design = np.column_stack([np.ones(len(y)), covariates - covariates.mean(axis=0)])
    left, sizes, right = svd(design)
    coefficients = (right.T / sizes) @ (left.T @ y)
    residual = y - design @ coefficients
    freedom = len(y) - design.shape[1]
    scatter = float(residual @ residual) / freedom
    variances = scatter * np.sum((right.T / sizes) ** 2, axis=1)
    reach = float(stats.t.ppf(0.975, freedom))
    alone = _alone(covariates)
    found = {}
    for number, name in enumerate(x.columns):
        effect, error = coefficients[1 + number], float(np.sqrt(variances[1 + number]))
        low, high = np.exp([effect - reach * error, effect + reach * error])
        found[str(name)] = {
            "factor": float(np.exp(effect)),
            "low": float(low),
            "high": float(high),
            "log_effect": float(effect),
            "standard_error": error,
            "degrees_of_freedom": float(freedom),
            "inflation": max(1.0 / float(alone[number]), 1.0),
            "unexplained": float(np.sqrt(scatter)),
            "p": float(2.0 * stats.t.sf(abs(effect) / error, freedom)) if error else None,
        }
    return found
