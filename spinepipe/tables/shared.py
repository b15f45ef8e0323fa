"""Columns and tables that studies of several kinds have."""

from spinepipe.tables.schema import JOINT, MESSAGE, POSE, SPECIMEN, Column, Table, status
from spinepipe.units import COORDINATES

NO_EQUILIBRIUM = "no pose was found"
NO_RESULT = "there is no result, see status"
ENDED = Column(
    "status",
    "text",
    "whether there is a result; constant: nothing varies; too_few: too little data",
    allowed=("done", "constant", "too_few"),
)
JOINT_OR_ALL = Column("joint", "text", "joint, or * for all joints together")


def p_value(name: str, meaning: str) -> Column:
    """A column of p-values."""
    return Column(name, "number", meaning, null=NO_RESULT, low=0.0, high=1.0)


STATISTICS = Table(
    "statistics",
    "Tests of significance: one row per test. Corrected together are the rows of one family that "
    "have the same test.",
    ("specimen", "family", "test", "joint", "response", "factor", "stratum"),
    (
        SPECIMEN,
        Column(
            "family", "text", "what is asked; its rows with the same test are corrected together"
        ),
        Column("test", "text", "name of the test"),
        JOINT_OR_ALL,
        Column("response", "text", "what is tested, such as extension_error"),
        Column("factor", "text", "what it is tested against; empty where there is nothing"),
        Column("stratum", "text", "what was held fixed, a stiffness set or a pose; or empty"),
        Column("n", "integer", "observations, or blocks of a Friedman test", low=0),
        Column("statistic_name", "text", "what the statistic is called"),
        Column("statistic", "number", "value of the statistic", null=NO_RESULT),
        Column("effect_name", "text", "what the effect size is called"),
        Column("effect", "number", "effect size", null=NO_RESULT),
        p_value("p", "p-value, uncorrected"),
        p_value("p_bonferroni", "p-value times family_size"),
        p_value("p_holm", "p-value corrected by Holm's method, never larger than Bonferroni's"),
        Column("family_size", "integer", "rows that were corrected together", low=0),
        ENDED,
        MESSAGE,
    ),
)

FRAMES_IN_GROUND = (
    "Joint frames in ground at the neutral pose: one row per specimen, pose and joint. "
    "Orientations are intrinsic Z, X', Y'' rotations"
)
FRAME_KEY = ("specimen", "pose", "joint")
FRAME_COLUMNS = (
    SPECIMEN,
    POSE,
    JOINT,
    *(
        Column(f"{axis}_mm", "number", f"origin along {axis}", "mm", null="no frame is defined")
        for axis in "xyz"
    ),
    *(
        Column(f"{name}_deg", "number", "orientation of the frame", "deg", "no frame is defined")
        for name in COORDINATES[3:]
    ),
    status("building of the frame"),
    MESSAGE,
)


LIMITS = ("two_sided", "chosen", "wide", "one_sided", "binary", "none")
"""What being inside a range takes, from the most to nothing; see `papers.ranges`."""


def against_paper(name: str) -> Table:
    """The table of a paper's numbers beside ours."""
    about = "The paper's numbers beside ours: one row per published quantity."
    columns = (
        Column("id", "text", "short name of the quantity"),
        Column("where", "text", "table or section of the paper"),
        Column("quantity", "text", "what it is"),
        Column("unit", "text", "unit of the values; may be empty"),
        *(
            Column(name, "number", meaning, "see unit", null="not printed, or not computed")
            for name, meaning in (
                ("paper", "the paper's value"),
                ("paper_low", "lower end of the range it is compared with"),
                ("paper_high", "upper end of the range it is compared with"),
                ("ours", "our value"),
                ("ours_low", "lower end of our range"),
                ("ours_high", "upper end of our range"),
            )
        ),
        Column(
            "limit",
            "text",
            "what being inside the range takes; two_sided: two ends, their distance from the paper "
            "(a quartile, a binomial or correlation interval, a printed tolerance); chosen: two "
            "ends, their distance chosen here; wide: ends that differ by a factor of four or more, "
            "such as half to twice, so inside is no agreement; one_sided: one end, an order or a "
            "sign; binary: a yes or no or a count, the same or not; none: nothing is compared",
            allowed=LIMITS,
        ),
        Column(
            "verdict",
            "text",
            "inside, outside: our value and the paper's range; circular: inside, but the cohort "
            "was built to have it; recomputed: the paper's number from its other numbers; "
            "contradicted: the paper's own numbers exclude each other, and ours is not outside "
            "all of them; not_computed: this run has no such value",
            allowed=("inside", "outside", "circular", "recomputed", "contradicted", "not_computed"),
        ),
        Column("reason", "text", "what the range is, and why ours is outside it"),
        Column(
            "evidence",
            "text",
            "what agreement would show; independent: that ours is as the paper's; circular: the "
            "cohort or the study was made to have the number; recomputed: it follows from the "
            "paper's other numbers; contradicted: these exclude it",
            null="nothing of a run can be held against it",
            allowed=("independent", "circular", "recomputed", "contradicted"),
        ),
    )
    return Table(name, about, ("id",), columns)


_AGAINST_ORDER = (
    *("quantity", "unit", "paper", "paper_low", "paper_high", "ours", "ours_low", "ours_high"),
    *("limit", "verdict", "reason", "where", "evidence"),
)


def against_as_shown(table: Table) -> tuple[Column, ...]:
    """What a reader compares stands first; the short name is left to the file."""
    columns = {column.name: column for column in table.columns}
    return tuple(columns[name] for name in _AGAINST_ORDER)


def joined(*notes: str) -> str:
    """Notes as one message."""
    return "; ".join(note for note in notes if note)
