"""`spinepipe show`: one specimen as text and as a picture."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from spinepipe.cli.find import specimen_of, study_or_cohort
from spinepipe.problems import InputError, InputProblem
from spinepipe.report.specimen import draw_specimen, view_of
from spinepipe.report.specimen_text import describe
from spinepipe.report.style import save, style
from spinepipe.studies.study import Study

PICTURES = (".png", ".svg", ".pdf")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What to show and where to draw it."""
    parser.add_argument("name", metavar="STUDY_OR_COHORT", help="name of a study or cohort")
    parser.add_argument("specimen", nargs="?", metavar="SPECIMEN", help="the first if left out")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="picture, .png, .svg or .pdf (default: results/show/<name>.png)",
    )


def run(options: argparse.Namespace) -> int:
    """Print and draw."""
    name = Path(options.name).name
    chosen = f"{name}-{options.specimen}" if options.specimen else name
    output = options.output or options.root / "results" / "show" / f"{chosen}.png"
    if output.suffix not in PICTURES:
        allowed = ", ".join(PICTURES)
        problem = InputProblem(
            "command line", None, "-o", output.name, allowed, "rename the picture"
        )
        raise InputError([problem])
    study, cohort = study_or_cohort(options.name, options.root)
    specimen = specimen_of(cohort, options.specimen)
    view = view_of(cohort, specimen, *_loading(study))
    print(describe(cohort, view))
    if not cohort.has_frames:
        print(f"\nno picture: {cohort.name} has neither landmarks.csv nor joints.csv to draw")
        return 0
    with style():
        save(draw_specimen(cohort, view), output)
    print(f"\npicture: {output}")
    return 0


def _loading(study: Study | None) -> tuple[Sequence[str] | None, Sequence[float]]:
    """Tests that a study chooses, and by how many mm it moves their loads, where it does so."""
    shift = getattr(study, "load_point_shift_mm", None)
    return getattr(study, "tests", None), (0.0, 0.0, 0.0) if shift is None else shift.in_order()
