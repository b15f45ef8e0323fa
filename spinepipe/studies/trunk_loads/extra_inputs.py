"""What decides besides study and cohort: the package's files, a user's table of regressions."""

from collections.abc import Mapping
from hashlib import sha256
from typing import Any

from spinepipe.cohort import Cohort
from spinepipe.muscles.myo_sim import origin_of_myo_sim
from spinepipe.muscles.regressions import PACKAGED
from spinepipe.studies.trunk_loads.settings import TrunkLoads


def marks_of(settings: TrunkLoads, cohort: Cohort) -> list[str]:
    """Digests of the package's files and of a table of regressions, where the study reads them."""
    found = [origin_of_myo_sim().sha256] if settings.geometry == "myo_sim" else []
    own = cohort.folder / settings.regressions
    if settings.regressions not in PACKAGED and own.is_file():
        found.append(sha256(own.read_bytes()).hexdigest())
    return found


def marks_of_source(expected: Any, _place: Mapping[str, str]) -> list[str]:
    """The same, as declared jobs are asked for it."""
    return marks_of(expected.study, expected.cohort)
