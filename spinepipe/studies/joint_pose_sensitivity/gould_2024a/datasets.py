"""The reduced dataset against the complete one, and bounds of both: sections 3.5 and 4."""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product

from spinepipe.comparison import summary
from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.joint_frames import DATASETS, END_JOINTS
from spinepipe.comparison.paper import JOINTS, PAPER
from spinepipe.comparison.ranges import Range, at_most, exactly
from spinepipe.comparison.run import NotComputed, Run
from spinepipe.units import ROTATIONS, TRANSLATIONS

_SHIFT = PAPER["reduced_against_complete"]
_BOUND = PAPER["spread_bound"]
MIDDLE_JOINT = "L2L3"
_KEPT = "it hangs on which fits succeeded, and those are not the paper's"
_SCATTER = "landmark SDs and the construction of frames are not published (A20, A21)"
_SIDEWAYS = ("right_bending", "left_rotation")


def claims() -> Iterator[Claim]:
    """Shifts between the datasets, drops of the extension IQR, bounds of the spreads."""
    for key, words, unit, bound, quantity, kind, names in (
        ("origin_median", "median origin", "mm", "origin_median_mm", "origin", "median",
         TRANSLATIONS),
        ("origin_iqr", "IQR of origins", "mm", "origin_iqr_mm", "origin", "iqr", TRANSLATIONS),
        ("orientation_median", "median orientation", "deg", "orientation_deg", "orientation",
         "median", ROTATIONS),
        ("orientation_iqr", "IQR of bending and rotation", "deg", "orientation_deg",
         "orientation", "iqr", _SIDEWAYS),
    ):  # fmt: skip
        value = float(_SHIFT[bound])
        yield Claim(
            f"reduced_against_complete.{key}", "section 3.5",
            f"largest difference of {words} between reduced and complete dataset", unit, value,
            at_most(value), _largest_shift(quantity, kind, names), _KEPT,
        )  # fmt: skip
    for joint in END_JOINTS:
        yield _drop(joint)
    yield from _bounds()
    for joint in END_JOINTS:
        yield _ratio(joint)


def _value(run: Run, dataset: str, column: str, quantity: str, joint: str, name: str) -> float:
    return summary.value(
        run, column, part="poses", loading="equilibrium", dataset=DATASETS[dataset][0],
        quantity=quantity, joint=joint, coordinate=name,
    )  # fmt: skip


def _shift(run: Run, column: str, quantity: str, joint: str, name: str) -> float:
    """Reduced less complete."""
    reduced, complete = (
        _value(run, dataset, column, quantity, joint, name) for dataset in ("reduced", "complete")
    )
    return reduced - complete


def _largest_shift(quantity: str, column: str, names: tuple[str, ...]) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        cells = product(JOINTS, names)
        return Ours(max(abs(_shift(run, column, quantity, *cell)) for cell in cells))

    return ours


def _drop(joint: str) -> Claim:
    paper = float(_SHIFT["extension_iqr_drop_deg"][joint])
    return Claim(
        f"reduced_against_complete.extension_iqr_drop.{joint}", "section 3.5",
        f"drop of the IQR of extension of {joint} from complete to reduced dataset", "deg", paper,
        exactly(paper), lambda run: Ours(-_shift(run, "iqr", "orientation", joint, "extension")),
        _KEPT, contradicted="A19: it rests on a column of Table 8 that is probably copied",
    )  # fmt: skip


def _ratio(joint: str) -> Claim:
    """Extension of an end joint scatters more than that of the middle joint."""
    printed = PAPER["joint_orientation"]["complete"]
    end, middle = (float(printed[name]["iqr"]["extension_deg"]) for name in (joint, MIDDLE_JOINT))
    return Claim(
        f"extension_iqr_over_middle.{joint}", "section 4, Table 8",
        f"IQR of extension of {joint} in that of {MIDDLE_JOINT}", "ratio", end / middle,
        Range(1.0, None, "the paper finds the end joints' larger: above 1"),
        partial(_over_middle, joint), _SCATTER, "one vertebra against the mean of two (A21)",
    )  # fmt: skip


def _over_middle(joint: str, run: Run) -> Ours:
    end, middle = (
        _value(run, "complete", "iqr", "orientation", name, "extension")
        for name in (joint, MIDDLE_JOINT)
    )
    if middle == 0.0:
        raise NotComputed(f"the IQR of {MIDDLE_JOINT} is 0")
    return Ours(end / middle)


def _bounds() -> Iterator[Claim]:
    for key, unit, quantity, names in (
        ("origin_iqr_mm", "mm", "origin", TRANSLATIONS),
        ("bending_and_rotation_iqr_deg", "deg", "orientation", _SIDEWAYS),
        ("extension_iqr_deg", "deg", "orientation", ("extension",)),
    ):
        value = float(_BOUND[key])
        yield Claim(
            f"spread_bound.{key.rsplit('_', 1)[0]}", "section 4",
            f"largest IQR of {quantity}: {', '.join(names)}", unit, value, at_most(value),
            _largest_iqr(quantity, names), _SCATTER,
        )  # fmt: skip


def _largest_iqr(quantity: str, names: tuple[str, ...]) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        cells = product(JOINTS, names)
        return Ours(max(_value(run, "complete", "iqr", quantity, *cell) for cell in cells))

    return ours
