"""Which exchange explains landmarks that are those of no spine: of columns, signs, sides or names.

Each is undone in turn. Undone rightly, endplates lie above each other, right sides to the right,
pedicles behind the body, and vertebrae one above the other.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from spinepipe.effects.contract import Array
from spinepipe.frames import FRAME_LANDMARKS

XYZ = ("x_mm", "y_mm", "z_mm")

Points = Mapping[str, Mapping[str, Array]]
"""Vertebra, caudal to cranial, to landmark to (3,) mm."""

UPRIGHT, ACROSS, BEHIND_MM = 0.5, 0.4, 3.0
"""Cosine of endplates' line with +y, of sides' line with +z; pedicles in front of a body."""

FAR_MM = 120.0
"""From the middle of a vertebra: its processes end nearer."""

EXPLAINED = 0.9
"""Share of what is asked of vertebrae that holds in a spine, curved and crushed ones too."""


@dataclass(frozen=True)
class Suspect:
    """What is behind it, in words, and the column that is named."""

    words: str
    column: str


def suspect(points: Points) -> Suspect | None:
    """The one mistake that makes a spine of the landmarks once undone; None where none does.

    Mistakes that do the same, as a turned z and exchanged sides, are told together.
    """
    if _fits(points):
        return None
    if (astray := _astray(points)) is not None:
        return astray
    fits = [(words, column) for words, column, undone in _tried(points) if _fits(undone(points))]
    if not fits:
        return None
    told = list(dict.fromkeys(words for words, _ in fits))
    return Suspect(f"suspected: {', or '.join(told[:2])}; correct it", fits[0][1])


def _astray(points: Points) -> Suspect | None:
    """The one landmark that lies far from the others of its vertebra, which lie together."""
    found = []
    for vertebra, of_one in points.items():
        middle = np.median(list(of_one.values()), axis=0)  # one stray point does not move it
        far = {name: point - middle for name, point in of_one.items()}
        away = [name for name, line in far.items() if np.linalg.norm(line) > FAR_MM]
        found += [(vertebra, name, far[name]) for name in away if len(of_one) > 2]
    if len(found) != 1:
        return None
    vertebra, name, line = found[0]
    column = XYZ[int(np.argmax(np.abs(line)))]
    words = f"{name} of {vertebra} misplaced: {column} differs by {np.abs(line).max():.0f} mm"
    return Suspect(f"suspected: {words}, or has a slip of the decimal point", column)


def _fits(points: Points) -> bool:
    """Whether vertebrae stand in order, and most that is asked of each of them holds."""
    heights = [_height(of_one) for of_one in points.values()]
    asked = list(_asked(points))
    in_order = all(low < high for low, high in pairwise(heights))
    return in_order and (not asked or float(np.mean(asked)) > EXPLAINED)


def _asked(points: Points) -> Iterator[bool]:
    top, bottom, left, right = FRAME_LANDMARKS
    for of_one in points.values():
        if top in of_one and bottom in of_one:
            up = of_one[top] - of_one[bottom]
            yield bool(up[1] > UPRIGHT * np.linalg.norm(up))
        if left in of_one and right in of_one:
            across = of_one[right] - of_one[left]
            yield bool(across[2] > ACROSS * np.linalg.norm(across))
            if top in of_one and bottom in of_one:
                behind = of_one[left] + of_one[right] - of_one[top] - of_one[bottom]
                yield bool(behind[0] / 2.0 < BEHIND_MM)


def _height(of_one: Mapping[str, Array]) -> float:
    """Where a vertebra is along y: its endplates, or what there is."""
    faces = [of_one[name] for name in FRAME_LANDMARKS[:2] if name in of_one]
    return float(np.mean(faces or list(of_one.values()), axis=0)[1])


def _tried(points: Points) -> Iterator[tuple[str, str, Callable[[Points], Points]]]:
    """Words, column and what undoes each mistake."""
    for words, column, undone in column_mistakes(XYZ):
        yield words, column, _of_each(undone)
    scanner = "x_mm and z_mm of the other sign, as where axes LPS are called RAS"
    yield scanner, XYZ[0], _of_each(_moved([0, 1, 2], np.array([-1.0, 1.0, -1.0])))
    yield "landmarks of left and right exchanged", "landmark", _renamed("left", "right")
    faces = "landmarks of superior and inferior endplates exchanged"
    yield faces, "landmark", _renamed("superior", "inferior")
    yield from _other_names(points)


def column_mistakes(
    columns: Sequence[str], ways: Sequence[str] = ("backwards", "downwards", "to the left")
) -> Iterator[tuple[str, str, Callable[[Array], Array]]]:
    """Words, column and what undoes each mistake of three columns (..., 3).

    Parameters
    ----------
    ways : to which side a column with the wrong sign was counted, in words; of the first columns.
    """
    keep = np.ones(3)
    for first, second in combinations(range(3), 2):
        order = [0, 1, 2]
        order[first], order[second] = second, first
        words = f"{columns[first]} and {columns[second]} exchanged"
        yield words, columns[first], _moved(order, keep)
    for axis, way in enumerate(ways):
        sign = np.where(np.arange(3) == axis, -1.0, 1.0)
        words = f"the sign of {columns[axis]}" + (f": counted {way}" if way else "")
        yield words, columns[axis], _moved([0, 1, 2], sign)


def _moved(order: Sequence[int], sign: Array) -> Callable[[Array], Array]:
    """Columns in another order, then with other signs."""
    return lambda points: points[..., list(order)] * sign


def _of_each(undone: Callable[[Array], Array]) -> Callable[[Points], Points]:
    return lambda points: {
        v: {name: undone(point) for name, point in one.items()} for v, one in points.items()
    }


def _renamed(first: str, second: str) -> Callable[[Points], Points]:
    """Names that begin with one word begin with the other."""

    def other(name: str) -> str:
        for word, instead in ((first, second), (second, first)):
            if name.startswith(f"{word}_"):
                return instead + name.removeprefix(word)
        return name

    def undone(points: Points) -> Points:
        return {v: {other(name): p for name, p in one.items()} for v, one in points.items()}

    return undone


def _other_names(points: Points) -> Iterator[tuple[str, str, Callable[[Points], Points]]]:
    """Vertebrae in the order in which they lie, where that is another one by one exchange."""
    names = list(points)
    wanted = sorted(names, key=lambda name: _height(points[name]))
    words = exchange(names, wanted)
    if words is not None:
        undone = {name: points[at] for name, at in zip(names, wanted, strict=True)}
        yield f"names of vertebrae {words}", "vertebra", lambda _points: undone


def exchange(names: Sequence[str], wanted: Sequence[str]) -> str | None:
    """How one order comes of another: two exchanged, or in reverse; None where by neither."""
    off = [name for name, other in zip(names, wanted, strict=True) if name != other]
    if len(off) == 2:
        return f"exchanged: {off[0]} and {off[1]}"
    return "in reverse order" if off and list(names) == list(wanted)[::-1] else None
