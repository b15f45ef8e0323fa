"""Generated parts of the documentation: complete, up to date, and derived from the code.

Catches pages that are stale or lack an entry of the code.
"""

import re
from pathlib import Path

import pytest

from spinepipe.problems import InputError
from spinepipe.reference.pages import (
    END,
    generators,
    outdated_pages,
    pages,
    refresh,
    table_pages,
)
from spinepipe.studies.registry import every_kind

ROOT = Path(__file__).resolve().parents[2]


def test_pages_are_up_to_date() -> None:
    assert outdated_pages(ROOT) == [], "run `spinepipe docs`"


def test_every_part_stands_on_some_page() -> None:
    named = re.compile(r"<!-- generated: (.+?) -->")
    shown = {name for path in pages(ROOT) for name in named.findall(path.read_text())}
    assert shown == set(generators())


def test_links_lead_somewhere() -> None:
    made = {ROOT / "docs" / place for place in table_pages()}
    for path in {*pages(ROOT), ROOT / "README.md"} - made:
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", path.read_text()):
            file = (path.parent / target).resolve()
            assert target.startswith("http") or file.exists() or file in made, (path, target)


def test_a_part_is_replaced_between_its_markers_only() -> None:
    text = f"before\n\n<!-- generated: cohort joints -->\nold\n{END}\n\nafter\n"
    new = refresh(text, "page.md")
    assert new.startswith("before\n\n<!-- generated: cohort joints -->\n")
    assert new.endswith(f"{END}\n\nafter\n")
    assert "old" not in new
    assert "| **`specimen`** | text |" in new
    assert refresh(new, "page.md") == new


def test_unknown_and_open_markers_are_told() -> None:
    with pytest.raises(InputError, match=r"page\.md.*'cohort joint'.*did you mean 'cohort joints'"):
        refresh(f"<!-- generated: cohort joint -->\n{END}", "page.md")
    with pytest.raises(InputError, match="a marker without an end"):
        refresh("<!-- generated: cohort joints -->\n", "page.md")


@pytest.mark.parametrize(
    "line",
    [
        "| `poses` | integer | `500` | at least 2; at most 20000 |",
        "| `calibration.weights.superior` | number | `100` |",
        "| `landmark_sd_mm` | number or null | `null` | above 0; at most 20 |",
        "| `loading` | text | `equilibrium` | `equilibrium`, `settle` |",
        "| `cohort` | text | **required** |",
    ],
)
def test_keys_of_a_study(line: str) -> None:
    assert line in generators()["keys joint_pose_sensitivity"]()


def test_an_effect_tells_what_its_options_change_and_how_it_is_searched() -> None:
    part = generators()["effects"]()
    stiffening = part[part.index("### `nonlinear_stiffening`") :].partition("\n### ")[0]
    assert (
        "`shape`, by default `exponential` (a search tries `exponential`, `tangent`" in stiffening
    )
    assert "| `rate` | 1/rad | 0 to 100 | 0 | 10 |" in stiffening
    assert "| `growth`, with `shape: tangent` | 1/rad^2 | 0 to 5000 | 0 | 75 |" in stiffening
    assert "What shows it: several load steps up to a large motion" in stiffening
    bushing = part[part.index("### `linear_bushing`") :].partition("\n### ")[0]
    assert "A search for missing effects does not try it." in bushing
    contact = part[part.index("### `facet_contact`") :].partition("\n### ")[0]
    assert "| `gap` | rad | 0 to 0.5 |  |" in contact  # a shape has no value at which it is off
    assert "with another `coordinate` they differ" in contact


def test_every_column_of_every_table_has_its_page() -> None:
    made = table_pages()
    for name, kind in every_kind().items():
        for table in kind.tables:
            page = made[f"table/{name}/{table.name}.md"]
            told = re.findall(
                r"^\| `(\w+)` \| .* \| (?:text|integer|number|flag) \|", page, re.MULTILINE
            )
            assert tuple(told) == table.names
            assert table.about in page
            assert f"[{table.name}]({name}/{table.name}.md)" in made[f"table/{name}.md"]


def test_bars_in_cells_are_escaped() -> None:
    for name, part in generators().items():
        tables = [line for line in part().splitlines() if line.startswith("|")]
        widths = {len(re.findall(r"(?<!\\)\|", line)) for line in tables if tables}
        assert len(widths) <= 1 or name == "effects", name
