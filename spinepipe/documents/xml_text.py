"""An XML file as elements that know their line. Without a document type it has no entities."""

from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from spinepipe.documents.text import read_bytes
from spinepipe.problems import InputProblem

MOST_BYTES = 50_000_000

LINE = "#line"
"""Attribute with the line on which an element begins; no file can have one of this name."""


def read_xml(path: Path, file: str) -> tuple[Element | None, list[InputProblem]]:
    """The root of a document, None where it cannot be read.

    Parameters
    ----------
    path : the file. file : its name in messages.
    """
    data, problems = read_bytes(path, file, MOST_BYTES)
    if problems:
        return None, problems
    parser, builder = expat.ParserCreate(), TreeBuilder()

    def start(tag: str, attributes: dict[str, str]) -> None:
        builder.start(tag, attributes | {LINE: str(parser.CurrentLineNumber)})

    def refuse(*_: object) -> None:
        raise ValueError("a document type")

    parser.StartElementHandler, parser.EndElementHandler = start, builder.end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = builder.data, refuse
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, ValueError) as error:
        place = (file, parser.CurrentLineNumber, None)
        remedy = "write it again with the program that made it"
        return None, [InputProblem(*place, str(error), "XML without a document type", remedy)]
    return builder.close(), []
