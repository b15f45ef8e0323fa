"""Licences of what the product runs on: read from the installed packages, judged, and listed.

A package says its licence in one of three ways, of which the first that is there counts: an SPDX
expression, classifiers, or the text of its licence. What needs a judgement has one in `JUDGED`.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, distribution
from pathlib import Path

from spinepipe.shipped import SHIPPED

LOCK = SHIPPED / "requirements.lock"

_PINNED = re.compile(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)", re.MULTILINE)

ALLOWED = frozenset(
    (
        *(
            "MIT",
            "MIT-CMU",
            "ISC",
            "BSD",
            "BSD-2-Clause",
            "BSD-3-Clause",
            "0BSD",
            "Apache-2.0",
            "Zlib",
        ),
        *("PSF-2.0", "BSL-1.0", "CC0-1.0", "MPL-2.0", "Apache-2.0 WITH LLVM-exception", "Qhull"),
    )
)
"""Licences beside which this product can be under the MIT licence; MPL-2.0 binds its own files."""

_BY_CLASSIFIER = {
    "MIT License": "MIT",
    "ISC License (ISCL)": "ISC",
    "BSD License": "BSD",
    "Apache Software License": "Apache-2.0",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "zlib/libpng License": "Zlib",
    "Python Software Foundation License": "PSF-2.0",
}

_BY_TEXT = (
    (re.compile(r"Permission is hereby granted, free of charge, to any person"), "MIT"),
    (re.compile(r"Apache License\s+Version 2\.0"), "Apache-2.0"),
    (re.compile(r"Redistribution and use in source and binary forms"), "BSD"),
)

_NOT_PASSED_ON = "Installed from its own package; nobody passes it on with this product."

_GCC = (
    "libgfortran (GPL-3.0 with GCC's exception for run-time libraries) and libquadmath (LGPL-2.1)"
)

JUDGED = {
    "cmeel-qhull": ("Qhull", "Its own short licence: free to copy and change, with its name."),
    "docutils": (
        "BSD-2-Clause",
        "Public domain and BSD. The GPL in its metadata is of a file for Emacs, which the package "
        "does not hold.",
    ),
    "matplotlib": ("PSF-2.0", "Its own licence, made after Python's."),
    "numpy": (
        "BSD-3-Clause AND 0BSD AND MIT AND Zlib AND CC0-1.0",
        f"Holds {_GCC} as files that can be replaced. {_NOT_PASSED_ON}",
    ),
    "pulp": (
        "MIT",
        "Holds the program cbc (EPL-1.0), which only Snakemake's other scheduler starts. "
        f"{_NOT_PASSED_ON}",
    ),
    "scikit-learn": (
        "BSD-3-Clause",
        "Holds libgomp (GPL-3.0 with GCC's exception for run-time libraries) as a file that can be "
        f"replaced. {_NOT_PASSED_ON}",
    ),
    "scipy": ("BSD-3-Clause", f"Holds {_GCC} as files that can be replaced. {_NOT_PASSED_ON}"),
}
"""Packages whose metadata say too little or too much: the licence, and why it is taken."""


@dataclass(frozen=True)
class Licence:
    """Of one package: name, version, licence (empty where none was found) and a remark."""

    package: str
    version: str
    licence: str
    remark: str = ""

    @property
    def allowed(self) -> bool:
        """Whether each part of the licence is allowed."""
        parts = re.split(r" AND | OR ", self.licence)
        return all(part.strip("()") in ALLOWED for part in parts)


def licences() -> list[Licence]:
    """Licences of all packages that the lock file pins, as they are installed here.

    Raises
    ------
    PackageNotFoundError
        For one that is not installed.
    """
    return [_of(name, version) for name, version in sorted(pinned().items())]


def pinned(lock: Path = LOCK) -> dict[str, str]:
    """Versions of the packages of a lock file."""
    return dict(_PINNED.findall(lock.read_text(encoding="utf-8")))


def _of(name: str, version: str) -> Licence:
    if name in JUDGED:
        return Licence(name, version, *JUDGED[name])
    return Licence(name, version, _told(distribution(name)))


def _told(found: Distribution) -> str:
    """The licence of a package by its own word; empty where it says nothing that is known."""
    about = found.metadata.json
    if "license_expression" in about:
        return str(about["license_expression"])
    told = [one.split(" :: ")[-1] for one in about.get("classifier", ())]
    said = [one for one in told if "Licen" in one or one == "Public Domain"]
    if said:
        return " AND ".join(_BY_CLASSIFIER.get(one, one) for one in sorted(said))
    word = str(about.get("license", "")).strip()
    if word in ALLOWED:
        return word
    return next((of for text in _texts(found) for form, of in _BY_TEXT if form.search(text)), "")


def _texts(found: Distribution) -> Iterator[str]:
    """Texts of licences in the package's own folder of metadata."""
    for path in found.files or ():
        if re.match(r"(?i)licen[sc]e|copying", path.name) and ".dist-info" in str(path):
            yield Path(str(path.locate())).read_text(encoding="utf-8", errors="replace")
