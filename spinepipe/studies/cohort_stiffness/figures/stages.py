"""What the map of errors compares: published, fitted and predicted stiffness."""

from dataclasses import dataclass

import pandas as pd

from spinepipe.report.cohort.named import NAME
from spinepipe.report.stage_errors import joint_label_of
from spinepipe.studies.fitted_to import NOTHING

MANY_SPECIMENS = 16
"""With more of them only three stages have room."""

_BY_WHOM = {
    "fitted": "fitted to this specimen",
    "left_out_specimen": "from the other specimens",
}
_ALL = (
    ("literature", "literature"),
    ("per_specimen", "fitted"),
    ("per_joint", "fitted"),
    ("per_joint", "left_out_specimen"),
    ("partially_pooled", "left_out_specimen"),
)
_FEW = (
    ("literature", "literature"),
    ("per_joint", "fitted"),
    ("partially_pooled", "left_out_specimen"),
)
_INSTEAD = ("partially_pooled", "per_joint", "per_specimen", "level_ratio")


@dataclass(frozen=True, eq=False)
class Stage:
    """One line of panels: what it is called and its rows of the table ``errors``."""

    title: str
    rows: pd.DataFrame


def stages(loaded: pd.DataFrame, specimens: int) -> list[Stage]:
    """Stages that the study has, from published to predicted; another where one is absent.

    Parameters
    ----------
    loaded : rows of ``errors`` in the loaded coordinate, at least one.
    """
    label = joint_label_of(loaded)
    chosen = loaded[loaded["fitted_to"].isin([label, NOTHING])]
    wanted = list(_FEW if specimens > MANY_SPECIMENS else _ALL)
    for stage in ("fitted", "left_out_specimen"):
        there = set(chosen.loc[chosen["stage"] == stage, "representation"])
        if not any(name in there and at == stage for name, at in wanted):
            wanted += [(name, stage) for name in _INSTEAD if name in there][:1]
    found = [
        Stage(_title(name, stage), rows)
        for name, stage in wanted
        if len(rows := chosen[(chosen["representation"] == name) & (chosen["stage"] == stage)])
    ]
    return found


def _title(representation: str, stage: str) -> str:
    name = NAME[representation]
    words = name if stage == "literature" else f"{name}, {_BY_WHOM[stage]}"
    return words[:1].upper() + words[1:]
