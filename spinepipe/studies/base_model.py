"""The model file whose effects act in every model of a study, besides the bushings it fits."""

from pathlib import Path

from pydantic import BaseModel, Field

from spinepipe.effects.contract import Array
from spinepipe.model import ScopedEffect
from spinepipe.model.file import ModelFile, effects_for
from spinepipe.studies.parts import FORM
from spinepipe.studies.study import STUDIES

__all__ = ["BUSHING", "Base", "beside_bushings", "made_by", "own_values"]

BUSHING = "linear_bushing"
"""The effect that studies of stiffness bring themselves."""

RESULTS = "results"


class Base(BaseModel):
    """What acts in every model besides the bushings."""

    model_config = FORM

    model: str = Field(
        min_length=1,
        description="a model file, relative to the Snakefile or absolute: its effects other than "
        "linear_bushing act in every model; may be a result of another study",
    )

    def path(self, root: Path) -> Path:
        """The model file; ``root`` is the folder of the Snakefile."""
        return root / self.model  # an absolute path replaces the root


def made_by(path: Path, root: Path) -> str | None:
    """The study of this project of which a file is a result, or None.

    Such a file may be missing until the study has run.
    """
    if not path.is_relative_to(root):
        return None
    folder, *below = path.relative_to(root).parts
    if folder != RESULTS or len(below) < 2:
        return None
    return below[0] if (root / STUDIES / f"{below[0]}.yaml").is_file() else None


def beside_bushings(
    model: ModelFile, specimen: str, joints: tuple[str, ...], left_out: bool = False
) -> tuple[ScopedEffect, ...]:
    """The effects of a model file that act on a specimen besides bushings, see `effects_for`."""
    found = effects_for(model, specimen, joints, left_out)
    return tuple(scoped for scoped in found if scoped.effect.name != BUSHING)


def own_values(model: ModelFile, specimen: str, joints: tuple[str, ...]) -> bool:
    """Whether a left-out specimen is predicted with what the file says of it alone."""
    told = beside_bushings(model, specimen, joints, left_out=True)
    return _numbers(told) != _numbers(beside_bushings(model, "*", joints))


def _numbers(effects: tuple[ScopedEffect, ...]) -> list[tuple[str, tuple[int, ...], Array]]:
    return [(one.effect.name, one.joints, one.values.tolist()) for one in effects]
