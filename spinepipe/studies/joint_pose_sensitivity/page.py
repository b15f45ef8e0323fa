"""The report of a joint-pose study: what it asks, its captions for this study, and its tables."""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.page.document import Document, Picture, ResultTables
from spinepipe.report.page.tables import Sortable, page_tables, sortable
from spinepipe.schema import Column, all_declared
from spinepipe.studies.joint_pose_sensitivity.figures.agreement import in_rows
from spinepipe.studies.joint_pose_sensitivity.figures.pose_against_stiffness import (
    TREE,
    importance_by_factor,
)
from spinepipe.studies.joint_pose_sensitivity.findings import findings, settling
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity
from spinepipe.studies.joint_pose_sensitivity.tables import (
    IMPORTANCE,
    STATISTICS,
)

QUESTION = (
    "How stiff are the intervertebral joints of this cohort, and how much of the answer hangs on "
    "where its landmarks were palpated?"
)

SHOWN = {
    "counts": "Fits and filters",
    "summary": "Medians and spreads",
    "against_gould_2024a": "Beside Gould et al. 2024",
    "posterior": "Posterior of stiffness and landmarks",
    "posterior_motion": "Motion that the posterior predicts",
    "success_by_method": "Success by method",
    "variance_shares": "Variance shares of joint pose and stiffness",
    "importance": "Importance in the regression tree, by factor",
    "required_precision": "Landmark precision needed",
    "load_point_effect": "Where the load acts",
    "spread_over_landmark_sd": "Spread of joint frames by landmark SD",
    "agreement": "Agreement of predicted and measured motion",
    "statistics": "Tests of significance",
}
"""Tables of the page in their order, with their titles."""

READ = ("poses", "calibrations", "success", "method_fits", "pose_weights", *SHOWN)
"""Tables whose rows the page needs; of the others it tells where they come from."""

_SIMULATED = ("errors", "agreement")
"""Figures of simulated motion."""

_SENTENCE_END = re.compile(r"(?<=[.])(?<!et al[.])\s+(?=[A-Z])")

_BY_FACTOR = tuple(
    column
    for column in IMPORTANCE.columns
    if column.name in ("specimen", "joint", "coordinate", "factor", "leaves", "r2", "n")
)

_IMPORTANCE = (
    *_BY_FACTOR[:4],
    Column("importance", "number", "share of all predictors of this factor among all splits"),
    Column("predictors", "integer", "predictors of this factor"),
    *_BY_FACTOR[4:],
    Column("message", "text", "why there is no tree"),
)

_FOLD = ["specimen", "family", "test", "joint", "response", "factor"]
_OPEN: dict[str, Any] = {
    "nullable": True,
    "empty": "no test is significant after Bonferroni's correction",
}
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
    Column("effect_lowest", "number", "smallest effect significant after Bonferroni", **_OPEN),
    Column("effect_highest", "number", "largest effect significant after Bonferroni", **_OPEN),
)


_SHAPES = {table.name: table for table in all_declared(__file__)}


def document(study: JointPoseSensitivity, cohort: Cohort, results: ResultTables) -> Document:
    """What the report says and shows."""
    return Document(
        question=QUESTION,
        findings=findings(study, results),
        pictures=[
            replace(picture, caption=caption(picture, study, cohort, results))
            for picture in results.pictures.values()
        ],
        tables=shown_tables(study, results),
        metadata=results.metadata,
        left_out=(
            *left_out(study),
            *papers.left_out(GOULD_2024A.cited, GOULD_2024A.stands_for(cohort.name)),
        ),
        poses=results.table("poses"),
        tests=study.tests,
        load_shift_mm=study.load_point_shift_mm.in_order(),
    )


def left_out(study: JointPoseSensitivity) -> tuple[str, ...]:
    """Optional parts that the settings leave out, each with the setting that does."""
    parts = (
        ("bootstrap over start values", "start_bootstrap: sets", study.start_bootstrap.sets),
        ("bootstrap over damping", "damping_bootstrap: sets", study.damping_bootstrap.sets),
        ("comparison of ways of fitting", "methods: poses", study.methods.poses),
        ("landmark precision", "landmark_precision: poses", study.landmark_precision.poses),
        ("posterior of stiffness and landmarks", "posterior: draws", study.posterior.draws),
    )
    told = tuple(f"{part} ({setting}: 0)" for part, setting, number in parts if not number)
    point = "stiffness over load points (load_point: one point and no SD)"
    return told if study.load_point.asked else (*told, point)


def caption(
    picture: Picture, study: JointPoseSensitivity, cohort: Cohort, results: ResultTables
) -> str:
    """A figure's caption for this study and cohort."""
    false = tuple(_false(cohort, results))
    sentences = _SENTENCE_END.split(picture.caption)
    kept = [sentence for sentence in sentences if not sentence.startswith(false)]
    if picture.name in _SIMULATED and settling(study):
        kept.append(settling(study))
    return " ".join(kept)


def _false(cohort: Cohort, results: ResultTables) -> Iterator[str]:
    """How the sentences begin that speak of something else than this study shows."""
    if not GOULD_2024A.stands_for(cohort.name):
        yield "For the cohort rebuilt from"
    several = len(cohort.specimen_names) > 1
    yield "With one specimen," if several else "With several specimens,"
    agreement = results.table("agreement")
    if not agreement.empty:
        rows = in_rows(agreement, cohort)
        yield "With few joints and directions," if rows else "With many joints and directions,"


def shown_tables(study: JointPoseSensitivity, results: ResultTables) -> list[Sortable]:
    """Tables that the study has, as the page shows them; those without rows are left out."""
    found = [
        table
        for name, title in SHOWN.items()
        if len(results.table(name))
        for table in _of(name, title, results.table(name), study)
    ]
    return [table for table in found if table.rows]


def _of(
    name: str, title: str, frame: pd.DataFrame, study: JointPoseSensitivity
) -> Iterator[Sortable]:
    about = _SHAPES[name].about
    if name == "statistics":
        yield sortable(name, title, about, in_full(frame), STATISTICS.columns)
        about = (
            "Tests done again and again with a stiffness set or a pose held fixed: how many are "
            f"significant at {study.significance:g}, and how large the effects of these are. One "
            "row per test, joint, response and factor; every single test is in statistics.parquet."
        )
        title = "Tests of significance, two factors"
        yield sortable(name, title, about, folded(frame, study.significance), FOLDED)
    elif name == "importance":
        # by factor, and one row with its message for each tree that could not be grown
        none = frame[frame["status"] != "done"].drop_duplicates(TREE)[[*TREE, "n", "message"]]
        trees = pd.concat([importance_by_factor(frame), none], ignore_index=True)
        yield sortable(name, title, about, trees, _IMPORTANCE)
    else:
        yield from page_tables(_SHAPES[name], title, frame)


def in_full(statistics: pd.DataFrame) -> pd.DataFrame:
    """The tests of families without repeats."""
    return statistics[~_repeated(statistics)]


def folded(statistics: pd.DataFrame, alpha: float) -> pd.DataFrame:
    """One row per test, joint, response and factor of the other families, as in `FOLDED`."""
    repeated = statistics[_repeated(statistics)]
    rows = []
    for key, part in repeated.groupby(_FOLD, sort=False, dropna=False):
        kept = part.loc[part["p_bonferroni"] < alpha, "effect"]
        rows.append(
            dict(zip(_FOLD, key, strict=True))
            | {
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
        )
    return pd.DataFrame(rows, columns=[column.name for column in FOLDED])


def _repeated(statistics: pd.DataFrame) -> pd.Series:
    """Whether a row's family does a test again and again, with something else held fixed."""
    again = statistics.duplicated(_FOLD, keep=False)
    families = [statistics["specimen"], statistics["family"]]
    return again.groupby(families).transform("any")
