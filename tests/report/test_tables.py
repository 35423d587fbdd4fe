import csv
import io
import json

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.report.tables import FORMS, Cell, Table, four_digits, render

ROWS = [
    {"kernel": "moller1", "ns": Cell(8.23456, "8.23"), "hits": 600},
    {"kernel": "a|b_c", "ns": Cell(12.5, "12.5 *"), "hits": np.int64(1234567)},
    {"kernel": "empty", "ns": float("nan"), "hits": None},
]
COLUMNS = ["kernel", "ns", "hits"]


def test_csv_holds_the_values_not_their_texts():
    read = list(csv.DictReader(io.StringIO(render(ROWS, COLUMNS, "csv", title="not in csv"))))
    assert [row["ns"] for row in read] == ["8.23456", "12.5", ""]
    assert [row["hits"] for row in read] == ["600", "1234567", ""]


def test_json_is_a_list_of_objects_with_null_for_nothing():
    assert json.loads(render(ROWS, COLUMNS, "json")) == [
        {"kernel": "moller1", "ns": 8.23456, "hits": 600},
        {"kernel": "a|b_c", "ns": 12.5, "hits": 1234567},
        {"kernel": "empty", "ns": None, "hits": None},
    ]


def test_numbers_stand_right_with_their_points_in_line():
    lines = render(ROWS, COLUMNS, "plain", headers={"ns": "ns a test"}).splitlines()
    assert lines[0].split() == ["kernel", "ns", "a", "test", "hits"]
    assert lines[2].index("8.23") + 1 == lines[3].index("12.5") + 2
    ends = [len(line.rstrip()) for line in lines[2:]]
    assert len(set(ends)) == 1
    assert lines[4].split() == ["empty", "-", "-"]


def test_latex_has_booktabs_and_escapes():
    text = render(ROWS, COLUMNS, "latex", title="5 % of a_b", headers={"ns": "% of it"})
    for part in (r"\toprule", r"\midrule", r"\bottomrule", r"a|b\_c", r"\% of it"):
        assert part in text
    assert r"\caption{5 \% of a\_b}" in text
    assert "{lrr}" in text


def test_github_escapes_bars_and_aligns():
    lines = render(ROWS, COLUMNS, "github", title="Times").splitlines()
    assert lines[0] == "**Times**"
    assert r"a\|b_c" in lines[5]
    assert all(line.replace(r"\|", "").count("|") == 4 for line in lines[2:])


@pytest.mark.parametrize("form", FORMS)
def test_no_rows(form):
    assert "kernel" in render([], COLUMNS, form) or form == "json"


def test_unknown_form_names_the_nearest():
    with pytest.raises(RtbenchError, match="did you mean 'github'"):
        render(ROWS, COLUMNS, "githup")


def test_notes_are_not_in_csv_and_json():
    table = Table("t", ROWS, ["kernel", "ns"], notes=["* level with_it"], raw_columns=["hits"])
    assert table.render("plain").endswith("* level with_it")
    assert table.render("latex").endswith(r"* level with\_it")
    assert table.render("csv").splitlines()[0] == "hits"
    assert "level" not in table.render("csv") + table.render("json")


@pytest.mark.parametrize(
    ("value", "text"),
    [(0, "0"), (8.23456, "8.235"), (12345.6, "12,346"), (0.00123456, "0.001235"), (-2.5, "-2.500")],
)
def test_four_digits(value, text):
    assert four_digits(value) == text
