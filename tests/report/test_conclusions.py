"""Numbers in sentences, and sentences of verdicts.

Would catch wrong digits, an end that is told though it is open, a verdict without a sentence.
"""

import math

import pytest

from spinepipe.report.conclusions import Conclusion, Sentence, Value, rows_of, told


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (Value(21.243, "N m/rad", 20.51, 22.02), "21.24\u00a0N\u00a0m/rad"),
        (Value(334_212.0, "N/m", 311_300.0, 355_100.0), "334\u2009000\u00a0N/m"),
        (Value(-10.112, "°", -12.4, -8.2), "−10.1°"),
        (Value(0.00012, "mm", -0.0024, 0.0026), "0.0001\u00a0mm"),
        (Value(-0.00001, "mm", -0.24, 0.26), "0.00\u00a0mm"),
        (Value(1800), "1\u2009800"),
        (Value(0.0663, "°"), "0.066°"),
    ],
)
def test_a_number_has_two_digits_of_its_half_width(value: Value, words: str) -> None:
    assert f"{value:unit}" == words


def test_an_open_end_is_told_as_open() -> None:
    assert f"{Value(5200.0, 'N/m', low=4450.0)}" == "5\u2009200 (above 4\u2009400)\u00a0N/m"
    assert f"{Value(5.2, 'mm', high=7.0):interval}" == "below 7.0"
    assert f"{Value(5.2, 'mm', 3.0, 7.0):interval}" == "3.0 to 7.0"
    assert f"{Value(5.2, 'mm'):interval}" == ""


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_no_nan_travels(number: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        Value(number)
    with pytest.raises(ValueError, match="finite"):
        Value(1.0, low=number)


ROWS = (
    Sentence("answer", "size", "large", "", "{joint} moves {x:unit}.", "", "", "it is small"),
    Sentence("light", "runs", "check_lost", "Runs", "{n} lost.", "", "", "none is"),
    Sentence("finding", "size", "large", "", "it moves {x}.", "over {n} runs", "f", "it is small"),
)


def test_a_conclusion_stands_wherever_its_table_says() -> None:
    size = Conclusion("size", "large", {"x": Value(3.0, "°"), "n": Value(7)}, {"joint": "L4–L5"})
    lost = Conclusion("runs", "check_lost", {"n": Value(2)})
    found = told([lost, size], ROWS)
    assert [(one.place, one.text) for one in found] == [
        ("answer", "L4–L5 moves 3°."),
        ("finding", "It moves 3°."),
        ("light", "2 lost."),
    ]
    assert found[1].note == "over 7 runs"
    assert found[2].level == "check"
    numbers = [(row["rule"], row["name"], row["value"]) for row in rows_of(found)]
    assert numbers == [("size", "x", 3.0), ("size", "n", 7), ("size", "x", 3.0), ("size", "n", 7),
                       ("runs", "n", 2)]  # fmt: skip


def test_a_verdict_without_a_sentence_is_no_silence() -> None:
    with pytest.raises(LookupError, match="size, verdict small"):
        told([Conclusion("size", "small")], ROWS)
