"""Every CSV of the server: one guard against formulas, one form of numbers, one quoting."""

from hornbill.csv_text import Formatted, cell, csv_text


def test_a_text_that_a_spreadsheet_would_run_is_only_text_and_numbers_stay_numbers() -> None:
    for label in ("=1+1", "+1", "-1", "@sum(A1)", "  =cmd|' /C calc'!A0", "\t=1", "\r=1"):
        assert str(cell(label)).startswith("'")
    assert (cell(-60.5), cell(-3), cell(Formatted("-1"))) == (-60.5, -3, "-1")
    assert (cell(None), cell(True), cell("knee")) == ("", "true", "knee")


def test_lines_are_quoted_where_needed_and_end_as_asked() -> None:
    rows = [("a", "b"), ('x,"y"', -0.1), (None, False)]
    assert csv_text(rows) == 'a,b\r\n"x,""y""",-0.1\r\n,false\r\n'
    assert csv_text(rows, end="\n") == 'a,b\n"x,""y""",-0.1\n,false\n'


def test_bytes_that_no_file_can_hold_do_no_harm() -> None:
    assert csv_text([("\ud800", "a\0b")]).encode() == b"?,ab\r\n"
