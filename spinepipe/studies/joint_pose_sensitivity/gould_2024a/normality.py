"""Which distributions the paper calls not normal: sections 3.4 and 3.5."""

from collections.abc import Callable, Iterator

from spinepipe.comparison.claim import Claim, Ours
from spinepipe.comparison.paper import FITTED, JOINTS, P_BELOW
from spinepipe.comparison.ranges import Range
from spinepipe.comparison.run import NotComputed, Run
from spinepipe.comparison.tested import tested
from spinepipe.units import ROTATIONS, TRANSLATIONS

_AT_LEAST_ONE = "the paper rejects normality without saying of which quantities: one at least"

ERRORS = tuple(f"{name}_error" for name in FITTED)
FRAMES = (
    *(f"{joint}_{name}_origin" for joint in JOINTS for name in TRANSLATIONS),
    *(f"{joint}_{name}_orientation" for joint in JOINTS for name in ROTATIONS),
)


def claims() -> Iterator[Claim]:
    """Number of rejected distributions."""
    for key, where, words, responses in (
        ("errors", "section 3.4", "errors", ERRORS),
        ("joint_frames", "section 3.5", "coordinates of joint frames, reduced dataset", FRAMES),
    ):
        yield Claim(
            f"normality.{key}", where, f"{words} that are not normal (chi-squared)", "count", None,
            Range(1.0, None, _AT_LEAST_ONE), _rejected(responses),
            "the same test finds no departure from a normal distribution in this run",
        )  # fmt: skip


def _rejected(responses: tuple[str, ...]) -> Callable[[Run], Ours]:
    def ours(run: Run) -> Ours:
        rows = tested(run, "chi", family="normality")
        rows = rows[rows["response"].isin(responses)]
        if rows.empty:
            raise NotComputed("no such distribution was tested")
        rejected = int((rows["p"] < P_BELOW).sum())
        return Ours(float(rejected), note=f"ours: {rejected} of {len(rows)} tested, uncorrected")

    return ours
