"""One test over many cases: all that fail are told, and none is a test of its own."""

import inspect
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from typing import Any

import pytest

PARAM = type(pytest.param())


def sweep(
    names: str,
    cases: Iterable[Any] | Callable[[], Iterable[Any]],
    title: Callable[..., Any] = reprlib.repr,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """As `pytest.mark.parametrize`, in one test; cases made by a function are made when it runs.

    A case that is skipped leaves the others to run, and the test counts as skipped if none fails.
    Fixtures are those of the one test, but each case has a `tmp_path` of its own: a test that
    changes what another fixture gave is no sweep.
    """
    arguments = names.replace(" ", "").split(",")

    def decorate(function: Callable[..., None]) -> Callable[..., None]:
        @wraps(function)
        def swept(*args: Any, **fixtures: Any) -> None:
            failed, skipped, count, folder = [], set(), 0, fixtures.get("tmp_path")
            for count, case in enumerate(cases() if callable(cases) else cases, start=1):
                values = case if len(arguments) > 1 else (case,)
                name = None
                if isinstance(case, PARAM):
                    assert not case.marks, "marks are of tests: parametrize, as here all cases run"
                    values, name = case.values, case.id
                if folder is not None:
                    fixtures["tmp_path"] = folder / str(count)
                    fixtures["tmp_path"].mkdir()
                try:
                    function(*args, **fixtures, **dict(zip(arguments, values, strict=True)))
                except pytest.skip.Exception as lacking:
                    skipped.add(str(lacking))
                except Exception as fault:
                    name = name or ", ".join(map(str, map(title, values)))
                    fault.add_note(f"case {count}: {name}")
                    failed.append(fault)
            assert count, "no cases"
            if failed:
                raise ExceptionGroup(f"{len(failed)} of {count} cases fail", failed)
            if skipped:
                pytest.skip("; ".join(sorted(skipped)))

        given = inspect.signature(function)
        left = [one for one in given.parameters.values() if one.name not in arguments]
        swept.__signature__ = given.replace(parameters=left)  # type: ignore[attr-defined]
        return swept

    return decorate


PLACES = ("coordinate", "side", "neighbour", "pair")
"""Options that say where an effect acts, and not how."""


def one_of_each(
    variants: Sequence[Any], name_and_options: Callable[[Any], tuple[str, Mapping[str, Any]]]
) -> list[Any]:
    """One variant of each form of each effect, at places that differ from form to form."""
    forms: dict[tuple[Any, ...], list[Any]] = {}
    for variant in variants:
        name, options = name_and_options(variant)
        form = sorted((key, str(o)) for key, o in options.items() if key not in PLACES)
        forms.setdefault((name, *form), []).append(variant)
    return [places[(5 * n) % len(places)] for n, places in enumerate(forms.values())]
