"""`spinepipe docs`: the parts of the documentation that come from the code."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from spinepipe.files import appearing
from spinepipe.reference.pages import DOCS, outdated_pages, refresh, table_pages

FOLDER = Path("docs") / "figures"

PICTURES: Mapping[str, str] = {
    "stiffness.png": "results/l1l4_joint_pose/figures/stiffness.png",
    "missing_effect.png": "results/stiffening_spines/discrepancy/figures/misfit.png",
    "factor_indices.png": "results/l1l4_factors/figures/factor_indices.png",
}
"""Pictures of README and tutorial in `docs/figures`: the figure of a plain run that each copies."""


def command(
    context: typer.Context,
    check: Annotated[
        bool, typer.Option("--check", help="write nothing; fail where a page is out of date")
    ] = False,
    figures: Annotated[
        bool, typer.Option("--figures", help="copy the pictures of README and tutorial instead")
    ] = False,
) -> int:
    """Write the generated parts of the documentation."""
    root = context.obj
    if figures:
        return _pictures(root)
    pages = outdated_pages(root)
    for path in pages:
        name = path.relative_to(root)
        if check:
            print(f"FAIL  {name}: out of date; run `spinepipe docs`")
        else:
            path.write_text(refresh(path.read_text(encoding="utf-8"), str(name)), "utf-8")
            print(f"wrote {name}")
    if not check:
        for place, text in table_pages().items():
            with appearing(root / DOCS / place) as temporary:
                temporary.write_text(text, "utf-8")
        print(f"wrote {DOCS}/table: a page for each result table")
    if not pages:
        print("ok    every generated part of docs/ is up to date")
    return 1 if pages and check else 0


def _pictures(root: Path) -> int:
    """Copy what was computed, and name what was not."""
    found = copy_pictures(root)
    for name, there in found.items():
        source = PICTURES[name]
        told = f"wrote {FOLDER / name} from {source}"
        print(told if there else f"FAIL  {FOLDER / name}: no {source}; run `make all` first")
    return 0 if all(found.values()) else 1


def copy_pictures(root: Path) -> dict[str, bool]:
    """Copy the results that are there; by picture, whether its result was.

    Parameters
    ----------
    root : folder of the Snakefile.
    """
    found = {}
    for name, result in PICTURES.items():
        found[name] = (root / result).is_file()
        if found[name]:
            with appearing(root / FOLDER / name) as temporary:
                temporary.write_bytes((root / result).read_bytes())
    return found
