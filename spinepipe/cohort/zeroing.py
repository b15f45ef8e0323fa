"""Zeroing by test: some rigs start each test at zero, others count from one pose all along.

All that is done with a cohort asks one question of it: were readings zeroed at step 0? Where tests
differ, those that keep their step-0 reading are zeroed as they are read. Motion from step 0 on is
told alike then; how far the spine had moved before step 0 is no longer asked of any test.

Some rigs subtract the mean of several readings, which leaves something at step 0. It is subtracted
as well: the error of step 0 is then that of one reading, as the noise of zeroed readings has it.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from spinepipe.cohort.draft import Draft
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.effects.contract import Array
from spinepipe.problems import InputProblem, Spelling
from spinepipe.units import COORDINATE_COLUMNS

KEY = "zeroed_at_step_0"
_PLACE = ["specimen", "test", "cycle", "joint"]

MOST_LEFT = 4.0
"""SDs of one reading at step 0 that zeroing by a mean leaves at most: a reading less the mean of n
has an SD of sqrt(1 - 1 / n) of one.
"""


def check_zeroing(draft: Draft, document: YamlDocument | None) -> Iterator[InputProblem]:
    """Tests that are named but unknown, and those that cannot be zeroed beside the named ones."""
    named = document.data.get(KEY) if document else None
    motion = draft.tables.get("motion")
    if document is None or not isinstance(named, list) or motion is None:
        return
    tests = Spelling(sorted(motion["test"].dropna().unique()), "correct it")
    known = set(tests.known)
    for name in named:
        if isinstance(name, str) and name not in known:
            place = document.place_of(KEY)
            allowed = f"a test of motion.csv: {tests.allowed}"
            yield InputProblem(*place, f"'{name}'", allowed, tests.remedy(name))
    if not known.intersection(name for name in named if isinstance(name, str)):
        return
    for line, column in _without_start(motion, named):
        found = "a reading, but none at step 0 of its cycle"
        allowed = f"one at step 0 in each test that {KEY} does not name, as it names some"
        remedy = f"add it, or name the test in {KEY} if its readings count from step 0"
        yield InputProblem(draft.file("motion"), line, column, found, allowed, remedy)


def _without_start(motion: pd.DataFrame, named: Sequence[str]) -> Iterator[tuple[int, str]]:
    """First line and column of what has readings but none at step 0, per cycle and joint."""
    kept = motion[~motion["test"].isin(named)]
    series = kept.groupby(_PLACE, dropna=False, sort=False).ngroup()
    found: dict[int, tuple[int, str]] = {}
    for column in COORDINATE_COLUMNS:
        read = kept[column].notna()
        started = set(series[read & (kept["step"] == 0)])
        for number, line in zip(series[read], kept.index[read], strict=True):
            if number not in started:
                found.setdefault(int(number), (int(line), column))
    yield from (found[number] for number in sorted(found))


def common_zeroing(
    motion: pd.DataFrame | None, zeroed: bool | Sequence[str], sd: Array | None = None
) -> tuple[pd.DataFrame | None, bool]:
    """Motion whose tests are all zeroed or none, and which; what a mean left is subtracted.

    Parameters
    ----------
    motion : rows of the format, cycles numbered. zeroed : all tests or none, or the names of some.
    sd : (6,) of one reading, NaN: not told; then nothing is taken for what a mean left.
    """
    if motion is None or zeroed is False:
        return motion, False
    named = motion["test"].isin(motion["test"] if zeroed is True else zeroed)
    if len(motion) and not named.any():
        return motion, False
    values = motion[list(COORDINATE_COLUMNS)]
    at_start = values.where(motion["step"] == 0)
    start = at_start.groupby([motion[name] for name in _PLACE]).transform("first")
    # of a zeroed test only what a mean leaves: more than that is for the plausibility checks
    most = MOST_LEFT * (np.zeros(len(COORDINATE_COLUMNS)) if sd is None else np.nan_to_num(sd))
    left = start.where(start.abs() <= most, 0.0)
    return motion.assign(**(values - start.where(~named, left))), True
