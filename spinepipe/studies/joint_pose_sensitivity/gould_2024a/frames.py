"""Joint frames of both datasets (Tables 7 and 8), and how far apart they lie (sections 3.5, 4)."""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product

from spinepipe.comparison.claim import (
    Claim,
    NotComputed,
    Ours,
    Range,
    Run,
    Verdict,
    at_most,
    exactly,
    half_width,
    normal_iqr,
)
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.assumed import with_sd
from spinepipe.studies.joint_pose_sensitivity.gould_2024a.paper import (
    JOINTS,
    MOTION_KEY,
    PAPER,
    REDUCED,
    SAMPLES,
    summary_cell,
    summary_median,
    summary_value,
)
from spinepipe.units import COORDINATE_UNITS, ROTATIONS, TRANSLATIONS

DATASETS = {"complete": ("all", SAMPLES), "reduced": ("reduced", REDUCED)}
"""The paper's word to the dataset of the summary and the paper's number of poses."""

TABLES = {
    "origin": ("Table 7", TRANSLATIONS),
    "orientation": ("Table 8", ROTATIONS),
}

END_JOINTS = ("L1L2", "L3L4")

_PUT_IN = {
    "complete": "circular: the cohort was built to have it (docs/decisions/0001)",
    "reduced": "circular: the cohort was built to have it in the complete dataset",
}

_FRAME_RULE = (
    "the middle joint's frame is the mean of two vertebrae's here; the text does not determine "
    "the paper's construction of frames (A21)"
)

_NO_SD = "the landmarks' SD decides it, and none per landmark and axis is published"
_SCATTER = {
    "origin": f"{_NO_SD}; closed_form.origin_iqr has what this study's SD gives",
    "orientation": f"{_NO_SD}, nor the construction of frames (A21)",
}

_CHOSEN = "circular: the cohort's own landmark SD and pedicles were chosen for it"
_KEPT = "which poses are in the reduced dataset hangs on which fits succeeded"
_SHIFT = PAPER["reduced_against_complete"]
_BOUND = PAPER["spread_bound"]
MIDDLE_JOINT = "L2L3"
_OTHER_FITS = "it hangs on which fits succeeded, and those are not the paper's"
_NO_SDS = "landmark SDs and the construction of frames are not published (A20, A21)"
_SIDEWAYS = ("right_bending", "left_rotation")


def claims_of_joint_frames() -> Iterator[Claim]:
    """Median and IQR of each coordinate of each joint frame, of both datasets."""
    for quantity, (table, names) in TABLES.items():
        for dataset, joint, name in product(DATASETS, JOINTS, names):
            yield from _coordinate(quantity, table, dataset, joint, name)


def _coordinate(quantity: str, table: str, dataset: str, joint: str, name: str) -> Iterator[Claim]:
    printed = PAPER[f"joint_{quantity}"][dataset][joint]
    middle, iqr = (float(printed[kind][MOTION_KEY[name]]) for kind in ("median", "iqr"))
    ours, n = DATASETS[dataset]
    where = {
        **{"part": "poses", "loading": "equilibrium", "dataset": ours},
        **{"quantity": quantity, "joint": joint, "coordinate": name},
    }
    key, unit = f"joint_{quantity}.{dataset}.{joint}.{name}", COORDINATE_UNITS[name]
    free = quantity == "orientation" and joint not in END_JOINTS  # nothing was left to choose
    words = f"of {name} {quantity} of {joint}, {dataset} dataset"
    yield Claim(
        f"{key}.median",
        table,
        f"median {words}",
        unit,
        middle,
        half_width(middle, iqr),
        summary_median(**where),
        _FRAME_RULE if free else _KEPT,
        "" if free else _PUT_IN[dataset],
        evidence=Verdict.INSIDE if free else Verdict.CIRCULAR,
    )
    yield Claim(
        f"{key}.iqr",
        table,
        f"IQR {words}",
        unit,
        iqr,
        normal_iqr(iqr, n),
        with_sd(summary_cell("iqr", **where), iqr, [(joint, quantity, name)]),
        _spread(quantity, dataset),
        _CHOSEN if _chosen(quantity, joint, name) else "",
        _copied(quantity, dataset, joint, name),
        Verdict.CIRCULAR if _chosen(quantity, joint, name) else Verdict.INSIDE,
    )


def _spread(quantity: str, dataset: str) -> str:
    """Why a spread may differ from the paper's."""
    return _SCATTER[quantity] if dataset == "complete" else f"{_SCATTER[quantity]}; {_KEPT}"


def _chosen(quantity: str, joint: str, name: str) -> bool:
    """The landmark SD was chosen for origins, the pedicles' distance for the end joints."""
    return quantity == "origin" or (joint in END_JOINTS and name != "extension")


def _copied(quantity: str, dataset: str, joint: str, name: str) -> str:
    """The printed IQR of extension repeats that of axial rotation at all joints."""
    if (quantity, dataset, name) != ("orientation", "reduced", "extension"):
        return ""
    printed = PAPER["joint_orientation"]["reduced"][joint]["iqr"]
    return (
        f"A19: printed is {float(printed['extension_deg']):g} deg, the same as of axial rotation, "
        "at all three joints: probably a copied column"
    )


def claims_of_datasets() -> Iterator[Claim]:
    """Shifts between the datasets, drops of the extension IQR, bounds of the spreads."""
    for key, words, unit, bound, quantity, kind, names in (
        (
            "origin_median",
            "median origin",
            "mm",
            "origin_median_mm",
            "origin",
            "median",
            TRANSLATIONS,
        ),
        ("origin_iqr", "IQR of origins", "mm", "origin_iqr_mm", "origin", "iqr", TRANSLATIONS),
        (
            "orientation_median",
            "median orientation",
            "deg",
            "orientation_deg",
            "orientation",
            "median",
            ROTATIONS,
        ),
        (
            "orientation_iqr",
            "IQR of bending and rotation",
            "deg",
            "orientation_deg",
            "orientation",
            "iqr",
            _SIDEWAYS,
        ),
    ):
        value = float(_SHIFT[bound])
        yield Claim(
            f"reduced_against_complete.{key}",
            "section 3.5",
            f"largest difference of {words} between reduced and complete dataset",
            unit,
            value,
            at_most(value),
            _largest_shift(quantity, kind, names),
            _OTHER_FITS,
        )
    for joint in END_JOINTS:
        yield _drop(joint)
    yield from _bounds()
    for joint in END_JOINTS:
        yield _ratio(joint)


def _largest_shift(quantity: str, column: str, names: tuple[str, ...]) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        cells = product(JOINTS, names)
        return Ours(max(abs(_shift(run, column, quantity, *cell)) for cell in cells))

    return ours


def _drop(joint: str) -> Claim:
    paper = float(_SHIFT["extension_iqr_drop_deg"][joint])
    return Claim(
        f"reduced_against_complete.extension_iqr_drop.{joint}",
        "section 3.5",
        f"drop of the IQR of extension of {joint} from complete to reduced dataset",
        "deg",
        paper,
        exactly(paper),
        lambda run: Ours(-_shift(run, "iqr", "orientation", joint, "extension")),
        _OTHER_FITS,
        contradicted="A19: it rests on a column of Table 8 that is probably copied",
    )


def _shift(run: Run, column: str, quantity: str, joint: str, name: str) -> float:
    """Reduced less complete."""
    reduced, complete = (
        _value(run, dataset, column, quantity, joint, name) for dataset in ("reduced", "complete")
    )
    return reduced - complete


def _bounds() -> Iterator[Claim]:
    for key, unit, quantity, names in (
        ("origin_iqr_mm", "mm", "origin", TRANSLATIONS),
        ("bending_and_rotation_iqr_deg", "deg", "orientation", _SIDEWAYS),
        ("extension_iqr_deg", "deg", "orientation", ("extension",)),
    ):
        value = float(_BOUND[key])
        yield Claim(
            f"spread_bound.{key.rsplit('_', 1)[0]}",
            "section 4",
            f"largest IQR of {quantity}: {', '.join(names)}",
            unit,
            value,
            at_most(value),
            with_sd(
                _largest_iqr(quantity, names),
                value,
                [(joint, quantity, name) for joint, name in product(JOINTS, names)],
            ),
            _NO_SDS,
        )


def _largest_iqr(quantity: str, names: tuple[str, ...]) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        cells = product(JOINTS, names)
        return Ours(max(_value(run, "complete", "iqr", quantity, *cell) for cell in cells))

    return ours


def _ratio(joint: str) -> Claim:
    """Extension of an end joint scatters more than that of the middle joint."""
    printed = PAPER["joint_orientation"]["complete"]
    end, middle = (float(printed[name]["iqr"]["extension_deg"]) for name in (joint, MIDDLE_JOINT))
    return Claim(
        f"extension_iqr_over_middle.{joint}",
        "section 4, Table 8",
        f"IQR of extension of {joint} in that of {MIDDLE_JOINT}",
        "ratio",
        end / middle,
        Range(1.0, None, "the paper finds the end joints' larger: above 1"),
        partial(_over_middle, joint),
        _NO_SDS,
        "one vertebra against the mean of two (A21)",
    )


def _over_middle(joint: str, run: Run) -> Ours:
    end, middle = (
        _value(run, "complete", "iqr", "orientation", name, "extension")
        for name in (joint, MIDDLE_JOINT)
    )
    if middle == 0.0:
        raise NotComputed(f"the IQR of {MIDDLE_JOINT} is 0")
    return Ours(end / middle)


def _value(run: Run, dataset: str, column: str, quantity: str, joint: str, name: str) -> float:
    return summary_value(
        run,
        column,
        part="poses",
        loading="equilibrium",
        dataset=DATASETS[dataset][0],
        quantity=quantity,
        joint=joint,
        coordinate=name,
    )
