"""CSV of the server: protection against formulas, numbers, quoting."""

from hornbill.csv_text import Formatted, cell, csv_text


def test_formulas_become_text_and_numbers_stay_numbers() -> None:
    for label in ("=1+1", "+1", "-1", "@sum(A1)", "  =cmd|' /C calc'!A0", "\t=1", "\r=1"):
        assert str(cell(label)).startswith("'")
    assert (cell(-60.5), cell(-3), cell(Formatted("-1"))) == (-60.5, -3, "-1")
    assert (cell(None), cell(True), cell("knee")) == ("", "true", "knee")


def test_quoting_and_line_ends() -> None:
    rows = [("a", "b"), ('x,"y"', -0.1), (None, False)]
    assert csv_text(rows) == 'a,b\r\n"x,""y""",-0.1\r\n,false\r\n'
    assert csv_text(rows, end="\n") == 'a,b\n"x,""y""",-0.1\n,false\n'


def test_invalid_characters_are_replaced() -> None:
    assert csv_text([("\ud800", "a\0b")]).encode() == b"?,ab\r\n"
