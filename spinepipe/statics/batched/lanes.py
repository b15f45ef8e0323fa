"""Effects on many joints at once: laws, geometry and measurement of all lanes as long lists.

A lane is one chain under one set of loads. A law takes arrays over joints; here these are the
joints of all lanes that have it. Laws act in the order of each model's effects.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from spinepipe.effects import Effect, EffectKind
from spinepipe.effects.contract import AcrossJoints, Array, Indices
from spinepipe.effects.dead_load import DeadLoad
from spinepipe.model import ScopedEffect, SpineModel
from spinepipe.statics.sensitivity import FreeParameter


@dataclass(frozen=True, eq=False)
class Acting:
    """An effect with the joints of the runs it acts on.

    Attributes
    ----------
    place : in each model's effects. owner : (V,) model of each row of values.
    joint, row : (K,) of each place, run by run: its joint, and the row of its values.
    values : (V, P) of all models one after the other.
    first : (R + 1,) number of places before each run.
    """

    effect: Effect
    place: int
    owner: Indices
    joint: Indices
    row: Indices
    values: Array
    first: Indices

    def with_models(self, models: Sequence[SpineModel]) -> "Acting":
        """The same with the values of these models."""
        owners = np.unique(self.owner).tolist()
        found = [models[owner].effects[self.place].values for owner in owners]
        return replace(self, values=np.concatenate(found))

    def repeated(self, values: Array) -> "Acting":
        """One run of one model as runs of M models, each its own, with values (M, R, P)."""
        each, (rows, places) = np.arange(len(values)), (len(self.values), len(self.joint))
        return replace(
            self,
            owner=np.repeat(each, rows),
            joint=np.tile(self.joint, len(values)),
            row=(rows * each[:, None] + self.row).ravel(),
            values=values.reshape(-1, values.shape[2]),
            first=places * np.arange(len(values) + 1),
        )

    @property
    def acts(self) -> NDArray[np.bool_]:
        """(R,) in which runs it has a place."""
        return np.diff(self.first) > 0

    def on(self, runs: Indices) -> tuple[Indices, Indices]:
        """Its places on lanes of these runs (N,), lane by lane: (K',) places and their lanes."""
        count = self.first[runs + 1] - self.first[runs]
        return ranges(self.first[runs], count), np.repeat(np.arange(len(runs)), count)

    def by_unknowns(self, free: Sequence[Sequence[FreeParameter]], count: int) -> Array:
        """(V, P, m) derivative of the values by the unknowns of the model that owns each row."""
        found = np.zeros((*self.values.shape, count))
        for owner in np.unique(self.owner).tolist():
            first = int(np.searchsorted(self.owner, owner))
            for number, parameter in enumerate(free[owner]):
                if parameter.effect == self.place:
                    rows = [first + row for row in parameter.rows]
                    values = self.values[rows, parameter.column]
                    slope = values if parameter.logarithmic else 1.0
                    found[rows, parameter.column, number] = slope
        return found


@dataclass(frozen=True, eq=False)
class Effects:
    """The effects of a stack by what they are, each group in the models' order.

    Attributes
    ----------
    laws : joint laws and path laws. cables : loads across joints. dead : loads fixed in ground.
    others : load effects that take no stack.
    """

    laws: tuple[Acting, ...]
    geometry: tuple[Acting, ...]
    cables: tuple[Acting, ...]
    dead: tuple[Acting, ...]
    measurement: tuple[Acting, ...]
    others: tuple[Acting, ...]

    @classmethod
    def of(cls, models: Sequence[SpineModel], runs: Sequence[tuple[int, str]]) -> "Effects":
        """The effects of M models in R runs, each a model's number and its test."""
        groups: dict[str, list[Acting]] = {field.name: [] for field in fields(cls)}
        for one in bind_effects(models, runs):
            groups[_group(one.effect)].append(one)
        return cls(**{name: tuple(group) for name, group in groups.items()})

    def with_models(self, models: Sequence[SpineModel]) -> "Effects":
        """The same with the values of these models."""
        return self._each(lambda one: one.with_models(models))

    def repeated(self, values: Sequence[Array]) -> "Effects":
        """Of one run of one model those of M, each its own model; values (M, R, P) by effect."""
        return self._each(lambda one: one.repeated(values[one.place]))

    def _each(self, change: Callable[[Acting], Acting]) -> "Effects":
        groups = {f.name: tuple(map(change, getattr(self, f.name))) for f in fields(self)}
        return Effects(**groups)


def _group(effect: Effect) -> str:
    match effect.kind:
        case EffectKind.GEOMETRY:
            return "geometry"
        case EffectKind.MEASUREMENT:
            return "measurement"
        case EffectKind.LOAD:
            if isinstance(effect, DeadLoad):
                return "dead"
            return "cables" if isinstance(effect, AcrossJoints) else "others"
        case _:
            return "laws"


def bind_effects(models: Sequence[SpineModel], runs: Sequence[tuple[int, str]]) -> Iterator[Acting]:
    """The effects of M models in R runs, each a model's number and its test; in their order.

    At one place models may have different effects, or the same with different options.
    """
    most = max((len(model.effects) for model in models), default=0)
    for place in range(most):
        groups: dict[Effect, dict[int, ScopedEffect]] = {}
        for number, model in enumerate(models):
            if place < len(model.effects):
                scoped = model.effects[place]
                groups.setdefault(scoped.effect, {})[number] = scoped
        for effect, members in groups.items():
            yield _one(effect, place, members, runs)


def _one(
    effect: Effect, place: int, members: dict[int, ScopedEffect], runs: Sequence[tuple[int, str]]
) -> Acting:
    """An effect at one place of the models that have it, by their numbers."""
    values = [scoped.values for scoped in members.values()]
    sizes = [len(of_model) for of_model in values]
    before = dict(zip(members, np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))
    nowhere = np.zeros(0, dtype=np.int64)
    there = {number: np.array(scoped.joints, dtype=np.int64) for number, scoped in members.items()}
    joints = [
        there[number] if number in there and members[number].in_scope(test) else nowhere
        for number, test in runs
    ]
    count = np.array([len(of_run) for of_run in joints], dtype=np.int64)
    rows = np.array([before.get(number, 0) for number, _ in runs], dtype=np.int64)
    return Acting(
        effect,
        place,
        np.repeat(list(members), sizes),
        np.concatenate([nowhere, *joints]),
        ranges(rows, count) if effect.per_joint else np.repeat(rows, count),
        np.concatenate(values),
        np.concatenate([[0], np.cumsum(count)]),
    )


def ranges(first: Indices, count: Indices) -> Indices:
    """``count`` (N,) numbers that follow each other from each of ``first`` (N,)."""
    before = np.cumsum(count) - count
    return np.repeat(first - before, count) + np.arange(count.sum())
