"""What each veto and constant of the verdict is good for: off, halved and doubled, from kept fits.

What only decides is replayed: `outcome` is asked again with one thing changed, from the search, the
proof and the suspected errors of a scored cohort. `python -m tests.validation ablation` counts.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from spinepipe.studies.discrepancy.search import outcome as rule
from spinepipe.studies.discrepancy.search.search_state import SearchResult

Counts = list[int]
"""Answers that change; now right, no more right; now wrong names, no more."""

Said = tuple[str, tuple[str, ...], tuple[str, ...]]
"""Verdict, names for certain, names that cannot be told apart."""

CONSTANTS = {
    "UNEXPLAINED_SHARE": math.inf,
    "TRIFLE": 0.0,
    "GAP_LEFT": math.inf,
    "LEAST_LEFT": 0.0,
    "WORSE_SHARE": 0.0,
    "WORSE": 0.0,
    "CLOSED": 0.0,
    "ALONE": 0.0,
    "NEARLY_ALL": math.inf,
    "AS_NEAR": 0.0,
    "LEAST_THRESHOLD": 0.0,
}
"""Each with the value at which it does nothing."""

VETOES = ("_most_stays", "_imitated", "_other_shape", "_unproven")


def replays(asked: Sequence[Any]) -> dict[str, Said]:
    """Answers with one thing changed that are not the answer as it is.

    Parameters
    ----------
    asked : what `outcome` was asked: search, margin, proof, errors, what is not excluded.
    """
    as_it_is = _said(*asked)
    found = {}
    for name, change in _changes(asked):
        with change as with_it:
            said = _said(*with_it)
        if said != as_it_is:
            found[name] = said
    return found


def _said(*asked: Any) -> Said:
    ended = rule.outcome(*asked)
    return str(ended.verdict), tuple(sorted({o.name for o in ended.named})), ended.tied


def _changes(asked: Sequence[Any]) -> Iterator[tuple[str, Any]]:
    search, margin, proof, errors, not_excluded = asked
    for name, off in CONSTANTS.items():
        value = getattr(rule, name)
        for how, other in (("off", off), ("halved", value / 2.0), ("doubled", 2.0 * value)):
            yield f"{name} {how}", _set(name, other, asked)
    for veto in VETOES:
        yield f"{veto.strip('_')} off", _set(veto, _never, asked)
    for how, other in (("off", 0.0), ("halved", margin / 2.0), ("doubled", 2.0 * margin)):
        yield f"margin {how}", _set("", None, (search, other, proof, errors, not_excluded))
    yield "data errors off", _set("", None, (search, margin, proof, (), not_excluded))
    yield "not excluded off", _set("", None, (search, margin, proof, errors, {}))
    for field, sure in (("over_stiffness", None), ("rivals_known", True)):
        yield (
            f"{field} off",
            _set("", None, (_all_with(search, field, sure), margin, proof, errors, not_excluded)),
        )


def _never(*_: Any) -> None:
    """No objection."""


def _all_with(search: SearchResult, field: str, value: Any) -> SearchResult:
    from dataclasses import replace

    return replace(search, standing=tuple(replace(o, **{field: value}) for o in search.standing))


@contextmanager
def _set(name: str, value: Any, asked: Sequence[Any]) -> Iterator[Sequence[Any]]:
    """With a name of the rule standing for something else."""
    if not name:
        yield asked
        return
    before: Callable[..., Any] | float = getattr(rule, name)
    setattr(rule, name, value)
    try:
        yield asked
    finally:
        setattr(rule, name, before)


def count(rows: Sequence[dict[str, Any]]) -> dict[str, Counts]:
    """Of each change, over scored rows with replays (`row["ablation"]`)."""
    from tests.validation.discrepancy.judged import judged

    found: dict[str, Counts] = {}
    for row in rows:
        before = judged(row)
        for name, (verdict, named, tied) in row["ablation"].items():
            after = judged(row | {"verdict": verdict, "named": named, "tied": tied})
            counts = found.setdefault(name, [0, 0, 0, 0, 0])
            counts[0] += 1
            counts[1] += after.top1 and not before.top1
            counts[2] += before.top1 and not after.top1
            counts[3] += after.wrong_name and not before.wrong_name
            counts[4] += before.wrong_name and not after.wrong_name
    return dict(sorted(found.items(), key=lambda one: -one[1][0]))


def main(folder: str) -> None:
    """`python -m tests.validation.discrepancy.ablation FOLDER`: rows as `keep_one` writes them."""
    import csv
    import json
    import sys
    from pathlib import Path

    every = (json.loads(path.read_text()) for path in sorted(Path(folder).glob("*.json")))
    rows = [row for row in every if row["status"] == "scored"]
    out = csv.writer(sys.stdout, lineterminator="\n")
    out.writerow(["change", "answers", "now_right", "no_more_right", "now_wrong", "no_more_wrong"])
    out.writerows([name, *counts] for name, counts in count(rows).items())
    print(f"of {len(rows)} cohorts", file=sys.stderr)


if __name__ == "__main__":
    import sys

    main(sys.argv[1])
