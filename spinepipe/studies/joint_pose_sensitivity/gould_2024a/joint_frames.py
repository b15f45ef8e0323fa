"""Joint frames: Tables 7 and 8."""

from collections.abc import Iterator
from itertools import product

from spinepipe.comparison import summary
from spinepipe.comparison.claim import Claim, Verdict
from spinepipe.comparison.paper import (
    JOINTS,
    MOTION_KEY,
    MOTION_UNIT,
    PAPER,
    REDUCED,
    SAMPLES,
)
from spinepipe.comparison.ranges import half_width, normal_iqr
from spinepipe.units import ROTATIONS, TRANSLATIONS

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
_NO_SD = "landmark SDs per landmark and axis are not published"
_SCATTER = {
    "origin": f"{_NO_SD}; closed_form.origin_iqr has what this study's SD gives",
    "orientation": f"{_NO_SD}, and neither is the construction of frames (A21)",
}
_CHOSEN = "circular: the cohort's own landmark SD and pedicles were chosen for it"
_KEPT = "which poses are in the reduced dataset hangs on which fits succeeded"


def claims() -> Iterator[Claim]:
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
    key, unit = f"joint_{quantity}.{dataset}.{joint}.{name}", MOTION_UNIT[name]
    free = quantity == "orientation" and joint not in END_JOINTS  # nothing was left to choose
    words = f"of {name} {quantity} of {joint}, {dataset} dataset"
    yield Claim(
        f"{key}.median", table, f"median {words}", unit, middle, half_width(middle, iqr),
        summary.median(**where), _FRAME_RULE if free else _KEPT, "" if free else _PUT_IN[dataset],
        evidence=Verdict.INSIDE if free else Verdict.CIRCULAR,
    )  # fmt: skip
    yield Claim(
        f"{key}.iqr", table, f"IQR {words}", unit, iqr, normal_iqr(iqr, n),
        summary.statistic("iqr", **where), _spread(quantity, dataset),
        _CHOSEN if _chosen(quantity, joint, name) else "",
        _copied(quantity, dataset, joint, name),
        Verdict.CIRCULAR if _chosen(quantity, joint, name) else Verdict.INSIDE,
    )  # fmt: skip


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
