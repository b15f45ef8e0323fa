"""Recordings that others have published, where they are at hand: read, or refused in a sentence.

`SPINEPIPE_PUBLIC_FILES` names a folder with them. Catches a crash, and points that ezc3d reads
otherwise. Tried on these repositories (commit: files; refused):

- Biomechanical-ToolKit/BTKData (6aee093370de: 65 .c3d, 13 .trc; 7 .c3d of which 2 empty or damaged,
  4 without a unit, 1 without markers, and 4 .trc of which 2 empty, 2 without markers)
- opensim-org/opensim-core (0435b081dc38: 3 .c3d, 26 .trc; 3 .trc of another rate than DataRate)
- opensim-org/opensim-models (20a888b9655e: 23 .trc; none)
- pyomeca/ezc3d-testFiles (e40a8f8e8476: 9 .c3d; 3 that are cut off or without markers)
- pyomeca/pyomeca (3594512b142e: a .c3d, a .trc; none)
- felixchenier/kineticstoolkit (6aa3a6e0c098: 11 .c3d; none)
- ross-wilkinson/opensim-model-fullBodyMuscleActuated (3cfbe329a8ef: a .trc; none)
"""

import os
from collections.abc import Iterator
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from spinepipe.motion.reading import read_motion
from spinepipe.motion.reading_c3d import open_c3d
from spinepipe.motion.reading_plates import read_force_plates
from spinepipe.motion.recording import M_PER
from spinepipe.problems import InputError

FOLDER = os.environ.get("SPINEPIPE_PUBLIC_FILES", "")

pytestmark = pytest.mark.skipif(not FOLDER, reason="SPINEPIPE_PUBLIC_FILES names no folder")

REFUSED_AT_MOST = 0.15
"""Share of files that are cut off, empty, without markers or units, or contradict themselves."""


def files(*suffixes: str) -> Iterator[Path]:
    yield from (one for one in sorted(Path(FOLDER).rglob("*")) if one.suffix.lower() in suffixes)


@pytest.mark.parametrize("suffix", [".trc", ".c3d"])
def test_every_file_is_read_or_refused_in_a_sentence(suffix: str) -> None:
    count, refused = 0, []
    for path in files(suffix):
        count += 1
        try:
            read_motion(path)
        except InputError as error:
            refused.append(f"{path.name}: {error.problems[0]}")
    assert len(refused) <= REFUSED_AT_MOST * count, "\n".join(refused)


def test_points_are_those_that_ezc3d_reads() -> None:
    """Of files that both read, where ezc3d has a place; without ANALOG:RATE it loses its way."""
    for path in files(".c3d"):
        try:
            whole = open_c3d(path, path.name)
            if whole.analog and not whole.numbers("ANALOG", "RATE"):
                continue
            found, theirs = read_motion(path), ezc3d.c3d(str(path))
        except (InputError, OSError, RuntimeError, ValueError, IndexError):
            continue
        unit = theirs["parameters"]["POINT"]["UNITS"]["value"][0].lower()
        points = M_PER.get(unit, 1.0) * theirs["data"]["points"][:3].transpose(2, 1, 0)
        both = found.seen[: len(points)] & np.isfinite(points).all(axis=-1)
        assert both.any() == found.seen.any(), path
        frames = found.places[: len(points)]
        np.testing.assert_allclose(
            frames[both], points[both], rtol=1e-5, atol=1e-6, err_msg=str(path)
        )


def test_forces_are_those_that_ezc3d_reads() -> None:
    for path in files(".c3d"):
        try:
            plates = read_force_plates(path)
            theirs = ezc3d.c3d(str(path), extract_forceplat_data=True)["data"]["platform"]
        except (InputError, OSError, RuntimeError, ValueError, IndexError):
            continue
        for plate, other in zip(plates, theirs, strict=True):
            if other["force"].size:
                forces = other["force"].T
                np.testing.assert_allclose(plate.force, forces, atol=1e-2, err_msg=str(path))
