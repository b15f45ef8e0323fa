"""A search on two straight chains that stiffen: roots of a cubic, made by nothing of spinepipe."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import chain_cases as cases
import numpy as np
import pytest

STUDY = "probe"
SETTINGS = """\
study: probe
kind: discrepancy
cohort: chains
base: {stiffness: per_specimen}
effects: [nonlinear_stiffening, hysteresis]
"""
STIFFNESS = {"a": 50.0, "b": 40.0}
SIGN = {"flexion": -1.0, "extension": 1.0}
RISE = 4000.0
"""N m/rad3; the stiffness is in N m/rad."""


def turned(moment: float, k: float) -> float:
    """Degrees at which k q + RISE q^3 is the moment; the cubic has one real root."""
    roots = np.roots([RISE, 0.0, k, -moment])
    return float(np.rad2deg(roots[np.argmin(np.abs(roots.imag))].real))


def chains(
    root: Path, stiffness: Mapping[str, float] = STIFFNESS, more: Sequence[str] = ()
) -> None:
    """A project with that cohort, read in two cycles with noise of 0.05 deg, and its study.

    ``more`` : tests beside flexion and extension.
    """
    linear = {name: np.array([[k, 60.0, 200.0]] * 3) for name, k in stiffness.items()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(cases.MOMENT_OF, "extension", ("mz_nm", 1.0, "extension"))
        tests = (*SIGN, *more)
        made = cases.Chains(linear, tests, steps=6, step_nm=1.5, cycles=2, noise_deg=0.05)
    for row in made.motion.itertuples():
        if row.test in SIGN:
            moment, k = SIGN[row.test] * made.step_nm * row.step, stiffness[row.specimen]
            away = turned(moment, k) - np.rad2deg(moment / k)
            made.motion.loc[row.Index, "extension_deg"] += away
    made.write(root)
    (root / f"config/studies/{STUDY}.yaml").write_text(SETTINGS)
