"""Tables of studies of kind trunk_loads: what is computed from persons and tasks."""

from spinepipe.studies.trunk_loads.tables import (
    NO_FORCES,
    STATUS,
    TASK,
    force,
    pressure,
)
from spinepipe.tables.schema import MESSAGE, SPECIMEN, Column, Table

SIMPLIFICATIONS = ("none", "no_feedback", "rigid_translations", "only_l5s1", "no_wrapping")

SIMPLIFIED = Table(
    "simplified",
    "What four wrong simplifications cost: one row per person, task and simplification.",
    ("specimen", "task", "simplification"),
    (
        SPECIMEN,
        TASK,
        Column(
            "simplification",
            "text",
            "none; no_feedback: forces do not move the spine; rigid_translations: joints only "
            "turn; only_l5s1: moments balance at L5S1 alone; no_wrapping: fascicles run straight",
            allowed=SIMPLIFICATIONS,
        ),
        pressure("l4l5_pressure", "pressure in the disc L4L5"),
        force("l4l5_compression", "compression of L4L5"),
        force("l5s1_compression", "compression of L5S1"),
        Column(
            "imbalance_nm",
            "number",
            "largest moment out of balance at any joint when the forces act on the whole model",
            "N m",
            null=NO_FORCES,
            low=0.0,
        ),
        STATUS,
        MESSAGE,
    ),
)

TIERS = ("untuned", "tuned", "left_out")

PRESSURES = Table(
    "pressures",
    "Computed against measured pressure of the disc L4L5 (Wilke 1999, 2001), for the person who "
    "stands for the volunteer: one row per tier and task. untuned: nothing was fitted; tuned: the "
    "numbers of table `tuning` were fitted to the counted tasks; left_out: to the others of them.",
    ("specimen", "tier", "task"),
    (
        SPECIMEN,
        Column("tier", "text", "what was fitted", allowed=TIERS),
        TASK,
        Column("measured_mpa", "number", "measured pressure", "MPa", low=0.0),
        Column(
            "measured_status",
            "text",
            "status of the measured value",
            allowed=("confirmed", "derived", "from_memory"),
        ),
        Column("measured_source", "text", "where it was read"),
        Column("counted", "flag", "whether the task counts in the agreement"),
        pressure("computed", "computed pressure"),
        Column("status", "text", "how finding the forces ended"),
    ),
)

REGION = ("low", "high", "open_below", "open_above", "identifiable")
"""Columns of how far a fitted number may go."""

_UNASKED = "not looked for: a task is left out, or errors tell no scatter"
_OPEN = f"open, or {_UNASKED}"

TUNING = Table(
    "tuning",
    "Numbers fitted to measured pressures: one row per tier, task left out and number.",
    ("specimen", "tier", "left_out", "parameter"),
    (
        SPECIMEN,
        Column("tier", "text", "what was fitted", allowed=TIERS),
        Column("left_out", "text", "task left out; empty for none"),
        Column("parameter", "text", "what was fitted"),
        Column("value", "number", "its value"),
        Column("default", "number", "its value untuned"),
        Column("unit", "text", "unit"),
        Column("at_bound", "flag", "whether it stands at the end of its range"),
        Column(
            "low",
            "number",
            "lower end of its 95 % region: the other number is fitted anew, one scatter for all "
            "errors (profile likelihood)",
            null=_OPEN,
        ),
        Column("high", "number", "upper end of it", null=_OPEN),
        Column("open_below", "flag", "whether pressures allow all its range below", null=_UNASKED),
        Column("open_above", "flag", "the same above", null=_UNASKED),
        Column("identifiable", "flag", "whether pressures tell both ends", null=_UNASKED),
    ),
)

AGREEMENT = Table(
    "agreement",
    "How well computed pressures agree with measured ones over counted tasks: one row per tier.",
    ("specimen", "tier"),
    (
        SPECIMEN,
        Column("tier", "text", "what was fitted", allowed=TIERS),
        Column("n_tasks", "integer", "tasks counted", low=0),
        Column("r", "number", "Pearson correlation", null="fewer than 3 tasks", low=-1.0, high=1.0),
        Column(
            "r_low", "number", "lower end of its 95 % interval (Fisher)", null="fewer than 4 tasks"
        ),
        Column("r_high", "number", "upper end of it", null="fewer than 4 tasks"),
        Column("rmse_mpa", "number", "root mean square error", "MPa", null="no task", low=0.0),
        Column("mean_error_mpa", "number", "mean of computed less measured", "MPa", null="no task"),
        Column("n_not_held", "integer", "counted tasks that no muscle forces hold", low=0),
        Column("goal_rmse_mpa", "number", "what was asked for", "MPa"),
        Column(
            "reached",
            "flag",
            "whether the goal is reached, and by forces that hold every counted task",
            null="no task",
        ),
    ),
)

DESIGN = Table(
    "design",
    "Values of the uncertain inputs: one row per sample and factor.",
    ("sample", "factor"),
    (
        Column("sample", "integer", "number of the sample, from 0", low=0),
        Column("factor", "text", "uncertain input"),
        Column("value", "number", "its value, in its unit"),
        Column("unit", "text", "unit; empty for factors"),
    ),
)

QUANTITIES = (
    "l4l5_pressure_mpa",
    "l4l5_compression_n",
    "l4l5_shear_n",
    "l5s1_compression_n",
    "l5s1_shear_n",
)

RESPONSES = Table(
    "responses",
    "Outcome of every sample: one row per person, task and sample.",
    ("specimen", "task", "sample"),
    (
        SPECIMEN,
        TASK,
        Column("sample", "integer", "number of the sample, from 0", low=0),
        *(
            Column(
                name,
                "number",
                "as in table tasks",
                "MPa" if name.endswith("mpa") else "N",
                null=NO_FORCES,
            )
            for name in QUANTITIES
        ),
        STATUS,
        MESSAGE,
    ),
)

_FEW = "fewer than 20 samples that hold, or more than 20 % that do not"

INTERVALS = Table(
    "intervals",
    "How far each answer can be trusted, by the spread of the inputs: one row per person, task and "
    "quantity. Failed samples are left out and counted.",
    ("specimen", "task", "quantity"),
    (
        SPECIMEN,
        TASK,
        Column("quantity", "text", "as in table tasks", allowed=QUANTITIES),
        Column("nominal", "number", "with every input at its nominal value", null=NO_FORCES),
        Column("low", "number", "2.5th percentile of the samples", null=_FEW),
        Column("median", "number", "median of the samples", null=_FEW),
        Column("high", "number", "97.5th percentile of the samples", null=_FEW),
        Column("n_samples", "integer", "samples that hold", low=0),
        Column("n_failed", "integer", "samples that do not", low=0),
    ),
)

DRIVERS = Table(
    "drivers",
    "What drives each answer: one row per person, task, quantity and factor (Sobol).",
    ("specimen", "task", "quantity", "factor"),
    (
        SPECIMEN,
        TASK,
        Column("quantity", "text", "as in table tasks", allowed=QUANTITIES),
        Column("factor", "text", "uncertain input"),
        *(
            Column(
                name, "number", meaning, null="too few samples held, or the answer does not vary"
            )
            for name, meaning in (
                ("first_order", "share of the variance that the factor explains alone"),
                ("first_order_low", "lower end of its 95 % interval"),
                ("first_order_high", "upper end of it"),
                ("total", "share of the variance that vanishes when the factor is known last"),
                ("total_low", "lower end of its 95 % interval"),
                ("total_high", "upper end of it"),
            )
        ),
        Column("n_samples", "integer", "samples that hold", low=0),
        MESSAGE,
    ),
)
