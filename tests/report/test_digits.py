import numpy as np
import pandas
import pytest

from rtbench.report.digits import absent, decimals, frequency, interval, measured, percent


@pytest.mark.parametrize("value", [None, "", float("nan"), np.float32("nan"), pandas.NA])
def test_nothing_is_absent(value):
    assert absent(value)


@pytest.mark.parametrize("value", [0, 0.0, "0", False, np.int64(0)])
def test_zero_is_something(value):
    assert not absent(value)


@pytest.mark.parametrize(
    ("half", "places"), [(0.02, 3), (0.04, 2), (0.25, 2), (0.4, 1), (4, 0), (400, 0), (0.0, 3)]
)
def test_decimals_follow_the_interval(half, places):
    assert decimals(10 - half, 10 + half) == places


def test_number_and_interval_have_the_same_digits():
    assert measured(8.23456, 8.1, 8.3).text == "8.23"
    assert interval(8.23456, 8.1, 8.3) == "[8.10, 8.30]"
    assert measured(8.23456, 8.1, 8.3).value == 8.23456


def test_without_an_interval_four_digits():
    assert measured(56.594).text == "56.59"
    assert interval(56.594, None, None) == ""


def test_a_column_has_no_more_decimals_than_usual():
    assert measured(8.23456, 8.234, 8.236, most=2).text == "8.23"
    assert measured(8.23456, 7.0, 9.0, most=2).text == "8.2"


def test_shares():
    assert percent(0.1143).text == "11.4"
    assert percent(0.0, "*").text == "0 *"
    assert frequency(6.1e-6).text == "0.00061"
    assert frequency(0.12072).text == "12.07"
    assert frequency(0).text == "0"
