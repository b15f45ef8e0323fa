"""Representations of stiffness: each way of describing it is one entry of `EVERY`, and only that.

What studies may ask for, how it is fitted, and how tables, figures and findings speak of it and
order it, all follow from the entries.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

EACH_JOINT: Literal["per_joint"] = "per_joint"
"""Grouping of unknowns that each joint has for itself, as in `free_parameters`."""


@dataclass(frozen=True)
class Representation:
    """One way of describing the stiffness of a spine's joints.

    Attributes
    ----------
    name : in study files, tables and folders of results.
    words : in figures and findings.
    sentence : in claims about what it predicts.
    by_level : whether it starts from the published values of each level, else from one for all.
    grouping : which joints share an unknown, as in `free_parameters`; None where it is published
        and nothing is fitted.
    pooled : whether it is fitted to all specimens at once.
    stiffens : whether resistance grows as the joint moves, by an unknown beside each stiffness.
        Studies ask for such a one by name.
    without_nuisances : the representation that it is with errors of joint centres and axes fitted
        beside; empty for one that takes these as stated. Studies ask for such a one by name.
    beats : those that it is claimed to be better than on held-out motion.
    """

    name: str
    words: str
    sentence: str
    by_level: bool = False
    grouping: Literal["per_specimen", "per_joint"] | None = None
    pooled: bool = False
    stiffens: bool = False
    without_nuisances: str = ""
    beats: tuple[str, ...] = ()


def _with_nuisances(one: Representation) -> Representation:
    """The same with errors of joint centres and axes fitted beside."""
    beside = "with errors of centres and axes"
    return replace(
        one,
        name=f"{one.name}_nuisance",
        words=f"{one.words}, centres and axes too",
        sentence=f"{one.sentence} {beside} fitted beside",
        without_nuisances=one.name,
        beats=(one.name,),
    )


_STATED = (
    Representation(
        "literature",
        words="published, one value",
        sentence="published stiffness",
    ),
    Representation(
        "literature_levels",
        words="published, level by level",
        sentence="published stiffness of the levels",
        by_level=True,
    ),
    Representation(
        "per_specimen",
        words="one value per specimen",
        sentence="one stiffness for all joints",
        grouping="per_specimen",
    ),
    Representation(
        "level_ratio",
        words="published ratio of levels",
        sentence="the published ratio of levels",
        by_level=True,
        grouping="per_specimen",
    ),
    Representation(
        "per_joint",
        words="each joint its own",
        sentence="a stiffness for each joint",
        grouping="per_joint",
        beats=("per_specimen", "level_ratio"),
    ),
    Representation(
        "partially_pooled",
        words="partially pooled",
        sentence="partially pooled stiffness",
        grouping="per_joint",
        pooled=True,
        beats=("per_specimen", "level_ratio", "per_joint"),
    ),
    Representation(
        "stiffening",
        words="one value per specimen, stiffening",
        sentence="one stiffening law for all joints",
        grouping="per_specimen",
        stiffens=True,
        beats=("per_specimen",),
    ),
    Representation(
        "per_joint_stiffening",
        words="each joint its own, stiffening",
        sentence="a stiffening law for each joint",
        grouping="per_joint",
        stiffens=True,
        beats=("per_joint",),
    ),
    Representation(
        "pooled_stiffening",
        words="partially pooled, stiffening",
        sentence="partially pooled stiffening laws",
        grouping="per_joint",
        pooled=True,
        stiffens=True,
        beats=("partially_pooled", "per_joint_stiffening"),
    ),
)
"""Those that take joint centres and axes as stated."""

EVERY = (
    *_STATED,
    *(_with_nuisances(one) for one in _STATED if one.grouping and not (one.pooled or one.stiffens)),
)
"""All of them, from what is taken as published to what is free in each joint; linear ones first."""

_NAMED = {one.name: one for one in EVERY}

NAMES = tuple(_NAMED)
"""Their names, in that order."""

IN_WORDS = {one.name: one.words for one in EVERY}
"""What figures and findings call them."""

PUBLISHED = tuple(one.name for one in EVERY if one.grouping is None)
"""Those that are not fitted: one value for all joints first."""

FITTED = tuple(one.name for one in EVERY if one.grouping is not None)
"""Those that are fitted, among which studies choose."""

NUISANCE = tuple(name for name in FITTED if _NAMED[name].without_nuisances)
"""Those with errors of joint centres and axes fitted beside."""

ASKED_FOR = tuple(name for name in FITTED if _NAMED[name].stiffens or name in NUISANCE)
"""Those that are fitted only where a study asks for them."""

UNLESS_ASKED = tuple(name for name in FITTED if name not in ASKED_FOR)
"""Those that are fitted where a study does not choose."""

STIFFENING_EFFECT = "nonlinear_stiffening"
"""Of these representations, beside the bushing."""

STIFFENING = tuple(name for name in FITTED if _NAMED[name].stiffens)
"""Those whose resistance grows as the joint moves."""

SHARED = tuple(one.name for one in EVERY if one.grouping == "per_specimen")
"""Those of which all joints of a specimen share an unknown."""

OF_JOINTS = tuple(one.name for one in EVERY if one.grouping == "per_joint")
"""Those with an unknown for each joint."""

POOLED = tuple(one.name for one in EVERY if one.pooled)
"""Those that are fitted to all specimens at once; the linear one first."""


def named(name: str) -> Representation:
    """The representation of that name."""
    return _NAMED[name]


def start_of(name: str) -> str:
    """The published set that a representation starts from."""
    return next(one for one in PUBLISHED if named(one).by_level == named(name).by_level)


def finest(names: Iterable[str]) -> str | None:
    """Of some fitted specimen by specimen, the one with most unknowns; None where there is none.

    Of those that take joint centres and axes as stated.
    """
    known = set(names) - {*POOLED, *NUISANCE}
    return next((name for name in (*OF_JOINTS, *SHARED) if name in known), None)
