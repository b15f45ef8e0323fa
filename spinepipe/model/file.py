"""The model file: one YAML per study with the effects, their scope and their parameter values.

Geometry, masses and loads stay in the cohort.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from spinepipe.documents.names import ALLOWED, distinct, name_fault
from spinepipe.documents.settings import validate
from spinepipe.documents.text import NUMBER
from spinepipe.documents.yaml_text import YamlDocument, read_yaml
from spinepipe.effects import Effect, create
from spinepipe.effects.contract import Array
from spinepipe.marks import write_marked
from spinepipe.model.spine import ScopedEffect
from spinepipe.problems import InputError, InputProblem

_FORM = ConfigDict(extra="forbid", frozen=True)


_Names = Annotated[tuple[str, ...], AfterValidator(distinct)]


class Scope(BaseModel):
    """Where an effect acts; ``*`` stands for all."""

    model_config = _FORM

    specimens: _Names = Field(default=("*",), description="specimens it acts in")
    joints: _Names = Field(default=("*",), description="joints it acts on")
    tests: _Names = Field(default=("*",), description="tests it acts in")


class Values(BaseModel):
    """Parameter values for a specimen and joint; the last row that fits a joint counts."""

    model_config = ConfigDict(extra="allow", frozen=True)

    specimen: str = Field(default="*", description="specimen, or * for all")
    joint: str = Field(default="*", description="joint, or * for all")

    @model_validator(mode="before")
    @classmethod
    def _numbers(cls, data: Any) -> Any:
        """Numbers in quotes count as numbers, decimal ones."""
        if not isinstance(data, dict):
            return data
        found = dict(data)
        for key in data.keys() - cls.model_fields.keys():
            if isinstance(data[key], str) and NUMBER.fullmatch(data[key]):
                found[key] = float(data[key])
        return found

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameter name to value, SI."""
        return dict(self.model_extra or {})


class EffectEntry(BaseModel):
    """One effect of the model."""

    model_config = _FORM

    effect: str = Field(description="name of the effect in the registry")
    options: dict[str, Any] = Field(default_factory=dict, description="variants of the effect")
    scope: Scope = Field(default_factory=Scope, description="where it acts")
    values: tuple[Values, ...] = Field(default=(), description="parameters; defaults otherwise")


class ModelFile(BaseModel):
    """A model: the cohort it belongs to and the effects at work."""

    model_config = _FORM

    model: str = Field(min_length=1, description="name of the model, of letters as all names")
    cohort: str = Field(min_length=1, description="cohort the model was made for")
    effects: tuple[EffectEntry, ...] = Field(min_length=1, description="effects, in order")


def write_model(model: ModelFile, path: str | Path, digest: str = "") -> None:
    """Write a model file, a result of a study with its digest; it appears whole or not at all."""
    text = yaml.safe_dump(model.model_dump(mode="json"), sort_keys=False, allow_unicode=True)
    write_marked(text, path, digest)


def read_model(path: str | Path) -> ModelFile:
    """Read a model file and check it against the registry of effects.

    Raises
    ------
    InputError
        With all problems at once.
    """
    name = str(path)
    document, problems = read_yaml(Path(path), name)
    if document is None:
        raise InputError(problems)
    model, faults = validate(ModelFile, document)
    if problems or model is None:
        raise InputError([*problems, *faults])
    if (fault := name_fault(model.model)) is not None:
        place = (name, document.line_of("model"), "model")
        problems.append(InputProblem(*place, fault, ALLOWED, "rename the model"))
    problems += [
        p for number, entry in enumerate(model.effects) for p in _check(document, number, entry)
    ]
    if problems:
        raise InputError(problems)
    return model


def _check(document: YamlDocument, number: int, entry: EffectEntry) -> list[InputProblem]:
    """Unknown effects, options and parameters, and values out of bounds."""
    place = f"effects.{number}"
    file, line = document.file, document.line_of(place)
    try:
        effect = create(entry.effect, entry.options)
    except (TypeError, ValueError, ArithmeticError, LookupError) as error:
        return [InputProblem(file, line, place, entry.effect, str(error), "correct it")]
    declared = {parameter.name: parameter for parameter in effect.parameters}
    problems = []
    for index, row in enumerate(entry.values):
        for name, value in row.parameters.items():
            where = f"{place}.values.{name}"
            line = document.line_of(f"{place}.values.{index}.{name}")
            if name not in declared:
                allowed = ", ".join(declared)
                problems.append(InputProblem(file, line, where, name, allowed, "rename it"))
            elif not _within(value, declared[name].low, declared[name].high):
                p = declared[name]
                allowed = f"{p.low:.3g} to {p.high:.3g} {p.unit}"
                problems.append(InputProblem(file, line, where, repr(value), allowed, "correct it"))
    return problems


def _within(value: Any, low: float, high: float) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and bool(low <= value <= high)


def effects_for(
    model: ModelFile, specimen: str, joints: Sequence[str], left_out: bool = False
) -> tuple[ScopedEffect, ...]:
    """The effects of a model file that act on a specimen with these joints.

    Parameters
    ----------
    specimen : its name; ``*`` for one that the file does not name.
    left_out : whether values for all specimens (``*``) count before those for this specimen, which
        then stand only where the file has no others.

    Raises
    ------
    InputError
        For joints in a scope or in values that the specimen does not have, and for values per
        joint of an effect that has one set for all.
    """
    problems = [p for n, entry in enumerate(model.effects) for p in _strangers(n, entry, joints)]
    if problems:
        raise InputError(problems)
    scoped = []
    for entry in model.effects:
        if entry.scope.specimens == ("*",) or specimen in entry.scope.specimens:
            effect = create(entry.effect, entry.options)
            chosen = tuple(
                index
                for index, joint in enumerate(joints)
                if entry.scope.joints == ("*",) or joint in entry.scope.joints
            )
            values = _values(entry, effect, specimen, [joints[index] for index in chosen], left_out)
            scoped.append(ScopedEffect(effect, chosen, values, entry.scope.tests))
    return tuple(scoped)


def _strangers(number: int, entry: EffectEntry, joints: Sequence[str]) -> list[InputProblem]:
    """Joints that the specimen does not have or that the effect cannot tell apart."""
    file, allowed = "model file", f"*, {', '.join(joints)}"
    named = [("scope.joints", joint) for joint in entry.scope.joints]
    named += [("values.joint", row.joint) for row in entry.values]
    problems = [
        InputProblem(file, None, f"effects.{number}.{place}", joint, allowed, "correct the joint")
        for place, joint in named
        if joint != "*" and joint not in joints
    ]
    if not create(entry.effect, entry.options).per_joint:
        problems += [
            InputProblem(
                file, None, f"effects.{number}.values.joint", row.joint, "*", "one set for all"
            )
            for row in entry.values
            if row.joint != "*"
        ]
    return problems


def _values(
    entry: EffectEntry, effect: Effect, specimen: str, joints: Sequence[str], left_out: bool
) -> Array:
    """(R, P) values of the joints in scope; one row for effects that are not per joint."""
    names = [parameter.name for parameter in effect.parameters]
    rows = joints if effect.per_joint else ["*"]
    values = np.tile([parameter.in_a_file for parameter in effect.parameters], (len(rows), 1))
    given = entry.values
    if left_out:  # the last row that fits counts
        given = tuple(sorted(given, key=lambda row: row.specimen == "*"))
    for row in given:
        if row.specimen in ("*", specimen):
            for index, joint in enumerate(rows):
                if row.joint in ("*", joint):
                    for name, value in row.parameters.items():
                        values[index, names.index(name)] = value
    return values
