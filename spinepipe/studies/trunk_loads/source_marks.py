"""What decides besides study and cohort: the files of the package that geometry is read from."""

from collections.abc import Mapping
from typing import Any

from spinepipe.muscles.myo_sim import origin_of_myo_sim
from spinepipe.studies.trunk_loads.settings import TrunkLoads


def marks_of(settings: TrunkLoads) -> list[str]:
    """Digest of the package's files, where the study reads them."""
    return [origin_of_myo_sim().sha256] if settings.geometry == "myo_sim" else []


def marks_of_source(expected: Any, _place: Mapping[str, str]) -> list[str]:
    """The same, as declared jobs are asked for it."""
    return marks_of(expected.study)
