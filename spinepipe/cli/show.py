"""`spinepipe show`: one specimen as text, and as a page or a picture."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from spinepipe.cli.find import specimen_of, study_or_cohort
from spinepipe.files import appearing
from spinepipe.problems import InputError, InputProblem
from spinepipe.report.measured_summary import measured_summary
from spinepipe.report.specimen import view_of
from spinepipe.report.specimen_curves import curve_charts, measured_curves
from spinepipe.report.specimen_page import specimen_page
from spinepipe.report.specimen_text import describe
from spinepipe.studies.study import Study

PAGE, PICTURES = ".html", (".png", ".svg", ".pdf")


def command(
    context: typer.Context,
    name: Annotated[str, typer.Argument(metavar="NAME", help="of a study or cohort")],
    specimen: Annotated[
        str | None, typer.Argument(help="of the cohort", show_default="the first")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="page, .html, or picture, .png, .svg or .pdf; default: results/show/NAME.html",
        ),
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="every load step in the terminal, as of one specimen")
    ] = False,
) -> int:
    """Show measured data: curves, geometry, summary."""
    root, named = context.obj, Path(name).name
    chosen = f"{named}-{specimen}" if specimen else named
    output = output or root / "results" / "show" / f"{chosen}{PAGE}"
    if output.suffix not in (PAGE, *PICTURES):
        allowed = ", ".join((PAGE, *PICTURES))
        problem = InputProblem("command line", None, "-o", output.name, allowed, "rename the file")
        raise InputError([problem])
    study, cohort = study_or_cohort(name, root)
    of_all = specimen is None and not everything
    specimen = specimen_of(cohort, specimen)
    view = view_of(cohort, specimen, *_loading(study))
    tests, _ = _loading(study)
    of_all = of_all and cohort.has_frames and cohort.loads is not None
    summary = measured_summary(cohort, tests) if of_all else None
    if summary is None or summary.empty:
        print(describe(cohort, view))
    else:
        print(f"{cohort.name}: {cohort.title}\n{summary.to_string(index=False)}")
    kind = "page" if output.suffix == PAGE else "picture"
    if not cohort.has_frames:
        print(f"\nno {kind}: {cohort.name} has neither landmarks.csv nor joints.csv to draw")
        return 0
    if kind == "page":
        with appearing(output) as temporary:
            temporary.write_text(specimen_page(cohort, view), encoding="utf-8")
    else:
        curves = curve_charts(cohort, list(measured_curves(view)))
        if not curves:
            print("\nno picture: no motion was measured; the page, .html, shows the geometry")
            return 0
        first = curves[0]
        panels = [panel for chart in curves for panel in chart.panels]
        whole = replace(first, panels=panels)
        picture = (
            whole.svg().encode() if output.suffix == ".svg" else whole.picture(output.suffix[1:])
        )
        with appearing(output) as temporary:
            temporary.write_bytes(picture)
    print(f"\n{kind}: {output}")
    print(f"Next: spinepipe new study NAME --cohort {cohort.name}")
    return 0


def _loading(study: Study | None) -> tuple[Sequence[str] | None, Sequence[float]]:
    """Tests that a study chooses, and by how many mm it moves their loads, where it does so."""
    shift = getattr(study, "load_point_shift_mm", None)
    return getattr(study, "tests", None), (0.0, 0.0, 0.0) if shift is None else shift.in_order()
