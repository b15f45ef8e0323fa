"""Which bodies of an OpenSim model are vertebrae, what moves with them, and where, in our axes."""

import re
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

from pydantic import Field

from spinepipe.cohort.checks import check_header
from spinepipe.cohort.cohort import VertebraName
from spinepipe.documents.yaml_text import YamlDocument
from spinepipe.effects.contract import Array
from spinepipe.frames import Pose
from spinepipe.imports.imported import AxesText, CohortTitle
from spinepipe.imports.opensim_model.document import GROUND, OsimDocument
from spinepipe.motion.reading import axes_of
from spinepipe.problems import InputError, InputProblem, one_of

_BASES = ("s1", "sacrum", "pelvis")
"""Names of the body below L5: the first that there is."""

_VERTEBRA = re.compile(
    r"(l|t|c|lumbar|thoracic|cervical|lumb|thor|cerv)_?(\d{1,2})(_?(body|vert\w*))?"
)
_JOINT = re.compile(r"([SLTC]\d{1,2})([SLTC]\d{1,2})")


class OsimSettings(CohortTitle):
    """The keys of the YAML that says what is what in a model."""

    kind: Literal["opensim_model"] = Field(description="what the file is")
    file: str = Field(min_length=1, description="the .osim, relative to this YAML")
    specimen: str | None = Field(
        default=None, description="what the specimen is called; null: as the model"
    )
    vertebrae: dict[VertebraName, str] | None = Field(
        default=None,
        description="bodies that are vertebrae, such as `{S1: pelvis, L5: lumbar5}`, and no "
        "others; null: those whose names say so",
    )
    axes: AxesText = Field(
        default="x y z",
        description="what forwards, up and right are in the axes of the model, as in `x z -y` "
        "where z is up and y to the left",
    )


@dataclass(frozen=True, eq=False)
class OsimSpine:
    """The spine of a document.

    Attributes
    ----------
    bodies : by vertebra, caudal to cranial.
    turn : (3, 3) our axes in rows, those of the model in columns.
    """

    document: OsimDocument
    bodies: dict[str, str]
    turn: Array

    @classmethod
    def of(cls, document: OsimDocument, settings: OsimSettings, told: YamlDocument) -> "OsimSpine":
        """Find the vertebrae.

        Raises
        ------
        InputError
            Where there are none, or they are no chain.
        """
        chosen, placed = settings.vertebrae or _by_name(document), document.placed
        place = told.place_of("vertebrae")
        named = "name them under `vertebrae:`, such as {S1: pelvis, L5: lumbar5}"
        problems = [
            InputProblem(*place, f"'{body}'", f"a placed body: {one_of(placed)}", named)
            for body in chosen.values()
            if body not in placed
        ]
        spine = cls(document, chosen, axes_of(settings.axes))
        order = sorted(chosen, key=lambda name: len(spine.down(chosen[name])))

        def faults() -> list[InputProblem]:
            header = YamlDocument(told.file, {"vertebrae": order}, told.lines)
            return [replace(one, remedy=named) for one in check_header(header, "")]

        if not problems and (problems := faults()):
            order.reverse()  # a chain from the top down
            if not faults():
                ends = (chosen[order[0]], chosen[order[-1]])
                low, high = (spine.ground(end).origin[1] for end in ends)
                if low < high:
                    problems = []
                    document.stand_on(chosen[order[0]])
        for lower, upper in pairwise(order):
            if not problems and chosen[lower] not in spine.down(chosen[upper]):
                found, allowed = f"{upper} that does not stand on {lower}", "a chain of bodies"
                problems.append(InputProblem(*place, found, allowed, named))
        if problems:
            raise InputError(problems)
        return replace(spine, bodies={name: chosen[name] for name in order})

    def down(self, body: str) -> list[str]:
        """The body and all between it and ground."""
        way = [body]
        while way[-1] in self.document.below:
            way.append(self.document.below[way[-1]][1])
        return way

    def carrier(self, body: str) -> str | None:
        """The vertebra that a body moves with: the next below it, else the lowest."""
        if body not in self.document.placed or (body == GROUND and GROUND not in self.named):
            return None
        way = [self.named[one] for one in self.down(body) if one in self.named]
        return way[0] if way else next(iter(self.bodies))

    @cached_property
    def named(self) -> dict[str, str]:
        """Vertebrae by their bodies."""
        return {body: name for name, body in self.bodies.items()}

    def is_fixed(self, body: str) -> bool:
        """Whether nothing moves between a body and the vertebra that carries it."""
        carrier = self.carrier(body)
        between = {*self.down(body)} ^ {*self.down(self.bodies[carrier])} if carrier else ()
        return carrier is not None and not any(self.document.below[b][0].moves for b in between)

    def ground(self, body: str, pose: Pose | None = None) -> Pose:
        """Pose in ground, in our axes, of a body or of what is fixed to it."""
        at = self.document.placed[body]
        at = at if pose is None else at @ pose
        return Pose(self.turn @ at.rotation @ self.turn.T, self.turn @ at.origin)

    def joint_frame(self, vertebra: str) -> Pose:
        """Frame of the joint below a vertebra, as it is on the vertebra's side."""
        body = self.bodies[vertebra]
        joint = self.document.below[body][0]
        return self.ground(*(joint.child if joint.child[0] == body else joint.parent))


def _by_name(document: OsimDocument) -> dict[str, str]:
    """Bodies called like vertebrae, and ground where the name of a joint says which it is."""
    bodies = {body.lower(): body for body in document.placed}
    found = {
        match[1][0].upper() + match[2].lstrip("0"): bodies[name]
        for name in bodies
        if (match := _VERTEBRA.fullmatch(name))
    }
    base = next((bodies[name] for name in _BASES if name in bodies), None)
    if "L5" in found and base is not None:
        return {"S1": base, **found}
    joints = [document.below[body] for body in found.values()]
    stands = [_JOINT.fullmatch(joint.name) for joint, lower in joints if lower == GROUND]
    return found | {match[2]: GROUND for match in stands if match}
