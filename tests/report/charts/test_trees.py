"""Charts of trees: which there are, what is drawn, and that half a file stops none of them."""

import numpy as np
import pytest

from rtbench.report import plots
from rtbench.report.charts.heat_maps import pictures_of, shaded
from rtbench.report.charts.tree_growth import builders_chart
from rtbench.report.charts.tree_kernels import peers_chart
from rtbench.report.charts.trees import bars_chart, pays_chart
from rtbench.report.layouts.tree_peers import against_peers, beside
from rtbench.report.trees import Trees

FEW = {"processes": 3, "rounds": 2}


def test_bars_are_the_medians(make):
    trees = Trees(make("trees", **FEW))
    figure = bars_chart(trees, ["scanned"])
    build, rays = figure.axes
    drawn = sorted(patch.get_width() for patch in rays.patches)
    wanted = sorted(
        trees.median(one).value
        for one in trees.of("scanned")
        if one.ours or one.cell["way"] == "peer"
    )
    assert drawn == pytest.approx(wanted)
    seconds = [float(np.median(tree.seconds)) for tree in trees.built("scanned")]
    assert [patch.get_width() for patch in build.patches] == pytest.approx(seconds)


def test_no_interval_takes_the_scale_of_bars(make):
    trees = Trees(make("trees", processes=2, rounds=2, spread=0.25))
    _, rays = bars_chart(trees, ["scanned"]).axes
    slowest = max(
        trees.median(one).value for one in trees.of("scanned") if one.cell["way"] != "brute_force"
    )
    assert rays.get_xlim()[1] <= 1.5 * slowest


def test_crossings_are_marked_with_their_rays(make):
    # 0.07 s more to build, 240 ns a ray less than the object median: about 300,000 rays.
    trees = Trees(make("trees", endings=("automatic",), peers=(), spread=0.001, **FEW))
    (panel,) = pays_chart(trees, ["scanned"]).axes
    texts = {text.get_text() for text in panel.texts}
    assert len(texts) == 3 and all(text.endswith(" k") for text in texts)
    counts = sorted(float(text.split()[0]) * 1e3 for text in texts)
    sah, objects, spatial = ((400, 0.1235), (640, 0.0515), (980, 0.0412))
    wanted = [0.1235 / (40_000 - 400) * 1e9]
    wanted += [(sah[1] - other[1]) / (other[0] - sah[0]) * 1e9 for other in (spatial, objects)]
    assert counts == pytest.approx(wanted, rel=0.06)


def test_exponents_stand_in_the_legend(make):
    figure = builders_chart(make("tree_builders"))
    (panel,) = figure.axes
    words = [text.get_text() for text in panel.get_legend().get_texts()]
    assert any(word.startswith("nlogn: N^1.0") and "largest half" in word for word in words)
    assert any(word.startswith("n2: N^") for word in words)


def test_one_precision_and_a_shape_a_kernel_beside_libraries(make):
    trees = Trees(
        make(
            "trees",
            kernels=("moller_trumbore", "watertight_safe"),
            precisions=("float32", "float64"),
            **FEW,
        )
    )
    figure = peers_chart(trees, beside(against_peers(trees)))
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["k-d, stack", "moller_trumbore", "watertight_safe"]
    lines = list(figure.axes[0].containers)
    assert len(lines) == 2 * 2  # models, kernels


def test_rules_share_a_scale_of_colours(make):
    run = make("trees", images=True, **FEW)
    figure = plots.figures(run)["heat-scanned"]
    images = [axes.images[0] for axes in figure.axes if axes.images]
    limits = [image.get_clim() for image in images if image.get_cmap().name == "viridis"]
    assert len(limits) == 6
    assert len(set(limits[:3])) == len(set(limits[3:])) == 1
    labels = " ".join(axes.get_ylabel() for axes in figure.axes)
    assert "traversal steps per ray" in labels and "triangle tests per ray" in labels


def test_images_that_are_cut_off_are_left_out(make):
    run = make("trees", images=True, **FEW)
    cut = run.path / "images" / "scanned-sah.npz"
    cut.write_bytes(cut.read_bytes()[:200])
    (run.path / "images" / "even-sah.npz").write_bytes(b"")
    found = pictures_of(run)
    assert [picture.rule for picture in found["scanned"]] == ["object_median", "spatial_median"]
    assert "heat-scanned" in plots.figures(run)


def test_a_shaded_surface_is_lit_by_its_slope():
    _, column = np.mgrid[:40, :40]
    towards, away = 5 + 0.1 * column, 5 - 0.1 * column
    assert shaded(towards)[20, 20] != shaded(away)[20, 20]
    hole = towards.copy()
    hole[:5] = np.nan
    picture = shaded(hole)
    assert (picture[:5] == 1).all() and (picture[5:] < 1).all()
    assert (shaded(np.full((4, 4), np.nan)) == 1).all()
    assert np.isfinite(shaded(np.ones((4, 4)))).all()


def test_leaves_are_drawn_where_the_records_have_them(make):
    key = {"model": "scanned", "structure": "kd", "rule": "sah", "builder": "nlogn"}
    sizes = [key | {"ending": "automatic", "sizes": [10, 30, 5, *[1] * 60]}]
    assert "leaf_sizes" not in plots.figures(make("trees", **FEW))
    figure = plots.figures(make("trees", "with", leaf_sizes=sizes, **FEW))["leaf_sizes"]
    (stairs,) = figure.axes[0].patches
    values = stairs.get_data().values
    assert values.sum() == pytest.approx(100)
    assert values[0] == pytest.approx(100 * 10 / 105) and values[-1] == pytest.approx(2300 / 105)


def test_half_a_run_has_charts_of_what_is_there(make):
    run = make(
        "trees",
        models={"bunny": 1000},
        rules=("sah",),
        peers=(),
        naive=False,
        processes=1,
        rounds=1,
    )
    assert set(plots.figures(run)) == {"build_and_trace"}
