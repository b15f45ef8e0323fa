"""Where a result file comes from: digests, seed and versions, for its Parquet metadata."""

import platform
from functools import cache
from importlib.metadata import version

from spinepipe.cohort import Cohort
from spinepipe.jobs.digest import code_digest, value_digest
from spinepipe.jobs.settings import relevant_settings
from spinepipe.studies import Study

_LIBRARIES = (
    *("numpy", "scipy", "pandas", "pyarrow", "pybullet", "SALib", "scikit-learn", "statsmodels"),
    *("matplotlib", "plotly", "Jinja2", "spinepipe"),
)


@cache
def versions() -> dict[str, str]:
    """Version of Python and of each library that results depend on."""
    found = {f"version_{name.lower()}": version(name) for name in _LIBRARIES}
    return {"version_python": platform.python_version(), **found}


def provenance(job: str, study: Study, cohort: Cohort) -> dict[str, str]:
    """Metadata of a file written by ``spinepipe.jobs.<job>`` for a study.

    ``config_digest`` covers the settings that the job depends on, no others.
    """
    return {
        "study": study.study,
        "kind": study.kind,
        "seed": str(getattr(study, "seed", "")),
        "cohort_digest": cohort.digest,
        "config_digest": value_digest(relevant_settings(job, study)),
        "code_digest": code_digest(f"spinepipe.jobs.{job}"),
        **versions(),
    }
