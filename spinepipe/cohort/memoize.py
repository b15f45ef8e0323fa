"""What is worked out of a cohort again and again: kept as long as the cohort, and no longer."""

from collections.abc import Callable
from functools import wraps
from typing import TypeVar, TypeVarTuple
from weakref import WeakKeyDictionary

from spinepipe.cohort.cohort import Cohort

Asked = TypeVarTuple("Asked")
Answer = TypeVar("Answer")


def kept_with_cohort(
    function: Callable[[Cohort, *Asked], Answer],
) -> Callable[[Cohort, *Asked], Answer]:
    """Keep answers by cohort object and arguments.

    A cache with a number of entries would keep that many cohorts, tables and all, in a worker that
    serves one study after the other. An answer must not hold the cohort.
    """
    kept: WeakKeyDictionary[Cohort, dict[tuple[*Asked], Answer]] = WeakKeyDictionary()

    @wraps(function)
    def answer(cohort: Cohort, *asked: *Asked) -> Answer:
        known = kept.setdefault(cohort, {})
        if asked not in known:
            known[asked] = function(cohort, *asked)
        return known[asked]

    return answer
