"""Tables of the posterior of a joint-pose study: unknowns, predicted motion, weights of poses."""

from spinepipe.tables.schema import JOINT, MESSAGE, POSE, SPECIMEN, Column, Table, status

NONE = "there is no posterior"
NOT_BELIEVED = "there is no posterior, or the sampler has not converged"
NOT_SAMPLED = "not sampled: the posterior is the prior, or there is none"
NOT_A_STIFFNESS = "not a stiffness"
SEE_UNIT = "see unit"

QUANTITIES = ("stiffness", "landmark", "joint_centre", "joint_axes")


def _number(name: str, meaning: str, null: str = NOT_BELIEVED) -> Column:
    return Column(name, "number", meaning, SEE_UNIT, null=null)


POSTERIOR = Table(
    "posterior",
    "What the data make likely of stiffness and landmarks together: one row per specimen and "
    "unknown, and where these put the joints. By a sampler, and beside it by the normal density "
    "at the likeliest point (Laplace).",
    ("specimen", "quantity", "joint", "unknown"),
    (
        SPECIMEN,
        Column(
            "quantity",
            "text",
            "stiffness; landmark: how far it lies from where it was felt, ground axes; "
            "joint_centre, joint_axes: offset and tilt of a joint from the frame that is stated",
            allowed=QUANTITIES,
        ),
        Column("joint", "text", "joint, or * for all of them; for a landmark its vertebra"),
        Column("unknown", "text", "which stiffness, landmark and axis, or direction"),
        Column("unit", "text", "unit of the numbers"),
        _number("mean", "mean of the draws"),
        _number("sd", "their standard deviation"),
        _number("median", "their median"),
        _number("low", "lower end of their 95 % interval"),
        _number("high", "upper end of their 95 % interval"),
        _number("laplace_mean", "mean by Laplace", NONE),
        _number("laplace_sd", "standard deviation by Laplace", NONE),
        _number("laplace_low", "lower end of the 95 % interval by Laplace", NONE),
        _number("laplace_high", "upper end of the 95 % interval by Laplace", NONE),
        Column(
            "sd_over_prior",
            "number",
            "standard deviation as a share of the one before the data were seen; of a stiffness on "
            "the scale on which its prior is normal, of a joint to first order",
            null=NOT_BELIEVED,
            low=0.0,
        ),
        Column(
            "prior_dominated",
            "flag",
            "that share is above 0.9: the data tell next to nothing of this",
            null=NOT_BELIEVED,
        ),
        *(
            Column(
                f"open_{side}",
                "flag",
                f"the {which} bound of the prior decides the {which} end, not the data: 2.5 % of "
                "the draws or more lie in the outermost 5 % of the prior",
                null=f"{NOT_A_STIFFNESS}, or {NOT_BELIEVED}",
            )
            for side, which in (("below", "lower"), ("above", "upper"))
        ),
        Column("r_hat", "number", "R-hat, rank-normalised and split", null=NOT_SAMPLED, low=0.0),
        Column("ess_bulk", "number", "effective size of the bulk", null=NOT_SAMPLED, low=0.0),
        Column("ess_tail", "number", "effective size of the tails", null=NOT_SAMPLED, low=0.0),
        status(
            "sampler (not_converged: R-hat above 1.01 or an effective size below 400, anywhere)"
        ),
        MESSAGE,
    ),
)

_LOST = "the sampler has not converged"
_MOTION = f"{SEE_UNIT}, from step 0 where the cohort is zeroed there"

POSTERIOR_MOTION = Table(
    "posterior_motion",
    "Motion that the posterior predicts: one row per specimen, test, cycle, step, joint and "
    "coordinate, in the joint frames in which motion is told.",
    ("specimen", "test", "cycle", "step", "joint", "coordinate"),
    (
        SPECIMEN,
        Column("test", "text", "load case"),
        Column("cycle", "integer", "repeat of the test", low=1),
        Column("step", "integer", "load step; 0 is the reference", low=0),
        JOINT,
        Column("coordinate", "text", "coordinate"),
        Column("unit", "text", "unit of the numbers", allowed=("mm", "deg")),
        Column("measured", "number", "measured", _MOTION, null="not measured"),
        Column("median", "number", "median of the predicted motion", _MOTION, null=_LOST),
        Column("low", "number", "lower end of its 95 % band", _MOTION, null=_LOST),
        Column("high", "number", "upper end of its 95 % band", _MOTION, null=_LOST),
        *(
            Column(
                f"reading_{end}",
                "number",
                f"{which} end of the 95 % band of a new reading, with error and scatter",
                _MOTION,
                null=f"the coordinate has no weight, or {_LOST}",
            )
            for end, which in (("low", "lower"), ("high", "upper"))
        ),
        Column(
            "inside",
            "flag",
            "whether the reading lies in that band",
            null=f"not measured, the coordinate has no weight, or {_LOST}",
        ),
        Column("draws", "integer", "draws it is made of", low=0),
        status("sampler"),
        MESSAGE,
    ),
)

POSE_WEIGHTS = Table(
    "pose_weights",
    "Which sampled pose with which stiffness the data make likely: one row per specimen, pose and "
    "free stiffness. Poses are drawn from the landmarks' prior, so a pose weighs as much as it "
    "makes the data likely, whatever its stiffness (evidence by Laplace).",
    ("specimen", "pose", "joint", "unknown"),
    (
        SPECIMEN,
        POSE,
        Column("joint", "text", "joint, or * for a stiffness shared by all"),
        Column("unknown", "text", "which stiffness, with its unit (n_per_m, nm_per_rad)"),
        Column("value", "number", "the stiffness that suits the pose best", SEE_UNIT, null=NONE),
        Column("low", "number", "lower end of its 95 % interval in this pose", SEE_UNIT, null=NONE),
        Column(
            "high", "number", "upper end of its 95 % interval in this pose", SEE_UNIT, null=NONE
        ),
        Column("log_evidence", "number", "logarithm of the evidence of the pose", null=NONE),
        Column(
            "weight",
            "number",
            "share of the evidence of all poses of the specimen; 0 for one without stiffness",
            low=0.0,
            high=1.0,
        ),
        status("fit in this pose"),
        MESSAGE,
    ),
)

TABLES = (POSTERIOR, POSTERIOR_MOTION, POSE_WEIGHTS)
"""Of the posterior."""
