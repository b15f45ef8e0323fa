"""Tests of significance as the page shows them: each, or folded where they are repeated."""

import pandas as pd

from spinepipe.tables.schema import Column

_FOLD = ["specimen", "family", "test", "joint", "response", "factor"]
_NO_EFFECT = "no test is significant after Bonferroni's correction"

FOLDED = (
    Column("specimen", "text", "name of the specimen"),
    Column("test", "text", "name of the test"),
    Column("joint", "text", "joint, or * for all joints together"),
    Column("response", "text", "what is tested"),
    Column("factor", "text", "what it is tested against"),
    Column("family_size", "integer", "tests that are corrected together and have a p-value"),
    Column("tests", "integer", "tests folded into this row, one per stratum"),
    Column("with_result", "integer", "of these: tests that could be done"),
    Column("significant", "integer", "significant without correction"),
    Column("bonferroni", "integer", "significant after Bonferroni's correction"),
    Column("holm", "integer", "significant after Holm's correction"),
    Column("effect_name", "text", "what the effect size is called"),
    Column("effect_lowest", "number", "smallest effect significant after Bonferroni", "",
           _NO_EFFECT),
    Column("effect_highest", "number", "largest effect significant after Bonferroni", "",
           _NO_EFFECT),
)  # fmt: skip


def in_full(statistics: pd.DataFrame) -> pd.DataFrame:
    """The tests of families without repeats."""
    return statistics[~_repeated(statistics)]


def folded(statistics: pd.DataFrame, alpha: float) -> pd.DataFrame:
    """One row per test, joint, response and factor of the other families, as in `FOLDED`."""
    repeated = statistics[_repeated(statistics)]
    rows = [
        dict(zip(_FOLD, key, strict=True)) | _fold(part, alpha)
        for key, part in repeated.groupby(_FOLD, sort=False, dropna=False)
    ]
    return pd.DataFrame(rows, columns=[column.name for column in FOLDED])


def _repeated(statistics: pd.DataFrame) -> pd.Series:
    """Whether a row's family does a test again and again, with something else held fixed."""
    again = statistics.duplicated(_FOLD, keep=False)
    families = [statistics["specimen"], statistics["family"]]
    return again.groupby(families).transform("any")


def _fold(part: pd.DataFrame, alpha: float) -> dict[str, object]:
    kept = part.loc[part["p_bonferroni"] < alpha, "effect"]
    return {
        "family_size": part["family_size"].max(),
        "tests": len(part),
        "with_result": int(part["p"].notna().sum()),
        "significant": int((part["p"] < alpha).sum()),
        "bonferroni": len(kept),
        "holm": int((part["p_holm"] < alpha).sum()),
        "effect_name": part["effect_name"].iloc[0],
        "effect_lowest": kept.min(),
        "effect_highest": kept.max(),
    }
