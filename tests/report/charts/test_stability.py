"""The charts and tables of hard cases show the numbers of the records."""

import csv
import itertools

import numpy as np
import pytest

from rtbench.records import schema
from rtbench.records.store import load_run
from rtbench.report import plots
from rtbench.report.charts import style
from rtbench.report.charts.stability import SHADES, few
from rtbench.report.layouts.stability import number
from rtbench.report.run_tables import tables_of

KERNELS = {"exact_uv": 0, "good_uv": 3, "moller1_uv": 60}
FAMILIES = ("near_edge", "exact_edge", "dir_scale", "axis_tie")
SCALE = {"float32": 1, "float64": 0.5}
UNITS = {"near_edge": "k: weight 10^-k", "dir_scale": "k: length 10^k", "axis_tie": "kind: which"}


def share(kernel, family, level):
    """Wrong ones of 200: more and more with the difficulty; none where it is easy."""
    if family == "exact_edge":
        return 0
    hard = abs(level) - 2
    return KERNELS[kernel] if hard > 0 else KERNELS[kernel] // 30 if hard == 0 else 0


def levels(family):
    return range(-5, 6) if family == "dir_scale" else range(6)


def curves():
    for precision in SCALE:
        for kernel in KERNELS:
            for family in (*FAMILIES, schema.LENGTHS):
                for level in levels(family if family != schema.LENGTHS else "dir_scale"):
                    wrong = int(share(kernel, family, level) * SCALE[precision])
                    ties = family == "exact_edge"
                    yield {
                        "kernel": kernel,
                        "precision": precision,
                        "family": family,
                        "difficulty": level,
                        "decided": 0 if ties else 200,
                        "wrong": wrong,
                        "wrong_share": None if ties else wrong / 200,
                    }


def families():
    points = list(curves())
    for precision in SCALE:
        for kernel in KERNELS:
            for family in FAMILIES:
                own = [
                    p
                    for p in points
                    if (p["kernel"], p["precision"], p["family"]) == (kernel, precision, family)
                ]
                over = [p["difficulty"] for p in own if (p["wrong_share"] or 0) > 0.01]
                row = {"kernel": kernel, "precision": precision, "family": family}
                row |= dict.fromkeys(schema.FAMILY_COLUMNS[3:], 0)
                row |= {key: sum(p[key] for p in own) for key in ("decided", "wrong")}
                yield row | {"cases": 200 * len(own), "knee": min(over, key=abs, default=None)}


def summary():
    for precision in SCALE:
        for kernel in KERNELS:
            own = [
                row
                for row in families()
                if (row["kernel"], row["precision"]) == (kernel, precision)
            ]
            row = dict.fromkeys(schema.STABILITY_COLUMNS, 0)
            row |= {"kernel": kernel, "precision": precision, "edges": "closed", "why": None}
            row |= {key: sum(one[key] for one in own) for key in ("wrong", "decided")}
            row |= {"c_star": 580000.0 if row["wrong"] else None, "p99_t": 0.8, "claims": None}
            row |= dict.fromkeys(schema.CRITERIA, int(not row["wrong"]))
            if kernel == "exact_uv":
                row["claims"] = "S1 X1"
            if row["wrong"]:
                row["why"] = "fails S1: 3 unstable answers, worst in dir_scale"
            yield row


@pytest.fixture
def run(sample_runs, tmp_path):
    folder = sample_runs.write_run(
        tmp_path / "a-stability", "stability", [], ["kernel", "precision"], families=UNITS
    )
    files = zip(schema.STABILITY_TABLES, (summary(), families(), curves()), strict=True)
    for name, rows in files:
        with (folder / name).open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, schema.TABLES[name])
            writer.writeheader()
            writer.writerows(rows)
    return load_run(folder)


def test_the_map_has_a_cell_for_each_kernel_and_family(run):
    figure = plots.figures(run)["families"]
    assert len(figure.axes) == 2
    for panel, precision in zip(figure.axes, SCALE, strict=True):
        assert panel.get_title().startswith(f"{precision}: wrong answers (%)")
        assert [label.get_text() for label in panel.get_yticklabels()] == list(KERNELS)
        shown = panel.collections[0].get_array().reshape(len(KERNELS), len(FAMILIES))
        for row in families():
            if row["precision"] == precision:
                place = list(KERNELS).index(row["kernel"]), FAMILIES.index(row["family"])
                if row["decided"]:
                    assert shown[place] == pytest.approx(100 * row["wrong"] / row["decided"])
                else:
                    assert np.ma.is_masked(shown[place])
    names = [label.get_text() for label in figure.axes[-1].get_xticklabels()]
    assert names == list(FAMILIES)


def test_more_wrong_is_darker_in_grey_too():
    grey = [
        sum(w * int(shade[i : i + 2], 16) for w, i in ((0.3, 1), (0.59, 3), (0.11, 5)))
        for shade in SHADES
    ]
    assert all(light - dark > 15 for light, dark in itertools.pairwise(grey))


def test_curves_and_their_knees(run):
    charts = plots.figures(run)
    assert list(charts) == ["families", "curves-float32", "curves-float64"]
    figure = charts["curves-float32"]
    panels = {panel.get_title(): panel for panel in figure.axes}
    # No curve where all are ties, none over kinds.
    assert list(panels) == ["near_edge", "dir_scale", schema.LENGTHS]
    assert panels["near_edge"].get_xlabel() == UNITS["near_edge"]
    for family, panel in panels.items():
        lines = {line.get_label(): line for line in panel.lines}
        for kernel in KERNELS:
            wanted = [
                (row["difficulty"], 100 * row["wrong_share"])
                for row in curves()
                if (row["kernel"], row["precision"], row["family"]) == (kernel, "float32", family)
            ]
            assert np.transpose(lines[kernel].get_data()) == pytest.approx(np.array(wanted))
        rings = [line for line in panel.lines if line.get_markersize() == 8]
        places = {float(line.get_xdata()[0]) for line in rings}
        assert len(rings) == 2
        # moller1 is over 1 % from 3 on (2 of 200 are 1 %), good_uv too (3 of 200).
        assert {abs(place) for place in places} == {3}


def test_at_most_six_kernels_have_curves():
    import pandas

    frame = pandas.DataFrame(
        {
            "kernel": [f"k{i}" for i in range(12)],
            "wrong": range(12, 0, -1),
            "claims": [None] * 11 + ["S1"],
        }
    )
    found = few(frame)
    assert len(found) == len(set(found)) == 6
    assert found[0] == "k11" and {"k10", "k0"} <= set(found)


def test_no_text_is_cut_off(run):
    for name, figure in plots.figures(run).items():
        style.settle(figure)
        renderer = figure.canvas.get_renderer()
        texts = [*figure.texts, *(text for axes in figure.axes for text in axes.texts)]
        for axes in figure.axes:
            texts += [axes.title, axes.xaxis.label, axes.yaxis.label]
            texts += [*axes.get_xticklabels(), *axes.get_yticklabels()]
        for text in texts:
            if text.get_visible() and text.get_text().strip():
                box = text.get_window_extent(renderer)
                assert box.x0 >= -1 and box.x1 <= figure.bbox.width + 1, (name, text.get_text())
                assert box.y0 >= -1 and box.y1 <= figure.bbox.height + 1, (name, text.get_text())


def test_tables(run):
    found = {table.name: table for table in tables_of(run)}
    assert list(found) == [
        "stability",
        "stability-causes",
        "stability-families",
        "stability-lengths",
    ]
    text = found["stability"].render()
    body = [line for line in text.splitlines() if line.endswith("closed")]
    lines = {line.split()[0] + line.split()[1]: line for line in body}
    assert lines["exact_uvfloat32"].split()[2:5] == ["0", "(0", "%)"]
    assert "5.8e5" in lines["good_uvfloat32"]
    assert lines["exact_uvfloat32"].split().count("x") == 9
    assert lines["good_uvfloat32"].split().count(".") == 9
    assert "good_uv float32 fails S1: 3 unstable answers" in text
    assert text.count("moller1_uv float32 fails") == 1, "a line for each kernel"
    rows = {row["family"]: row for row in found["stability-families"].rows}
    assert rows["near_edge"]["moller1_uv float32"].text == "15.2"  # 182 of 1200
    assert "exact_edge" not in rows
    lengths = found["stability-lengths"].rows[2]
    assert (lengths["kernel"], lengths["-5"].text, lengths["0"].text) == ("moller1_uv", "30.0", "0")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, ""),
        (0.0, "0"),
        (0.478, "0.48"),
        (9.94, "9.9"),
        (12.4, "12"),
        (5821.0, "5,821"),
        (99999.4, "99,999"),
        (580000.0, "5.8e5"),
        (1e-7, "1.0e-7"),
        (-3.0, "-3"),
        (float("inf"), "infinite"),
    ],
)
def test_numbers_of_any_size(value, text):
    assert number(value).text == text
