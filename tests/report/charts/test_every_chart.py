"""What holds for every chart: units on the axes, nothing cut off, nothing covered."""

import itertools
import re

import pytest

from rtbench.report import plots
from rtbench.report.charts import style

MANY = {f"havel_{number:02d}_first": (6 + number / 2, 8 + number / 3) for number in range(13)}
CASES = {
    "density": {},
    "density_at_one": {"densities": (0.3,)},
    "density_of_many": {"kernels": tuple(MANY), "ends": MANY | {"empty": (0.4, 0.4)}},
    "density_at_one_of_many": {
        "kernels": tuple(MANY),
        "ends": MANY | {"empty": (0.4, 0.4)},
        "densities": (0.5,),
    },
    "density_in_two_precisions": {"precisions": ("float32", "float64")},
    "density_single": {"processes": 1, "rounds": 1},
    "outcomes": {},
    "stages": {},
    "prediction": {},
    "working_set": {},
    "latency": {},
    "soup": {},
    "soup_of_endings": {"endings": ("tuv", "last_tuv", "whole", "last_whole")},
    "soup_of_orders": {
        "bases": ("moller_trumbore", "kensler_shirley"),
        "endings": ("last_tuv", "last_uvt", "last_whole"),
    },
    "soup_in_two_precisions": {"precisions": ("float32", "float64")},
    "soup_of_endings_in_two_precisions": {
        "precisions": ("float32", "float64"),
        "endings": ("tuv", "last_tuv"),
    },
    "soup_single": {"processes": 1, "rounds": 1, "ratios": (0.5,)},
    "break_even": {},
    "break_even_at_one_size": {"sizes": (512,)},
    "break_even_in_two_precisions": {"precisions": ("float32", "float64")},
    "compilers": {},
    "compilers_in_two_precisions": {"precisions": ("float32", "float64"), "ratios": (0.5,)},
    "compilers_with_other_hits": {"other_hits": [("wald_last_uv", "avx2", "fast", 3)]},
    "packets": {},
    "packets_in_two_precisions": {"precisions": ("float32", "float64")},
    "packets_of_one_width": {"widths": (16,), "packings": False, "ratios": (0.5,)},
    "trees": {"images": True, "models": {"bunny": 69_451}},
    "trees_of_kernels": {
        "kernels": ("moller_trumbore", "watertight_safe", "adaptive_exact"),
        "precisions": ("float32", "float64"),
        "ways": ("stack", "blocks", "packets", "wide"),
        "structures": ("kd", "bvh"),
        "rules": ("sah",),
        "endings": ("automatic",),
        "rays": ("primary", "random"),
    },
    "trees_of_sizes": {
        "models": {f"scanned:{n}": n for n in (1000, 8000, 64_000, 512_000)},
        "structures": ("kd", "bvh"),
        "ways": ("stack", "wide"),
        "endings": ("automatic",),
        "peers": ("embree", "open3d"),
    },
    "trees_of_many_models": {
        "models": {name: 10_000 * len(name) for name in ("even", "bunny", "dragon", "sponza_hall")},
        "rays": ("primary", "shadow", "random"),
        "endings": ("automatic",),
    },
    "trees_single": {"processes": 1, "rounds": 1, "models": {"even": 20_000}},
    "tree_builders": {},
    "packets_single": {"processes": 1, "rounds": 1, "angles": (10.0,), "packets": ("general",)},
}
# What these count is no time.
UNITS = {
    "pays": "(s)",
    "builders": "(s)",
    "build_over_n": "(s)",
    "tree_peers": "speed / its speed",
    "drift": "(%)",
    "soup": "million tests per second",
    "break_even": "rays per triangle",
    "break_even_map": "rays per triangle",
    **dict.fromkeys(("compilers", "packets", "spread", "packing"), "million tests per second"),
}


@pytest.fixture(params=CASES)
def charts(request, make):
    known = ("working_set", "break_even", "tree_builders")
    two_words = [name for name in known if request.param.startswith(name)]
    experiment = (two_words or [request.param.split("_")[0]])[0]
    options = {"processes": 3, "rounds": 2} | CASES[request.param]
    found = plots.figures(make(experiment, **options))
    assert found
    return found


def drawn(figure):
    style.settle(figure)
    return figure.canvas.get_renderer()


def texts(figure):
    """Return every text that is seen: heads, titles, labels, ticks within the scale, legends."""
    found = list(figure.texts)
    found += [text for legend in figure.legends for text in legend.get_texts()]
    for axes in figure.axes:
        found += [axes.title, axes._left_title, axes.xaxis.label, axes.yaxis.label, *axes.texts]
        found += axes.get_legend().get_texts() if axes.get_legend() else []
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            for tick in axis.get_major_ticks():
                found += [tick.label1, tick.label2] if low <= tick.get_loc() <= high else []
    return [text for text in found if text.get_visible() and text.get_text().strip()]


def test_units_stand_on_the_axes(charts):
    for name, figure in charts.items():
        labels = [words for axes in figure.axes for words in (axes.get_xlabel(), axes.get_ylabel())]
        unit = "per ray" if name.startswith("heat-") else UNITS.get(name, "(ns")
        assert any(unit in words for words in labels), (name, labels)


def test_machine_and_kernels_stand_in_the_head(charts):
    for name, figure in charts.items():
        head = " ".join(text.get_text() for text in figure.texts).replace("\n", " ")
        assert "AMD EPYC 9B14" in head
        told = re.search(r"moller1|moller_trumbore|\d+ kernels", head)
        # Steps and builds are of no kernel.
        assert name in ("drift", "outcomes", "builders") or name.startswith("heat-") or told


def test_no_text_is_cut_off(charts):
    for name, figure in charts.items():
        renderer = drawn(figure)
        width, height = figure.bbox.width, figure.bbox.height
        for text in texts(figure):
            box = text.get_window_extent(renderer)
            assert box.x0 >= -1 and box.y0 >= -1, (name, text.get_text())
            assert box.x1 <= width + 1 and box.y1 <= height + 1, (name, text.get_text())


def test_no_text_lies_on_another(charts):
    for name, figure in charts.items():
        renderer = drawn(figure)
        boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in texts(figure)]
        for (one, first), (other, second) in itertools.combinations(boxes, 2):
            across = min(first.x1, second.x1) - max(first.x0, second.x0)
            down = min(first.y1, second.y1) - max(first.y0, second.y0)
            assert across < 1.5 or down < 1.5, (name, one, other)


def test_no_legend_covers_the_data(charts):
    for name, figure in charts.items():
        renderer = drawn(figure)
        for axes in figure.axes:
            if axes.get_legend() is None:
                continue
            box = axes.get_legend().get_window_extent(renderer)
            for other in figure.axes:
                assert not box.overlaps(other.get_window_extent(renderer)), name
