import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.path import Path

from rtbench.report.charts.break_even import break_even_chart
from rtbench.report.charts.break_even_map import break_even_map


def regions(axes):
    """Return kernel to the outlines of its region."""
    return {
        found.get_label(): [Path(path.vertices) for path in found.get_paths()]
        for found in axes.collections
        if isinstance(found, PolyCollection) and not found.get_label().startswith("_")
    }


def test_a_region_s_kernel_is_the_cheapest_there(make):
    run = make("break_even")
    prepared = {
        (row["kernel"], row["scene"]): row["ns_per_triangle"] for row in run.info["preparation"]
    }
    summary = run.summary
    for axes, ratio in zip(break_even_map(run).axes, (0.1, 0.5), strict=True):
        found = regions(axes)
        for scene in (512, 4096, 32768):
            rows = summary[(summary.density == ratio) & (summary.scene == scene)]
            for rays in (1.5, 12, 40, 150, 900):
                costs = {
                    kernel: ns + prepared.get((kernel, scene), 0) / rays
                    for kernel, ns in zip(rows.kernel, rows.ns_per_test, strict=True)
                }
                best = min(costs, key=costs.get)
                assert any(path.contains_point((scene, rays)) for path in found[best])


def test_the_map_has_a_panel_a_hit_ratio_and_logarithmic_scales(make):
    figure = break_even_map(make("break_even"))
    assert [axes.get_title() for axes in figure.axes] == ["hit ratio 0.1", "hit ratio 0.5"]
    for axes in figure.axes:
        assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
        assert axes.get_xlabel() == "triangles"
        assert axes.get_xlim() == pytest.approx((64, 262144))
    assert figure.axes[0].get_ylabel() == "rays per triangle"


def test_regions_are_named_where_there_is_room(make):
    figure = break_even_map(make("break_even"))
    written = {text.get_text() for text in figure.axes[0].texts}
    assert {"Wald, last whole", "Möller-Trumbore, last whole"} <= written


def test_caches_stand_where_the_triangles_fill_them(make):
    run = make("break_even")
    run.info["config"]["layout"] = "padded"
    axes = break_even_map(run).axes[0]
    upright = {line.get_xdata()[0] for line in axes.lines if tuple(line.get_ydata()) == (0, 1)}
    assert upright == {32768 / 48, 1048576 / 48}  # level 3 lies beyond the scale
    assert {"L1d 32 KiB", "L2 1 MiB"} <= {text.get_text() for text in axes.texts}


def test_what_is_not_told_apart_is_hatched(make):
    def hatched(run):
        return [text.get_text() for text in break_even_map(run).legends[0].get_texts()]

    assert "not told apart" in hatched(make("break_even", name="noisy", spread=0.3))
    assert "not told apart" not in hatched(make("break_even", name="single", processes=1, rounds=1))


def test_an_unfinished_run_has_a_map_that_says_so(make, soup_runs):
    run = make("break_even", processes=1, rounds=1)
    run.info["preparation"] = []
    kept = run.summary[(run.summary.kernel != "kensler_shirley_last_tuv_uv")]
    run.summary = kept[(kept.kernel != "moller_trumbore_last_whole_uv") | (kept.scene == 64)]
    run.summary = run.summary[run.summary.kernel != "moller_trumbore_last_whole_uv"]
    (axes,) = break_even_map(run).axes
    assert [text.get_text() for text in axes.texts] == ["no kernel has all sizes"]


def test_lines_are_the_break_even_of_the_records(make):
    run = make("break_even")
    for axes, ratio in zip(break_even_chart(run).axes, (0.1, 0.5), strict=True):
        lines = {line.get_label(): line for line in axes.lines}
        told = [
            row
            for row in run.info["break_even"]
            if (row["kernel"], row["density"]) == ("wald_last_whole_uv", ratio)
        ]
        drawn = lines["Wald, last whole"]
        assert drawn.get_ydata() == pytest.approx([row["rays_per_triangle"] for row in told])
        assert np.log2(drawn.get_xdata()) == pytest.approx([6, 9, 12, 15, 18], abs=0.4)


def test_what_never_pays_is_torn_out_of_its_line(make):
    run = make("break_even")
    never = [row["scene"] for row in run.info["break_even"] if row["rays_per_triangle"] is None]
    assert never == [262144]  # of the stored Kensler-Shirley, at a hit ratio of 0.5
    lines = {line.get_label(): line for line in break_even_chart(run).axes[1].lines}
    drawn = lines["Kensler-Shirley (stored), last whole"].get_ydata()
    assert np.isnan(drawn).tolist() == [False] * 4 + [True]
