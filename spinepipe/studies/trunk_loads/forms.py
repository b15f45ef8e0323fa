"""What a user writes down of what persons hold: `tasks.csv`.

Rotations are those of bodies in ground, extension, right bending and left rotation positive, so a
bend forwards by 50 deg is -50. They are counted from the subject's upright posture or from the
pose in which the source of the geometry gives it. Moments and forces from outside are written as
they act on the trunk: who pulls backwards with 242 N m is held by -242 N m.
"""

from typing import get_args

from spinepipe.cohort.columns import Column, TableForm
from spinepipe.muscles.task import Tone
from spinepipe.muscles.trunk import BODIES
from spinepipe.units import ROTATIONS, TRANSLATIONS

UPRIGHT, SOURCE = "upright", "source"
FORCE, MOMENT = "force", "moment"

WORDS: dict[str, tuple[str, ...]] = {
    "counted_from": (UPRIGHT, SOURCE),
    "holding": ("both", "right", "left"),
    "applied_as": (MOMENT, FORCE),
    "tone": get_args(Tone),
}
"""Columns of tasks that hold one of a few words; an empty cell stands for the first."""

PUSHED_AT = tuple(f"T{number}" for number in range(1, 12))
"""Vertebrae at which something may push: those of the thorax."""

WAYS = {
    "extension": "backwards",
    "right_bending": "to the right",
    "left_rotation": "turned to the left",
}
FARTHEST_DEG = 130.0


def turn(what: str, axis: str) -> str:
    """Column of the rotation of a body, or of trunk or pelvis, about an axis."""
    return f"{what}_{axis}_deg"


def _turns(what: str, meaning: str) -> tuple[Column, ...]:
    return tuple(
        Column(turn(what, axis), f"{meaning}, {WAYS[axis]}", low=-FARTHEST_DEG, high=FARTHEST_DEG)
        for axis in ROTATIONS
    )


HANDS = tuple(f"hands_{way}_mm" for way in TRANSLATIONS)
PUSH_N = tuple(f"push_{way}_n" for way in TRANSLATIONS)
PUSH_NM = tuple(f"push_{axis}_nm" for axis in ROTATIONS)

TASKS = TableForm(
    "tasks",
    "task",
    (
        Column("task", "name of the task", "text", required=True),
        Column("number", "of Ghezelbash 2016 Table 1; empty: none", "integer", low=1, high=12),
        Column("counted_from", "rotations from upright or source; empty: upright", "text"),
        *_turns("trunk", "rotation of the trunk"),
        *_turns("pelvis", "rotation of the pelvis; empty: as usual with the trunk's"),
        *(
            column
            for body in reversed(BODIES)
            for column in _turns(body, f"rotation of {body}; all bodies or none")
        ),
        Column("hand_load_kg", "load in the hands; empty: none", low=0),
        *(
            Column(
                name, f"load from the centre of L5S1, {way}; empty: hands hang", low=-3e3, high=3e3
            )
            for name, way in zip(HANDS, ("forwards", "up", "to the right"), strict=True)
        ),
        Column("holding", "both, right or left hand; empty: both", "text"),
        *(
            Column(name, f"force on the trunk from outside, {way}", low=-5e3, high=5e3)
            for name, way in zip(PUSH_N, ("forwards", "up", "to the right"), strict=True)
        ),
        *(
            Column(name, f"moment on the trunk from outside, {WAYS[axis]}", low=-600, high=600)
            for name, axis in zip(PUSH_NM, ROTATIONS, strict=True)
        ),
        Column("applied_at", "vertebra of the thorax that is pushed, T1 to T11", "text"),
        Column("applied_as", "moment, or a force that has it about L5S1; empty: moment", "text"),
        Column("intra_abdominal_pressure_kpa", "pressure in the belly; empty: 0", low=0, high=60),
        Column("largest_stress_mpa", "largest active stress of muscles; empty: 0.6", low=0),
        Column("tone", "none, stated or stable; empty: none", "text"),
        Column("tone_percent", "least activation of all muscles, if stated", low=0, high=100),
    ),
    keys=("task",),
)
