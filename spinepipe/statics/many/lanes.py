"""Effects on many joints at once: laws, geometry and measurement of all lanes as long lists.

A lane is one chain under one set of loads. A law takes arrays over joints; here these are the
joints of all lanes that have it. Laws act in the order of each model's effects.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from spinepipe.effects import Effect, Kind
from spinepipe.effects.contract import AcrossJoints, Array, Indices
from spinepipe.effects.dead_load import DeadLoad
from spinepipe.model import SpineModel
from spinepipe.statics.sensitivity import FreeParameter


@dataclass(frozen=True, eq=False)
class Acting:
    """An effect with the joints of the runs it acts on.

    Attributes
    ----------
    place : in each model's effects. owner : (V,) model of each row of values.
    run, joint, row : (K,) of each place: the run, its joint, and the row of its values; by run.
    values : (V, P) of all models one after the other.
    first : (R + 1,) number of places before each run.
    """

    effect: Effect
    place: int
    owner: Indices
    run: Indices
    joint: Indices
    row: Indices
    values: Array
    first: Indices

    def with_models(self, models: Sequence[SpineModel]) -> "Acting":
        """The same with the values of these models."""
        owners = np.unique(self.owner).tolist()
        found = [models[owner].effects[self.place].values for owner in owners]
        return replace(self, values=np.concatenate(found))

    def on(self, runs: Indices) -> tuple[Indices, Indices]:
        """Its places on lanes of these runs (N,), lane by lane: (K',) places and their lanes."""
        count = self.first[runs + 1] - self.first[runs]
        lanes = np.repeat(np.arange(len(runs)), count)
        ends = np.cumsum(count)
        within = np.arange(len(lanes)) - np.repeat(ends - count, count)
        return np.repeat(self.first[runs], count) + within, lanes

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
        for one in acting(models, runs):
            groups[_group(one.effect)].append(one)
        return cls(**{name: tuple(group) for name, group in groups.items()})

    def with_models(self, models: Sequence[SpineModel]) -> "Effects":
        """The same with the values of these models."""
        return self._each(lambda one: one.with_models(models))

    def with_values(self, values: Sequence[Array]) -> "Effects":
        """The same with values (M, R, P) of each effect, for models with the same effects."""
        return self._each(lambda one: replace(one, values=np.concatenate(values[one.place])))

    def _each(self, change: Callable[[Acting], Acting]) -> "Effects":
        groups = {f.name: tuple(map(change, getattr(self, f.name))) for f in fields(self)}
        return Effects(**groups)


def _group(effect: Effect) -> str:
    match effect.kind:
        case Kind.GEOMETRY:
            return "geometry"
        case Kind.MEASUREMENT:
            return "measurement"
        case Kind.LOAD:
            if isinstance(effect, DeadLoad):
                return "dead"
            return "cables" if isinstance(effect, AcrossJoints) else "others"
        case _:
            return "laws"


def acting(models: Sequence[SpineModel], runs: Sequence[tuple[int, str]]) -> Iterator[Acting]:
    """The effects of M models in R runs, each a model's number and its test; in their order.

    At one place models may have different effects, or the same with different options.
    """
    most = max((len(model.effects) for model in models), default=0)
    for place in range(most):
        groups: dict[Effect, list[int]] = {}
        for number, model in enumerate(models):
            if place < len(model.effects):
                groups.setdefault(model.effects[place].effect, []).append(number)
        for effect, members in groups.items():
            yield _one(models, runs, effect, place, members)


def _one(
    models: Sequence[SpineModel],
    runs: Sequence[tuple[int, str]],
    effect: Effect,
    place: int,
    members: Sequence[int],
) -> Acting:
    before: dict[int, int] = {}
    owner: list[int] = []
    for number in members:
        before[number] = len(owner)
        owner += [number] * len(models[number].effects[place].values)
    found: list[tuple[int, int, int]] = []
    first = [0]
    for run, (number, test) in enumerate(runs):
        if number in before:
            scoped = models[number].effects[place]
            if scoped.in_scope(test):
                found += [
                    (run, joint, before[number] + (k if effect.per_joint else 0))
                    for k, joint in enumerate(scoped.joints)
                ]
        first.append(len(found))
    run_of, joint_of, row_of = np.array(found, dtype=np.int64).reshape(-1, 3).T
    values = np.concatenate([models[number].effects[place].values for number in members])
    owners, firsts = np.array(owner), np.array(first)
    return Acting(effect, place, owners, run_of, joint_of, row_of, values, firsts)
