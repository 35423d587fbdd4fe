import csv
import io

import numpy as np
import pytest

from rtbench.report.layouts.packets import (
    axes_table,
    layouts_table,
    packets_tables,
    reciprocal_table,
    spread_table,
    widths_table,
)

WIDEST = 130


def taken(run):
    """Return each cell's ns a test, one a process and round, as the file of samples has them."""
    found = {}
    with (run.path / "samples.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = tuple(row[name] for name in run.cell)
            place = row["process"], row["round"]
            found.setdefault(key, {})[place] = int(row["ns"]) / int(row["tests"])
    return found


def raw(table):
    return list(csv.DictReader(io.StringIO(table.render("csv"))))


def row_of(table, kernel, ratio=0.5, **wanted):
    (row,) = (
        row
        for row in table.rows
        if row["kernel"] == kernel
        and row["density"].value == ratio
        and all(row[name] == value for name, value in wanted.items())
    )
    return row


def test_speeds_are_those_of_the_samples(make):
    run = make("packets")
    times = taken(run)
    for table in packets_tables(run):
        rows = raw(table)
        assert rows
        for row in rows:
            key = tuple({"order": "sweep", **row}[name] for name in run.cell)
            ns = np.median(list(times[key].values()))
            assert float(row["ns_per_test"]) == pytest.approx(ns)
            assert float(row["mtests_per_s"]) == pytest.approx(1000 / ns)


def test_every_width_stands_beside_the_scalar_form(make):
    table = widths_table(make("packets"))
    assert table.columns == ["form", "kernel", "density", "1", "4", "8", "16", "gain"]
    for form, factor in (("rays", 1), ("triangles", 1.1)):
        row = row_of(table, "wald", form=form)
        assert row["1"].value == pytest.approx(1000 / 2.3, rel=0.03)
        assert row["4"].value == pytest.approx(1000 / (1.2 * factor), rel=0.03)
        assert row["8"].value == pytest.approx(1000 / (0.6 * factor), rel=0.03)
    row = row_of(table, "wald", form="rays, exit")
    assert row["16"].value == pytest.approx(1000 / (0.3 * 0.9), rel=0.03) and "8" not in row
    assert row_of(table, "wald", form="pairs")["1"].value == pytest.approx(1000 / 11, rel=0.03)


def test_gain_is_the_ratio_of_samples_of_the_same_round(make):
    run = make("packets")
    times = taken(run)
    (row,) = (
        row
        for row in raw(widths_table(run))
        if (row["kernel"], row["density"], row["form"], row["width"], row["exit"])
        == ("wald_uv", "0.5", "rays", "16", "none")
    )
    keys = {
        width: next(
            key
            for key in times
            if dict(zip(run.cell, key, strict=True)).items()
            >= {
                **{"kernel": "wald_uv", "density": "0.5", "form": "rays", "width": width},
                **{"packet": "general", "angle": "10.0", "exit": "none", "axes": "stored"},
                **{"layout": layout, "reciprocal": "division"},
            }.items()
        )
        for width, layout in (("1", "own"), ("16", "blocks"))
    }
    slow, fast = times[keys["1"]], times[keys["16"]]
    expected = np.median([slow[place] / fast[place] for place in slow])
    assert float(row["gain"]) == pytest.approx(expected, rel=0.01)
    assert float(row["gain_low"]) < expected < float(row["gain_high"])


def test_every_cell_is_told_once(make):
    rows = raw(widths_table(make("packets")))
    keys = [tuple(row.items()) for row in rows]
    assert len(set(keys)) == len(keys)
    scalar = [row for row in rows if row["width"] == "1"]
    assert len(scalar) == 3 * 2 + 3 and all(row["gain"] == "1.0" for row in scalar)


def test_angles_stand_in_order_with_the_exit_and_without(make):
    table = spread_table(make("packets"))
    heads = [f"{angle}°" for angle in (0, 1, 10, 30, 90)]
    assert table.columns[-10:] == [*(f"{head} any" for head in heads), *heads]
    row = row_of(table, "wald", packet="common")
    assert row["90° any"].value == pytest.approx(1000 / (0.3 * 1.7), rel=0.03)
    assert row["90°"].value == pytest.approx(1000 / 0.3, rel=0.03)
    assert len(table.rows) == 3 * 3 * 2


def test_layouts_stand_side_by_side(make):
    row = row_of(layouts_table(make("packets")), "wald", form="rays")
    found = [row[name].value for name in ("blocks", "struct of arrays", "array of structs")]
    assert found == pytest.approx([1000 / 0.3, 1000 / 0.3, 400 / 0.3], rel=0.03)


def test_only_kernels_that_project_have_axes(make):
    table = axes_table(make("packets"))
    assert {row["kernel"] for row in table.rows} == {"wald"}
    assert row_of(table, "wald")["fixed"].value == pytest.approx(1000 / 0.27, rel=0.03)


def test_the_estimate_has_its_error_beside_it(make):
    table = reciprocal_table(make("packets"))
    row = row_of(table, "moller_trumbore")
    assert row["estimate"].value == pytest.approx(1000 / (0.38 * 1.05), rel=0.03)
    assert (row["error"].text, row["most"].text, row["differ"]) == ("3.0e-08", "1.9e-07", 2)


def test_endings_that_say_nothing_stand_below(make):
    table = widths_table(make("packets"))
    assert "ending" not in table.columns
    assert "endings: tuv, moller_trumbore uvt" in table.notes


@pytest.mark.parametrize("options", [{}, {"packings": False, "forms": ("rays",)}])
def test_a_line_is_no_wider_than_a_screen(make, options):
    tables = packets_tables(make("packets", processes=3, rounds=2, **options))
    for table in tables:
        lines = table.render("plain").splitlines()
        assert max(map(len, lines[2 : len(table.rows) + 4])) <= WIDEST, table.name
    assert [table.name for table in tables if table.rows] == (
        ["packets", "spread"] if options else ["packets", "spread", "layouts", "axes", "reciprocal"]
    )


def test_precisions_are_told_apart(make):
    table = widths_table(make("packets", precisions=("float32", "float64"), processes=2, rounds=2))
    assert "precision" in table.columns
    found = [row["16"].value for row in table.rows if row["kernel"] == "wald"][:4:2]
    assert found[0] / found[1] == pytest.approx(2, rel=0.1)
