"""What the product runs on may be passed on with it; who needs a judgement has one that holds.

Catches a new dependency that may not be passed on.
"""

import re
from importlib.metadata import PathDistribution, distribution
from pathlib import Path

from sweeps import sweep

from spinepipe.reference import licences as module
from spinepipe.reference.licences import JUDGED, LOCK, Licence, licences, pinned

ROOT = Path(__file__).resolve().parents[2]
HEAD = "Metadata-Version: 2.4\nName: one\nVersion: 1.0\n"


def test_every_package_has_a_licence_that_is_allowed() -> None:
    """Else look at the licence, and judge it in `spinepipe/reference/licences.py` with a reason."""
    assert [one for one in licences() if not one.allowed] == []


def test_every_pinned_package_is_listed_with_its_version() -> None:
    lines = [line for line in LOCK.read_text().splitlines() if "==" in line]
    assert len(pinned()) == len(lines) > 50
    page = (ROOT / "docs" / "licences.md").read_text()
    for name, version in pinned().items():
        assert f"| `{name}` | {version} | " in page, "run `spinepipe docs`"


def test_what_was_judged_is_pinned_and_as_it_was_judged() -> None:
    assert set(JUDGED) <= set(pinned())
    files = {name: [str(f) for f in distribution(name).files or ()] for name in JUDGED}
    assert not [file for file in files["docutils"] if file.endswith(".el")]
    assert [file for file in files["pulp"] if file.endswith("coin-license.txt")]
    profile = (ROOT / "profiles" / "default" / "config.yaml").read_text()
    assert "scheduler: greedy" in profile  # the one that does not start pulp's program
    for name in ("numpy", "scipy"):
        told = " ".join(p.read_text("utf-8", "replace") for p in _licence_files(name))
        assert re.search(r"GCC RUNTIME LIBRARY EXCEPTION", told)


def _licence_files(name: str) -> list[Path]:
    found = distribution(name)
    return [Path(str(f.locate())) for f in found.files or () if f.name.startswith("LICENSE")]


@sweep(
    "metadata, licence, allowed",
    [
        ("License-Expression: MIT", "MIT", True),
        ("License-Expression: MIT AND PSF-2.0", "MIT AND PSF-2.0", True),
        ("License-Expression: GPL-3.0-or-later", "GPL-3.0-or-later", False),
        ("License-Expression: MIT OR LGPL-2.1-only", "MIT OR LGPL-2.1-only", False),
        ("Classifier: License :: OSI Approved :: BSD License", "BSD", True),
        (
            "Classifier: License :: OSI Approved :: MIT License\n"
            "Classifier: License :: OSI Approved :: GNU General Public License v3 (GPLv3)",
            "GNU General Public License v3 (GPLv3) AND MIT",
            False,
        ),
        ("License: MIT", "MIT", True),
        ("License: as you like", "", False),
        ("Summary: no word of it", "", False),
    ],
)
def test_licences_are_read_as_packages_tell_them(
    tmp_path: Path, metadata: str, licence: str, allowed: bool
) -> None:
    folder = tmp_path / "one-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text(
        f"Metadata-Version: 2.4\nName: one\nVersion: 1.0\n{metadata}\n"
    )
    told = module._told(PathDistribution(folder))
    assert told == licence
    assert Licence("one", "1.0", told).allowed == allowed


@sweep(
    "text, licence",
    [
        ("Permission is hereby granted, free of charge, to any person", "MIT"),
        ("GNU GENERAL PUBLIC LICENSE\nVersion 3", ""),
    ],
)
def test_the_text_of_a_licence_is_the_last_word(tmp_path: Path, text: str, licence: str) -> None:
    folder = tmp_path / "one-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text(HEAD)
    (folder / "LICENSE").write_text(text)
    (folder / "RECORD").write_text("one-1.0.dist-info/LICENSE,,\n")
    assert module._told(PathDistribution(folder)) == licence
