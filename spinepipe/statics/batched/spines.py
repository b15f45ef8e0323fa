"""Many spines of one structure, and the same test of each: numbers as arrays, names once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spinepipe.effects import Wrench
from spinepipe.effects.contract import Array, Indices
from spinepipe.frames import Pose
from spinepipe.model import Body, LoadCase, SpineModel
from spinepipe.statics.batched.forward_kinematics import Chains, Loads
from spinepipe.statics.batched.lanes import Effects
from spinepipe.statics.batched.stack import Stack, chains_of, durations, supports_of, wrenches_of

_NUMBERS = ("rotations", "origins", "masses", "coms", "inertias", "damping")
"""What spines share with `Chains`, by the same names."""


@dataclass(frozen=True, eq=False)
class Spines:
    """M spines that differ in numbers alone.

    Attributes
    ----------
    like : names and effects; the arrays take the place of its numbers.
    rotations, origins : (M, J, 3, 3) and (M, J, 3) m, joint frames in ground, neutral pose.
    masses, coms, inertias : (M, J) kg, (M, J, 3) m, (M, J, 3, 3) kg m2, as of `Body`.
    damping : (M, J, 6) N s/m and N m s/rad.
    values : of each effect of ``like`` (M, R, P).
    """

    like: SpineModel
    rotations: Array
    origins: Array
    masses: Array
    coms: Array
    inertias: Array
    damping: Array
    values: tuple[Array, ...]

    def __len__(self) -> int:
        return len(self.origins)

    @classmethod
    def of(cls, model: SpineModel, count: int) -> "Spines":
        """The same spine that many times."""
        chain = chains_of([model])._asdict()
        numbers = {name: _repeated(chain[name][0], count) for name in _NUMBERS}
        values = tuple(_repeated(scoped.values, count) for scoped in model.effects)
        return cls(like=model, **numbers, values=values)

    def part(self, chosen: slice | Indices) -> "Spines":
        """Some of them."""
        numbers = {name: getattr(self, name)[chosen] for name in _NUMBERS}
        return replace(self, **numbers, values=tuple(values[chosen] for values in self.values))

    def model(self, i: int) -> SpineModel:
        """One of them as a model of its own.

        Raises
        ------
        RefusedModel
            For numbers that no solver should be given.
        """
        bodies = zip(self.like.bodies, self.masses[i], self.coms[i], self.inertias[i], strict=True)
        effects = zip(self.like.effects, self.values, strict=True)
        return replace(
            self.like,
            frames=tuple(map(Pose, self.rotations[i], self.origins[i])),
            bodies=tuple(Body(b.name, float(m), c, inertia) for b, m, c, inertia in bodies),
            damping=self.damping[i],
            effects=tuple(scoped.with_values(values[i]) for scoped, values in effects),
        )


@dataclass(frozen=True, eq=False)
class Cases:
    """One test of M spines, with the same steps and loaded vertebrae.

    Attributes
    ----------
    like : names, steps, times and bodies; the arrays take the place of its numbers.
    points, forces, moments : (M, T, W, 3) m, N and N m in ground, of each step's wrenches; where
        a step has fewer than W, the last ones are zero and nobody's.
    """

    like: LoadCase
    points: Array
    forces: Array
    moments: Array

    def __len__(self) -> int:
        return len(self.points)

    @classmethod
    def of(cls, case: LoadCase, count: int) -> "Cases":
        """The same loads that many times."""
        _, *numbers = wrenches_of(case.steps)
        points, forces, moments = (_repeated(part, count) for part in numbers)
        return cls(case, points, forces, moments)

    def part(self, chosen: slice | Indices) -> "Cases":
        """Some of them."""
        return Cases(self.like, self.points[chosen], self.forces[chosen], self.moments[chosen])

    def steps(self, chosen: Sequence[int]) -> "Cases":
        """Some of the steps, by their places."""
        like = replace(self.like, steps=tuple(self.like.steps[place] for place in chosen))
        return Cases(like, self.points[:, chosen], self.forces[:, chosen], self.moments[:, chosen])

    def case(self, i: int) -> LoadCase:
        """One of them as a load case of its own."""
        steps = []
        for row, step in enumerate(self.like.steps):
            at = (self.points[i, row], self.forces[i, row], self.moments[i, row])
            every = zip(step.wrenches, *at, strict=False)  # where a step has fewer, the rest is 0
            wrenches = tuple(Wrench(one.body, *numbers) for one, *numbers in every)
            steps.append(replace(step, wrenches=wrenches))
        return replace(self.like, steps=tuple(steps))


def stacked(spines: Spines, cases: Cases) -> Stack:
    """The same test of many spines, a run each."""
    count, steps = len(spines), len(cases.like.steps)
    like, test = spines.like, cases.like
    # copies, which may be written to: kernels are compiled for such arrays alone
    numbers = {name: np.array(getattr(spines, name), order="C") for name in _NUMBERS}
    chains = Chains(**numbers, gravity=np.array(_repeated(like.gravity, count), order="C"))
    row = np.tile(np.arange(steps), count)
    bodies = wrenches_of(test.steps)[0][row]
    points, forces, moments = (
        np.array(one, order="C").reshape(*bodies.shape, 3)
        for one in (cases.points, cases.forces, cases.moments)
    )
    supports = supports_of(test.steps, like.n_joints).part(row)
    chain = np.repeat(np.arange(count), steps)
    listed = Loads(chain, bodies, points, forces, moments, supports)
    return Stack.made(
        spines.model,
        cases.case,
        chains,
        Effects.of([like], [(0, test.test)]).repeated(spines.values),
        listed,
        np.full(count, steps),
        durations(test)[row],
    )


def _repeated(one: object, count: int) -> Array:
    """(count, ...) of the same numbers, kept once."""
    values = np.asarray(one, dtype=float)
    return np.broadcast_to(values, (count, *values.shape))
