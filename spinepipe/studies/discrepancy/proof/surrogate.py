"""A surrogate without physics: the base, and a ridge on the generic basis."""

from dataclasses import replace

import numpy as np

from spinepipe.discrepancy.generic import generic_columns
from spinepipe.discrepancy.grounds import Grounds
from spinepipe.discrepancy.proof.tangent import LinearModel, tangent
from spinepipe.units import COORDINATES


def surrogate(grounds: Grounds, nuisance_size: float) -> LinearModel:
    """The base to first order, with generic terms that are the same in all specimens.

    A term's strength is that of all joints together plus a part of each joint's own, both with
    prior SD one in units of the term's size.

    Raises
    ------
    NoEquilibrium
        When a load step has no stable pose.
    """
    base = tangent(grounds, nuisance_size)
    known = len(base.mean)
    read = np.any([used.any(axis=(0, 1)) for w in grounds.plain.values() for used in w.used], 0)
    coordinates = [name for name, there in zip(COORDINATES, read, strict=True) if there]
    members, added = {}, 0
    for name, one in base.members.items():
        model, cases = grounds.fit.models[name], grounds.readings[name].cases
        found = generic_columns(model, cases, grounds.noise.zeroed, coordinates)
        keys = [(t.family, t.coordinate, t.number) for t in found.terms]
        order = {key: number for number, key in enumerate(dict.fromkeys(keys))}
        together = np.zeros((len(keys), len(order)))
        together[np.arange(len(keys)), [order[key] for key in keys]] = 1.0
        onto = np.hstack([np.eye(len(keys)), together])
        added = onto.shape[1]
        columns = tuple(
            np.concatenate([by_x, moved @ onto], axis=-1)
            for by_x, moved in zip(one.by_x, found.moved, strict=True)
        )
        numbers = np.concatenate([one.numbers, known + np.arange(added)])
        members[name] = replace(one, by_x=columns, numbers=numbers)
    free = np.full(added, np.inf)
    return LinearModel(
        members,
        np.concatenate([base.mean, np.zeros(added)]),
        np.concatenate([base.sd, np.ones(added)]),
        np.concatenate([base.low, -free]),
        np.concatenate([base.high, free]),
    )
