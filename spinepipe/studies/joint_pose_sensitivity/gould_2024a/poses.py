"""Over all sampled poses, section 3.3: stiffness, errors, normality and correlations (Table 5)."""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product

from spinepipe.comparison.claim import (
    Claim,
    NotComputed,
    Ours,
    Range,
    Run,
    at_most,
    exactly,
    factor_of_two,
    insignificant,
    of_sign,
    spearman_interval,
    spearman_threshold,
    tested,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.assumed import with_load_point
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.paper import (
    FITTED,
    JOINTS,
    MEASURED_JOINTS,
    NO_RAW_DATA,
    P_BELOW,
    PAPER,
    REDUCED,
    STIFFNESS_KEY,
    summary_cell,
    summary_median,
    summary_percent,
    summary_value,
)
from spinepipe.units import COORDINATE_UNITS, ROTATIONS, STIFFNESS_UNITS, TRANSLATIONS

_CONFOUNDED = (
    "which errors remain at a best fit hangs on measured motion, weights and joint frames "
    "together; the paper's motion in its own frames is not published"
)

_ELSEWHERE = (
    "signs and sizes hang on joint frames, load line and motion, of which some are assumed here"
)

_JUST = "the paper's one pair was just significant, without correction for the number of pairs"
_THRESHOLD = spearman_threshold(P_BELOW, REDUCED)

OPPOSITE = {
    ("anterior", "anterior"): "A27: Table 6 has the opposite sign, at a fixed pose",
    ("extension", "extension"): "A28: Table 6 has the opposite sign, at a fixed pose",
}

_AT_LEAST_ONE = "the paper rejects normality without saying of which quantities: one at least"
ERRORS = tuple(f"{name}_error" for name in FITTED)

FRAMES = (
    *(f"{joint}_{name}_origin" for joint in JOINTS for name in TRANSLATIONS),
    *(f"{joint}_{name}_orientation" for joint in JOINTS for name in ROTATIONS),
)

QUARTILES = ("quartile_25", "median", "quartile_75")

REDUCED_SET = {"part": "poses", "loading": "equilibrium", "dataset": "reduced"}

_ARM = (
    NO_RAW_DATA + "; flexion stiffness hangs on the lever arm of the load, for which the paper's "
    "numbers exclude each other (A1, A2)"
)


def claims_of_pose_sampling() -> Iterator[Claim]:
    """Stiffness of the reduced dataset, its spread, and the bounds of its errors."""
    for name in FITTED:
        yield from _stiffness(name)
    yield _wider()
    for kind, name_of in (("translation_mm", "translation"), ("rotation_deg", "rotation")):
        bound = float(PAPER["reduced_error_bound"][kind])
        names = ("anterior", "superior") if name_of == "translation" else ("extension",)
        yield Claim(
            f"reduced.largest_error.{name_of}",
            "section 3.3, Fig 7",
            f"largest error of a {name_of} in the reduced dataset",
            COORDINATE_UNITS[names[0]],
            bound,
            at_most(bound),
            partial(_largest, names),
            NO_RAW_DATA,
            "the paper leaves outliers of its figure out; ours are all of the reduced dataset",
        )
    for joint in MEASURED_JOINTS:
        yield Claim(
            f"reduced.anterior_over_superior_error.{joint}",
            "section 3.3, Fig 7",
            f"median anterior error in superior errors at {joint}",
            "ratio",
            None,
            Range(1.0, None, "the paper's medians are largest in the anterior direction: above 1"),
            partial(_order, joint),
            NO_RAW_DATA,
        )


def _stiffness(name: str) -> Iterator[Claim]:
    low, middle, high = _quartiles(name)
    where = {**REDUCED_SET, "quantity": "stiffness", "joint": "*", "coordinate": name}
    unit, reason = STIFFNESS_UNITS[name], _ARM if name == "extension" else NO_RAW_DATA
    ours = summary_median(**where)
    yield Claim(
        f"reduced.stiffness.{name}.median",
        "section 3.3, Fig 8",
        f"median {name} stiffness",
        unit,
        middle,
        Range(low, high, "the paper's IQR"),
        with_load_point(ours, middle) if name == "extension" else ours,
        reason,
    )
    yield Claim(
        f"reduced.stiffness.{name}.iqr",
        "section 3.3, Fig 8",
        f"IQR of {name} stiffness",
        unit,
        high - low,
        factor_of_two(high - low),
        summary_cell("iqr", **where),
        reason,
    )
    percent = _paper_percent(name)
    yield Claim(
        f"reduced.stiffness.{name}.iqr_percent",
        "section 3.3",
        f"IQR of {name} stiffness",
        "% of median",
        percent,
        factor_of_two(percent),
        summary_percent("iqr", **where),
        NO_RAW_DATA,
    )


def _wider() -> Claim:
    """Anterior stiffness is found far less precisely than flexion stiffness."""
    ratio = _paper_percent("anterior") / _paper_percent("extension")
    return Claim(
        "reduced.anterior_iqr_percent_over_extension",
        "section 3.3, Fig 8",
        "IQR in percent of the median, anterior in extension stiffness",
        "ratio",
        ratio,
        Range(1.0, None, "the paper's anterior stiffness scatters more: above 1"),
        _wider_by,
        NO_RAW_DATA,
    )


def _wider_by(run: Run) -> Ours:
    anterior, extension = (
        summary_percent("iqr", **REDUCED_SET, quantity="stiffness", joint="*", coordinate=name)(
            run
        ).value
        for name in ("anterior", "extension")
    )
    if extension == 0.0:
        raise NotComputed("the IQR of extension stiffness is 0")
    return Ours(anterior / extension)


def _paper_percent(name: str) -> float:
    low, middle, high = _quartiles(name)
    return 100.0 * (high - low) / middle


def _quartiles(name: str) -> tuple[float, float, float]:
    """Lower quartile, median and upper quartile as printed."""
    printed, key = PAPER["reduced_stiffness"], STIFFNESS_KEY[name]
    low, middle, high = (float(printed[at][key]) for at in QUARTILES)
    return low, middle, high


def _largest(names: tuple[str, ...], run: Run) -> Ours:
    return Ours(
        max(
            summary_value(
                run, "maximum", **REDUCED_SET, quantity="error", joint=joint, coordinate=name
            )
            for joint in MEASURED_JOINTS
            for name in names
        )
    )


def _order(joint: str, run: Run) -> Ours:
    anterior, superior = (
        summary_value(run, "median", **REDUCED_SET, quantity="error", joint=joint, coordinate=name)
        for name in ("anterior", "superior")
    )
    if superior == 0.0:
        raise NotComputed("the median superior error is 0")
    return Ours(anterior / superior)


def claims_of_normality() -> Iterator[Claim]:
    """Number of rejected distributions."""
    for key, where, words, responses in (
        ("errors", "section 3.4", "errors", ERRORS),
        ("joint_frames", "section 3.5", "coordinates of joint frames, reduced dataset", FRAMES),
    ):
        yield Claim(
            f"normality.{key}",
            where,
            f"{words} that are not normal (chi-squared)",
            "count",
            None,
            Range(1.0, None, _AT_LEAST_ONE),
            _rejected(responses),
            "the same test finds no departure from a normal distribution in this run",
        )


def _rejected(responses: tuple[str, ...]) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        rows = tested(run, "chi", family="normality")
        rows = rows[rows["response"].isin(responses)]
        if rows.empty:
            raise NotComputed("no such distribution was tested")
        rejected = int((rows["p"] < P_BELOW).sum())
        return Ours(float(rejected), note=f"ours: {rejected} of {len(rows)} tested, uncorrected")

    return ours


def claims_of_correlations() -> Iterator[Claim]:
    """Table 5 cell by cell, then joint poses."""
    for error, stiffness in product(FITTED, FITTED):
        rho = PAPER["error_stiffness_correlation"][error].get(stiffness)
        allowed = (
            insignificant(P_BELOW, REDUCED)
            if rho is None
            else spearman_interval(float(rho), REDUCED)
        )
        yield Claim(
            f"table_5.{error}_error.{stiffness}_stiffness",
            "Table 5",
            f"Spearman: {error} error and {stiffness} stiffness",
            "rho",
            None if rho is None else float(rho),
            allowed,
            _rho("error against stiffness", f"{error}_error", f"{stiffness}_stiffness"),
            _CONFOUNDED,
            OPPOSITE.get((error, stiffness), ""),
        )
        if rho is not None:
            yield _sign(error, stiffness, float(rho))
    yield from _poses()
    for joint, name in product(MEASURED_JOINTS, FITTED):
        yield _on_motion(joint, name)


def _sign(error: str, stiffness: str, rho: float) -> Claim:
    return Claim(
        f"table_5.{error}_error.{stiffness}_stiffness.sign",
        "Table 5",
        f"Spearman: {error} error and {stiffness} stiffness, sign only",
        "rho",
        rho,
        of_sign(rho, "the paper's sign"),
        _rho("error against stiffness", f"{error}_error", f"{stiffness}_stiffness"),
        _CONFOUNDED,
        OPPOSITE.get((error, stiffness), ""),
    )


def _rho(family: str, response: str, factor: str) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        row = tested(run, "spearman", family=family, response=response, factor=factor).iloc[0]
        rho = float(row["effect"])
        spread = spearman_interval(rho, int(row["n"])) if abs(rho) < 1.0 else None
        ends = (None, None) if spread is None else (spread.low, spread.high)
        return Ours(rho, *ends, f"ours: n = {int(row['n'])}, p = {row['p']:.2g} uncorrected")

    return ours


def _poses() -> Iterator[Claim]:
    printed = PAPER["pose_correlation"]
    yield Claim(
        "pose_correlation.extension_stiffness",
        "section 3.3",
        "Spearman: extension stiffness and mean left rotation of the joint frames",
        "rho",
        float(printed["r"]),
        spearman_interval(float(printed["r"]), REDUCED),
        _rho("stiffness against pose", "extension_stiffness", "left_rotation_orientation"),
        _CONFOUNDED,
    )
    for key, family, words, note in (
        ("stiffness", "stiffness against pose", "stiffness", _JUST),
        ("error", "error against pose", "error", ""),
    ):
        count = float(printed[f"significant_pairs_with_{key}"])
        yield Claim(
            f"pose_correlation.significant_pairs_with_{key}",
            "section 3.3",
            f"pairs of {words} and joint pose with rho beyond {_THRESHOLD:.3f}, the threshold of "
            f"p = {P_BELOW:g} in {REDUCED} pairs",
            "count",
            count,
            exactly(count),
            _significant(family, key),
            _ELSEWHERE,
            note,
        )


def _on_motion(joint: str, name: str) -> Claim:
    """Whether the error goes with the measured motion, which each joint frame sees otherwise."""
    paper = float(bool(PAPER["error_depends_on_motion"][name]))
    return Claim(
        f"error_depends_on_motion.{joint}.{name}",
        "section 3.3, supplement SE",
        f"{name} error at {joint} depends on the measured motion: rho beyond {_THRESHOLD:.3f}, the "
        f"threshold of p = {P_BELOW:g} in {REDUCED} pairs",
        "1: yes, 0: no",
        paper,
        exactly(paper),
        partial(_depends_on_motion, joint, name),
        "the paper's motion in the frames of its poses is not published, nor is the size of its "
        "correlation; ours here is the opposite of what it reports",
    )


def _depends_on_motion(joint: str, name: str, run: Run) -> Ours:
    where = {"joint": joint, "response": f"{name}_error"}
    row = tested(run, "spearman", family="error against motion", **where).iloc[0]
    rho = float(row["effect"])
    note = f"ours: rho {rho:.2f}, n = {int(row['n'])}, p = {row['p']:.2g} uncorrected"
    return Ours(float(abs(rho) > _THRESHOLD), note=note)


def _significant(family: str, key: str) -> Callable[[Run], Ours]:
    responses = [f"{name}_{key}" for name in FITTED]

    def ours(run: Run) -> Ours:
        rows = tested(run, "spearman", family=family)
        rows = rows[rows["response"].isin(responses)]
        if rows.empty:
            raise NotComputed("no such pair was tested")
        found = int((rows["effect"].abs() > _THRESHOLD).sum())
        corrected = int((rows["p_bonferroni"] < P_BELOW).sum())
        note = f"ours: of {len(rows)} tested; {corrected} significant after Bonferroni"
        return Ours(float(found), note=f"{note} with n = {int(rows['n'].max())}")

    return ours
