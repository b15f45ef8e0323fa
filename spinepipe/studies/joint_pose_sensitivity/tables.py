"""Tables of studies of kind joint_pose_sensitivity: poses, fits, motion, shares and agreement."""

from spinepipe.tables.schema import (
    JOINT,
    MESSAGE,
    POSE,
    SPECIMEN,
    Column,
    Table,
    coordinates,
    length_or_angle,
    status,
    stiffness_unit,
)
from spinepipe.tables.shared import (
    ENDED,
    FRAME_COLUMNS,
    FRAME_KEY,
    FRAMES_IN_GROUND,
    JOINT_OR_ALL,
    NO_EQUILIBRIUM,
    NO_RESULT,
    p_value,
)
from spinepipe.units import COORDINATES

NOT_MEASURED = "not measured"

LANDMARKS = Table(
    "landmarks",
    "Sampled landmark sets: one row per specimen, pose, vertebra and landmark, in ground axes.",
    ("specimen", "pose", "vertebra", "landmark"),
    (
        SPECIMEN,
        POSE,
        Column("vertebra", "text", "vertebra"),
        Column("landmark", "text", "landmark, as in the cohort's landmarks.csv"),
        *(
            Column(f"{axis}_mm", "number", f"position along {axis} ({way})", unit="mm")
            for axis, way in (("x", "anterior"), ("y", "superior"), ("z", "right"))
        ),
        Column("sd_mm", "number", "standard deviation per axis it was drawn with", "mm", low=0.0),
    ),
)

POSES = Table("poses", f"{FRAMES_IN_GROUND}.", FRAME_KEY, FRAME_COLUMNS)


def region_columns(name: str) -> tuple[str, ...]:
    """Columns of what is known of a stiffness beside its value, in the order of the table."""
    suffix, _ = stiffness_unit(name)
    numbers = tuple(f"{name}_{what}_{suffix}" for what in ("se", "low", "high"))
    return (*numbers, *(f"{name}_{flag}" for flag in ("open_below", "open_above", "identifiable")))


def stiffness_columns() -> tuple[Column, ...]:
    """Stiffness of a fit against each coordinate, its error and its region."""
    columns = []
    for name in COORDINATES:
        suffix, unit = stiffness_unit(name)
        words = name.replace("_", " ")
        error, low, high, below, above, known = region_columns(name)
        columns += [
            Column(
                f"{name}_{suffix}",
                "number",
                f"stiffness against {words}",
                unit,
                null="no stiffness was found",
                low=0.0,
            ),
            Column(
                error,
                "number",
                f"standard error of the stiffness against {words}, to first order",
                unit,
                null="held fixed, at a bound, or not constrained by the data",
                low=0.0,
            ),
            *(
                Column(
                    end,
                    "number",
                    f"{which} end of the stiffness' 95 % region, all others fitted anew",
                    unit,
                    null="held fixed, no stiffness was found, or open: the data allow the bound",
                    low=0.0,
                )
                for end, which in ((low, "lower"), (high, "upper"))
            ),
            *(
                Column(
                    flag,
                    "flag",
                    f"whether the region reaches the {which} bound of the fit",
                    null="held fixed, or no stiffness was found",
                )
                for flag, which in ((below, "lower"), (above, "upper"))
            ),
            Column(
                known,
                "flag",
                "whether the data hold this stiffness: both ends of its region lie inside the "
                "bounds and its standard error is small; where false do not believe it",
                null="held fixed, or no stiffness was found",
            ),
        ]
    return tuple(columns)


CALIBRATIONS = Table(
    "calibrations",
    "Identified stiffness: one row per specimen and pose, and per joint where stiffness is "
    "per_joint (joint is * where all joints share it).",
    ("specimen", "pose", "joint"),
    (
        SPECIMEN,
        POSE,
        Column("joint", "text", "joint, or * for a stiffness shared by all"),
        *stiffness_columns(),
        *(
            Column(
                f"{name}_error_{length_or_angle(name)}",
                "number",
                "mean absolute error of the predicted motion over the readings of steps that enter "
                "the cost",
                length_or_angle(name),
                null="not measured, or no pose was found",
                low=0.0,
            )
            for name in COORDINATES
        ),
        Column(
            "cost",
            "number",
            "sum of weight times squared error",
            "mm2, deg2",
            null="no stiffness was found",
            low=0.0,
        ),
        Column("degrees_of_freedom", "integer", "readings in the cost less unknowns"),
        Column("iterations", "integer", "iterations of the best start", low=0),
        Column("evaluations", "integer", "evaluations of all starts", low=0),
        Column("n_optima", "integer", "distinct optima found from all starts", low=0),
        Column(
            "start_stiffened",
            "integer",
            "times the start was doubled in stiffness before it stood",
            low=0,
        ),
        status("fit"),
        MESSAGE,
    ),
)

SIMULATIONS = Table(
    "simulations",
    "Predicted and measured motion: one row per specimen, pose, stiffness, test, cycle, load step "
    "and joint. Errors are predicted less measured.",
    ("specimen", "pose", "stiffness", "test", "cycle", "step", "joint"),
    (
        SPECIMEN,
        POSE,
        Column("stiffness", "text", "calibrated (this pose's own) or best01, best02 ..."),
        Column("test", "text", "load case"),
        Column("cycle", "integer", "repeat of the test", low=1),
        Column("step", "integer", "load step; 0 is the reference", low=0),
        JOINT,
        *coordinates(
            "predicted", "predicted (from step 0 where the cohort is zeroed there)", NO_EQUILIBRIUM
        ),
        *coordinates("measured", "measured, in this pose's joint frame", NOT_MEASURED),
        *coordinates("error", "predicted less measured", f"{NOT_MEASURED}, or {NO_EQUILIBRIUM}"),
        Column(
            "unmeasured_taken_as_zero",
            "flag",
            "measured motion was brought into this frame with unmeasured components as zero",
        ),
        Column(
            "remaining_mm",
            "number",
            "largest translation still to go to equilibrium",
            "mm",
            null="equilibrium loading, or there is no equilibrium",
            low=0.0,
        ),
        Column(
            "remaining_deg",
            "number",
            "largest rotation still to go to equilibrium",
            "deg",
            null="equilibrium loading, or there is no equilibrium",
            low=0.0,
        ),
        status("solve"),
        MESSAGE,
    ),
)


_LIMITS = "mm or deg, see unit"

TOLD, NOT_MEANINGFUL, NOTHING_TO_TELL = "told", "not_meaningful", "no_result"
"""What may be said of a correlation of difference and mean."""


def _agreement(name: str, meaning: str) -> Column:
    return Column(name, "number", meaning, _LIMITS, null=NO_RESULT)


AGREEMENT = Table(
    "agreement",
    "Predicted against measured motion after Bland and Altman: one row per dataset, joint and "
    "coordinate. Differences are predicted less measured. Intervals take pairs as independent; one "
    "reading seen in many poses is not.",
    ("specimen", "dataset", "joint", "coordinate"),
    (
        SPECIMEN,
        Column("dataset", "text", "poses it is made of"),
        JOINT_OR_ALL,
        Column("coordinate", "text", "coordinate"),
        Column("unit", "text", "unit of the differences", allowed=("mm", "deg")),
        Column("n", "integer", "pairs of readings", low=0),
        _agreement("bias", "mean difference"),
        _agreement("bias_low", "lower end of the 95 % interval of the bias"),
        _agreement("bias_high", "upper end of the 95 % interval of the bias"),
        _agreement("sd", "standard deviation of the differences"),
        _agreement("lower_limit", "lower limit of agreement, bias less 1.96 SD"),
        _agreement("upper_limit", "upper limit of agreement, bias plus 1.96 SD"),
        _agreement("lower_limit_low", "lower end of the 95 % interval of the lower limit"),
        _agreement("upper_limit_high", "upper end of the 95 % interval of the upper limit"),
        Column(
            "proportional_rho",
            "number",
            "Spearman's correlation of difference and mean: bias that grows with motion",
            null="see proportional",
            low=-1.0,
            high=1.0,
        ),
        p_value("proportional_p", "its p-value, uncorrected"),
        _agreement("measured_sd", "standard deviation of the measured values"),
        _agreement("predicted_sd", "standard deviation of the predicted values"),
        Column(
            "proportional",
            "text",
            "told: proportional_rho tells of a bias; not_meaningful: it is left out, because one "
            "of measured_sd and predicted_sd is more than twice the other: values that hardly vary "
            "beside ones that do correlate with their difference whatever the bias; no_result",
            allowed=(TOLD, NOT_MEANINGFUL, NOTHING_TO_TELL),
        ),
        ENDED,
        MESSAGE,
    ),
)


def _share(name: str, meaning: str) -> Column:
    return Column(name, "number", meaning, null=NO_RESULT, low=0.0, high=1.0)


VARIANCE_SHARES = Table(
    "variance_shares",
    "Joint pose against stiffness: shares of the variance of each error, of its size and with its "
    "sign, over the grid of all reduced poses and best stiffness sets, with 95 % intervals.",
    ("specimen", "joint", "coordinate", "factor"),
    (
        SPECIMEN,
        Column("joint", "text", "joint"),
        Column("coordinate", "text", "coordinate whose absolute error is decomposed"),
        Column(
            "factor",
            "text",
            "what the share belongs to",
            allowed=("pose", "stiffness", "interaction"),
        ),
        _share("share", "share of the variance"),
        _share("share_low", "lower end of its 95 % interval"),
        _share("share_high", "upper end of its 95 % interval"),
        _share("total", "share with the interaction added: what fixing all else would leave"),
        _share("signed_share", "share of the variance of the error along the measured motion"),
        _share("signed_share_low", "lower end of its 95 % interval"),
        _share("signed_share_high", "upper end of its 95 % interval"),
        Column("n_poses", "integer", "joint poses in the grid", low=0),
        Column("n_stiffness", "integer", "stiffness sets in the grid", low=0),
        ENDED,
        MESSAGE,
    ),
)

IMPORTANCE = Table(
    "importance",
    "Regression tree of each error on joint pose and stiffness: share of the squared error that "
    "splits on a predictor remove. The shares of a tree sum to one, or are all 0 without a split.",
    ("specimen", "joint", "coordinate", "predictor"),
    (
        SPECIMEN,
        Column("joint", "text", "joint whose error is explained"),
        Column("coordinate", "text", "coordinate whose absolute error is explained"),
        Column("predictor", "text", "predictor, such as L2L3_extension_orientation"),
        Column("factor", "text", "what the predictor belongs to", allowed=("pose", "stiffness")),
        _share("importance", "share of this predictor among all splits"),
        Column(
            "leaves",
            "integer",
            "leaves of the pruned tree; 1: nothing is explained",
            null=NO_RESULT,
            low=1,
        ),
        Column(
            "r2",
            "number",
            "share of the variance explained, cross-validated",
            null=NO_RESULT,
            high=1.0,
        ),
        Column("n", "integer", "rows the tree was grown on", low=0),
        ENDED,
        MESSAGE,
    ),
)

TABLES = (LANDMARKS, POSES, CALIBRATIONS, SIMULATIONS, AGREEMENT, VARIANCE_SHARES, IMPORTANCE)
"""Of poses, motion and shares."""
