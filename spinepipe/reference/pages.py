"""The generated list of effects: an overview, and each as it declares itself."""

import inspect
import sys
from collections.abc import Iterator, Mapping
from dataclasses import fields
from math import inf
from typing import Any

from spinepipe.effects import Effect, Parameter, Trial, create, registered
from spinepipe.report.markdown import code, table

_HEAD = ("parameter", "unit", "bounds", "off", "default", "prior SD", "meaning")


def effects() -> str:
    """All registered effects with options, parameters, and how a search tries them."""
    every = sorted(registered().items())
    rows = [(f"[{code(name)}](#{name})", create(name).kind, _about(cls)) for name, cls in every]
    return "\n\n".join(
        [
            table(("effect", "kind", "what it is"), rows),
            *(_effect(name, cls) for name, cls in every),
        ]
    )


def _about(cls: type) -> str:
    """The first line of the effect's file, without its name."""
    first = (sys.modules[cls.__module__].__doc__ or "").strip().split("\n")[0]
    return first.partition(": ")[2].rstrip(".") or first


def _effect(name: str, cls: type) -> str:
    effect = create(name)
    scope = "for each joint" if effect.per_joint else "once for the whole model"
    trial: Trial | None = getattr(cls, "trial", None)
    parts = [
        f"### {code(name)}",
        f"Kind: {effect.kind}; parameters {scope}.",
        _law(cls),
        _options(cls, trial),
        _parameters(name, effect, trial),
        _search(trial),
    ]
    return "\n\n".join(part for part in parts if part)


def _law(cls: type) -> str:
    """The law as its class says it; options are listed apart."""
    words = inspect.cleandoc(cls.__doc__ or "").split("\n\n")
    return "\n\n".join(part for part in words if not part.startswith("Options:"))


def _options(cls: type, trial: Trial | None) -> str:
    """Each option with its default and what a search tries."""
    told = []
    for field in fields(cls):
        tried = _tried(trial, field.name)
        others = f" (a search tries {', '.join(map(_typed, tried))})" if len(tried) > 1 else ""
        told.append(f"{code(field.name)}, by default {_typed(field.default)}{others}")
    return f"Options: {'; '.join(told)}." if told else ""


def _tried(trial: Trial | None, option: str) -> list[Any]:
    """The values of an option among the variants, each once."""
    variants = trial.variants if trial else ()
    return list(dict.fromkeys(one[option] for one in variants if option in one))


def _typed(value: Any) -> str:
    """A value as a model file has it."""
    return code(f"[{', '.join(value)}]" if isinstance(value, tuple) else str(value))


def _parameters(name: str, effect: Effect, trial: Trial | None) -> str:
    """Parameters with the default options, then those that other options have instead."""
    own = effect.parameters
    if not own:
        return "No parameters."
    rows, differing = [_row(one, "") for one in own], []
    for options, parameters in _other_options(name, trial):
        known = {one.name: one for one in own}
        rows += [_row(one, options) for one in parameters if one.name not in known]
        if any(_size(one) != _size(known.get(one.name, one)) for one in parameters):
            differing.append(options.partition(":")[0])
    listed = table(_HEAD, rows)
    if differing:
        keys = " and ".join(map(code, dict.fromkeys(differing)))
        listed += f"\n\nSizes are those of the default options; with another {keys} they differ."
    return listed


def _other_options(name: str, trial: Trial | None) -> Iterator[tuple[str, tuple[Parameter, ...]]]:
    """Parameters with one option at a time away from its default, among those that are tried."""
    effect_class = registered()[name]
    for field in fields(effect_class):
        for value in _tried(trial, field.name):
            if value != field.default:
                options: Mapping[str, Any] = {field.name: value}
                yield f"{field.name}: {value}", create(name, options).parameters


def _size(one: Parameter) -> tuple[float, ...]:
    return one.low, one.high, one.default, one.prior_scale


def _row(one: Parameter, options: str) -> tuple[str, ...]:
    bounds = f"{_number(one.low)} to {_number(one.high)}"
    prior = f"{one.prior_scale:g}" + (" (of the logarithm)" if one.logarithmic else "")
    off = "" if one.off is None else f"{one.off:g}"
    name = f"{code(one.name)}, with {code(options)}" if options else code(one.name)
    return name, one.unit, bounds, off, f"{one.default:.6g}", prior, one.meaning


def _number(value: float) -> str:
    return "no limit" if abs(value) == inf else f"{value:.6g}"


def _search(trial: Trial | None) -> str:
    """How its values may differ in a search, and what test shows it."""
    if trial is None:
        return "A search for missing effects does not try it."
    spreads = ", ".join(trial.spreads)
    return f"In a search its values may be: {spreads}. What shows it: {trial.told_by}."
