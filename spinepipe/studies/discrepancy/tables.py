"""Tables of studies of kind discrepancy: where a model is wrong, and what was tried to mend it."""

from spinepipe.effects import Kind, Spread
from spinepipe.effects.field_numbers import NUMBERS
from spinepipe.status import Status
from spinepipe.tables.schema import JOINT, MESSAGE, SPECIMEN, Column, Table, status
from spinepipe.units import COORDINATES

MODELS = ("base", "with_effects")
"""The two models that are compared; without a named effect they are the same."""

POOLED_BY = (
    *("all", "specimen", "joint", "coordinate", "test", "step"),
    "joint x coordinate x test",
)
NOT_TESTABLE = "not_testable"

ADVICE = ("advised", "offered", "tells_nothing", "no_pose", "would_do", "not_enough")
"""What becomes of a run that could be added, or of an imperfection that could be known better."""

_MOTION = "see unit"
_NO_POSE = "no pose was found"
_NOT_HELD_OUT = "not held out, or no pose was found"
_TEST = Column("test", "text", "test")
_EVERYWHERE = "or * where all are together"


def _place(name: str) -> Column:
    return Column(name, "text", f"{name} {_EVERYWHERE}")


def _motion(name: str, meaning: str, null: str | None) -> Column:
    return Column(name, "number", meaning, _MOTION, null)


def _of_noise(name: str, meaning: str, null: str | None = None) -> Column:
    return Column(name, "number", meaning, "noise SD", null, low=0.0)


GAP = Table(
    "gap",
    "Measured and modelled motion, reading by reading: one row per specimen, test, load step, "
    "joint and measured coordinate. Cycles are averaged. Where a rig fixes the coordinate and its "
    "load was measured, motion is that load: as listed, and as the models hold it.",
    ("specimen", "test", "step", "joint", "coordinate"),
    (
        SPECIMEN,
        _TEST,
        Column("step", "integer", "load step", low=0),
        JOINT,
        Column("coordinate", "text", "coordinate of the joint", allowed=COORDINATES),
        Column("unit", "text", "unit of the motion", allowed=("mm", "deg", "N", "N m")),
        Column(
            "held_at",
            "number",
            "where a rig has the coordinate",
            "mm where unit is N, deg where it is N m",
            "the coordinate is free",
        ),
        Column(
            "load",
            "number",
            "what the test's forces and moments do at this joint, in the direction of the "
            "coordinate in the neutral pose; weight and load effects not counted",
            "N where unit is mm or N, N m where it is deg or N m",
        ),
        _motion("measured", "measured motion, mean over cycles", None),
        Column("readings", "integer", "cycles averaged", low=1),
        _motion("base", "motion of the base model, fitted", _NO_POSE),
        _motion(
            "with_effects",
            "motion of the full simulator with the named effects, fitted; the base's where none "
            "is named",
            _NO_POSE,
        ),
        _motion(
            "with_table",
            "the same with tables in the place of what has no name, as model_with_effects.yaml has "
            "them",
            "there is no table",
        ),
        Column("noise_sd", "number", "SD of the measured mean", _MOTION, low=0.0),
        Column("held_out_fold", "text", "fold in which this row was held out; empty: in none"),
        _motion("held_out_base", "motion of the base model fitted without this row", _NOT_HELD_OUT),
        _motion(
            "held_out_with_effects",
            "motion with the named effects, all fitted without this row",
            _NOT_HELD_OUT,
        ),
    ),
)

CANDIDATES = Table(
    "candidates",
    "What was tried: one row per stage of the search and form of an effect.",
    ("stage", "effect", "variant", "spread", "scope", "shape"),
    (
        Column(
            "stage",
            "text",
            "design: what the tests could tell, before residuals are looked at; screen N: all "
            "candidates, linear at the model of round N; refit N: the leading few, by the full "
            "simulator; screen, refit in place of X (N): X taken away, all others tried there",
        ),
        Column(
            "beside",
            "text",
            "effects in the model beside which it was tried, with commas, once for each form; "
            "empty: the base alone",
        ),
        Column("effect", "text", "effect, as in a model file"),
        Column("kind", "text", "what it acts on", allowed=tuple(Kind)),
        Column("variant", "text", "its options, as JSON"),
        Column("spread", "text", "how its values may differ between places", allowed=tuple(Spread)),
        Column("scope", "text", "joints, specimens and tests it acts in, in words; * for all"),
        Column("shape", "text", "its parameters of shape in units of the parameter, as JSON"),
        Column("parameters", "integer", "parameters that are fitted", low=0),
        Column(
            "estimate",
            "number",
            "estimate of its strength",
            "see unit",
            "not fitted, or several strengths",
        ),
        Column("unit", "text", "unit of the estimate"),
        Column(
            "log_evidence",
            "number",
            "natural logarithm of the evidence for the effect against the model without it",
            null="not computed",
        ),
        Column("delta_chi2", "number", "by how much it lowers chi squared", null="not computed"),
        Column(
            "gap_share", "number", "share of the discrepancy that it closes", null="not computed"
        ),
        Column(
            "absorbed",
            "number",
            "share of its signature that the base and the nuisance take up",
            null="not computed",
            low=0.0,
            high=1.0,
        ),
        _of_noise("detectable_gap", "smallest gap at which it would be found", "not computed"),
        Column("threshold", "number", "log evidence that it must exceed", null="not calibrated"),
        Column(
            "status",
            "text",
            "how its fit ended; not_testable: these tests cannot show it",
            allowed=(*Status, NOT_TESTABLE),
        ),
        MESSAGE,
    ),
)

WHERE = Table(
    "where",
    "Where model and measurement disagree, in SDs of the noise: one row per place and model, "
    "pooled in seven ways. The gap is the root of chi2 / dof - 1: 0 where only noise is left.",
    ("by", "specimen", "test", "step", "joint", "coordinate", "model"),
    (
        Column("by", "text", "what is told apart; the rest is together", allowed=POOLED_BY),
        *(_place(name) for name in ("specimen", "test")),
        Column("step", "text", f"number of the load step, {_EVERYWHERE}"),
        *(_place(name) for name in ("joint", "coordinate")),
        Column("readings", "integer", "rows of the table gap in it", low=0),
        Column("model", "text", "base, or with the named effects", allowed=MODELS),
        _of_noise("gap", "discrepancy above the noise", "no pose was found"),
        _of_noise("gap_low", "lower end of its 95 % interval", "no pose was found"),
        _of_noise("gap_high", "upper end of its 95 % interval", "no pose was found"),
        _of_noise(
            "rms_residual", "root of chi2 / dof: 1 where only noise is left", "no pose was found"
        ),
    ),
)

CONFUSIONS = Table(
    "confusions",
    "What these tests could tell apart: one row per pair of effects.",
    ("effect", "other"),
    (
        Column("effect", "text", "effect that is there"),
        Column("other", "text", "effect that is taken for it"),
        Column(
            "share",
            "number",
            "share of the discrepancy that `effect` would make which `other` can explain, "
            "beyond base and nuisance; 1: they cannot be told apart",
            low=0.0,
            high=1.0,
        ),
        _of_noise(
            "gap_told_apart",
            "gap from which `effect` would lead by the margin, to first order",
            "`other` explains all of it",
        ),
    ),
)


def _rms(name: str, of: str, null: str) -> Column:
    meaning = f"root mean square residual of {of}: 1 is noise and what training leaves open"
    return _of_noise(name, meaning, null)


def _gaps(model: str, of: str, null: str) -> tuple[Column, ...]:
    """The gap of a model in a fold, and its interval."""
    return (
        _of_noise(f"gap_{model}", f"gap of {of} beyond noise and what training leaves open", null),
        _of_noise(f"gap_{model}_low", "lower end of its 95 % interval", null),
        _of_noise(f"gap_{model}_high", "upper end of its 95 % interval", null),
    )


_NOTHING_TO_CLOSE = "no result, or the base's discrepancy is not above the noise"

HELD_OUT = Table(
    "held_out",
    "Proof on motion that was left out of the fits: one row per specimen or test left out. A test "
    "is left out in all specimens, whose other tests are fitted; a specimen but for every second "
    "of its load steps, to which its own stiffness and sizes of effects are fitted.",
    ("fold",),
    (
        Column("fold", "text", "specimen or test left out"),
        Column("kind", "text", "what is left out", allowed=("specimen", "test", "steps")),
        Column("readings", "integer", "readings left out", low=0),
        _rms("rms_base", "the base model", "no result, see status"),
        _rms("rms_with_effects", "the model with the named effects", "no result, see status"),
        _rms("rms_surrogate", "a generic surrogate that knows no physics", "not computed"),
        *_gaps("base", "the base model", "no result, see status"),
        *_gaps("with_effects", "the model with the named effects", "no result, see status"),
        *_gaps("surrogate", "the generic surrogate", "not computed"),
        Column(
            "closed",
            "number",
            "share of the base's excess misfit (chi squared) that the effects take away; negative: "
            "they add to it",
            null=_NOTHING_TO_CLOSE,
            high=1.0,
        ),
        Column(
            "worse",
            "flag",
            "whether the effects predict it worse than the base, by more than noise makes",
        ),
        status("fits"),
        MESSAGE,
        Column(
            "gap_closed",
            "number",
            "share of the base's gap that the effects close: 1 less the root of what `closed` "
            "leaves of 1; negative: they widen it",
            null=_NOTHING_TO_CLOSE,
            high=1.0,
        ),
    ),
)

IMPERFECTIONS = Table(
    "imperfections",
    "What the small imperfections took up that the study allows for: one row per imperfection, at "
    "its most likely size, and one per mean over several of them.",
    ("model", "specimen", "kind", "component", "joint", "test"),
    (
        Column("model", "text", "base, or with the named effects", allowed=MODELS),
        Column("specimen", "text", "specimen; * in a mean over all"),
        Column("kind", "text", "imperfection, as in the study's nuisance settings"),
        Column("component", "text", "direction, or the two coordinates that are coupled"),
        Column("joint", "text", "joint; * for a load, for all joints alike, in a mean over all"),
        Column("test", "text", "test; * for what all tests share, in a mean over all"),
        Column("value", "number", "most likely size", "see unit"),
        Column("unit", "text", "of value and prior_sd; 1: a share", allowed=("mm", "deg", "1")),
        Column("prior_sd", "number", "one prior SD", "see unit", low=0.0),
        Column("in_prior_sds", "number", "most likely size", "prior SD"),
        Column(
            "posterior_sd",
            "number",
            "how far readings leave it open (1: they say nothing); of a mean its standard error "
            "by the scatter of the places",
            "prior SD",
            low=0.0,
        ),
        Column(
            "taken_chi2",
            "number",
            "by how much it lowers chi squared, to first order; these add up",
            null="a mean",
        ),
        Column("places", "integer", "imperfections in it; 1 where it is no mean", low=1),
        Column(
            "chance",
            "number",
            "how often random errors make as large a mean",
            null="no mean",
            low=0.0,
            high=1.0,
        ),
        Column("common", "flag", "whether the mean is too large for random errors"),
    ),
)

NEXT_TESTS = Table(
    "next_tests",
    "Which test next, for tied names, for what has none and for effects that imperfections hide: "
    "one row per subject and run, the most log evidence per cycle first.",
    ("effect_or_pair", "test"),
    (
        Column("effect_or_pair", "text", "what is asked: an effect, two names, or what has none"),
        Column("test", "text", "a run to add, or what an imperfection would have to be known to"),
        Column("cycles", "integer", "cycles to be made, all specimens together; 0: no test", low=0),
        Column("gain_in_log_evidence", "number", "expected gain", null="no pose was found"),
        Column("gain_per_cycle", "number", "the same per cycle", null="no test, or no pose"),
        Column(
            "status",
            "text",
            "advised: the best of its subject; offered: others; tells_nothing; no_pose: the base "
            "has none; would_do, not_enough: whether the effect would be evident",
            allowed=ADVICE,
        ),
        MESSAGE,
    ),
)

FIELD_NUMBERS = Table(
    "field_numbers",
    "What a tester reads off a joint's curve of load over motion, whatever the formula of its law: "
    "one row per joint and coordinate that an effect which stands changes, number, specimen, and "
    "model; and one per mean over the specimens. The joint is moved along one coordinate, the "
    "others at rest; of the models, not of the readings. A number that is not there has no row.",
    ("model", "specimen", "joint", "coordinate", "number"),
    (
        Column("model", "text", "base, or with the effects", allowed=MODELS),
        _place("specimen"),
        JOINT,
        Column("coordinate", "text", "coordinate of the joint", allowed=COORDINATES),
        Column(
            "number",
            "text",
            "stiffness_at_zero: slope at rest. stiffness_at_..., motion_at_...: slope and motion "
            "at the load, to its minus and plus side. break_...: motion at which the slope is half "
            "way from that at rest to that at the load. zone: distance of the breaks, where the "
            "joint is softer at rest than at both loads. loop_area: work lost in a cycle between "
            "the loads. drift_per_decade: motion from 1 to 10 minutes under the plus load over "
            "that at once",
            allowed=NUMBERS,
        ),
        Column(
            "load",
            "number",
            "at which it is told: 5 N m or 50 N, or what the tests reach, if that is less",
            "N m of rotations, N of translations",
            low=0.0,
        ),
        Column("value", "number", "the number", "see unit"),
        Column(
            "unit",
            "text",
            "of the value; 1: a share",
            allowed=("N m/deg", "deg", "N m deg", "N/mm", "mm", "J", "1"),
        ),
        *(
            Column(
                end,
                "number",
                f"{word} end of the 95 % interval, by the errors of all fitted values to first "
                "order",
                "see unit",
                "the number comes and goes within the errors",
            )
            for end, word in (("low", "lower"), ("high", "upper"))
        ),
        Column("at_bound", "flag", "whether a fitted value that it hangs on ended at a bound"),
        Column("specimens", "integer", "specimens in it", low=1),
    ),
)

TABULATED = Table(
    "tabulated",
    "What stays without a name, as a table of load over motion: one row per joint, pair of "
    "coordinates, motion and specimen, and one per mean over specimens; none where the verdict has "
    "no table. Between motions the load goes straight, and beyond as in the last stretch.",
    ("specimen", "joint", "coordinate", "over", "motion"),
    (
        _place("specimen"),
        JOINT,
        Column("coordinate", "text", "coordinate that is loaded", allowed=COORDINATES),
        Column("over", "text", "coordinate that the joint is moved along", allowed=COORDINATES),
        Column("motion", "number", "that motion, the others at rest", "see motion_unit"),
        Column("motion_unit", "text", "unit of the motion", allowed=("mm", "deg")),
        Column(
            "load",
            "number",
            "load that holds the joint there, springs and named effects included",
            "see load_unit",
        ),
        *(
            Column(end, "number", f"{word} end of its 95 % interval", "see load_unit")
            for end, word in (("low", "lower"), ("high", "upper"))
        ),
        Column("base", "number", "the same of the base model", "see load_unit"),
        Column("load_unit", "text", "unit of the loads", allowed=("N", "N m")),
        Column("specimens", "integer", "specimens in it", low=1),
    ),
)
