"""From estimates to indices with status and message."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects.contract import Array
from spinepipe.sensitivity.global_indices.design import Design, Method
from spinepipe.sensitivity.global_indices.estimated import Estimated
from spinepipe.sensitivity.global_indices.index import Index, Known, Masked, masked
from spinepipe.sensitivity.global_indices.kept import Kept
from spinepipe.sensitivity.global_indices.settings import INDICES

Name = tuple[str, str, str]
"""Index, factor or group, second one of a pair (else empty)."""


@dataclass(frozen=True, eq=False)
class Report:
    """All that is known of K outputs.

    Attributes
    ----------
    found : estimates of the outputs that vary. varies : (K,) bool.
    status, why : of all outputs alike; ``done`` where nothing stands against indices.
    """

    design: Design
    left: Kept
    found: Estimated
    varies: NDArray[np.bool_]
    status: Known
    why: str

    def index(self, name: Name) -> Index:
        """One index of all outputs."""
        status, message = self._told(name)
        at = self._at.get(name)
        known = self.varies & (at is not None)
        ends = None if self.found.ends is None or at is None else self.found.ends[:, at]
        low, high = (None, None) if ends is None else ends
        estimate = None if at is None else self.found.estimate[at]
        return Index(
            *name,
            self._spread_out(estimate, known),
            self._spread_out(low, known),
            self._spread_out(high, known),
            self._runs,
            self.left.failed,
            status,
            message,
        )

    @cached_property
    def _at(self) -> dict[Name, int]:
        return {name: at for at, name in enumerate(self.found.names)}

    @property
    def _runs(self) -> int:
        one_curve = self.design.method is Method.FAST
        return self.design.block if one_curve else int(self.left.rows.sum())

    def _told(self, name: Name) -> tuple[tuple[Known, ...], tuple[str, ...]]:
        each = [self._told_of_one(name, bool(varies)) for varies in self.varies]
        return tuple(status for status, _ in each), tuple(message for _, message in each)

    def _told_of_one(self, name: Name, varies: bool) -> tuple[Known, str]:
        if self.status is not Known.DONE:
            return self.status, self.why
        if not varies:
            return Known.CONSTANT, "the output is the same in all runs"
        if name not in self._at:
            return Known.TOO_MANY_FAILED, f"{self.left.message}, {name[1]}'s among them"
        return Known.DONE, "; ".join(filter(None, (self.left.message, self.found.note)))

    def _spread_out(self, part: Array | None, known: NDArray[np.bool_]) -> Masked:
        """(K,) of numbers for the outputs that vary, or of nothing."""
        values = np.zeros(len(known))
        if part is None:
            return masked(values, np.ones(len(known)))
        values[known] = part
        return masked(values, ~known)


def names_of(design: Design) -> list[Name]:
    """All indices a design has, in the order of tables."""
    found: list[Name] = []
    for index in INDICES[design.method]:
        if index == "S2":
            pairs = combinations(design.inputs, 2) if design.second_order else ()
            found += [(index, first, second) for first, second in pairs]
        else:
            found += [(index, name, "") for name in design.inputs if _has(design, index, name)]
    return found


def _has(design: Design, index: str, name: str) -> bool:
    """Of Morris, groups of several have no sign, so no mean and SD of signed effects."""
    signed = design.method is Method.MORRIS and index != "mu_star"
    return not (signed and design.groups.count(name) > 1)
