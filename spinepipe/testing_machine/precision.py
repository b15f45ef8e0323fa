"""How sure readings are: what is declared in ``cohort.yaml``, and where it comes from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinepipe.testing_machine.load_steps import ResampledTest

Array = NDArray[np.float64]

NOT_READ = {"deg": 0.1, "mm": 0.1}
"""SD that stands for a kind of reading that there is none of: the form asks for one."""


@dataclass(frozen=True)
class ReadingPrecision:
    """How sure the readings of one kind (deg or mm) are; NaN where it cannot be told.

    Attributes
    ----------
    row : SD of a single row of the recordings around the regression.
    regression : SD of a reading after it. cycles : SD of a reading between repeats.
    finest : SD that the resolution of the files makes at least.
    """

    row: float
    regression: float
    cycles: float
    finest: float

    @property
    def sd(self) -> float:
        """What is declared: the largest of what is known, as each leaves something out."""
        return float(np.nanmax([self.regression, self.cycles, self.finest]))


def reading_precision(
    tests: Sequence[ResampledTest], unit: str, zeroed: bool
) -> ReadingPrecision | None:
    """Pooled over all readings whose column ends with this unit; None where there are none."""
    of_rows, of_regression, of_cycles, finest = [], [], [], []
    for test in tests:
        for place, (joint, column) in enumerate(test.places):
            if not column.endswith(unit):
                continue
            of_rows += [cycle.raw[:, place] for cycle in test.cycles]
            of_regression += [cycle.sds[:, place] for cycle in test.cycles]
            finest += [one.finest[joint, column] for one in test.recordings]
            if len(test.cycles) > 1:
                of_cycles.append(_between([c.motion[:, place] for c in test.cycles], zeroed))
    if not of_rows:
        return None
    return ReadingPrecision(
        _rms(np.concatenate(of_rows)),
        _rms(np.concatenate(of_regression)),
        _rms(np.concatenate(of_cycles)) if of_cycles else float("nan"),
        max(finest) / np.sqrt(12.0),
    )


def _between(cycles: Sequence[Array], zeroed: bool) -> Array:
    """(T,) SD of one reading between cycles; zeroed readings carry the error of step 0 as well."""
    shortest = min(map(len, cycles))
    sds = np.std([one[:shortest] for one in cycles], axis=0, ddof=1)
    return sds[1:] / np.sqrt(2.0) if zeroed else sds


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def declared_sd(sure: ReadingPrecision | None, unit: str) -> float:
    """The SD with two digits, rounded up."""
    if sure is None or sure.sd == 0.0:
        return NOT_READ[unit]
    scale = 10.0 ** (1 - int(np.floor(np.log10(sure.sd))))
    return float(f"{np.ceil(sure.sd * scale - 1e-9) / scale:.10g}")


def sd_sentence(rotation: ReadingPrecision | None, translation: ReadingPrecision | None) -> str:
    """Where the declared SDs come from."""
    words = []
    for sure, unit in ((rotation, "deg"), (translation, "mm")):
        if sure is None:
            words.append(f"No motion in {unit} was read, {NOT_READ[unit]} stands for its SD.")
        elif sure.sd == 0.0:
            words.append(f"Readings in {unit} never change, {NOT_READ[unit]} stands for their SD.")
        else:
            between = (
                "no cycle is repeated"
                if np.isnan(sure.cycles)
                else f"{sure.cycles:.2g} {unit} between cycles"
            )
            words.append(
                f"{declared_sd(sure, unit):g} {unit}, the largest of {sure.regression:.2g} {unit} "
                f"by what rows leave around the regression ({sure.row:.2g} for a single row), "
                f"{between}, and {sure.finest:.2g} by the resolution of the files."
            )
    return " ".join(words)
