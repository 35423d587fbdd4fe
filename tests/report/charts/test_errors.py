"""The chart and the tables of relative errors show the numbers of errors.csv."""

import csv

import numpy as np
import pytest

from rtbench.records.store import load_run
from rtbench.report import plots
from rtbench.report.charts.errors import errors_chart, method_of
from rtbench.report.run_tables import tables_of

KERNELS = [
    ("moller_trumbore_uv", "", 1.5),
    ("moller_trumbore_last_uv", "", 1.25),
    ("wald_uv", "own", 2.0),
    ("wald_uv", "double", 0.9),
    ("wald_last_uv", "own", 2.5),
    ("wald_last_uv", "double", 0.8),
]
SCALES = {"float32": 1e-6, "float64": 1e-15}


def errors():
    for precision, scale in SCALES.items():
        for kernel, prepared, mean in KERNELS:
            if (precision, prepared) == ("float64", "double"):
                continue
            for place, quantity in enumerate("tuv"):
                for reference in ("exact", "moller_trumbore"):
                    own = kernel.startswith("moller") and precision == "float64"
                    zero = own and reference == "moller_trumbore"
                    value = 0.0 if zero else mean * scale / (1 + place)
                    yield {
                        "kernel": kernel,
                        "precision": precision,
                        "prepared": prepared,
                        "quantity": quantity,
                        "reference": reference,
                        "mean": value,
                        "ci_low": 0.9 * value,
                        "ci_high": 1.2 * value,
                        "median": 0.3 * value,
                        "p99": 9 * value,
                        "max": 50 * value,
                        "over_condition_median": 0.25,
                        "over_condition_p99": 1.75,
                        "over_condition_max": 6.5,
                        "hits": 1000 - place,
                    }


def choices():
    for precision in SCALES:
        for kernel, differ, near in (("moller_trumbore_uv", 0, 0), ("wald_uv", 3, 2), ("", 3, 2)):
            yield {
                "kernel": kernel,
                "precision": precision,
                "prepared": "own" if kernel == "wald_uv" else "",
                "density": 0.5,
                "rays": 4096,
                "differ": differ,
                "within_rounding": near,
            }


@pytest.fixture
def run(sample_runs, tmp_path):
    columns = ["kernel", "precision", "prepared"]
    folder = sample_runs.write_run(tmp_path / "a-relative_error", "relative_error", [], columns)
    for name, rows in (("errors.csv", list(errors())), ("choices.csv", list(choices()))):
        with (folder / name).open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
    return load_run(folder)


def test_dots_and_intervals_are_those_of_the_records(run):
    figure = errors_chart(run)
    assert list(plots.figures(run)) == ["errors"]
    assert len(figure.axes) == 6
    for panel, (precision, quantity) in zip(
        figure.axes, [(p, q) for p in SCALES for q in "tuv"], strict=True
    ):
        assert panel.get_xscale() == "log" and precision in panel.get_title()
        assert panel.get_title().startswith(f"{quantity},")
        wanted = [
            row["mean"] / SCALES[precision]
            for row in errors()
            if (row["precision"], row["quantity"], row["reference"])
            == (precision, quantity, "exact")
        ]
        shown = [float(bar[0].get_xdata()[0]) for bar in panel.containers]
        assert sorted(shown) == pytest.approx(sorted(wanted))
        ends = np.array([bar[2][0].get_segments()[0][:, 0] for bar in panel.containers])
        assert ends == pytest.approx(np.outer(shown, [0.9, 1.2]))


def test_a_method_is_a_row(run):
    panel = errors_chart(run).axes[0]
    assert [label.get_text() for label in panel.get_yticklabels()] == ["moller_trumbore", "wald"]
    rows = [round(float(bar[0].get_ydata()[0])) for bar in panel.containers]
    assert sorted(rows) == [0, 0, 1, 1, 1, 1]
    places = {float(bar[0].get_ydata()[0]) for bar in panel.containers}
    assert len(places) == 6, "two dots on one another"


def test_methods_are_read_off_the_names():
    assert method_of("wald_last_uv") == ("wald", True)
    assert method_of("moller1_uv") == ("moller1", False)


def test_tables(run):
    found = {table.name: table for table in tables_of(run)}
    assert list(found) == [
        "errors-float32",
        "errors-float64",
        "error-tails-float32",
        "error-tails-float64",
        "error-references",
        "choices",
    ]
    means = found["errors-float32"].render()
    assert "1.50 [1.35, 1.80]" in means and "0.75 [0.68, 0.90]" in means
    assert "998 to 1,000 hits" in means
    wald = next(
        row
        for row in found["error-tails-float64"].rows
        if (row["kernel"], row["prepared"]) == ("wald_last_uv", "own")
    )
    texts = [wald[f"t_{name}"].text for name in ("median", "p99", "over_condition_p99")]
    assert texts == ["0.75", "22.50", "1.75"]
    assert len(found["errors-float32"].raw_rows) == 6 * 3 * 2


def test_the_references_are_compared(run):
    table = {t.name: t for t in tables_of(run)}["error-references"]
    rows = {(r["precision"], r["reference"], r["quantity"]): r for r in table.rows}
    double = rows["float64", "Möller-Trumbore in double", "t"]
    assert double["own"].value == 0 and double["least"].value == 0
    assert double["greatest"].value == pytest.approx(2.5e-15)
    assert double["of_"] == "wald_last_uv (own)"
    single = rows["float32", "exact", "t"]
    assert single["place"] == "3 of 6" and single["least"].value == pytest.approx(0.8e-6)
    assert single["of"] == "wald_last_uv (double)"


def test_choices_are_counted(run):
    table = {t.name: t for t in tables_of(run)}["choices"]
    row = table.rows[0]
    assert [row[key] for key in ("kernels", "rays", "differ", "within_rounding", "most", "by")] == [
        2,
        4096,
        3,
        2,
        3,
        "wald_uv",
    ]
