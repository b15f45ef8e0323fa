"""The page of a joint-pose study."""

from typing import Any

import pandas as pd

from spinepipe.cohort import Cohort
from spinepipe.comparison import papers
from spinepipe.report.conclusions import sentences_of
from spinepipe.report.page.study_page import Page, ResultTables
from spinepipe.report.page.tables import Sortable, sortable
from spinepipe.schema import Column, all_declared
from spinepipe.studies.joint_pose_sensitivity.conclusions import conclusions
from spinepipe.studies.joint_pose_sensitivity.gould_2024a import GOULD_2024A
from spinepipe.studies.joint_pose_sensitivity.retained import FACTOR, MOST_LOST, UNIT
from spinepipe.studies.joint_pose_sensitivity.settings import JointPoseSensitivity

_IQR = "median low_quartile high_quartile"
SHOWN = {
    "summary": (
        "Stiffness and errors over the retained fits",
        f"quantity joint coordinate unit n {_IQR} percent_of_measured open_share lower_end_median",
    ),
    "counts": (
        "Fits and what filters keep of them",
        "part loading fits solved near_start_any near_start_all outliers reduced",
    ),
    "load_point_effect": (
        "Where the load acts",
        "joint coordinate unit stated stated_low stated_high per_mm_anterior per_mm_superior "
        "uncertain_low uncertain_median uncertain_high message",
    ),
    "posterior": (
        "Stiffness with landmarks as unknowns too",
        "joint coordinate unit median low high laplace_low laplace_high r_hat ess_bulk message",
    ),
    "required_precision": (
        "Landmark precision needed",
        "stiffness motion n sd_mm sd_low_mm sd_high_mm message",
    ),
    "variance_shares": (
        "Shares of joint pose and stiffness in errors",
        "joint coordinate factor signed_share signed_share_low signed_share_high message",
    ),
    "agreement": (
        "Agreement of predicted and measured motion",
        "joint coordinate unit n bias bias_low bias_high lower_limit upper_limit message",
    ),
    "success_by_method": (
        "Ways of fitting",
        "method fits successful success_low success_high arrived evaluations_median",
    ),
}
"""Tables of the page in their order: a title, and what a reader compares beside the specimen."""

READ = (
    *("calibrations", "success", "simulations", "bootstrap", "stiffness_over_load_point"),
    *("posterior_motion", "pose_weights", "statistics", "against_gould_2024a", *SHOWN),
)
"""Tables whose rows the page needs; of the others it tells where they come from."""

_STIFFNESS = ("N/m", "N m/rad")
_NO_STIFFNESS = ("percent_of_measured", "open_share", "r_hat", "ess_bulk")
_COORDINATE = Column("coordinate", "text", "coordinate whose stiffness it is")
_SHAPES = {table.name: table for table in all_declared(__file__)}

_FOLD = ["specimen", "family", "test", "joint", "response", "factor"]
_OPEN: dict[str, Any] = {"nullable": True, "empty": "none is significant after Holm's correction"}
FOLDED = (
    *(Column(name, "text", f"{name} of the tests") for name in _FOLD),
    Column("tests", "integer", "tests folded into this row, one for each pose or stiffness set"),
    Column("significant", "integer", "of these: significant after Holm's correction"),
    Column("effect_name", "text", "what the effect size is called"),
    Column("effect_lowest", "number", "smallest significant effect", **_OPEN),
    Column("effect_highest", "number", "largest significant effect", **_OPEN),
)


def page(study: JointPoseSensitivity, cohort: Cohort, results: ResultTables) -> Page:
    """What the page says and shows, of the tables that there are by then."""
    return Page(
        conclusions=list(conclusions(study, cohort, results)),
        sentences=sentences_of(__package__),
        key_figure="stiffness",
        tables=shown_tables(study, results),
        left_out=(
            *left_out(study),
            *papers.left_out(GOULD_2024A.cited, GOULD_2024A.stands_for(cohort.name)),
        ),
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


def shown_tables(study: JointPoseSensitivity, results: ResultTables) -> list[Sortable]:
    """Tables that the study has, of retained fits where there are others too."""
    found = []
    for name, (title, columns) in SHOWN.items():
        rows = results.table(name)
        if len(rows):
            known = {one.name: one for one in (_COORDINATE, *_SHAPES[name].columns)}
            kept = [known[one] for one in ("specimen", *columns.split())]
            found.append(sortable(name, title, _SHAPES[name].about, _chosen(rows, name), kept))
    tests = results.table("statistics")
    if len(tests):
        about = f"Significant: p below {study.significance:g} after Holm's correction by family."
        rows = folded(tests, study.significance)
        found.append(sortable("statistics", "Tests of significance", about, rows, FOLDED))
    return [table for table in found if table.rows]


def _chosen(rows: pd.DataFrame, name: str) -> pd.DataFrame:
    """Rows of retained fits, stiffness in the field's units and only where it is identifiable."""
    if name == "summary":
        rows = rows[(rows["part"] == "poses") & (rows["dataset"] == "reduced")]
        rows = rows[rows["quantity"].isin(["stiffness", "error"])]
        unknown = rows["open_share"].astype(float) > MOST_LOST
        return _in_field_units(_without(rows, ("median", "low_quartile", "high_quartile"), unknown))
    if name == "agreement":
        return rows[rows["dataset"] == "reduced"]
    if name == "load_point_effect":
        unknown = rows[["stated_low", "stated_high"]].isna().any(axis=1)
        numbers = ("stated", "per_mm_anterior", "per_mm_superior", "uncertain_median")
        return _in_field_units(_without(rows, numbers, unknown))
    if name == "posterior":
        own = rows[rows["quantity"] == "stiffness"]
        names = own["unknown"].str.replace(r"_(n_per_m|nm_per_rad)$", "", regex=True)
        own = own.assign(coordinate=names)
        for end, flag in (("low", "open_below"), ("high", "open_above")):
            own = _without(own, (end, f"laplace_{end}", "median"), own[flag].eq(True))
        return _in_field_units(own)
    return rows


def _without(rows: pd.DataFrame, columns: tuple[str, ...], where: pd.Series) -> pd.DataFrame:
    """Rows with these columns empty there."""
    return rows.assign(**{name: rows[name].astype(float).mask(where) for name in columns})


def _in_field_units(rows: pd.DataFrame) -> pd.DataFrame:
    """Numbers of stiffness in N/mm and N m/deg."""
    stiff = rows["unit"].isin(_STIFFNESS)
    factor = rows["coordinate"].map(FACTOR).where(stiff, 1.0)
    numbers = rows.select_dtypes("number").columns.difference(["n", *_NO_STIFFNESS])
    changed = {name: rows[name].astype(float) * factor for name in numbers}
    return rows.assign(**changed, unit=rows["coordinate"].map(UNIT).where(stiff, rows["unit"]))


def folded(statistics: pd.DataFrame, alpha: float) -> pd.DataFrame:
    """One row for each test, joint, response and factor, whatever is held fixed in it."""
    kept = statistics["effect"].where(statistics["p_holm"] < alpha)
    groups = statistics.assign(kept=kept).groupby(_FOLD, sort=False, dropna=False, as_index=False)
    return groups.agg(
        tests=("kept", "size"),
        significant=("kept", "count"),
        effect_name=("effect_name", "first"),
        effect_lowest=("kept", "min"),
        effect_highest=("kept", "max"),
    )
