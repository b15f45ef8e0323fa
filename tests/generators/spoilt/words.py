"""Numbers, names and texts as they should not be written, each with what must be said of it."""

from tests.generators.spoilt.case import Expected

REFUSED, TOLD, FINE, OPEN = Expected.REFUSED, Expected.TOLD, Expected.FINE, Expected.OPEN

MAIN_NUMBERS = {
    "nan": "nan",
    "inf": "inf",
    "1e999": "1e999",
    "hex": "0x1F",
    "decimal comma": "12,5",
    "thousands": "1,234.5",
    "words": "five",
    "100 000 digits": "1" * 100_000,
    "1e300": "1e300",
}
"""Tried in every column of numbers."""

FURTHER_NUMBERS = {
    "-inf": "-INF",
    "NaN": "NaN",
    "thousands by a blank": "1 234",
    "thousands by an apostrophe": "1'234",
    "underscore": "1_000",
    "true minus": "−5",
    "Arabic digit": "٣",
    "wide digit": "５",
    "half": "½",
    "fraction": "1/2",
    "unit": "5 mm",
    "degree sign": "5°",
    "about": "~5",
    "below": "<5",
    "n/a": "n/a",
    "none": "None",
    "dash": "-",
    "question": "?",
    "star": "*",
    "true": "TRUE",
    "spreadsheet error": "#REF!",
    "formula": "=A1+1",
    "two points": "1.2.3",
    "two signs": "--1",
    "no exponent": "1e",
    "no mantissa": "e5",
    "point alone": ".",
    "broken exponent": "1e5.5",
    "brackets": "(5)",
    "percent": "5%",
    "dollar": "$5",
    "octal": "0o17",
    "time": "1:30",
    "complex": "1+2j",
    "noughts": "0" * 100_000,
    "digits and x": "1" * 199 + "x",
    "150 digits": "1" * 150,
    "-1e300": "-1e300",
    "control": "5\x07",
    "escape": "\x1b[31m5",
    "line in a cell": "5\n6",
    "hidden blank": "5\u200b",
    "turned": "\u202e5",
}
"""Tried in one column of every table at least."""

_TWINS = str.maketrans("aceopxyTSLI3BHKM", "асеорхуТЅⅬІЗВНКМ")


def look_alike(name: str) -> str:
    """The name with its first letter or digit that has a twin in another script replaced."""
    for at, character in enumerate(name):
        twin = character.translate(_TWINS)
        if twin != character:
            return name[:at] + twin + name[at + 1 :]
    return name + "а"


def bad_names(name: str) -> dict[str, str]:
    """Ways to write a name wrong."""
    return {
        "look-alike": look_alike(name),
        "unknown": "q7x",
        "path": f"../{name}",
        "dollars": "a $\\frac$",
        "tag": "<script>alert(1)</script>",
        "61 characters": "n" * 61,
        "260 characters": "n" * 260,
        "100 000 characters": "n" * 100_000,
        "control": f"{name}\x07",
        "formula": f"=cmd|{name}",
        "absolute": "/etc/passwd",
        "backslash": f"a\\{name}",
        "braces": f"{{{name}}}",
        "equals": f"a={name}",
        "shell": f"$(id){name}",
        "backquotes": "`id`",
        "dots": f"{name}..",
        "device": "CON",
        "option": f"-{name}",
        "NUL": f"{name}\x00",
        "escape": f"\x1b[2J{name}",
        "turned": f"{name}\u202e",
        "hidden blank": f"{name}\u200b",
        "hard blank": f"{name}\u00a0b",
        "wide letters": "".join(chr(ord(c) + 0xFEE0) if "!" <= c <= "~" else c for c in name),
        "emoji": f"{name}😀",
        "line": f"{name}\n{name}",
        "quote": f"{name}'",
        "lone surrogate": f"{name}\udc80",
    }


MAIN_NAMES = ("look-alike", "unknown", "path", "dollars", "tag", "100 000 characters")

TEXTS = {
    "control": ("a\x07", REFUSED),
    "NUL": ("a\x00", REFUSED),
    "turned": ("\u202ea", REFUSED),
    "word of 100 000": ("a" * 100_000, REFUSED),
    "100 000 words": ("a " * 50_000, REFUSED),
    "tag": ("<script>alert(1)</script>", OPEN),
    "dollars": ("a $\\frac$", OPEN),
    "accents": ("Größe é", OPEN),
}
"""Of free texts; names and words of a list are asked more."""
