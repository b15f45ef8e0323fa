"""Which names people may give: letters of one alphabet, digits and a few signs.

Names become folders, headings and figures, and rows find each other by them. So two names that look
alike must be alike, and none may mean anything to a shell, a path or a formula.
"""

import re
import unicodedata
from collections import Counter
from collections.abc import Iterator
from functools import cache

LONGEST_NAME = 60
"""Characters; a path of several names stays within what systems bear (255 bytes a folder)."""

MOST_BYTES = 200
"""Of a name in UTF-8: with what stands before it in a folder's name it stays within 255."""

EVERYONE = "*"
"""In place of a name: a row is for all of them."""

SIGNS = " _-+.,:()%&*#·"
"""Signs that a name may have besides letters and digits."""

ALLOWED = (
    f"at most {LONGEST_NAME} letters of one alphabet, digits, blanks and _ - + . , : ( ) % & * # ·"
    f", {MOST_BYTES} bytes, a letter or digit first, no two dots in a row, no dot at the end"
)

FOLDER_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")

ALLOWED_FOLDER = (
    f"at most {LONGEST_NAME} letters A-Z a-z, digits, _ . - and a letter or digit first, no two "
    "dots in a row, no dot at the end"
)

RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)
"""Names that Windows keeps for devices."""

COHORT_NAME = re.compile(r"[a-z0-9_]+")
"""Names of cohorts: a study tells them from paths by their signs."""

PLAIN = re.compile(rf"[A-Za-z0-9][A-Za-z0-9 _]{{0,{LONGEST_NAME - 1}}}")
"""Names that need no closer look, but for those that Windows keeps."""

ALPHABETS = ("LATIN", "GREEK", "CYRILLIC", "ARMENIAN", "CHEROKEE", "COPTIC")
"""Those whose letters are taken for each other's (Japanese, for one, is written in three)."""

_TWINS = dict(
    zip(
        "АВЕЅІЈКМНОРСТХУаеіјорсухѕԁԛԝΑΒΕΖΗΙΚΜΝΟΡΤΥΧο",
        "ABESIJKMHOPCTXYaeijopcyxsdqwABEZHIKMNOPTYXo",
        strict=True,
    )
)
"""Cyrillic and Greek letters, and the Latin ones that they look like."""


def name_fault(name: str) -> str | None:
    """What is wrong with a name, in words; None where nothing is."""
    if PLAIN.fullmatch(name) and not RESERVED.fullmatch(name):
        return None
    return next(_faults(name), None)


def folder_fault(name: str) -> str | None:
    """What is wrong with a name that becomes a folder; None where nothing is."""
    if len(name) <= LONGEST_NAME and not FOLDER_NAME.fullmatch(name):
        strange = next((c for c in name if not re.match(r"[A-Za-z0-9_.-]", c)), None)
        return look_alike(name) or f"'{name}'" + (f" with {_shown(strange)}" if strange else "")
    return name_fault(name)


def _faults(name: str) -> Iterator[str]:
    if len(name) > LONGEST_NAME:
        yield f"a name of {len(name)} characters, '{name[:20]}…'"
        return
    if len(name.encode()) > MOST_BYTES:
        yield f"a name of {len(name.encode())} bytes in UTF-8, '{name[:20]}…'"
    strange = next((c for c in name if not (_is_part_of_a_word(c) or c in SIGNS)), None)
    if strange is not None:
        yield f"'{name}' with {_shown(strange)}"
    if not name[:1].isalnum():
        yield f"'{name}', which begins with a sign"
    if ".." in name or name.endswith("."):
        yield f"'{name}', whose dots mean a folder"
    if RESERVED.fullmatch(name):
        yield f"'{name}', a name that Windows keeps for itself"
    mixed = look_alike(name)
    if mixed is not None:
        yield mixed


@cache
def _is_part_of_a_word(character: str) -> bool:
    """Letters, digits, and marks that belong to letters."""
    return unicodedata.category(character)[0] in "LNM"


def look_alike(name: str) -> str | None:
    """Letters that look like others: of several alphabets, or of a form of their own."""
    if name.isascii():
        return None
    name = name[:LONGEST_NAME]
    of_letters = [(c, _alphabet(c)) for c in name if _alphabet(c)]
    alphabets = list(dict.fromkeys(alphabet for _, alphabet in of_letters))
    if len(alphabets) > 1:
        rare = min(alphabets, key=[alphabet for _, alphabet in of_letters].count)
        odd = next(c for c, alphabet in of_letters if alphabet == rare)
        return f"'{name}', in which {_shown(odd)} looks like another letter"
    twins = "".join(_TWINS.get(c, c) for c in name)
    if of_letters and all(c in _TWINS for c, _ in of_letters):
        return f"'{name}', whose letters look like '{twins}' but are {str(alphabets[0]).title()}"
    plain = unicodedata.normalize("NFKC", name)
    if plain != name:
        return f"'{name}', which looks like '{plain}' but is written with other characters"
    return None


@cache
def _alphabet(character: str) -> str | None:
    word = unicodedata.name(character, "").partition(" ")[0]
    return word if word in ALPHABETS and character.isalpha() else None


def _shown(character: str) -> str:
    told = unicodedata.name(character, f"U+{ord(character):04X}").lower()
    return f"'{character}' ({told})"


def distinct(names: tuple[str, ...]) -> tuple[str, ...]:
    """The names as they are.

    Raises
    ------
    ValueError
        For a name that stands there twice.
    """
    twice = next((name for name, times in Counter(names).items() if times > 1), None)
    if twice is not None:
        raise ValueError(f"each name once ('{twice}' stands there twice)")
    return names
