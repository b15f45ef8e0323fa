"""What figures and findings call representations, load cases and sources."""

NAME = {
    "literature": "published, one value",
    "literature_levels": "published, level by level",
    "per_specimen": "one value per specimen",
    "level_ratio": "published ratio of levels",
    "per_joint": "each joint its own",
    "partially_pooled": "partially pooled",
}
"""Representations of stiffness in words."""

_LONGEST = 22


def case(test: str) -> str:
    """A load case in words: ``left_axial_rotation`` is ``Left axial rotation``."""
    words = test.replace("_", " ").strip()
    return words[:1].upper() + words[1:]


def short(name: str, longest: int = _LONGEST) -> str:
    """A name that fits beside an axis; the middle of a longer one is left out."""
    if len(name) <= longest:
        return name
    tail = longest // 2
    return f"{name[: longest - 1 - tail]}…{name[-tail:]}"


def listed(names: tuple[str, ...], most: int) -> str:
    """The first names, and how many more there are."""
    shown = ", ".join(short(name) for name in names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
